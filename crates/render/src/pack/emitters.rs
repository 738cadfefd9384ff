//! Emitters of the path integrator and their selection probabilities, proportional to power.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::light_tree::{self, Cone, TreeEmitter};
use super::primitive::{area, axes, bounding_box, bounding_sphere};
use super::{
    DIRECTIONAL, DISTANT_T_MAX, EMITTER, ENVIRONMENT, Emitter, Light, Material, NO_INDEX, NO_SHADOW, PLANE, POINT,
    Primitive, SPOT, TRIANGLE, t_max,
};
use wgray_scene::{Color, Scene, Texels, TextureKind};
use wgray_trace::cpu::primitive::is_solid;
use wgray_trace::records::{Lighting, PackedBvh};

/// The emitters of a scene.
#[derive(Default)]
pub struct PackedEmitters {
    /// Lights, emitters and light tree.
    pub lighting: Lighting,
    /// Probability of sampling the environment map.
    pub environment_probability: f64,
    /// [`Instance::leaves`](super::Instance::leaves) per instance; empty without a light tree.
    pub instance_leaves: Vec<u32>,
}

/// Maximum number of emitters that are selected only by power; more emitters use a light tree.
pub const MAX_LISTED_EMITTERS: usize = 16;
/// Maximum number of emitters in a light tree, which takes about 100 bytes per emitter. More emitters are selected only
/// by power.
const MAX_TREE_EMITTERS: usize = 500_000;

/// Collects all emitters: primitives, delta lights, triangles of meshes and the environment map. Sets
/// [`Material::density`], the PDF of samples on emissive surfaces. `environment_integral` is the integral of the map
/// over all directions.
pub fn emitters(
    scene: &Scene,
    materials: &mut [Material],
    delta_lights: &[Light],
    primitives: &[(Primitive, bool)],
    bvh: &PackedBvh,
    environment_integral: Option<f64>,
) -> PackedEmitters {
    // Mean radiance of each material, and its power per area.
    let radiances: Vec<f64> = (materials.iter().enumerate())
        .map(
            |(i, material)| match scene.materials.get(i).map(|material| &material.emission) {
                Some(emission) => mean_of(scene, emission),
                None => mean(material.emission), // of an area light
            },
        )
        .collect();
    let mut strengths: Vec<f64> = (materials.iter().zip(&radiances))
        .map(|(material, radiance)| {
            let sides = if material.kind == EMITTER { 1.0 } else { 2.0 };
            std::f64::consts::PI * radiance * sides
        })
        .collect();
    let mut packed = PackedEmitters::default();
    let mut powers = Vec::new();
    // Group of each emitter for `mix_in_uniform`: the material index, or a unique number if a light has no material.
    let mut groups = Vec::new();
    for (i, (primitive, _)) in (0..).zip(primitives) {
        let material = &materials[primitive.material as usize];
        let strength = strengths[primitive.material as usize];
        if strength > 0.0 && primitive.kind != PLANE {
            let light = light_of(primitive, i, material, t_max(scene.render.shadow_epsilon));
            powers.push(strength * area(primitive));
            groups.push(primitive.material as usize);
            packed.lighting.lights.push(light);
        }
    }
    for light in delta_lights.iter().filter(|light| light.color != Vec3::ZERO) {
        powers.push(match light.kind {
            POINT => 4.0 * std::f64::consts::PI * mean(light.color),
            SPOT => spot_power(light) * mean(light.color),
            _ => std::f64::consts::PI * radius(primitives, bvh).powi(2) * mean(light.color),
        });
        packed.lighting.lights.push(*light);
    }
    let environment = packed.lighting.lights.len();
    let material_count = groups.len();
    groups.extend((material_count..environment).map(|i| materials.len() + i));
    if let Some(environment_integral) = environment_integral {
        powers.push(std::f64::consts::PI * radius(primitives, bvh).powi(2) * environment_integral);
        packed.lighting.lights.push(environment_light());
        groups.push(materials.len() + environment);
    }
    let mut references: Vec<(u32, u32)> = (0..packed.lighting.lights.len() as u32).map(|i| (0, i)).collect();
    for (number, instance) in (1..).zip(&bvh.instances) {
        let mesh = &bvh.meshes[instance.mesh as usize];
        let columns = DMat3::from_cols(instance.u.as_dvec3(), instance.v.as_dvec3(), instance.w.as_dvec3());
        for (slot, triangle) in (0..).zip(&mesh.triangles) {
            let mesh_group = mesh.groups.get(slot as usize).copied().unwrap_or(0);
            let material = bvh.group_words[(instance.first_group_word + mesh_group) as usize] & !NO_SHADOW;
            let strength = strengths[material as usize];
            if strength > 0.0 {
                let [a, b, c] = [triangle.x, triangle.y, triangle.z]
                    .map(|vertex| columns * mesh.vertices[vertex as usize].truncate().as_dvec3());
                let area = 0.5 * (b - a).cross(c - a).length();
                if area > 0.0 {
                    references.push((number, slot));
                    powers.push(strength * area);
                    groups.push(material as usize);
                }
            }
        }
    }
    scale_far_powers(&mut powers, &references, &packed.lighting.lights);
    let is_far = |reference: &(u32, u32)| is_far(&packed.lighting.lights, reference);
    let near_count = references.iter().filter(|reference| !is_far(reference)).count();
    if (MAX_LISTED_EMITTERS + 1..=MAX_TREE_EMITTERS).contains(&near_count) {
        let list = EmitterList {
            references,
            powers,
            radiances,
            strengths,
        };
        return with_tree(packed, materials, primitives, bvh, &list);
    }
    for (group, factor) in mix_in_uniform(&mut powers, &groups, |i| is_far(&references[i])) {
        if let Some(strength) = strengths.get_mut(group) {
            *strength *= factor;
        }
    }
    let total: f64 = powers.iter().sum();
    for (material, strength) in materials.iter_mut().zip(strengths) {
        // With a tiny total, the value of an unused emissive material could overflow.
        material.density = if total > 0.0 {
            (strength / total).min(f64::from(f32::MAX)) as f32
        } else {
            0.0
        };
    }
    for (light, power) in packed.lighting.lights.iter_mut().zip(&powers) {
        light.density = match light.kind {
            POINT | DIRECTIONAL | SPOT | ENVIRONMENT => (power / total) as f32,
            _ => materials[primitives[light.primitive as usize].0.material as usize].density,
        };
    }
    packed.environment_probability = environment_integral.map_or(0.0, |_| powers[environment] / total);
    packed.lighting.emitters = (table(&powers).into_iter().zip(references))
        .map(|((threshold, alias_index), (instance, index))| Emitter {
            threshold,
            alias_index,
            instance,
            index,
        })
        .collect();
    packed
}

