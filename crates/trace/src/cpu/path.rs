//! Twin of `shaders/path.wgsl`: specular paths from the camera.

use glam::{UVec2, Vec3};

use super::differential::{Differential, HitDifferential, reflected_differential, refracted_differential};
use super::lanes::{Condition, Real, SurfaceVectors, Vector3};
use super::math::{dot, max};
use super::ray::Ray;
use super::specular::{fresnel, reflected_direction, refracted_cosine, refracted_direction};
use super::surface::Surface;
use crate::records::{GLASS, MAX_SPLIT_DEPTH, MIRROR, Material};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    pub ray: Ray,
    pub differential: Differential,
    pub throughput: Vec3,
    pub depth: u32,
    pub branch: u32,
    pub origin_prim: UVec2,
    pub inside_prim: UVec2,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularSplit {
    pub primary: Path,
    pub secondary: Path,
    pub splits: bool,
}

pub fn is_specular(material: &Material) -> bool {
    (material.kind == MIRROR) | (material.kind == GLASS)
}

pub fn mirrored_path(path: Path, surface: Surface, hit_diff: HitDifferential, material: &Material) -> SpecularSplit {
    let primary = reflected_path(path, surface, hit_diff, path.throughput * material.tint);
    SpecularSplit {
        primary,
        secondary: primary,
        splits: false,
    }
}

#[inline(always)]
pub fn usable_normal<F: Real, T: SurfaceVectors<Real = F>>(surface: T, normal: F::Vec3) -> F::Vec3 {
    let usable = is_usable(surface, normal);
    if !(!usable).any() {
        return normal;
    }
    let smooth = surface.smooth_normal();
    let fallback = Vector3::select(surface.normal(), smooth, is_usable(surface, smooth));
    Vector3::select(fallback, normal, usable)
}

#[inline(always)]
pub fn is_usable<F: Real, T: SurfaceVectors<Real = F>>(surface: T, normal: F::Vec3) -> F::Mask {
    let wo = surface.wo();
    let height = dot(reflected_direction(-wo, normal), surface.normal());
    let zero = height.splat(0.0);
    height.gt(zero) & dot(wo, normal).gt(zero)
}

pub fn glass_path(
    path: Path,
    surface: Surface,
    hit_diff: HitDifferential,
    material: &Material,
    random: f32,
) -> SpecularSplit {
    let eta = if surface.side > 0.0 {
        1.0 / material.ior
    } else {
        material.ior
    };
    let cosine_i = max(dot(surface.wo, surface.shading_normal), 1e-6);
    let cosine_t = refracted_cosine(cosine_i, eta);
    let reflectance = fresnel(cosine_i, cosine_t, eta);
    let splits = (path.depth < MAX_SPLIT_DEPTH) & (reflectance > 0.0) & (reflectance < 1.0);
    let reflected_share = if splits { reflectance } else { 1.0 };
    let mut reflection = reflected_path(path, surface, hit_diff, path.throughput * reflected_share);
    let refracted_share = if splits { 1.0 - reflectance } else { 1.0 };
    let throughput = path.throughput * material.tint * refracted_share;
    let refraction = refracted_path(path, surface, hit_diff, throughput, eta, cosine_i, cosine_t);
    if splits {
        reflection.branch |= 1 << path.depth;
        return SpecularSplit {
            primary: refraction,
            secondary: reflection,
            splits: true,
        };
    }
    if random < reflectance {
        return SpecularSplit {
            primary: reflection,
            secondary: reflection,
            splits: false,
        };
    }
    SpecularSplit {
        primary: refraction,
        secondary: refraction,
        splits: false,
    }
}

pub fn reflected_path(path: Path, surface: Surface, hit_diff: HitDifferential, throughput: Vec3) -> Path {
    let d = path.ray.direction;
    let ray = Ray {
        origin: surface.ray_origin,
        direction: reflected_direction(d, surface.shading_normal),
    };
    let differential = reflected_differential(hit_diff, d, surface.shading_normal);
    Path {
        ray,
        differential,
        throughput,
        depth: path.depth + 1,
        branch: path.branch,
        origin_prim: surface.exclude_front,
        inside_prim: surface.exclude_back,
    }
}

pub fn refracted_path(
    path: Path,
    surface: Surface,
    hit_diff: HitDifferential,
    throughput: Vec3,
    eta: f32,
    cosine_i: f32,
    cosine_t: f32,
) -> Path {
    let d = path.ray.direction;
    let origin = surface.position - (surface.ray_origin - surface.position);
    let ray = Ray {
        origin,
        direction: refracted_direction(d, surface.shading_normal, eta, cosine_i, cosine_t),
    };
    let differential = refracted_differential(hit_diff, d, surface.shading_normal, eta, cosine_t);
    Path {
        ray,
        differential,
        throughput,
        depth: path.depth + 1,
        branch: path.branch,
        origin_prim: surface.exclude_back,
        inside_prim: surface.exclude_front,
    }
}

pub fn pass_through_path(path: Path, surface: Surface, hit_diff: HitDifferential) -> Path {
    let origin = surface.position - (surface.ray_origin - surface.position);
    let ray = Ray {
        origin,
        direction: path.ray.direction,
    };
    Path {
        ray,
        differential: Differential {
            x: hit_diff.x,
            y: hit_diff.y,
        },
        throughput: path.throughput,
        depth: path.depth,
        branch: path.branch,
        origin_prim: surface.exclude_back,
        inside_prim: surface.exclude_front,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::math::normalize;
    use crate::records::NO_PRIMITIVE;

    #[test]
    fn unusable_normals_fall_back_to_the_smooth_or_the_geometric_normal() {
        let zero = Vec3::ZERO;
        let smooth_normal = normalize(Vec3::new(0.1, 0.0, 1.0));
        let surface = |x: f32| Surface {
            position: zero,
            normal: Vec3::Z,
            smooth_normal,
            shading_normal: smooth_normal,
            wo: normalize(Vec3::new(x, 0.0, 1.0)),
            ray_origin: zero,
            terminator_offset: zero,
            side: 1.0,
            exclude_front: NO_PRIMITIVE,
            exclude_back: NO_PRIMITIVE,
            uv: zero.truncate(),
            du: zero,
            dv: zero,
        };
        let tilted = normalize(Vec3::new(1.0, 0.0, 1.0));
        // For a viewer above the triangle, a normal tilted by 45 degrees reflects rays along the triangle or below it.
        // For a viewer on the side to which the normal tilts, the normal is usable.
        assert_eq!(usable_normal(surface(-0.1), tilted), smooth_normal);
        assert_eq!(usable_normal(surface(0.5), tilted), tilted);
        // For a viewer at a grazing angle, the smooth normal also reflects rays below the triangle.
        assert_eq!(usable_normal(surface(-8.0), tilted), Vec3::Z);
    }
}
