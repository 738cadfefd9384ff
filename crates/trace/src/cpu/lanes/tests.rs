//! Tests that each lane of a shared function has the bits of the `f32` version, with every instruction set.

use fearless_simd::dispatch;
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

use super::*;
use crate::cases;
use crate::cpu::diffuse::{angles_at, diffuse_pdf, diffuse_sample};
use crate::cpu::equirect::{cap_above, cell_towards, direction_in_cell};
use crate::cpu::ggx::{ggx_albedo, ggx_albedo_along, ggx_d, ggx_g1, ggx_g2, ggx_length, ggx_pdf, ggx_sample};
use crate::cpu::light_sample::{power_heuristic, solid_angle_pdf};
use crate::cpu::light_tree::{light_importances, light_shares};
use crate::cpu::lobe::{
    facet_alpha, facet_eval, facet_loss, facet_pdf, facet_weight, half_vector, vector_from_lobe, vector_to_lobe,
};
use crate::cpu::math::{atan2, cross, dot, floor, max, min, normalize, power, sine};
use crate::cpu::mesh::{flipped_to, lift};
use crate::cpu::metal::{conductor_fresnel, metal_eval, metal_fresnel, metal_pdf, metal_sample};
use crate::cpu::path::usable_normal;
use crate::cpu::principled::{
    PrincipledLobes, evaluated_sample, glass_eval, glass_pdf, mirrored_pdf, principled_direction, principled_eval,
    principled_mixture, principled_pdf, refracting_density, sheen_albedo, sheen_probability,
};
use crate::cpu::rng::{hash4, unit_float};
use crate::cpu::rough_dielectric::{
    dielectric_gain, refracting_normal, rough_dielectric_eval, rough_dielectric_pdf, rough_dielectric_sample,
};
use crate::cpu::sequence::{scramble, shuffled_index, sobol_bits, sobol_reversed};
use crate::cpu::specular::{fresnel, reflected_direction, refracted_cosine, refracted_direction};
use crate::cpu::surface::largest;
use crate::cpu::traversal::levels;
use crate::cpu::warp::{cap_sample, disk_sample, frame_around, hemisphere_sample, triangle_sample, vector_around};
use crate::records::{LOBE_ANISOTROPY, LOBE_COAT, LOBE_SHEEN, LOBE_SPECULAR, LOBE_TRANSMISSION, LightNode};

const LANES: usize = 8;

/// Arguments of the functions.
#[derive(Clone, Copy)]
struct Arguments<W: Word> {
    words: [W; 4],
    /// Point on the unit square.
    square: [W::Real; 2],
    numbers: [W::Real; 9],
}