/// Defensive sampling of near emitters: scales the power of each group so that a quarter of the samples are uniform
/// over all emitters. Otherwise, an occluded strong emitter would take the samples of all other emitters. Returns the
/// factors of the groups; no factors for a single group.
fn mix_in_uniform(powers: &mut [f64], groups: &[usize], is_far: impl Fn(usize) -> bool) -> Vec<(usize, f64)> {
    let mut near: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
    for (i, (power, group)) in powers.iter().zip(groups).enumerate() {
        if !is_far(i) {
            let (sum, count) = near.entry(*group).or_default();
            *sum += power;
            *count += 1.0;
        }
    }
    let (total_power, total_count) = near
        .values()
        .fold((0.0, 0.0), |(total_power, total_count), (sum, count)| {
            (total_power + sum, total_count + count)
        });
    if near.len() < 2 {
        return Vec::new();
    }
    let factors: BTreeMap<usize, f64> = (near.iter())
        .map(|(group, (sum, count))| (*group, 0.75 + 0.25 * (count / total_count) * (total_power / sum)))
        .collect();
    for (i, power) in powers.iter_mut().enumerate() {
        if let Some(factor) = factors.get(&groups[i])
            && !is_far(i)
        {
            *power *= factor;
        }
    }
    factors.into_iter().collect()
}

