//! A packed scene.

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec4};
use wgray_scene::Integrator;

use super::*;
use crate::film::Form;

/// A scene as both backends read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    /// Where coordinates are counted from: a point of the scene file's space.
    pub origin: DVec3,
    /// The camera.
    pub camera: Camera,
    /// What light is simulated.
    pub integrator: Integrator,
    /// What belongs to the scene as a whole.
    pub environment: Environment,
    /// The primitives, lights' rectangles among them: those outside of the tree, sorted by kind and in each kind by whether they
    /// can cast a shadow, then those in it.
    pub primitives: Vec<Primitive>,
    /// A sphere around each primitive.
    pub bounds: Vec<Sphere>,
    /// The tree over all instances of meshes, and over the bounded primitives where these are many.
    pub nodes: Vec<Node>,
    /// What it is over, in the order of its leaves.
    pub items: Vec<Item>,
    /// The meshes in the world.
    pub instances: Vec<Instance>,
    /// The meshes.
    pub meshes: Vec<Arc<PackedMesh>>,
    /// For each group of each instance its material, and [`NO_SHADOW`].
    pub group_words: Vec<u32>,
    /// The materials of the scene, then one for each area light.
    pub materials: Vec<Material>,
    /// The lights, rectangles first; each knows the primitive that shines. Under the integrator `path` every primitive that
    /// shines is one.
    pub lights: Vec<Light>,
    /// Under the integrator `path`, what light is sampled of: the table by which one is chosen.
    pub emitters: Vec<Emitter>,
    /// The tree over what shines where that is much, which is then one of the emitters.
    pub light_nodes: Vec<LightNode>,
    /// Of each primitive, and of each triangle of the instances of meshes that shine, which child of which node of that tree it is, as [`LightNode::parent`] has it, else [`NOTHING`].
    pub light_leaves: Vec<u32>,
    /// How many there are of all these, and where.
    pub counts: Counts,
    /// What materials look up in textures.
    pub lookups: Vec<Lookup>,
    /// The textures that materials look up.
    pub textures: Vec<Texture>,
    /// Their images: tables of places, and texels.
    pub texels: Vec<u32>,
    /// The filter's bins ([`filter::table`]); none if it is the box of the pixel.
    pub filter_table: Vec<Vec4>,
    /// Samples of every pixel; under adaptive sampling the most that one gets.
    pub pixel_samples: u32,
    /// Whether sampling is adaptive.
    pub adaptive: bool,
    /// The constants.
    pub specialization: Specialization,
}

impl Packed {
    /// Samples of light at every hit, over all lights; a point or directional light counts 1. Under the integrator `path` one of all.
    pub fn light_samples(&self) -> u64 {
        if self.integrator == Integrator::Path {
            return u64::from(!self.emitters.is_empty());
        }
        let (area_lights, lights) = (self.counts.lights.x, self.counts.lights.y);
        u64::from(area_lights) * u64::from(self.specialization.light_samples) + u64::from(lights - area_lights)
    }

    /// Returns the number of emitters that the path tracer samples: lights, emissive surfaces, the environment.
    pub fn emitter_count(&self) -> u64 {
        // A light tree is a single entry of the table.
        let in_tree = self.light_leaves.iter().filter(|leaf| **leaf != NOTHING).count();
        self.emitters.len().saturating_sub(usize::from(in_tree > 0)) as u64 + in_tree as u64
    }

    /// The same scene, and a film that has layers. Without effect under another integrator than `path`, which alone has them.
    #[must_use]
    pub fn with_layers(mut self) -> Packed {
        self.specialization.layers = (self.integrator == Integrator::Path).into();
        self
    }

    /// The same scene, and a film without layers. The colours are the same.
    #[must_use]
    pub fn without_layers(mut self) -> Packed {
        self.specialization.layers = 0;
        self
    }

