//! The materials at the hits of several paths: records of the scene, or materials that the scalar functions evaluate.

use fearless_simd::prelude::*;
use glam::Vec3;

use super::super::energy::principled_energy;
use super::super::geometry::{fetch_hit_primitive, hit_differential, material_of, surface_of};
use super::super::lanes::{LaneMaterials, MaterialRows};
use super::super::mesh::HitPrimitive;
use super::super::path::Path;
use super::super::principled::bounded_color;
use super::super::ray::Hit;
use super::super::scattering::{
    bounded, facet_frame, is_delta, is_transmissive, local_wo, material_for_view, shaded_normal,
};
use super::super::surface::Surface;
use super::super::texture::evaluate_material;
use super::super::vertices::with_vertex_colors;
use super::rows::{LANES, Rows3, set3};
use crate::records::{DIFFUSE, Material, NO_INDEX, PRINCIPLED, Packed};

/// A surface and its material, evaluated by scalar functions.
pub struct Evaluated {
    pub prim: HitPrimitive,
    /// In scenes with anisotropic materials, the tangents of rough surfaces are the frames of their lobes.
    pub surface: Surface,
    pub material: Material,
    pub coat_normal: Vec3,
    /// Albedos of `principled_energy`.
    pub energy: Vec3,
}

/// Evaluates a surface and its material, like the first part of the scalar `shade`.
pub fn evaluate(scene: &Packed, path: &Path, hit: Hit) -> Evaluated {
    let s = &scene.specialization;
    let prim = fetch_hit_primitive(scene, hit);
    let mut surface = surface_of(scene, &prim, hit, path.ray);
    let mut material = *material_of(scene, &prim);
    let mut coat_normal = surface.shading_normal;
    if (s.lookups != 0) | (s.vertex_colors != 0) {
        let hit_diff = hit_differential(scene, &prim, hit, surface, path.ray, path.differential);
        let mut shading = evaluate_material(scene, &prim, hit, &material, surface, hit_diff, s.lookups);
        if s.vertex_colors != 0 {
            shading.material = with_vertex_colors(scene, &shading.material, hit);
        }
        material = bounded(shading.material);
        surface.shading_normal = shading.normal;
        coat_normal = shading.coat_normal;
    }
    let mut energy = Vec3::ONE;
    if material.kind != DIFFUSE && !is_delta(&material) && (s.anisotropic != 0 || is_transmissive(&material)) {
        surface.shading_normal = shaded_normal(surface, &material, surface.shading_normal);
        let frame = facet_frame(scene, surface, &material);
        (surface.du, surface.dv) = (frame.u, frame.v);
        if material.kind == PRINCIPLED {
            energy = principled_energy(scene, &material, local_wo(&surface), surface.side);
        } else {
            material = material_for_view(scene, &surface, material);
            material.energy = NO_INDEX; // the loss is known
        }
    }
    Evaluated {
        prim,
        surface,
        material,
        coat_normal,
        energy,
    }
}

/// The materials at the hits, one per lane.
pub struct HitMaterials {
    pub rows: MaterialRows,
    /// Indices of the materials in the scene. [`NO_INDEX`] after a material that was evaluated for a hit.
    index_of_lane: [u32; LANES],
    pub energy: Rows3,
}

impl Default for HitMaterials {
    fn default() -> HitMaterials {
        HitMaterials {
            rows: MaterialRows::default(),
            index_of_lane: [NO_INDEX; LANES],
            energy: Default::default(),
        }
    }
}

impl HitMaterials {
    #[inline(always)]
    pub fn lanes<S: Simd>(&self, simd: S) -> LaneMaterials<'_, S> {
        LaneMaterials { simd, rows: &self.rows }
    }

    /// Sets a material of the scene.
    #[inline(always)]
    pub fn set(&mut self, scene: &Packed, lane: usize, index: u32) {
        let s = &scene.specialization;
        let material = &scene.materials[index as usize];
        let is_bounded = (s.lookups != 0) | (s.vertex_colors != 0);
        if material.kind == DIFFUSE {
            self.index_of_lane[lane] = NO_INDEX; // the rest of the lane's material is left as it was
            let color = material.diffuse;
            self.rows
                .set_diffuse(lane, if is_bounded { bounded_color(color) } else { color });
            return;
        }
        if self.index_of_lane[lane] == index {
            return;
        }
        self.index_of_lane[lane] = index;
        if is_bounded {
            self.rows.set(lane, &bounded(*material));
        } else {
            self.rows.set(lane, material);
        }
        set3(&mut self.energy, lane, Vec3::ONE);
    }

    /// Sets a material that was evaluated for a hit.
    #[inline(always)]
    pub fn set_evaluated(&mut self, lane: usize, evaluated: &Evaluated) {
        self.index_of_lane[lane] = NO_INDEX;
        self.rows.set(lane, &evaluated.material);
        set3(&mut self.energy, lane, evaluated.energy);
    }
}
