//! The stage that shades the hits of a batch of paths. Hits on most surfaces are sorted into queues and shaded in
//! SIMD lanes, with the bits of the scalar function [`shade`]. That function shades all other hits.

use std::ops::AddAssign;

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::Simd as _;
use glam::{UVec2, Vec3};

use super::super::geometry::{group_word, instance_of, is_on_mesh};
use super::super::integrators::path::{PathState, shade};
use super::super::lobe::is_polished;
use super::super::prefetch::prefetch_vertices;
use super::super::primitive::is_solid;
use super::super::ray::Hit;
use super::super::samples::LEVEL;
use super::super::scattering::is_transmissive;
use super::QueuedShadowRay;
use super::batch::Batch;
use super::smooth::SmoothKind;
use crate::records::{
    DIFFUSE, ENVIRONMENT_MAP, FOR_ANISOTROPY, FOR_ROUGHNESS, GLASS, METAL, MIRROR, Material, NO_COLORS, NO_INDEX,
    NO_SHADOW, OPAQUE, PRINCIPLED, Packed, ROUGH_GLASS, THIN,
};

/// True in builds with optimization. Otherwise, only diffuse surfaces are shaded in lanes, because the stack frame of the
/// other kinds, whose functions are inlined, would be larger than the 2 MiB of a thread.
pub const IS_OPTIMIZED: bool = !cfg!(debug_assertions);

/// Paths to continue or to end in lanes.
#[derive(Default)]
pub struct ShadingQueues {
    /// Hits to shade, for each kind of material and each kind of surface.
    hits: [[Vec<QueuedHit>; SurfaceKind::ALL.len()]; MaterialKind::ALL.len()],
    /// Paths whose rays hit nothing but the environment map.
    missed: Vec<u32>,
}

/// A material whose hits are shaded in lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialKind {
    Diffuse,
    Principled,
    /// A rough conductor.
    Metal,
    /// A rough dielectric.
    Dielectric,
    /// A material without roughness.
    Smooth(SmoothKind),
}

impl MaterialKind {
    pub const ALL: [MaterialKind; 8] = [
        MaterialKind::Diffuse,
        MaterialKind::Principled,
        MaterialKind::Metal,
        MaterialKind::Dielectric,
        MaterialKind::Smooth(SmoothKind::Mirror),
        MaterialKind::Smooth(SmoothKind::Metal),
        MaterialKind::Smooth(SmoothKind::Dielectric),
        MaterialKind::Smooth(SmoothKind::Thin),
    ];

    /// Returns the kind of a material without roughness; [`None`] for other materials.
    #[inline(always)]
    pub fn smooth(self) -> Option<SmoothKind> {
        match self {
            MaterialKind::Smooth(kind) if IS_OPTIMIZED => Some(kind),
            _ => None,
        }
    }

    /// Returns the position in [`MaterialKind::ALL`].
    fn index(self) -> usize {
        match self {
            MaterialKind::Diffuse => 0,
            MaterialKind::Principled => 1,
            MaterialKind::Metal => 2,
            MaterialKind::Dielectric => 3,
            MaterialKind::Smooth(kind) => 4 + kind as usize,
        }
    }
}

/// The kind of surface of a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceKind {
    /// A flat primitive.
    Flat,
    /// A triangle of a mesh.
    Face,
    /// A solid; a surface with emission, a texture, vertex colors or transmission; with anisotropy in the scene, any surface
    /// that is not diffuse. The scalar functions evaluate surface and material of each hit, which is then shaded in lanes.
    Evaluated,
}

impl SurfaceKind {
    pub const ALL: [SurfaceKind; 3] = [SurfaceKind::Flat, SurfaceKind::Face, SurfaceKind::Evaluated];
}

/// Numbers of hits shaded in lanes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LaneHits {
    /// Numbers for each kind of material, with a number for each kind of surface.
    counts: [[usize; SurfaceKind::ALL.len()]; MaterialKind::ALL.len()],
}

impl LaneHits {
    pub fn count(&self, material: MaterialKind, surface: SurfaceKind) -> usize {
        self.counts[material.index()][surface as usize]
    }
}