    /// The memory that trees of boxes take, in bytes.
    pub fn tree_bytes(&self) -> u64 {
        let of_meshes = self.meshes.iter().map(|mesh| size_of_val(mesh.nodes.as_slice()));
        let own = size_of_val(self.nodes.as_slice()) + size_of_val(self.items.as_slice());
        (own + of_meshes.sum::<usize>()) as u64
    }

    /// The memory that texels take, with tables of those around the scene, in bytes.
    pub fn texel_bytes(&self) -> u64 {
        size_of_val(self.texels.as_slice()) as u64
    }

    /// The memory that all of it takes, in bytes.
    pub fn bytes(&self) -> u64 {
        let lists = [
            size_of_val(self.primitives.as_slice()),
            size_of_val(self.bounds.as_slice()),
            size_of_val(self.nodes.as_slice()),
            size_of_val(self.items.as_slice()),
            size_of_val(self.instances.as_slice()),
            size_of_val(self.group_words.as_slice()),
            size_of_val(self.materials.as_slice()),
            size_of_val(self.lights.as_slice()),
            size_of_val(self.emitters.as_slice()),
            size_of_val(self.light_nodes.as_slice()),
            size_of_val(self.light_leaves.as_slice()),
            size_of_val(self.lookups.as_slice()),
            size_of_val(self.textures.as_slice()),
            size_of_val(self.texels.as_slice()),
            size_of_val(self.filter_table.as_slice()),
        ];
        let of_meshes = self.meshes.iter().map(|mesh| mesh.bytes());
        of_meshes.sum::<u64>() + lists.iter().map(|bytes| *bytes as u64).sum::<u64>()
    }

    /// Whether the picture has alpha: its background is transparent.
    pub fn has_alpha(&self) -> bool {
        self.specialization.alpha != 0
    }

    /// What its film has beside the sums.
    pub fn form(&self) -> Form {
        Form {
            adaptive: self.adaptive,
            layers: self.specialization.layers != 0,
        }
    }

    /// Whether another scene is the same, seen by whatever camera.
    pub fn same_but_camera(&self, other: &Packed) -> bool {
        let Packed {
            origin,
            camera: _,
            integrator,
            environment,
            primitives,
            bounds,
            nodes,
            items,
            instances,
            meshes,
            group_words,
            materials,
            lights,
            emitters,
            light_nodes,
            light_leaves,
            counts,
            lookups,
            textures,
            texels,
            filter_table,
            pixel_samples,
            adaptive,
            specialization,
        } = self;
        let same_meshes = || {
            let mut pairs = meshes.iter().zip(&other.meshes);
            meshes.len() == other.meshes.len() && pairs.all(|(a, b)| Arc::ptr_eq(a, b) || a == b)
        };
        (origin, environment, counts, specialization)
            == (&other.origin, &other.environment, &other.counts, &other.specialization)
            && (primitives, bounds, materials, lights, emitters)
                == (
                    &other.primitives,
                    &other.bounds,
                    &other.materials,
                    &other.lights,
                    &other.emitters,
                )
            && (light_nodes, light_leaves) == (&other.light_nodes, &other.light_leaves)
            && (lookups, textures, texels, filter_table)
                == (&other.lookups, &other.textures, &other.texels, &other.filter_table)
            && (integrator, pixel_samples, adaptive) == (&other.integrator, &other.pixel_samples, &other.adaptive)
            && (nodes, items, instances, group_words)
                == (&other.nodes, &other.items, &other.instances, &other.group_words)
            && same_meshes()
    }

    /// The kinds of primitives that there are, each with where its primitives are.
    pub fn kinds(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        let kinds = (0..).zip(self.counts.primitives);
        let ranges = kinds.map(|(kind, range)| (kind, range.x as usize..range.z as usize));
        ranges.filter(|(_, range)| !range.is_empty())
    }

    /// The kinds of primitives that can cast a shadow, each with where these are.
    pub fn shadow_casters(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        let kinds = (0..).zip(self.counts.primitives);
        let ranges = kinds.map(|(kind, range)| (kind, range.x as usize..range.y as usize));
        ranges.filter(|(_, range)| !range.is_empty())
    }
}
