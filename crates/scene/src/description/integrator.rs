//! The integrators and their properties.

use serde::{Deserialize, Serialize};

use super::Pattern;
use crate::description::kinds::*;
use crate::limits::MAX_DEPTH;

/// A light transport algorithm. In a file, the names are in snake case: `"path"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// Direct light with the Phong reflection model, mirrors and glass, as defined in the documentation of the scene
    /// format.
    Phong,
    /// Path tracing: global illumination.
    Path,
}

/// The properties of an integrator.
struct Properties {
    name: &'static str,
    /// Minimum and maximum number of bounces that `max_depth` accepts.
    depths: (u32, u32),
    /// Default sampling pattern.
    pattern: Pattern,
    follows_paths: bool,
    needs_emitters: bool,
    has_layers: bool,
    has_smooth_noise: bool,
}

impl Integrator {
    /// All integrators.
    pub const ALL: [Integrator; 2] = [Integrator::Phong, Integrator::Path];

    const fn properties(self) -> Properties {
        match self {
            Integrator::Phong => Properties {
                name: "phong",
                depths: (1, 64),
                pattern: Pattern::Grid,
                follows_paths: false,
                needs_emitters: false,
                has_layers: false,
                has_smooth_noise: false,
            },
            Integrator::Path => Properties {
                name: "path",
                depths: (0, MAX_DEPTH),
                pattern: Pattern::Sobol,
                follows_paths: true,
                needs_emitters: true,
                has_layers: true,
                has_smooth_noise: true,
            },
        }
    }

    /// Returns the name in files and options.
    pub const fn name(self) -> &'static str {
        self.properties().name
    }

    /// Returns the minimum and maximum number of bounces that `max_depth` accepts.
    pub const fn depths(self) -> (u32, u32) {
        self.properties().depths
    }

    /// Returns the default sampling pattern.
    pub const fn pattern(self) -> Pattern {
        self.properties().pattern
    }

    /// Returns true for path tracing, which supports scene keys that need `"path"`, but not ambient light and
    /// transparent shadows.
    pub const fn follows_paths(self) -> bool {
        self.properties().follows_paths
    }

    /// Returns true if lights are selected from a table of emitters: emissive surfaces, the environment and lights.
    /// Otherwise the contributions of all lights are summed, and nothing else emits.
    pub const fn needs_emitters(self) -> bool {
        self.properties().needs_emitters
    }

    /// Returns true if the film can have layers, such as the albedo.
    pub const fn has_layers(self) -> bool {
        self.properties().has_layers
    }

    /// Returns true if neighboring pixels have similar noise, as with indirect light; otherwise, most noise is at edges.
    pub const fn has_smooth_noise(self) -> bool {
        self.properties().has_smooth_noise
    }
}
