//! The records of a scene, grouped by purpose.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::cast_slice;
use glam::{DVec3, Vec4};
use wgray_scene::Integrator;

use super::*;
use crate::bvh::{DecodedNode, DecodedOnce};
use crate::film::FilmLayout;

/// A packed scene: the records that both backends read.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    /// Origin of all coordinates, in scene file space.
    pub origin: DVec3,
    /// The camera.
    pub camera: Camera,
    /// The integrator.
    pub integrator: Integrator,
    /// Values that apply to the whole scene, and the environment map.
    pub environment: Environment,
    /// Primitives, including lights' rectangles. Primitives outside of the BVH come first, sorted by kind, then by
    /// whether they can cast a shadow.
    pub primitives: Vec<Primitive>,
    /// Bounding sphere of each primitive.
    pub bounds: Vec<Sphere>,
    /// BVH over mesh instances and primitives.
    pub bvh: PackedBvh,
    /// Materials of the scene file, followed by one material per area light.
    pub materials: Vec<Material>,
    /// Lights and emitters.
    pub lighting: Lighting,
    /// Counts and first rows of records.
    pub counts: Counts,
    /// Textures and their texels.
    pub textures: PackedTextures,
    /// Settings of pixel sampling.
    pub sampling: Sampling,
    /// Override constants of the kernel.
    pub specialization: Specialization,
}

/// The BVH over all mesh instances and, if a scene has more than
/// `MAX_LINEAR_PRIMITIVES` of `wgray_render::pack`, the bounded primitives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PackedBvh {
    /// Nodes of this BVH.
    pub nodes: Vec<Node>,
    /// Items of the leaves, in leaf order.
    pub items: Vec<BvhItem>,
    /// The mesh instances.
    pub instances: Vec<Instance>,
    /// The meshes.
    pub meshes: Vec<Arc<PackedMesh>>,
    /// A word for each triangle group of each instance: the material index, combined with the flag [`NO_SHADOW`].
    pub group_words: Vec<u32>,
    /// The nodes in the form for traversal on the CPU.
    pub decoded: DecodedOnce<Vec<DecodedNode>>,
}

/// The lights and emitters of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lighting {
    /// Lights, rectangles first, with their primitives. If the integrator needs emitters, every emissive primitive has
    /// a light.
    pub lights: Vec<Light>,
    /// Alias table of emitters, if the integrator needs it.
    pub emitters: Vec<Emitter>,
    /// Nodes of the light tree, which is a single entry of the alias table; empty if the scene has few emitters.
    pub nodes: Vec<LightNode>,
    /// Leaf in the light tree of each primitive and of each triangle of emissive instances, encoded like
    /// [`LightNode::parent`]; [`NO_INDEX`] without a leaf.
    pub leaves: Vec<u32>,
}

/// The textures of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PackedTextures {
    /// Lookups of materials.
    pub lookups: Vec<Lookup>,
    /// Textures that the lookups sample.
    pub records: Vec<Texture>,
    /// Words of images: tables of level offsets, and texels. Also the sampling tables of the environment map and the
    /// albedo tables of materials. Copies of the scene share them.
    pub texels: Arc<Vec<u32>>,
}

/// Settings of pixel sampling: reconstruction filter and sample counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sampling {
    /// Bins of the pixel filter; empty for a box filter of one pixel.
    pub filter_table: Vec<Vec4>,
    /// Samples per pixel; with adaptive sampling the maximum.
    pub pixel_samples: u32,
    /// True if sampling is adaptive.
    pub adaptive: bool,
}

impl Packed {
    /// Returns the number of light samples per hit: with `path` at most 1, otherwise the sum over all lights. A light
    /// without area has one sample.
    pub fn light_samples(&self) -> u64 {
        if self.integrator.needs_emitters() {
            return u64::from(!self.lighting.emitters.is_empty());
        }
        let (area_lights, lights) = (self.counts.lights.x, self.counts.lights.y);
        u64::from(area_lights) * u64::from(self.specialization.light_samples) + u64::from(lights - area_lights)
    }

    /// Returns the number of emitters sampled by the path tracer, including the environment.
    pub fn emitter_count(&self) -> u64 {
        // A light tree is a single entry of the alias table.
        let in_tree = self.lighting.leaves.iter().filter(|leaf| **leaf != NO_INDEX).count();
        self.lighting.emitters.len().saturating_sub(usize::from(in_tree > 0)) as u64 + in_tree as u64
    }

    /// Adds layers to the film, if the integrator has layers.
    #[must_use]
    pub fn with_layers(mut self) -> Packed {
        self.specialization.layers = self.integrator.has_layers().into();
        self
    }

    /// Removes layers from the film. The radiance does not change.
    #[must_use]
    pub fn without_layers(mut self) -> Packed {
        self.specialization.layers = 0;
        self
    }

