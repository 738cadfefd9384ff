//! Values of a bounce of several paths: path states before it, random numbers, hit points, shadow rays and next rays.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8, u32x8};
use glam::{UVec2, Vec3};

use super::super::integrators::path::{decision, decision_set};
use super::super::lanes::{Lanes2, Real, Vector3, Word, constant, select};
use super::super::light_sample::power_heuristic;
use super::super::math::{dot, min};
use super::super::rng::{hash4, unit_float};
use super::super::surface::largest;
use super::lights::{LightChoices, LightSamples};
use super::materials::{NextRays, Reflections};
use super::rows::{F, LANES, Row, Rows3, V, get3, splat3, store3};
use super::shade::MaterialKind;
use super::surfaces::LaneSurfaces;
use crate::records::{INFINITE_T, Packed};

/// Path states before a bounce.
#[derive(Default)]
pub struct PathRows {
    pub throughput: Rows3,
    pub eta2: Row,
    pub pixel_x: [u32; LANES],
    pub pixel_y: [u32; LANES],
    pub sample: [u32; LANES],
    pub depth: [u32; LANES],
    pub exclude_front: [UVec2; LANES],
    pub exclude_back: [UVec2; LANES],
}

/// Random numbers of a bounce.
pub struct RandomLanes<S: Simd> {
    pub sample: u32x8<S>,
    pub depth: u32x8<S>,
    pub key: [u32x8<S>; 4],
    /// Unused if nothing depends on decisions.
    pub decision_key: [u32x8<S>; 4],
    /// Selects the lobe.
    pub lobe: F<S>,
    pub roulette: F<S>,
}

impl<S: Simd> RandomLanes<S> {
    #[inline(always)]
    pub fn of(simd: S, scene: &Packed, rows: &PathRows, material_kind: MaterialKind) -> Self {
        let s = &scene.specialization;
        let words = |words: &[u32; LANES]| u32x8::simd_from(simd, *words);
        let (x, y, depth, sample) = (
            words(&rows.pixel_x),
            words(&rows.pixel_y),
            words(&rows.depth),
            words(&rows.sample),
        );
        let seed = x.splat(scene.camera.seed);
        let key = hash4([x, y, seed, (depth << 1) + 1]);
        let has_choices = has_roulette(scene) || material_kind != MaterialKind::Diffuse;
        let decision_key = if has_choices || s.emitters > 1 || s.light_tree != 0 {
            hash4([x, y, seed, (depth << 1) + 2])
        } else {
            key
        };
        let (mut lobe, mut roulette) = (SimdBase::splat(simd, 0.0), SimdBase::splat(simd, 0.0));
        if has_choices {
            let [.., x, y] = decision_key;
            let choices = decision_set(scene, Lanes2 { x, y }, sample);
            (lobe, roulette) = (unit_float(choices.x), unit_float(choices.y));
        }
        RandomLanes {
            sample,
            depth,
            key,
            decision_key,
            lobe,
            roulette,
        }
    }

    #[inline(always)]
    pub fn light_choices(&self, scene: &Packed) -> LightChoices<S> {
        let [x, y, ..] = self.decision_key;
        let tree_key = Lanes2 { x, y };
        let [x, y, ..] = self.key;
        LightChoices {
            emitter: if scene.specialization.emitters > 1 {
                decision_set(scene, tree_key, self.sample)
            } else {
                tree_key // not used
            },
            tree_key,
            sample: self.sample,
            u: decision(scene, Lanes2 { x, y }, self.sample),
        }
    }

    #[inline(always)]
    pub fn direction_choice(&self, scene: &Packed) -> Lanes2<F<S>> {
        let [.., x, y] = self.key;
        decision(scene, Lanes2 { x, y }, self.sample)
    }
}

#[inline(always)]
fn has_roulette(scene: &Packed) -> bool {
    scene.specialization.rr_depth < scene.specialization.bounces
}

/// Shadow rays.
#[derive(Default)]
pub struct ShadowRows {
    pub contributions: Rows3,
    pub to_lights: Rows3,
    /// Mask of the lanes with a finite contribution above 0.
    pub queued: u64,
    /// Mask of the lanes whose ray starts behind the surface.
    pub behind: u64,
}