impl AddAssign for LaneHits {
    fn add_assign(&mut self, other: LaneHits) {
        let counts = self.counts.as_flattened_mut().iter_mut();
        for (count, more) in counts.zip(other.counts.as_flattened()) {
            *count += more;
        }
    }
}

/// A hit, with the indices of its path and its material.
#[derive(Clone, Copy)]
pub struct QueuedHit {
    pub path: u32,
    pub material: u32,
    pub hit: Hit,
}

/// Shades the hits of the active paths, like [`shade`], and queues their shadow rays. Returns the numbers of hits
/// shaded in lanes.
pub fn shade_hits(
    scene: &Packed,
    paths: &mut [PathState],
    pixels: &[UVec2],
    active: &[u32],
    hits: &[Hit],
    shadow_rays: &mut Vec<QueuedShadowRay>,
    queues: &mut ShadingQueues,
) -> LaneHits {
    shadow_rays.clear();
    queues.hits.as_flattened_mut().iter_mut().for_each(Vec::clear);
    queues.missed.clear();
    let has_lanes = has_lane_instructions();
    let has_environment_map = IS_OPTIMIZED && scene.specialization.environment_flags & ENVIRONMENT_MAP != 0;
    for (&path, &hit) in active.iter().zip(hits) {
        if has_lanes && has_environment_map && hit.primitive == NO_INDEX {
            queues.missed.push(path);
            continue;
        }
        let state = &mut paths[path as usize];
        let found = if has_lanes { lane_queue(scene, state, hit) } else { None };
        if let Some((material_kind, surface_kind, material)) = found {
            if state.path.depth >= scene.specialization.bounces {
                state.ended = true;
                continue;
            }
            if is_on_mesh(hit) {
                prefetch_vertices(scene, hit);
            }
            let queue = &mut queues.hits[material_kind.index()][surface_kind as usize];
            queue.push(QueuedHit { path, material, hit });
        } else if let Some(ray) = shade(scene, state, hit, pixels[path as usize]) {
            shadow_rays.push(QueuedShadowRay { path, ray });
        }
    }
    let lane_hits = LaneHits {
        counts: queues.hits.each_ref().map(|queues| queues.each_ref().map(Vec::len)),
    };
    if lane_hits != LaneHits::default() || !queues.missed.is_empty() {
        let batch = Batch {
            scene,
            paths,
            pixels,
            shadow_rays,
        };
        shade_in_lanes(batch, queues);
    }
    lane_hits
}

/// Returns true if the processor has SIMD instructions for which shading is compiled. SSE2 is left out: its code is the
/// largest, and almost all processors have more instructions.
fn has_lane_instructions() -> bool {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    return LEVEL.as_sse4_2().is_some();
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    true
}

fn shade_in_lanes(mut batch: Batch, queues: &ShadingQueues) {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        if let Some(simd) = LEVEL.as_avx512() {
            simd.vectorize(
                #[inline(always)]
                || batch.shade_queues(simd, queues),
            );
        } else if let Some(simd) = LEVEL.as_avx2() {
            simd.vectorize(
                #[inline(always)]
                || batch.shade_queues(simd, queues),
            );
        } else if let Some(simd) = LEVEL.as_sse4_2() {
            simd.vectorize(
                #[inline(always)]
                || batch.shade_queues(simd, queues),
            );
        }
    }
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    fearless_simd::dispatch!(*LEVEL, simd => batch.shade_queues(simd, queues));
}

impl ShadingQueues {
    pub fn missed(&self) -> &[u32] {
        &self.missed
    }

    /// Returns the queues that contain hits, with their kinds.
    pub fn filled(&self) -> impl Iterator<Item = (MaterialKind, SurfaceKind, &[QueuedHit])> {
        let of_material = |material: MaterialKind| {
            SurfaceKind::ALL.map(|surface| (material, surface, &self.hits[material.index()][surface as usize][..]))
        };
        let all = MaterialKind::ALL.into_iter().flat_map(of_material);
        all.filter(|(_, _, hits)| !hits.is_empty())
    }
}

