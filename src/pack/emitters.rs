//! What shines, for the integrator `path`: of each thing how likely a sample of light is one of it, which is by its power.

use glam::{DMat3, DVec3, Vec3};

use super::geometry::Trees;
use super::{
    DIRECTIONAL, DISK, ELLIPSOID, EMITTER, Emitter, Light, Material, NO_SHADOW, PLANE, POINT, Primitive, RECTANGLE,
    TRIANGLE, reach,
};
use crate::scene::{Color, Scene, Texels, TextureKind};

/// What shines.
#[derive(Default)]
pub struct Shining {
    /// The primitives that shine, and the lights without extent.
    pub lights: Vec<Light>,
    /// These, and the triangles of meshes that shine.
    pub emitters: Vec<Emitter>,
}

/// All that shines, of primitives with their materials, lights without extent and meshes. The materials are told how densely samples lie on
/// what shines.
pub fn emitters(
    scene: &Scene,
    materials: &mut [Material],
    delta_lights: &[Light],
    primitives: &[(Primitive, bool)],
    trees: &Trees,
) -> Shining {
    // Of each material the power of a unit of area.
    let strengths: Vec<f64> = (materials.iter().enumerate())
        .map(|(i, material)| {
            let mean = match scene.materials.get(i).map(|material| &material.emission) {
                Some(emission) => mean_of(scene, emission),
                None => mean(material.emission), // a light's own
            };
            let sides = if material.kind == EMITTER { 1.0 } else { 2.0 };
            std::f64::consts::PI * mean * sides
        })
        .collect();
    let mut shining = Shining::default();
    let mut powers = Vec::new();
    for (i, (primitive, _)) in (0..).zip(primitives) {
        let material = &materials[primitive.material as usize];
        let strength = strengths[primitive.material as usize];
        if strength > 0.0 && primitive.kind != PLANE {
            let light = light_of(primitive, i, material, reach(scene.render.shadow_epsilon));
            powers.push(strength * area(primitive));
            shining.lights.push(light);
        }
    }
    for light in delta_lights.iter().filter(|light| light.color != Vec3::ZERO) {
        powers.push(match light.kind {
            POINT => 4.0 * std::f64::consts::PI * mean(light.color),
            _ => std::f64::consts::PI * radius(primitives, trees).powi(2) * mean(light.color),
        });
        shining.lights.push(*light);
    }
    let mut places: Vec<(u32, u32)> = (0..shining.lights.len() as u32).map(|i| (0, i)).collect();
    for (number, instance) in (1..).zip(&trees.instances) {
        let mesh = &trees.meshes[instance.mesh as usize];
        let columns = DMat3::from_cols(instance.u.as_dvec3(), instance.v.as_dvec3(), instance.w.as_dvec3());
        for (slot, triangle) in (0..).zip(&mesh.triangles) {
            let group = mesh.groups.get(slot as usize).copied().unwrap_or(0);
            let material = trees.group_words[(instance.materials + group) as usize] & !NO_SHADOW;
            let strength = strengths[material as usize];
            if strength > 0.0 {
                let [a, b, c] = [triangle.x, triangle.y, triangle.z]
                    .map(|vertex| columns * mesh.vertices[vertex as usize].truncate().as_dvec3());
                let area = 0.5 * (b - a).cross(c - a).length();
                if area > 0.0 {
                    places.push((number, slot));
                    powers.push(strength * area);
                }
            }
        }
    }
    let total: f64 = powers.iter().sum();
    for (material, strength) in materials.iter_mut().zip(strengths) {
        // Where all that shines is tiny, what shines nowhere may be beyond all numbers.
        material.density = if total > 0.0 {
            (strength / total).min(f64::from(f32::MAX)) as f32
        } else {
            0.0
        };
    }
    for (light, power) in shining.lights.iter_mut().zip(&powers) {
        light.density = match light.kind {
            POINT | DIRECTIONAL => (power / total) as f32,
            _ => materials[primitives[light.primitive as usize].0.material as usize].density,
        };
    }
    shining.emitters = (table(&powers).into_iter().zip(places))
        .map(|((threshold, other), (instance, index))| Emitter {
            threshold,
            other,
            instance,
            index,
        })
        .collect();
    shining
}

