//! Values as 32-bit words for kernels: one word per scalar, in field order.

use glam::{IVec2, UVec2, UVec3, UVec4, Vec2, Vec3, Vec4};
use wgray_trace::cpu::dielectric::DielectricSample;
use wgray_trace::cpu::differential::{Derivative, Differential, HitDifferential};
use wgray_trace::cpu::diffuse::Angles;
use wgray_trace::cpu::equirect::EnvironmentCell;
use wgray_trace::cpu::footprint::{Ellipse, Footprint};
use wgray_trace::cpu::light::LightSegments;
use wgray_trace::cpu::light_sample::{CylinderPart, CylinderPoint};
use wgray_trace::cpu::lobe::LobeSample;
use wgray_trace::cpu::mesh::{Crossing, HitPrimitive, Shear};
use wgray_trace::cpu::modified_phong::PhongFactors;
use wgray_trace::cpu::path::{Path, SpecularSplit};
use wgray_trace::cpu::phong::Lobes;
use wgray_trace::cpu::primitive::Tangents;
use wgray_trace::cpu::principled::PrincipledLobes;
use wgray_trace::cpu::ray::{Hit, Ray};
use wgray_trace::cpu::shadow::{SampleBlock, ShadowFrustum};
use wgray_trace::cpu::slab::{RayInterval, Slabs};
use wgray_trace::cpu::surface::Surface;
use wgray_trace::records::{
    Camera, Environment, FirstHit, Instance, Light, LightNode, Material, Node, Primitive, Sphere, Texture,
};

pub trait ProbeWords: Sized {
    /// Reads a value from the front of `words`, and removes the words of the value from `words`.
    fn read(words: &mut &[u32]) -> Self;
    fn write(&self, words: &mut Vec<u32>);
}

macro_rules! scalars {
    ($($ty:ty: |$bits:ident| $from:expr, |$value:ident| $to:expr;)*) => {$(
        impl ProbeWords for $ty {
            fn read(words: &mut &[u32]) -> Self {
                let ($bits, rest) = words.split_first().expect("a word for each scalar of the type");
                *words = rest;
                $from
            }
            fn write(&self, words: &mut Vec<u32>) {
                let $value = *self;
                words.push($to);
            }
        }
    )*};
}
scalars! {
    f32: |bits| f32::from_bits(*bits), |x| x.to_bits();
    u32: |bits| *bits, |x| x;
    i32: |bits| *bits as i32, |x| x as u32;
    bool: |bits| *bits != 0, |x| u32::from(x);
}

/// Plain data, which is uploaded as is.
macro_rules! pod {
    ($($ty:ty),* $(,)?) => {$(
        impl ProbeWords for $ty {
            fn read(words: &mut &[u32]) -> Self {
                let (value_words, rest) = words.split_at(size_of::<$ty>() / 4);
                *words = rest;
                bytemuck::pod_read_unaligned(bytemuck::cast_slice(value_words))
            }
            fn write(&self, words: &mut Vec<u32>) {
                words.extend(bytemuck::bytes_of(self).chunks_exact(4).map(bytemuck::pod_read_unaligned::<u32>));
            }
        }
    )*};
}
pod![Vec2, Vec3, Vec4, UVec2, UVec3, UVec4, IVec2];
pod![
    Camera,
    Environment,
    Primitive,
    Material,
    Light,
    LightNode,
    FirstHit,
    Sphere,
    Texture,
    Node,
    Instance
];

/// Records of `crates/trace/src/cpu/`. If a field is missing here, the code does not compile.
macro_rules! records {
    ($($ty:ident { $($field:ident),* $(,)? })*) => {$(
        impl ProbeWords for $ty {
            fn read(words: &mut &[u32]) -> Self {
                $(let $field = ProbeWords::read(words);)*
                $ty { $($field),* }
            }
            fn write(&self, words: &mut Vec<u32>) {
                let $ty { $($field),* } = self;
                $($field.write(words);)*
            }
        }
    )*};
}
records! {
    Ray { origin, direction }
    Hit { t, instance, primitive, slot, barycentric }
    Surface { position, normal, smooth_normal, shading_normal, wo, ray_origin, terminator_offset, side, exclude_front, exclude_back, uv, du, dv }
    Derivative { position, direction }
    Differential { x, y }
    HitDifferential { x, y, normal_x, normal_y }
    Footprint { uv, dx, dy }
    Ellipse { m, major, minor }
    EnvironmentCell { column, row, x, y }
    Tangents { u, v }
    CylinderPart { arc, middle, side, end, start }
    CylinderPoint { to, normal }
    Path { ray, differential, throughput, depth, branch, origin_prim, inside_prim }
    SpecularSplit { primary, secondary, splits }
    DielectricSample { path, is_transmitted, eta }
    Angles { wi, wo, between }
    LobeSample { wi, weight, pdf, eta }
    PrincipledLobes {
        diffuse, alpha, f0, f90, glass, transmission_tint, glass_f0, glass_f90, f0_ior, ratio, eta, thin, coat, coat_alpha,
        coat_normal, sheen, sheen_alpha, lobe_probs,
    }
    PhongFactors { diffuse, specular, diffuse_share }
    LightSegments { towards, u, v }
    Lobes { diffuse, specular }
    SampleBlock { pattern, side, first, count, group, key }
    ShadowFrustum { apex, segments, length2, inverse_depth }
    Slabs { low_origin, high_origin, inverse }
    RayInterval { low_origin, high_origin, near_low, near_high, far_low, far_high }
    Shear { axis, slope, scale }
    Crossing { is_hit, t, barycentric }
    HitPrimitive {
        primitive, edge_1, edge_2, uv_0, uv_1, uv_2, normal_0, normal_1, normal_2, tangents_0, tangents_1,
        tangents_2, anchor, condition_number,
    }
}

/// An argument that a twin takes by value or by reference.
pub trait Argument<'a>: Sized {
    type Owned: ProbeWords;
    fn of(owned: &'a Self::Owned) -> Self;
}

impl<'a, T: ProbeWords + Copy> Argument<'a> for T {
    type Owned = T;
    fn of(owned: &'a T) -> T {
        *owned
    }
}

macro_rules! by_reference {
    ($($ty:ty),*) => {$(
        impl<'a> Argument<'a> for &'a $ty {
            type Owned = $ty;
            fn of(owned: &'a $ty) -> &'a $ty {
                owned
            }
        }
    )*};
}
by_reference![
    Camera,
    Environment,
    Primitive,
    Material,
    PrincipledLobes,
    Light,
    LightNode,
    Sphere,
    Surface,
    ShadowFrustum,
    Texture,
    Node,
    Instance,
    HitPrimitive
];
