//! Light samples of several paths in SIMD lanes.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8, u32x8};
use glam::{UVec2, Vec2, Vec3};

use super::super::emitter::{LightSample, sample_emitter, select_emitter};
use super::super::environment::EnvironmentEval;
use super::super::lanes::{Lanes2, Real, Vector3};
use super::super::light_choice::EmitterSelection;
use super::super::light_sample::solid_angle_pdf;
use super::super::math::dot;
use super::environment::environment_samples;
use super::light_tree::TreePoints;
use super::rows::{F, LANES, Row, Rows3, V, get3, lane_mask, lanes_of, load3, set3, splat3, store3};
use super::shade::IS_OPTIMIZED;
use crate::records::{ENVIRONMENT, Light, NO_INDEX, Packed, RECTANGLE};

/// One light sample per path.
pub struct LightRows<'a> {
    scene: &'a Packed,
    /// The only light, if it can be sampled in lanes: all of its samples have the same `t_max` and `primitive`.
    only_light: Option<&'a Light>,
    pub to_light: Rows3,
    radiance: Rows3,
    pdf: Row,
    is_delta: Row,
    pub t_max: Row,
    pub primitive: [u32; LANES],
}

impl<'a> LightRows<'a> {
    pub fn new(scene: &'a Packed) -> LightRows<'a> {
        let light = only_light(scene);
        LightRows {
            scene,
            only_light: light,
            to_light: Default::default(),
            radiance: Default::default(),
            pdf: Default::default(),
            is_delta: Default::default(),
            t_max: [light.map_or(0.0, |light| light.t_max); LANES],
            primitive: [light.map_or(0, |light| light.primitive); LANES],
        }
    }

    fn set(&mut self, lane: usize, light: LightSample) {
        set3(&mut self.to_light, lane, light.to);
        set3(&mut self.radiance, lane, light.radiance);
        self.pdf[lane] = light.pdf;
        self.is_delta[lane] = if light.is_delta { 1.0 } else { 0.0 };
        self.t_max[lane] = light.t_max;
        self.primitive[lane] = light.primitive;
    }
}

/// Random numbers that select an emitter and a point on it, like those of the scalar `shade`.
pub struct LightChoices<S: Simd> {
    /// Bits that select an emitter.
    pub emitter: Lanes2<u32x8<S>>,
    /// Key of the choices in a light tree.
    pub tree_key: Lanes2<u32x8<S>>,
    /// Sample numbers of the paths.
    pub sample: u32x8<S>,
    /// Point on the unit square.
    pub u: Lanes2<F<S>>,
}

/// Values of [`LightSample`] in lanes.
pub struct LightSamples<S: Simd> {
    pub to_light: V<S>,
    pub radiance: V<S>,
    pub pdf: F<S>,
    pub is_delta: mask32x8<S>,
}

impl LightRows<'_> {
    /// Samples a light for each of the first `count` surface points.
    #[inline(always)]
    pub fn sample<S: Simd>(
        &mut self,
        simd: S,
        choices: LightChoices<S>,
        points: V<S>,
        normals: V<S>,
        count: usize,
    ) -> LightSamples<S> {
        let scene = self.scene;
        let zero: F<S> = SimdBase::splat(simd, 0.0);
        if let Some(light) = self.only_light {
            let (to_light, radiance, pdf) = rectangle_samples(simd, light, points, choices.u);
            self.to_light = store3(to_light);
            return LightSamples {
                to_light,
                radiance,
                pdf,
                is_delta: zero.lt(zero), // false in all lanes
            };
        }
        let (points, normals) = (store3(points), store3(normals));
        let (bits_x, bits_y): ([u32; LANES], [u32; LANES]) = (choices.emitter.x.into(), choices.emitter.y.into());
        let mut selections = std::array::from_fn(|lane| EmitterSelection {
            emitter: select_emitter(scene, UVec2::new(bits_x[lane], bits_y[lane])),
            density: 0.0,
        });
        if scene.specialization.light_tree != 0 {
            let in_tree = (0..count).filter(|lane| selections[*lane].emitter.index == NO_INDEX);
            let mask = in_tree.fold(0, |mask, lane| mask | 1 << lane);
            let points = TreePoints {
                points: &points,
                normals: &normals,
                key: choices.tree_key,
                sample: choices.sample,
            };
            points.select(simd, scene, mask, &mut selections);
        }
        let (u_x, u_y): (Row, Row) = (choices.u.x.into(), choices.u.y.into());
        let mut environment_lanes = 0;
        for lane in 0..count {
            let (p, normal) = (get3(&points, lane), get3(&normals, lane));
            let selection = selections[lane];
            if let Some(light) = environment_light(scene, &selection) {
                environment_lanes |= 1 << lane;
                self.t_max[lane] = light.t_max;
                continue;
            }
            let u = Vec2::new(u_x[lane], u_y[lane]);
            self.set(lane, sample_emitter(scene, selection, p, normal, u));
        }
        if environment_lanes != 0 {
            let (to_light, evals) = environment_samples(simd, scene, &normals, choices.u, environment_lanes);
            if environment_lanes == lane_mask(count) {
                self.to_light = store3(to_light);
                self.primitive = [NO_INDEX; LANES];
                return LightSamples {
                    to_light,
                    radiance: load3(simd, &evals.radiance),
                    pdf: f32x8::simd_from(simd, evals.pdf),
                    is_delta: zero.lt(zero), // false in all lanes
                };
            }
            let to_light = store3(to_light);
            for lane in lanes_of(environment_lanes) {
                let EnvironmentEval { radiance, pdf } = evals.eval(lane);
                let sample = LightSample {
                    to: get3(&to_light, lane),
                    radiance,
                    pdf,
                    is_delta: false,
                    t_max: self.t_max[lane],
                    primitive: NO_INDEX,
                };
                self.set(lane, sample);
            }
        }
        LightSamples {
            to_light: load3(simd, &self.to_light),
            radiance: load3(simd, &self.radiance),
            pdf: f32x8::simd_from(simd, self.pdf),
            is_delta: f32x8::simd_from(simd, self.is_delta).gt(zero),
        }
    }
}