/// Scales the power of distant emitters so that their fraction s of the power becomes 0.5 s + 0.25: in a wide
/// landscape, a near emitter has a tiny fraction of the power, but dominates the light in its neighborhood.
fn scale_far_powers(powers: &mut [f64], references: &[(u32, u32)], lights: &[Light]) {
    let far_flags: Vec<bool> = references.iter().map(|reference| is_far(lights, reference)).collect();
    let sum = |is_far: bool| -> f64 {
        let selected = powers.iter().zip(&far_flags).filter(|(_, far)| **far == is_far);
        selected.map(|(power, _)| power).sum()
    };
    let (far_power, near_power) = (sum(true), sum(false));
    if far_power > 0.0 && near_power > 0.0 {
        let fraction = 0.5 * (far_power / (far_power + near_power)) + 0.25;
        let factor = near_power * fraction / (1.0 - fraction) / far_power;
        for (power, _) in powers.iter_mut().zip(far_flags).filter(|(_, far)| *far) {
            *power *= factor;
        }
    }
}

fn environment_light() -> Light {
    Light {
        t_max: DISTANT_T_MAX,
        primitive: NO_INDEX,
        number: NO_INDEX,
        kind: ENVIRONMENT,
        ..bytemuck::Zeroable::zeroed()
    }
}

fn is_far(lights: &[Light], &(instance, index): &(u32, u32)) -> bool {
    instance == 0 && matches!(lights[index as usize].kind, DIRECTIONAL | ENVIRONMENT)
}

/// All emitters, and the strengths of materials.
struct EmitterList {
    /// 0 for a light, else 1 + mesh instance; and the index of the light or triangle.
    references: Vec<(u32, u32)>,
    /// Power of each emitter.
    powers: Vec<f64>,
    /// Mean radiance of each material.
    radiances: Vec<f64>,
    /// Power per area of each material.
    strengths: Vec<f64>,
}

/// Builds the light tree over all near emitters. The alias table selects the light tree or a distant emitter.
fn with_tree(
    mut packed: PackedEmitters,
    materials: &mut [Material],
    primitives: &[(Primitive, bool)],
    bvh: &PackedBvh,
    list: &EmitterList,
) -> PackedEmitters {
    let is_far = |reference: &(u32, u32)| is_far(&packed.lighting.lights, reference);
    let (mut in_tree, mut far) = (Vec::new(), Vec::new());
    for (reference, power) in list.references.iter().zip(&list.powers) {
        if is_far(reference) { &mut far } else { &mut in_tree }.push((*reference, *power));
    }
    let power_of = |emitters: &[((u32, u32), f64)]| emitters.iter().map(|(_, power)| power).sum::<f64>();
    let (tree_power, total) = (power_of(&in_tree), power_of(&in_tree) + power_of(&far));
    let tree_probability = tree_power / total;
    let tree_emitters: Vec<TreeEmitter> = in_tree
        .iter()
        .map(|((instance, index), _)| {
            let emitter = match *instance {
                0 => tree_emitter(&packed.lighting.lights[*index as usize], primitives, &list.radiances),
                number => {
                    let (corners, material) = instance_triangle(bvh, number as usize - 1, *index);
                    tree_emitter_of_triangle(corners, list.radiances[material as usize], true)
                }
            };
            TreeEmitter {
                density: emitter.density * tree_probability,
                instance: *instance,
                index: *index,
                ..emitter
            }
        })
        .collect();
    packed.lighting.nodes = light_tree::build(&tree_emitters);
    packed.lighting.leaves = vec![NO_INDEX; primitives.len()];
    packed.instance_leaves = vec![NO_INDEX; bvh.instances.len()];
    for emitter in tree_emitters.iter().filter(|emitter| emitter.instance != 0) {
        let number = emitter.instance as usize - 1;
        if packed.instance_leaves[number] == NO_INDEX {
            packed.instance_leaves[number] = packed.lighting.leaves.len() as u32;
            let triangles = bvh.meshes[bvh.instances[number].mesh as usize].triangles.len();
            packed
                .lighting
                .leaves
                .resize(packed.lighting.leaves.len() + triangles, NO_INDEX);
        }
    }
    for (number, node) in (0..).zip(&packed.lighting.nodes) {
        for (i, child) in (4 * number..).zip(0..4) {
            if node.children[child] != NO_INDEX || node.intensity[child] == 0.0 {
                continue;
            }
            let leaf = match node.instance[child] {
                0 => packed.lighting.lights[node.index[child] as usize].primitive,
                number => packed.instance_leaves[number as usize - 1] + node.index[child],
            };
            if leaf != NO_INDEX {
                packed.lighting.leaves[leaf as usize] = i;
            }
        }
    }
    for (material, strength) in materials.iter_mut().zip(&list.strengths) {
        material.density = if *strength > 0.0 { 1.0 } else { 0.0 };
    }
    for ((_, index), power) in &far {
        let light = &mut packed.lighting.lights[*index as usize];
        light.density = (power / total) as f32;
        if light.kind == ENVIRONMENT {
            packed.environment_probability = power / total;
        }
    }
    let weights: Vec<f64> = [tree_power]
        .into_iter()
        .chain(far.iter().map(|(_, power)| *power))
        .collect();
    let references = [(0, NO_INDEX)]
        .into_iter()
        .chain(far.iter().map(|(reference, _)| *reference));
    packed.lighting.emitters = (table(&weights).into_iter().zip(references))
        .map(|((threshold, alias_index), (instance, index))| Emitter {
            threshold,
            alias_index,
            instance,
            index,
        })
        .collect();
    packed
}

