//! A packed scene.

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec4};
use wgray_scene::Integrator;

use super::*;
use crate::film::Form;

/// A packed scene: the records that both backends read.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    /// The origin of all coordinates: a point in the space of the scene file.
    pub origin: DVec3,
    /// The camera.
    pub camera: Camera,
    /// The integrator.
    pub integrator: Integrator,
    /// Values of the scene as a whole.
    pub environment: Environment,
    /// The primitives, including the rectangles of lights: those outside of the BVH, sorted by kind and in each kind by whether they
    /// can cast a shadow, then those in it.
    pub primitives: Vec<Primitive>,
    /// The bounding sphere of each primitive.
    pub bounds: Vec<Sphere>,
    /// The BVH over all instances of meshes, and over the bounded primitives where these are many.
    pub nodes: Vec<Node>,
    /// The contents of its leaves, in their order.
    pub items: Vec<Item>,
    /// The instances of meshes.
    pub instances: Vec<Instance>,
    /// The meshes.
    pub meshes: Vec<Arc<PackedMesh>>,
    /// The material of each group of each instance, and [`NO_SHADOW`].
    pub group_words: Vec<u32>,
    /// The materials of the scene, then one for each area light.
    pub materials: Vec<Material>,
    /// The lights, rectangles first; each refers to its primitive. Under the integrator `path` every emissive primitive is one.
    pub lights: Vec<Light>,
    /// Under the integrator `path`, the table from which emitters are sampled.
    pub emitters: Vec<Emitter>,
    /// The light tree, which is a single emitter of the table; empty if there are few emitters.
    pub light_nodes: Vec<LightNode>,
    /// The leaf of each primitive and of each triangle of emissive instances in the light tree, encoded as [`LightNode::parent`]; else [`NO_INDEX`].
    pub light_leaves: Vec<u32>,
    /// The numbers and positions of all records.
    pub counts: Counts,
    /// The texture lookups of materials.
    pub lookups: Vec<Lookup>,
    /// The textures of these lookups.
    pub textures: Vec<Texture>,
    /// Their images: tables of offsets, and texels.
    pub texels: Vec<u32>,
    /// The bins of the pixel filter; empty if it is the box of the pixel.
    pub filter_table: Vec<Vec4>,
    /// The number of samples per pixel; under adaptive sampling the maximum.
    pub pixel_samples: u32,
    /// True if sampling is adaptive.
    pub adaptive: bool,
    /// The constants of the kernel.
    pub specialization: Specialization,
}

impl Packed {
    /// Returns the number of light samples per hit over all lights; a point or directional light counts as one. Under the integrator `path` it is one
    /// for all lights.
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
        let in_tree = self.light_leaves.iter().filter(|leaf| **leaf != NO_INDEX).count();
        self.emitters.len().saturating_sub(usize::from(in_tree > 0)) as u64 + in_tree as u64
    }

    /// Returns the scene with layers in its film. Only the integrator `path` has layers; others ignore it.
    #[must_use]
    pub fn with_layers(mut self) -> Packed {
        self.specialization.layers = (self.integrator == Integrator::Path).into();
        self
    }

    /// Returns the scene without layers in its film. The colors are the same.
    #[must_use]
    pub fn without_layers(mut self) -> Packed {
        self.specialization.layers = 0;
        self
    }

    /// Returns the size of all BVHs in bytes.
    pub fn tree_bytes(&self) -> u64 {
        let of_meshes = self.meshes.iter().map(|mesh| size_of_val(mesh.nodes.as_slice()));
        let own = size_of_val(self.nodes.as_slice()) + size_of_val(self.items.as_slice());
        (own + of_meshes.sum::<usize>()) as u64
    }

    /// Returns the size of texels and of the sampling tables of environment maps in bytes.
    pub fn texel_bytes(&self) -> u64 {
        size_of_val(self.texels.as_slice()) as u64
    }

    /// Returns the size of all records in bytes.
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

    /// Returns true if the image has alpha, that is, a transparent background.
    pub fn has_alpha(&self) -> bool {
        self.specialization.alpha != 0
    }

    /// Returns the form of its film.
    pub fn form(&self) -> Form {
        Form {
            adaptive: self.adaptive,
            layers: self.specialization.layers != 0,
        }
    }

    /// Returns true if another scene differs in the camera only.
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

    /// Returns the kinds of primitives in the scene, each with the range of its primitives.
    pub fn kinds(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        let kinds = (0..).zip(self.counts.primitives);
        let ranges = kinds.map(|(kind, range)| (kind, range.x as usize..range.z as usize));
        ranges.filter(|(_, range)| !range.is_empty())
    }

    /// Returns the kinds of primitives that can cast shadows, each with their range.
    pub fn shadow_casters(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        let kinds = (0..).zip(self.counts.primitives);
        let ranges = kinds.map(|(kind, range)| (kind, range.x as usize..range.y as usize));
        ranges.filter(|(_, range)| !range.is_empty())
    }
}