    /// Adds noise estimates to the film: half sums and moments of the radiance; if the film has layers, also moments of
    /// albedo, normal and depth.
    #[must_use]
    pub fn with_noise(mut self) -> Packed {
        self.specialization.noise = 1;
        self
    }

    /// Removes noise estimates from the film. The radiance does not change.
    #[must_use]
    pub fn without_noise(mut self) -> Packed {
        self.specialization.noise = 0;
        self
    }

    /// Returns the size of all BVHs in bytes.
    pub fn tree_bytes(&self) -> u64 {
        let mesh_bvhs = self.bvh.meshes.iter().map(|mesh| size_of_val(mesh.nodes.as_slice()));
        let scene_bvh = size_of_val(self.bvh.nodes.as_slice()) + size_of_val(self.bvh.items.as_slice());
        (scene_bvh + mesh_bvhs.sum::<usize>()) as u64
    }

    /// Returns the size of texels, sampling tables and albedo tables in bytes.
    pub fn texel_bytes(&self) -> u64 {
        size_of_val(self.textures.texels.as_slice()) as u64
    }

    /// Returns the size of all records in bytes.
    pub fn bytes(&self) -> u64 {
        let meshes = self.bvh.meshes.iter().map(|mesh| mesh.bytes());
        meshes.sum::<u64>() + self.lists().map(|bytes| bytes.len() as u64).sum::<u64>()
    }

    /// Returns the bytes of all lists except the lists of meshes. The patterns name every field, so that the compiler
    /// rejects a forgotten field.
    pub fn lists(&self) -> impl Iterator<Item = &[u8]> {
        let Packed {
            origin: _,
            camera: _,
            integrator: _,
            environment: _,
            primitives,
            bounds,
            bvh,
            materials,
            lighting,
            counts: _,
            textures,
            sampling,
            specialization: _,
        } = self;
        let PackedBvh {
            nodes,
            items,
            instances,
            meshes: _,
            group_words,
            decoded: _,
        } = bvh;
        let PackedTextures {
            lookups,
            records,
            texels,
        } = textures;
        let Lighting {
            lights,
            emitters,
            nodes: light_nodes,
            leaves,
        } = lighting;
        let lists: [&[u8]; 15] = [
            cast_slice(primitives),
            cast_slice(bounds),
            cast_slice(nodes),
            cast_slice(items),
            cast_slice(instances),
            cast_slice(group_words),
            cast_slice(materials),
            cast_slice(lights),
            cast_slice(emitters),
            cast_slice(light_nodes),
            cast_slice(leaves),
            cast_slice(lookups),
            cast_slice(records),
            cast_slice(texels.as_slice()),
            cast_slice(&sampling.filter_table),
        ];
        lists.into_iter()
    }

    /// Returns true for images with a transparent background.
    pub fn has_alpha(&self) -> bool {
        self.specialization.alpha != 0
    }

    /// Returns the layout of the scene's films.
    pub fn film_layout(&self) -> FilmLayout {
        FilmLayout {
            adaptive: self.sampling.adaptive,
            layers: self.specialization.layers != 0,
            noise: self.specialization.noise != 0,
        }
    }

    /// Returns true if the other scene differs only in the camera.
    pub fn same_but_camera(&self, other: &Packed) -> bool {
        let settings = |scene: &Packed| {
            let Sampling {
                pixel_samples,
                adaptive,
                ..
            } = scene.sampling;
            (
                (scene.origin, scene.integrator, pixel_samples, adaptive),
                (scene.environment, scene.counts, scene.specialization),
            )
        };
        // Shared texels need not be compared.
        let is_same_list = |(a, b): (&[u8], &[u8])| std::ptr::eq(a, b) || a == b;
        let (meshes, other_meshes) = (&self.bvh.meshes, &other.bvh.meshes);
        let mut pairs = meshes.iter().zip(other_meshes);
        settings(self) == settings(other)
            && self.lists().zip(other.lists()).all(is_same_list)
            && meshes.len() == other_meshes.len()
            && pairs.all(|(a, b)| Arc::ptr_eq(a, b) || a == b)
    }

    /// Returns the kinds of primitives outside of the BVH, with their index ranges.
    pub fn kinds(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        let kinds = (0..).zip(self.counts.primitives);
        let ranges = kinds.map(|(kind, range)| (kind, range.x as usize..range.z as usize));
        ranges.filter(|(_, range)| !range.is_empty())
    }

    /// Returns the kinds of shadow-casting primitives outside of the BVH, with their index ranges.
    pub fn shadow_casters(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        let kinds = (0..).zip(self.counts.primitives);
        let ranges = kinds.map(|(kind, range)| (kind, range.x as usize..range.y as usize));
        ranges.filter(|(_, range)| !range.is_empty())
    }
}