/// Returns the world-space corners of a triangle of an instance, and the material index.
fn instance_triangle(bvh: &PackedBvh, number: usize, slot: u32) -> ([DVec3; 3], u32) {
    let instance = &bvh.instances[number];
    let mesh = &bvh.meshes[instance.mesh as usize];
    let columns = DMat3::from_cols(instance.u.as_dvec3(), instance.v.as_dvec3(), instance.w.as_dvec3());
    let triangle = mesh.triangles[slot as usize];
    let corners = [triangle.x, triangle.y, triangle.z]
        .map(|vertex| instance.anchor.as_dvec3() + columns * mesh.vertices[vertex as usize].truncate().as_dvec3());
    let group = mesh.groups.get(slot as usize).copied().unwrap_or(0);
    (
        corners,
        bvh.group_words[(instance.first_group_word + group) as usize] & !NO_SHADOW,
    )
}

fn tree_emitter_of_triangle([a, b, c]: [DVec3; 3], radiance: f64, two_sided: bool) -> TreeEmitter {
    let span = (b - a).cross(c - a);
    let area = 0.5 * span.length();
    TreeEmitter {
        low: a.min(b).min(c),
        high: a.max(b).max(c),
        cone: Cone::flat(span.normalize_or(DVec3::Z), two_sided),
        intensity: radiance * area,
        density: 1.0 / area,
        instance: 0,
        index: 0,
    }
}

fn tree_emitter(light: &Light, primitives: &[(Primitive, bool)], radiances: &[f64]) -> TreeEmitter {
    let center = light.center.as_dvec3();
    let point = |cone: Cone| TreeEmitter {
        low: center,
        high: center,
        cone,
        intensity: mean(light.color),
        density: 1.0,
        instance: 0,
        index: 0,
    };
    match light.kind {
        POINT => return point(Cone::ALL),
        SPOT => {
            // Conservative: full intensity within `spread`; outside, at most the cosine of the angle beyond `spread`.
            let angle = |one_minus_cosine: f64| (1.0 - one_minus_cosine).clamp(-1.0, 1.0).acos();
            let cone = f64::from(light.cone);
            let (outer, inner) = (angle(cone), angle(cone - 1.0 / f64::from(light.falloff)));
            let spread = inner.max(outer - std::f64::consts::FRAC_PI_2);
            return point(Cone {
                axis: light.normal.as_dvec3(),
                spread,
                edge: outer - spread,
                two_sided: false,
            });
        }
        _ => {}
    }
    let primitive = &primitives[light.primitive as usize].0;
    let radiance = radiances[primitive.material as usize];
    let [u, v, _] = axes(primitive);
    if primitive.kind == TRIANGLE {
        let corners = [center, center + u, center + v];
        return tree_emitter_of_triangle(corners, radiance, light.sides == 2);
    }
    let area = area(primitive);
    let (cone, intensity) = match is_solid(primitive.kind) {
        // Mean projected area of a convex solid (Cauchy).
        true => (Cone::ALL, radiance * area / 4.0),
        false => {
            let normal = u.cross(v).normalize_or(DVec3::Z);
            (Cone::flat(normal, light.sides == 2), radiance * area)
        }
    };
    let (low, high) = bounding_box(primitive);
    TreeEmitter {
        low,
        high,
        cone,
        intensity,
        density: 1.0 / area,
        instance: 0,
        index: 0,
    }
}