/// Calls all other functions, and appends the name and the result of each call to `reals` or `words`.
#[inline(always)]
fn append_results<W, K>(a: Arguments<W>, reals: &mut Vec<(&'static str, W::Real)>, words: &mut Vec<(&'static str, W)>)
where
    W: Word<UVec4 = K>,
    K: WordVector4<Word = W>,
{
    let [i, j, k, l] = a.words;
    let u: <W::Real as Real>::Vec2 = Vector2::new(a.square[0], a.square[1]);
    let n = &a.numbers;
    let vector = |first: usize| Vector3::new(n[first], n[first + 1], n[first + 2]);
    let [p, q, r]: [<W::Real as Real>::Vec3; 3] = [0, 3, 6].map(vector);
    let unit = normalize(p);
    let angles = angles_at(p, q, r);
    let scalars = [
        ("dot", dot(p, q)),
        ("max", max(n[0], n[1])),
        ("min", min(n[0], n[1])),
        ("largest", largest(p)),
        ("unit_float", unit_float(i)),
        ("solid_angle_pdf", solid_angle_pdf(n[8], p, q)),
        ("power_heuristic", power_heuristic(n[0], n[1])),
        ("angles_at wi", angles.wi),
        ("angles_at wo", angles.wo),
        ("angles_at between", angles.between),
        ("diffuse_pdf", diffuse_pdf(angles)),
        ("floor", floor(n[8])),
        ("atan2", atan2(n[0], n[1])),
        ("sine", sine(n[2])),
    ];
    reals.extend(scalars);
    for (name, v) in [("disk_sample", disk_sample(u)), ("triangle_sample", triangle_sample(u))] {
        reals.extend([(name, v.x()), (name, v.y())]);
    }
    let frame = frame_around(unit);
    for (name, v) in [
        ("cross", cross(p, q)),
        ("normalize", unit),
        ("flipped_to", flipped_to(p, q)),
        ("lift", lift(unit, q, r)),
        ("frame_around u", frame.u),
        ("frame_around v", frame.v),
        ("vector_around", vector_around(unit, q)),
        ("hemisphere_sample", hemisphere_sample(unit, u)),
        ("diffuse_sample", diffuse_sample(unit, u)),
        ("select", Vector3::select(p, q, n[0].lt(n[1]))),
    ] {
        reals.extend([(name, v.x()), (name, v.y()), (name, v.z())]);
    }
    let (width, height) = (37, 18);
    let cell = cell_towards(unit, width, height);
    reals.extend([("cell_towards x", cell.x), ("cell_towards y", cell.y)]);
    words.extend([("cell_towards column", cell.column), ("cell_towards row", cell.row)]);
    let row = k & 15;
    reals.push(("cap_above", cap_above(row, height)));
    let v = direction_in_cell(j & 31, row, u, width, height);
    reals.extend([
        ("direction_in_cell", v.x()),
        ("direction_in_cell", v.y()),
        ("direction_in_cell", v.z()),
    ]);
    let sobol: W::UVec2 = sobol_bits(i, WordVector2::new(j, k));
    words.extend([
        ("sobol_bits", sobol.x()),
        ("sobol_bits", sobol.y()),
        ("sobol_reversed", sobol_reversed(i)),
        ("scramble", scramble(i, j)),
        ("shuffled_index", shuffled_index(i, j)),
    ]);
    words.extend(hash4(K::from_words([i, j, k, l])).words().map(|word| ("hash4", word)));
}

/// Combinations of lobes of `principled`.
const LOBES: [u32; 6] = [
    0,
    LOBE_SPECULAR,
    LOBE_SPECULAR | LOBE_COAT,
    LOBE_TRANSMISSION,
    LOBE_SHEEN,
    LOBE_SPECULAR | LOBE_TRANSMISSION | LOBE_COAT | LOBE_SHEEN | LOBE_ANISOTROPY,
];

/// A material and a surface with arbitrary parameters.
#[derive(Clone, Copy)]
struct Parameters<F>([F; 9]);

macro_rules! parameters {
    ($($real:ident $i:literal)*; $($vector:ident $first:literal)*) => {
        impl<F: Real> MaterialFields for Parameters<F> {
            type Real = F;

            $(fn $real(&self) -> F {
                self.0[$i]
            })*

            $(fn $vector(&self) -> F::Vec3 {
                Vector3::new(self.0[$first], self.0[$first + 1], self.0[$first + 2])
            })*

            fn is_thin(&self) -> F::Mask {
                self.0[0].gt(self.0[1])
            }

            fn has_aniso_table(&self) -> F::Mask {
                self.0[2].gt(self.0[3])
            }
        }
    };
}

parameters! {
    roughness 0 anisotropy 1 ior 2 sheen_roughness 3 metallic 4 transmission 5 clearcoat 6 clearcoat_roughness 7
    specular_weight 8 loss 0;
    diffuse 0 specular 3 sheen 6 tint 1 eta 2 k 5
}

impl<F: Real> Parameters<F> {
    /// Returns a normal, and directions to the previous vertex and to a light.
    #[inline(always)]
    fn directions(&self) -> [F::Vec3; 3] {
        [self.diffuse(), self.specular(), self.sheen()].map(normalize)
    }
}

impl<F: Real> SurfaceVectors for Parameters<F> {
    type Real = F;

    fn normal(&self) -> F::Vec3 {
        self.diffuse()
    }

    fn smooth_normal(&self) -> F::Vec3 {
        self.specular()
    }

    fn wo(&self) -> F::Vec3 {
        self.sheen()
    }
}