/// Returns the only light of the scene, if it can be sampled in lanes.
fn only_light(scene: &Packed) -> Option<&Light> {
    let s = &scene.specialization;
    let [emitter] = scene.lighting.emitters[..] else {
        return None;
    };
    let is_plain = s.light_tree == 0 && s.emission_textures == 0 && s.alpha_surfaces == 0 && emitter.instance == 0;
    let light = scene.lighting.lights.get(emitter.index as usize)?;
    (is_plain && light.kind == RECTANGLE).then_some(light)
}

/// Returns the environment map, if it is the selected emitter and can be sampled in lanes.
#[inline(always)]
fn environment_light<'a>(scene: &'a Packed, selection: &EmitterSelection) -> Option<&'a Light> {
    if !IS_OPTIMIZED || selection.emitter.instance != 0 {
        return None;
    }
    let light = &scene.lighting.lights[selection.emitter.index as usize];
    (light.kind == ENVIRONMENT).then_some(light)
}

/// Returns the vectors to light samples, their radiance and their pdfs, like `sample_light` for rectangles.
#[inline(always)]
fn rectangle_samples<S: Simd>(simd: S, light: &Light, p: V<S>, u: Lanes2<F<S>>) -> (V<S>, V<S>, F<S>) {
    let vector = |v| splat3(simd, v);
    let (x, y) = (u.x * 2.0 - 1.0, u.y * 2.0 - 1.0);
    let normal = vector(light.normal);
    let to_light = (vector(light.center) - p * x.splat(light.finite)) + vector(light.u) * x + vector(light.v) * y;
    let pdf = solid_angle_pdf(x.splat(light.density), to_light, normal);
    let mut radiance = vector(light.color);
    if light.sides == 1 {
        let behind = dot(normal, to_light).ge(x.splat(0.0));
        radiance = Vector3::select(radiance, vector(Vec3::ZERO), behind);
    }
    (to_light, radiance, pdf)
}