/// Returns the kinds of the material and of the surface of a hit, and the index of the material, if the hit can be
/// shaded in lanes.
#[inline(always)]
fn lane_queue(scene: &Packed, state: &PathState, hit: Hit) -> Option<(MaterialKind, SurfaceKind, u32)> {
    let s = &scene.specialization;
    if hit.primitive == NO_INDEX {
        return None;
    }
    let surface_kind = match is_on_mesh(hit) {
        true => SurfaceKind::Face,
        false if is_solid(scene.primitives[hit.primitive as usize].kind) => SurfaceKind::Evaluated,
        false => SurfaceKind::Flat,
    };
    let index = material_index(scene, hit);
    // Only the scalar `shade` records layers of the last hit and computes absorption. Without absorption, the factor is
    // exactly 1.
    let is_last = state.path.depth >= s.bounces;
    let records_layers = s.layers != 0 && (state.path.depth == 0 || !state.albedo_recorded);
    let material = &scene.materials[index as usize];
    let transmits = is_transmissive(material);
    let absorbs = state.absorption != Vec3::ZERO || material.absorption != Vec3::ZERO;
    if records_layers && is_last || s.absorption != 0 && absorbs {
        return None;
    }
    let (material_kind, scalar_purposes) = lane_material(material)?;
    let is_smooth = matches!(material_kind, MaterialKind::Smooth(_));
    if is_smooth && s.differentials != 0 {
        return None; // only the scalar `shade` computes differentials of reflected rays
    }
    let mut lookups = (0..material.lookups.y).map(|i| &scene.textures.lookups[(material.lookups.x + i) as usize]);
    if lookups.any(|lookup| lookup.purposes & scalar_purposes != 0) {
        return None;
    }
    let is_emissive = material.density > 0.0;
    if is_emissive && is_last {
        return None; // emission is added to the last hit
    }
    let has_plain_surface = material.lookups.y == 0 && material.vertex_colors == NO_COLORS && !is_emissive;
    let has_frame = !is_smooth && material_kind != MaterialKind::Diffuse && (s.anisotropic != 0 || transmits);
    if has_plain_surface && !has_frame {
        return Some((material_kind, surface_kind, index));
    }
    Some((material_kind, SurfaceKind::Evaluated, index))
}

/// Returns the index of the material at a hit.
#[inline(always)]
pub fn material_index(scene: &Packed, hit: Hit) -> u32 {
    if is_on_mesh(hit) {
        return group_word(scene, instance_of(scene, hit), hit.slot) & !NO_SHADOW;
    }
    scene.primitives[hit.primitive as usize].material
}

/// Returns the kind of a material without alpha, if its hits can be shaded in lanes. Hits on materials that have a texture
/// lookup with any of the returned purposes are shaded one by one.
#[inline(always)]
fn lane_material(material: &Material) -> Option<(MaterialKind, u32)> {
    if material.alpha_mode != OPAQUE {
        return None;
    }
    let decides_polish = FOR_ROUGHNESS | FOR_ANISOTROPY;
    match material.kind {
        DIFFUSE if material.roughness == 0.0 => Some((MaterialKind::Diffuse, FOR_ROUGHNESS)),
        PRINCIPLED if IS_OPTIMIZED => Some((MaterialKind::Principled, 0)),
        METAL if IS_OPTIMIZED && !is_polished(material) => Some((MaterialKind::Metal, decides_polish)),
        ROUGH_GLASS if IS_OPTIMIZED && !is_polished(material) => Some((MaterialKind::Dielectric, decides_polish)),
        THIN if !is_polished(material) => None,
        MIRROR | METAL | GLASS | ROUGH_GLASS | THIN if IS_OPTIMIZED => {
            let kind = match material.kind {
                MIRROR => SmoothKind::Mirror,
                METAL => SmoothKind::Metal,
                THIN => SmoothKind::Thin,
                _ => SmoothKind::Dielectric,
            };
            Some((MaterialKind::Smooth(kind), decides_polish))
        }
        _ => None,
    }
}