/// Builds an alias table: thresholds and alias indices. Vose, "A Linear Algorithm for Generating Random Numbers with a
/// Given Distribution", IEEE TSE 17(9), 1991.
fn table(weights: &[f64]) -> Vec<(f32, u32)> {
    let mean = weights.iter().sum::<f64>() / weights.len() as f64;
    let mut scaled_weights: Vec<f64> = weights.iter().map(|weight| weight / mean).collect();
    let mut table: Vec<(f32, u32)> = (0..weights.len() as u32).map(|i| (1.0, i)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..weights.len()).partition(|i| scaled_weights[*i] < 1.0);
    while let (Some(i), Some(&j)) = (small.pop(), large.last()) {
        table[i] = (scaled_weights[i] as f32, j as u32);
        scaled_weights[j] -= 1.0 - scaled_weights[i];
        if scaled_weights[j] < 1.0 {
            small.push(j);
            large.pop();
        }
    }
    table
}

/// Returns the power of a spot light of intensity 1. The falloff is the square of a ramp that is linear in the cosine.
fn spot_power(light: &Light) -> f64 {
    let (cone, ramp) = (f64::from(light.cone), 1.0 / f64::from(light.falloff));
    2.0 * std::f64::consts::PI * (cone - ramp + ramp / 3.0)
}

fn mean(color: Vec3) -> f64 {
    color.as_dvec3().element_sum() / 3.0
}

/// Returns the mean of a color's components; for a texture, averaged over the texture.
fn mean_of(scene: &Scene, color: &Color) -> f64 {
    let component_mean = |color: DVec3| color.element_sum() / 3.0;
    match *color {
        Color::Plain(color) => component_mean(color),
        Color::Texture(i) => match &scene.textures[i].kind {
            TextureKind::Constant(color) => component_mean(*color),
            TextureKind::Checker { even, odd } => component_mean((*even + *odd) / 2.0),
            TextureKind::Lines { cell, line, .. } => component_mean((*cell + *line) / 2.0),
            TextureKind::Image { image, factor, .. } => {
                component_mean(*factor)
                    * match &image.texels {
                        Texels::Bytes(_, bytes) => {
                            let sum: u64 = bytes.as_flattened().par_iter().map(|byte| u64::from(*byte)).sum();
                            sum as f64 / 255.0 / (3 * bytes.len().max(1)) as f64
                        }
                        Texels::Floats(floats) => {
                            floats.iter().flatten().map(|x| f64::from(*x)).sum::<f64>()
                                / (3 * floats.len().max(1)) as f64
                        }
                    }
            }
        },
    }
}

fn light_of(primitive: &Primitive, number: u32, material: &Material, t_max: f32) -> Light {
    let [u, v, _] = axes(primitive);
    Light {
        center: primitive.anchor,
        t_max,
        u: u.as_vec3(),
        finite: 1.0,
        v: v.as_vec3(),
        primitive: number,
        color: material.emission,
        number: primitive.shape,
        normal: u.cross(v).normalize_or_zero().as_vec3(),
        kind: primitive.kind,
        sides: if material.kind == EMITTER { 1 } else { 2 },
        ..bytemuck::Zeroable::zeroed()
    }
}

/// Returns half the diagonal of the bounding box of bounded geometry; 1 if the box is empty.
fn radius(primitives: &[(Primitive, bool)], bvh: &PackedBvh) -> f64 {
    let spheres = primitives.iter().filter(|(p, _)| p.kind != PLANE).map(|(p, _)| {
        let sphere = bounding_sphere(p);
        let (center, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
        (center - radius, center + radius)
    });
    let items = bvh.items.iter().map(|item| (item.low.as_dvec3(), item.high.as_dvec3()));
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = (spheres.chain(items)).fold(empty, |(low, high), (a, b)| (low.min(a), high.max(b)));
    if low.x <= high.x {
        (high - low).length() / 2.0
    } else {
        1.0
    }
}