/// For each of some weights a threshold and another index: one of n numbers is as likely as its weight if it is taken itself with
/// its threshold's probability, else the other. Vose, "A Linear Algorithm for Generating Random Numbers with a Given Distribution",
/// IEEE TSE 17(9), 1991.
fn table(weights: &[f64]) -> Vec<(f32, u32)> {
    let mean = weights.iter().sum::<f64>() / weights.len() as f64;
    let mut rest: Vec<f64> = weights.iter().map(|weight| weight / mean).collect();
    let mut table: Vec<(f32, u32)> = (0..weights.len() as u32).map(|i| (1.0, i)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..weights.len()).partition(|i| rest[*i] < 1.0);
    while let (Some(i), Some(&j)) = (small.pop(), large.last()) {
        table[i] = (rest[i] as f32, j as u32);
        rest[j] -= 1.0 - rest[i];
        if rest[j] < 1.0 {
            small.push(j);
            large.pop();
        }
    }
    table
}

fn mean(color: Vec3) -> f64 {
    color.as_dvec3().element_sum() / 3.0
}

/// The mean of a colour's components, over the whole of a texture.
fn mean_of(scene: &Scene, color: &Color) -> f64 {
    let mean = |color: DVec3| color.element_sum() / 3.0;
    match *color {
        Color::Plain(color) => mean(color),
        Color::Texture(i) => match &scene.textures[i].kind {
            TextureKind::Constant(color) => mean(*color),
            TextureKind::Checker { even, odd } => mean((*even + *odd) / 2.0),
            TextureKind::Lines { cell, line, .. } => mean((*cell + *line) / 2.0),
            TextureKind::Image { image, .. } => match &image.texels {
                Texels::Bytes(_, bytes) => {
                    let sum: u64 = bytes.iter().flatten().map(|byte| u64::from(*byte)).sum();
                    sum as f64 / 255.0 / (3 * bytes.len().max(1)) as f64
                }
                Texels::Floats(floats) => {
                    floats.iter().flatten().map(|x| f64::from(*x)).sum::<f64>() / (3 * floats.len().max(1)) as f64
                }
            },
        },
    }
}

/// A primitive that shines, as a light.
fn light_of(primitive: &Primitive, number: u32, material: &Material, reach: f32) -> Light {
    let [u, v, _] = axes(primitive);
    Light {
        center: primitive.anchor,
        reach,
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

/// The images of a local space's axes.
fn axes(primitive: &Primitive) -> [DVec3; 3] {
    let rows = [primitive.x, primitive.y, primitive.z].map(Vec3::as_dvec3);
    let columns = DMat3::from_cols_array_2d(&rows.map(|row| row.to_array()))
        .transpose()
        .inverse();
    [columns.x_axis, columns.y_axis, columns.z_axis]
}

/// A primitive's area; an ellipsoid's as `ellipsoid_area` has it.
fn area(primitive: &Primitive) -> f64 {
    let [u, v, _] = axes(primitive);
    let span = u.cross(v).length();
    match primitive.kind {
        RECTANGLE => 4.0 * span,
        DISK => std::f64::consts::PI * span,
        TRIANGLE => 0.5 * span,
        ELLIPSOID => {
            let rows = [primitive.x, primitive.y, primitive.z].map(|row| row.as_dvec3().length_squared());
            let squares: f64 = rows.iter().sum();
            4.0 * std::f64::consts::PI * (squares / 3.0).sqrt() / f64::from(primitive.determinant).abs()
        }
        _ => 0.0,
    }
}

/// Half the diagonal of a box around all that is bounded; 1 where there is nothing.
fn radius(primitives: &[(Primitive, bool)], trees: &Trees) -> f64 {
    let spheres = primitives.iter().filter(|(p, _)| p.kind != PLANE).map(|(p, _)| {
        let sphere = super::bounds::sphere(p);
        let (center, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
        (center - radius, center + radius)
    });
    let items = trees
        .items
        .iter()
        .map(|item| (item.low.as_dvec3(), item.high.as_dvec3()));
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = (spheres.chain(items)).fold(empty, |(low, high), (a, b)| (low.min(a), high.max(b)));
    if low.x <= high.x {
        (high - low).length() / 2.0
    } else {
        1.0
    }
}