/// Calls the functions of microfacets. `append` gets the name and the results of each call.
#[inline(always)]
fn append_facet_results<F: Real>(n: [F; 9], u: F::Vec2, mut append: impl FnMut(&'static str, &[F])) {
    let parameters = Parameters(n);
    let alpha: F::Vec2 = Vector2::new(n[1].abs(), n[4].abs());
    let [normal, wo, wi] = parameters.directions();
    for (name, x) in [
        ("ggx_d", ggx_d(alpha, normal)),
        ("ggx_length", ggx_length(alpha, wo)),
        ("ggx_g1", ggx_g1(alpha, wo)),
        ("ggx_g2", ggx_g2(alpha, wo, wi)),
        ("ggx_pdf", ggx_pdf(alpha, wo, normal)),
        ("facet_eval", facet_eval(alpha, wo, wi)),
        ("facet_pdf", facet_pdf(alpha, wo, wi)),
        ("facet_weight", facet_weight(alpha, wo, wi)),
        ("mirrored_pdf", mirrored_pdf(alpha, wo, normal)),
        ("refracting_density", refracting_density(wo, wi, normal, n[0])),
        ("sheen_albedo", sheen_albedo(n[0], n[1])),
        ("conductor_fresnel", conductor_fresnel(n[0], n[1], n[2])),
        ("metal_pdf", metal_pdf(&parameters, wo, wi)),
        ("dielectric_gain", dielectric_gain(&parameters)),
        ("rough_dielectric_pdf", rough_dielectric_pdf(&parameters, wo, wi)),
        ("facet_loss", facet_loss(alpha, wo)),
        ("power", power(n[0], n[1])),
        ("fresnel", fresnel(n[0], n[1], n[2])),
        ("refracted_cosine", refracted_cosine(n[0], n[1])),
    ] {
        append(name, &[x]);
    }
    for (name, v) in [
        ("ggx_albedo", ggx_albedo(n[0], n[1])),
        ("ggx_albedo_along", ggx_albedo_along(alpha, wo)),
        ("facet_alpha", facet_alpha(&parameters)),
    ] {
        append(name, &[v.x(), v.y()]);
    }
    let frame = frame_around(normal);
    let metal_sample = metal_sample(&parameters, wo, u);
    append("metal_sample pdf", &[metal_sample.pdf]);
    let glass_sample = rough_dielectric_sample(&parameters, wo, u, n[8].abs());
    append("rough_dielectric_sample pdf", &[glass_sample.pdf, glass_sample.eta]);
    for (name, v) in [
        ("ggx_sample", ggx_sample(alpha, wo, u)),
        ("cap_sample", cap_sample(u, n[0])),
        ("half_vector", half_vector(wo, wi)),
        ("vector_to_lobe", vector_to_lobe(frame, normal, wi)),
        ("vector_from_lobe", vector_from_lobe(frame, normal, wi)),
        ("reflected_direction", reflected_direction(wo, normal)),
        ("refracted_direction", refracted_direction(wo, normal, n[0], n[1], n[2])),
        ("usable_normal", usable_normal(parameters, wi)),
        ("metal_fresnel", metal_fresnel(&parameters, n[0])),
        ("metal_eval", metal_eval(&parameters, wo, wi)),
        ("metal_sample", metal_sample.wi),
        ("metal_sample weight", metal_sample.weight),
        ("refracting_normal", refracting_normal(&parameters, wo, wi)),
        ("rough_dielectric_eval", rough_dielectric_eval(&parameters, wo, wi)),
        ("rough_dielectric_sample", glass_sample.wi),
        ("rough_dielectric_sample weight", glass_sample.weight),
    ] {
        append(name, &[v.x(), v.y(), v.z()]);
    }
}

/// Calls the functions of `principled` materials with these lobes.
#[inline(always)]
fn append_principled_results<F: Real>(n: [F; 9], u: F::Vec2, lobes: u32, mut append: impl FnMut(&'static str, &[F])) {
    let parameters = Parameters(n);
    let [normal, wo, wi] = parameters.directions();
    let m = principled_mixture(&parameters, wo, n[0].lt(n[3]), normal, lobes, parameters.diffuse());
    append_lobes(&m, &mut append);
    let direction = principled_direction(&m, wo, u, n[8].abs(), lobes);
    let sample = evaluated_sample(direction, parameters.tint(), n[7]);
    for (name, v) in [
        ("principled_eval", principled_eval(&m, wo, wi, lobes)),
        ("glass_eval", glass_eval(&m, wo, wi)),
        ("principled_direction", direction.wi),
        ("principled_direction weight", direction.weight),
        ("evaluated_sample weight", sample.weight),
    ] {
        append(name, &[v.x(), v.y(), v.z()]);
    }
    append("principled_pdf", &[principled_pdf(&m, wo, wi, lobes)]);
    append("glass_pdf", &[glass_pdf(&m, wo, wi)]);
    append("principled_direction pdf", &[direction.pdf, direction.eta, sample.pdf]);
}

#[inline(always)]
fn append_lobes<F: Real>(m: &PrincipledLobes<F>, append: &mut impl FnMut(&'static str, &[F])) {
    for v in [m.diffuse, m.f0, m.f90, m.transmission_tint, m.glass_f0, m.sheen] {
        append("principled_mixture", &[v.x(), v.y(), v.z()]);
    }
    let p = m.lobe_probs;
    append("principled_mixture probabilities", &[p.x(), p.y(), p.z(), p.w()]);
    append("sheen_probability", &[sheen_probability(m)]);
    let numbers = [
        m.glass,
        m.glass_f90,
        m.f0_ior,
        m.ratio,
        m.eta,
        m.coat,
        m.coat_alpha,
        m.sheen_alpha,
    ];
    append("principled_mixture numbers", &numbers);
    append("principled_mixture alpha", &[m.alpha.x(), m.alpha.y()]);
}

struct Random(u64);

impl Random {
    fn word(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    /// Returns a number from -1 to 1, a special number, or a number with arbitrary bits.
    fn number(&mut self) -> f32 {
        const SPECIAL: [f32; 8] = [0.0, -0.0, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-40];
        let word = self.word();
        match self.word() % 8 {
            0 => SPECIAL[word as usize % SPECIAL.len()],
            1 => f32::from_bits(word),
            _ => unit_float(word) * 2.0 - 1.0,
        }
    }
}

fn bits(x: f32) -> u32 {
    if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }
}

#[test]
fn lanes_are_bit_identical_to_scalar_results() {
    // Without optimization, the frame of all inlined functions exceeds the stack of a test's thread.
    let thread = std::thread::Builder::new().stack_size(64 << 20);
    let result = thread.spawn(compare_lanes).expect("a thread").join();
    result.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
}

fn compare_lanes() {
    let random = &mut Random(7);
    let mut differing = 0;
    for _ in 0..cases(3000) {
        let mut lanes = [(); LANES].map(|()| Arguments {
            words: [(); 4].map(|()| random.word()),
            square: [(); 2].map(|()| unit_float(random.word())),
            numbers: [(); 9].map(|()| random.number()),
        });
        // Points where `disk_sample` switches between its cases.
        lanes[0].square = [[0.0, 0.5], [0.5, 0.5], [0.5, 0.0], [0.25, 0.75]][random.word() as usize % 4];
        let expected = lanes.map(|arguments| {
            let (mut reals, mut words) = (Vec::new(), Vec::new());
            append_results(arguments, &mut reals, &mut words);
            let (numbers, u) = (arguments.numbers, Vec2::from_array(arguments.square));
            let mut append = |name, results: &[f32]| reals.extend(results.iter().map(|&x| (name, x)));
            append_facet_results(numbers, u, &mut append);
            for lobes in LOBES {
                append_principled_results(numbers, u, lobes, &mut append);
            }
            (reals, words)
        });
        for level in levels() {
            dispatch!(level, simd => {
                let word = |i: usize| u32x8::simd_from(simd, lanes.map(|a| a.words[i]));
                let arguments = Arguments {
                    words: [word(0), word(1), word(2), word(3)],
                    square: [0, 1].map(|i| f32x8::simd_from(simd, lanes.map(|a: Arguments<u32>| a.square[i]))),
                    numbers: [0, 1, 2, 3, 4, 5, 6, 7, 8]
                        .map(|i| f32x8::simd_from(simd, lanes.map(|a: Arguments<u32>| a.numbers[i]))),
                };
                let (mut reals, mut words) = (Vec::new(), Vec::new());
                append_results(arguments, &mut reals, &mut words);
                let (numbers, u) = (arguments.numbers, Lanes2 { x: arguments.square[0], y: arguments.square[1] });
                let mut append = |name, results: &[f32x8<_>]| reals.extend(results.iter().map(|&x| (name, x)));
                // Separate functions, because the compile time of a long function is not linear.
                simd.vectorize(
                    #[inline(always)]
                    || append_facet_results(numbers, u, &mut append),
                );
                for lobes in LOBES {
                    simd.vectorize(
                        #[inline(always)]
                        || append_principled_results(numbers, u, lobes, &mut append),
                    );
                }
                assert_eq!((reals.len(), words.len()), (expected[0].0.len(), expected[0].1.len()));
                for (i, (name, x)) in reals.iter().enumerate() {
                    let x: [f32; LANES] = (*x).into();
                    for lane in 0..LANES {
                        assert_eq!(bits(x[lane]), bits(expected[lane].0[i].1), "{name}, {level:?}");
                    }
                }
                for (i, (name, x)) in words.iter().enumerate() {
                    let x: [u32; LANES] = (*x).into();
                    for lane in 0..LANES {
                        assert_eq!(x[lane], expected[lane].1[i].1, "{name}, {level:?}");
                        differing += usize::from(x[lane] != expected[(lane + 1) % LANES].1[i].1);
                    }
                }
            });
        }
    }
    assert!(
        differing > cases(10_000),
        "results that differ between neighboring lanes: {differing}"
    );
}

#[test]
fn scalar_functions_accept_glam_vectors() {
    assert_eq!(dot(Vec3::X, Vec3::splat(2.0)), 2.0);
    assert_eq!(disk_sample(Vec2::splat(0.5)), Vec2::ZERO);
    assert_eq!(
        sobol_bits(0, UVec2::ZERO),
        sobol_bits(0u32, <u32 as Word>::UVec2::new(0, 0))
    );
    assert_ne!(hash4(UVec4::ZERO), UVec4::ZERO);
}

impl Random {
    fn vec4(&mut self) -> Vec4 {
        Vec4::from_array([(); 4].map(|()| self.number()))
    }

    fn vec3(&mut self) -> Vec3 {
        Vec3::from_array([(); 3].map(|()| self.number()))
    }

    fn light_node(&mut self) -> LightNode {
        LightNode {
            x: self.vec4(),
            y: self.vec4(),
            z: self.vec4(),
            radius: self.vec4().abs(),
            axis_x: self.vec4(),
            axis_y: self.vec4(),
            axis_z: self.vec4(),
            cosine: self.vec4(),
            intensity: self.vec4(),
            edge: self.vec4(),
            sides: UVec4::from_array([(); 4].map(|()| 1 + self.word() % 2)),
            ..bytemuck::Zeroable::zeroed()
        }
    }
}

#[test]
fn two_light_nodes_have_the_bits_of_single_nodes() {
    let random = &mut Random(1);
    let (mut positive, mut without_light, mut differing) = (0, 0, 0);
    for i in 0..4000 {
        let nodes = [random.light_node(), random.light_node()];
        let points = [random.vec3(), random.vec3()];
        let normals = [random.vec3(), if i % 4 == 0 { Vec3::ZERO } else { random.vec3() }];
        let single = [0, 1].map(|i| {
            let importances = light_importances(&nodes[i], points[i], normals[i]);
            (importances, light_shares(importances))
        });
        let both = |values: [Vec4; 2]| -> [f32; LANES] { std::array::from_fn(|i| values[i / 4].to_array()[i % 4]) };
        let importances = both(single.map(|(importances, _)| importances));
        let shares = both(single.map(|(_, shares)| shares));
        for level in levels() {
            let found: [[f32; LANES]; 2] = dispatch!(level, simd => {
                let rows = |vectors: [Vec3; 2]| {
                    let row = |axis: usize| {
                        f32x8::simd_from(simd, std::array::from_fn(|i| vectors[i / 4].to_array()[axis]))
                    };
                    Lanes3 { x: row(0), y: row(1), z: row(2) }
                };
                let two = TwoLightNodes { simd, nodes: [&nodes[0], &nodes[1]] };
                let importances = light_importances(&two, rows(points), rows(normals));
                [importances.into(), light_shares(importances).into()]
            });
            assert_eq!(found[0].map(bits), importances.map(bits), "{level:?}");
            assert_eq!(found[1].map(bits), shares.map(bits), "{level:?}");
        }
        positive += importances.iter().filter(|x| **x > 0.0).count();
        without_light += importances
            .chunks(4)
            .filter(|node| node.iter().all(|x| *x == 0.0))
            .count();
        differing += usize::from(importances[..4] != importances[4..]);
    }
    assert!(
        positive > 2000 && without_light > 200 && differing > 2000,
        "{positive} positive importances, {without_light} nodes without light, {differing} pairs that differ"
    );
}
