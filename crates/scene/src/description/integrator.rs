//! The integrators, with a row of properties for each.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Pattern;
use crate::limits::DEEPEST;

/// A light transport algorithm. In a file the names are in snake case: `"path"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// Direct light and Phong's reflection model, the formula in the scene format's page.
    Phong,
    /// Paths of light from surface to surface.
    Path,
}

/// The properties of an integrator.
struct Row {
    name: &'static str,
    /// The fewest and the most bounces of a path.
    depths: (u32, u32),
    /// The default pattern of samples.
    pattern: Pattern,
    /// The fewest samples per pixel that adaptive sampling takes before it estimates the error.
    pilot_samples: u32,
    follows_paths: bool,
    needs_emitters: bool,
    has_layers: bool,
}

impl Integrator {
    /// All of them.
    pub const ALL: [Integrator; 2] = [Integrator::Phong, Integrator::Path];

    const fn row(self) -> Row {
        match self {
            Integrator::Phong => Row {
                name: "phong",
                depths: (1, 64),
                pattern: Pattern::Grid,
                pilot_samples: 16,
                follows_paths: false,
                needs_emitters: false,
                has_layers: false,
            },
            // Few samples miss light that is rarely found, and underestimate the error.
            Integrator::Path => Row {
                name: "path",
                depths: (0, DEEPEST),
                pattern: Pattern::Sobol,
                pilot_samples: 64,
                follows_paths: true,
                needs_emitters: true,
                has_layers: true,
            },
        }
    }

    /// The name in files and options.
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// The fewest and the most bounces of a path.
    pub const fn depths(self) -> (u32, u32) {
        self.row().depths
    }

    /// The pattern of samples that have none of their own.
    pub const fn pattern(self) -> Pattern {
        self.row().pattern
    }

    /// The fewest samples per pixel that adaptive sampling takes before it estimates the error.
    pub const fn pilot_samples(self) -> u32 {
        self.row().pilot_samples
    }

    /// Returns whether light is traced from surface to surface, so that the keys of paths apply, and ambient light and transparent shadows do not.
    pub const fn follows_paths(self) -> bool {
        self.row().follows_paths
    }

    /// Returns whether light is sampled from a table of emitters: emissive surfaces, the environment and lights. Otherwise all lights are summed, and
    /// nothing else emits.
    pub const fn needs_emitters(self) -> bool {
        self.row().needs_emitters
    }

    /// Returns whether the film can have layers, such as the albedo.
    pub const fn has_layers(self) -> bool {
        self.row().has_layers
    }
}