impl ShadowRows {
    #[inline(always)]
    pub fn set_contributions<S: Simd>(
        &mut self,
        light: &LightSamples<S>,
        throughput: V<S>,
        reflections: &Reflections<S>,
    ) {
        let (zero, one) = (light.pdf.splat(0.0), light.pdf.splat(1.0));
        let mut contribution = throughput * reflections.value * light.radiance * (constant(1.0) / light.pdf);
        let weight = power_heuristic(light.pdf, reflections.pdf);
        contribution = contribution * select(weight, one, light.is_delta);
        let max_component = largest(contribution);
        self.queued = (max_component.gt(zero) & max_component.lt(zero.splat(INFINITE_T))).to_bitmask();
        self.contributions = store3(contribution);
    }

    /// Starts the rays to lights behind transmitting surfaces at `origin_behind`. Distances to infinite lights are at least 2.
    #[inline(always)]
    pub fn move_behind<S: Simd>(
        &mut self,
        surface: &LaneSurfaces<S>,
        origin_behind: V<S>,
        transmits: mask32x8<S>,
        to_light: V<S>,
        distances: F<S>,
    ) {
        let simd = distances.simd;
        let is_behind = transmits & dot(surface.normal, to_light).lt(distances.splat(0.0));
        let is_finite = distances.lt(distances.splat(2.0));
        let shift = Vector3::select(splat3(simd, Vec3::ZERO), surface.ray_origin - origin_behind, is_finite);
        self.to_lights = store3(Vector3::select(to_light, to_light + shift, is_behind));
        self.behind = is_behind.to_bitmask();
    }
}

/// Next rays of the paths.
pub struct NextRows {
    pub directions: Rows3,
    pub throughputs: Rows3,
    pub pdfs: Row,
    pub eta2: Row,
    /// Mask of the lanes whose ray leaves behind the surface.
    pub behind: u64,
    /// Mask of the lanes whose path continues.
    pub survivors: u64,
}

impl NextRows {
    #[inline(always)]
    pub fn of<S: Simd>(
        simd: S,
        scene: &Packed,
        rows: &PathRows,
        random: &RandomLanes<S>,
        next: &NextRays<S>,
    ) -> NextRows {
        let zero: F<S> = SimdBase::splat(simd, 0.0);
        let mut throughput = next.throughput;
        let mut eta2 = f32x8::simd_from(simd, rows.eta2);
        let mut behind = 0;
        if let Some(transmitted) = next.transmitted {
            eta2 = select(eta2, eta2 * transmitted.eta * transmitted.eta, transmitted.mask);
            behind = transmitted.mask.to_bitmask();
        }
        let mut survives = zero.le(zero); // true in all lanes
        if has_roulette(scene) {
            let first_depth = random.depth.splat(scene.specialization.rr_depth);
            let in_roulette = (random.depth + 1).simd_ge(first_depth);
            let chance = min(largest(throughput) / eta2, zero.splat(1.0));
            survives = !(in_roulette & random.roulette.ge(chance));
            throughput = Vector3::select(throughput, throughput * (constant(1.0) / chance), in_roulette);
        }
        NextRows {
            directions: store3(next.wi),
            throughputs: store3(throughput),
            pdfs: next.pdf.into(),
            eta2: eta2.into(),
            behind,
            survivors: (survives & largest(throughput).gt(zero)).to_bitmask(),
        }
    }
}

/// Hit points.
pub struct PointRows {
    pub sides: Row,
    pub normals: Rows3,
    pub normals_to_light: Rows3,
    pub origins: Rows3,
    pub origins_behind: Rows3,
    /// Albedos times the throughputs.
    pub albedos: Rows3,
}

/// Start of a ray, and the primitives that it excludes.
pub struct Exit {
    pub origin: Vec3,
    pub exclude_front: UVec2,
    pub exclude_back: UVec2,
}

impl PointRows {
    /// Returns where the ray of a lane leaves the surface: behind it in the lanes of the mask `behind`.
    #[inline(always)]
    pub fn exit(&self, rows: &PathRows, lane: usize, behind: u64) -> Exit {
        let (front, back) = (rows.exclude_front[lane], rows.exclude_back[lane]);
        match behind >> lane & 1 != 0 {
            true => Exit {
                origin: get3(&self.origins_behind, lane),
                exclude_front: back,
                exclude_back: front,
            },
            false => Exit {
                origin: get3(&self.origins, lane),
                exclude_front: front,
                exclude_back: back,
            },
        }
    }
}
