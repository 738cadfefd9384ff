//! Surfaces at the hits of several paths in SIMD lanes, without texture coordinates.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, mask32x8};
use glam::{Vec3, Vec4Swizzles as _};

use super::super::geometry::instance_of;
use super::super::lanes::{Real, SurfaceVectors, Vector3, constant, select};
use super::super::math::{cross, dot, max, normalize};
use super::super::mesh::{HitPrimitive, flipped_to, lift};
use super::super::primitive::Tangents;
use super::super::ray::{Hit, Ray};
use super::super::surface::{Surface, largest};
use super::rows::{F, LANES, Row, Rows3, V, load3, set3, splat3};
use crate::records::{Instance, NO_INDEX, Packed};

/// The fields of [`Surface`] that shading in lanes needs.
#[derive(Clone, Copy)]
pub struct LaneSurfaces<S: Simd> {
    pub position: V<S>,
    pub normal: V<S>,
    pub smooth_normal: V<S>,
    pub shading_normal: V<S>,
    pub ray_origin: V<S>,
    pub terminator_offset: V<S>,
    /// The normal of the clear coat, before it is made usable.
    pub coat_normal: V<S>,
    /// Unit vectors towards the previous vertices.
    pub wo: V<S>,
    /// 1 where the front of a surface is hit, else -1.
    pub side: F<S>,
    /// [`None`] if tangents follow from the shading normal.
    pub tangents: Option<Tangents<V<S>>>,
    /// [`None`] if no hit is on a mesh. Other primitives may have any values.
    pub triangle: Option<LaneTriangles<S>>,
    /// True where the material transmits light. [`None`] if none does.
    pub transmits: Option<mask32x8<S>>,
}

/// `anchor`, `x` and `y` of triangles ([`Primitive`](crate::records::Primitive)). They map a point p to barycentric
/// coordinates: `dot(x, p - anchor)` and `dot(y, p - anchor)`.
#[derive(Clone, Copy)]
pub struct LaneTriangles<S: Simd> {
    anchor: V<S>,
    x: V<S>,
    y: V<S>,
}

impl<S: Simd> SurfaceVectors for LaneSurfaces<S> {
    type Real = F<S>;

    #[inline(always)]
    fn normal(&self) -> V<S> {
        self.normal
    }

    #[inline(always)]
    fn smooth_normal(&self) -> V<S> {
        self.smooth_normal
    }

    #[inline(always)]
    fn wo(&self) -> V<S> {
        self.wo
    }
}

impl<S: Simd> LaneSurfaces<S> {
    /// Returns `value` where a surface may reflect light from `wi`, else zero.
    #[inline(always)]
    pub fn where_allowed(&self, wi: V<S>, value: V<S>) -> V<S> {
        Vector3::select(splat3(wi.x.simd, Vec3::ZERO), value, self.direction_allowed(wi))
    }

    /// Returns true where a surface may reflect light from `wi`, like the scalar `direction_allowed`.
    #[inline(always)]
    pub fn direction_allowed(&self, wi: V<S>) -> mask32x8<S> {
        let zero = wi.x.splat(0.0);
        let (over_shaded, over_smooth) = (dot(self.shading_normal, wi), dot(self.smooth_normal, wi));
        let mut lit = over_shaded.gt(zero) & over_smooth.gt(zero);
        // Without a mesh, the smooth normal is the geometric normal, so light from below is not in `lit`.
        if let Some(triangle) = &self.triangle {
            lit &= self.face_direction_allowed(triangle, wi);
        }
        if let Some(transmits) = self.transmits {
            let behind = over_shaded.lt(zero) & over_smooth.lt(zero) & dot(self.normal, wi).lt(zero);
            lit |= transmits & behind;
        }
        lit
    }

    /// Returns true where the terminator of a triangle lets light from `wi` pass, like the scalar `face_direction_allowed`.
    #[inline(always)]
    fn face_direction_allowed(&self, triangle: &LaneTriangles<S>, wi: V<S>) -> mask32x8<S> {
        let zero = wi.x.splat(0.0);
        let fall = -dot(self.normal, wi);
        let height = dot(self.normal, self.terminator_offset);
        let crossing = self.position + self.terminator_offset + wi * (height / max(fall, fall.splat(1e-30)));
        let from_anchor = crossing - triangle.anchor;
        let (x, y) = (dot(triangle.x, from_anchor), dot(triangle.y, from_anchor));
        fall.le(zero) | x.lt(zero) | y.lt(zero) | (x + y).gt(zero.splat(1.0))
    }

    /// Returns the normals that bound the directions to lights, like the scalar `lit_normal`.
    #[inline(always)]
    pub fn lit_normal(&self) -> V<S> {
        match self.transmits {
            Some(transmits) => Vector3::select(self.shading_normal, splat3(self.side.simd, Vec3::ZERO), transmits),
            None => self.shading_normal,
        }
    }

    /// Returns the origins of rays that leave on the other sides of the surfaces, like the scalar `flipped`.
    /// `has_instances` is true if the scene has instances of meshes.
    #[inline(always)]
    pub fn origin_behind(&self, has_instances: bool) -> V<S> {
        let origin = self.position - (self.ray_origin - self.position);
        match has_instances {
            true => origin + self.terminator_offset,
            false => origin,
        }
    }
}

/// Hits on primitives that are neither solids nor triangles of meshes.
pub struct FlatHits {
    origin: Rows3,
    direction: Rows3,
    t: Row,
    anchor: Rows3,
    z: Rows3,
}

impl FlatHits {
    pub fn new() -> FlatHits {
        FlatHits {
            origin: Default::default(),
            direction: Default::default(),
            t: Default::default(),
            anchor: Default::default(),
            z: Default::default(),
        }
    }

    #[inline(always)]
    pub fn set(&mut self, scene: &Packed, lane: usize, ray: Ray, hit: Hit) {
        let q = &scene.primitives[hit.primitive as usize];
        set3(&mut self.origin, lane, ray.origin);
        set3(&mut self.direction, lane, ray.direction);
        self.t[lane] = hit.t;
        set3(&mut self.anchor, lane, q.anchor);
        set3(&mut self.z, lane, q.z);
    }

    /// Returns the surfaces, like `surface_at`.
    #[inline(always)]
    pub fn surfaces<S: Simd>(&self, simd: S, epsilon: f32) -> LaneSurfaces<S> {
        let direction = load3(simd, &self.direction);
        let (anchor, gradient) = (load3(simd, &self.anchor), load3(simd, &self.z));
        let point = load3(simd, &self.origin) + direction * f32x8::simd_from(simd, self.t);
        let offset = point - anchor;
        let inverse_slope = constant(1.0) / Real::sqrt(dot(gradient, gradient));
        let outward = gradient * inverse_slope;
        let height = dot(gradient, offset);
        let position = point - outward * (height * inverse_slope);
        let side = side_towards(outward, direction);
        let normal = outward * side;
        let size = max(largest(position), largest(offset));
        LaneSurfaces {
            position,
            normal,
            smooth_normal: normal,
            shading_normal: normal,
            ray_origin: position + normal * (constant(epsilon) * size),
            terminator_offset: splat3(simd, Vec3::ZERO),
            coat_normal: normal,
            wo: -direction,
            side,
            tangents: None,
            triangle: None,
            transmits: None,
        }
    }
}

/// Returns -1 if a ray hits a surface from behind, else 1.
#[inline(always)]
fn side_towards<S: Simd>(outward: V<S>, direction: V<S>) -> F<S> {
    let cosine = dot(outward, direction);
    select(cosine.splat(1.0), cosine.splat(-1.0), cosine.gt(cosine.splat(0.0)))
}

/// The fields of one instance per lane.
struct InstanceRows {
    x: Rows3,
    y: Rows3,
    z: Rows3,
    anchor: Rows3,
    u: Rows3,
    v: Rows3,
    w: Rows3,
    condition_number: Row,
    side: Row,
    /// 1 if the mesh has normals, else 0.
    has_normals: Row,
}

impl InstanceRows {
    #[inline(always)]
    fn set(&mut self, lane: usize, i: &Instance) {
        let vectors = [
            (&mut self.x, i.x),
            (&mut self.y, i.y),
            (&mut self.z, i.z),
            (&mut self.anchor, i.anchor),
            (&mut self.u, i.u),
            (&mut self.v, i.v),
            (&mut self.w, i.w),
        ];
        for (rows, v) in vectors {
            set3(rows, lane, v);
        }
        self.condition_number[lane] = i.condition_number;
        self.side[lane] = i.side;
        self.has_normals[lane] = if i.attributes == NO_INDEX { 0.0 } else { 1.0 };
    }
}

/// Hits on triangles of meshes.
pub struct FaceHits {
    direction: Rows3,
    barycentric: [Row; 2],
    vertices: [Rows3; 3],
    normals: [Rows3; 3],
    instances: InstanceRows,
    /// 1 + index of the instance of each lane, as in [`Hit`].
    instance_of_lane: [u32; LANES],
}

impl FaceHits {
    pub fn new() -> FaceHits {
        FaceHits {
            direction: Default::default(),
            barycentric: Default::default(),
            vertices: Default::default(),
            normals: Default::default(),
            instances: InstanceRows {
                x: Default::default(),
                y: Default::default(),
                z: Default::default(),
                anchor: Default::default(),
                u: Default::default(),
                v: Default::default(),
                w: Default::default(),
                condition_number: Default::default(),
                side: Default::default(),
                has_normals: Default::default(),
            },
            instance_of_lane: [0; LANES],
        }
    }

    #[inline(always)]
    pub fn set(&mut self, scene: &Packed, lane: usize, ray: Ray, hit: Hit) {
        let i = instance_of(scene, hit);
        if self.instance_of_lane[lane] != hit.instance {
            self.instance_of_lane[lane] = hit.instance;
            self.instances.set(lane, i);
        }
        set3(&mut self.direction, lane, ray.direction);
        self.barycentric[0][lane] = hit.barycentric.x;
        self.barycentric[1][lane] = hit.barycentric.y;
        let mesh = &scene.bvh.meshes[i.mesh as usize];
        let triangle = mesh.triangles[hit.slot as usize];
        for (corner, vertex) in [triangle.x, triangle.y, triangle.z].into_iter().enumerate() {
            set3(&mut self.vertices[corner], lane, mesh.vertices[vertex as usize].xyz());
            if i.attributes != NO_INDEX {
                set3(&mut self.normals[corner], lane, mesh.attributes[vertex as usize].xyz());
            }
        }
    }

    /// Returns the surfaces, like `face_primitive` and `face_surface`.
    #[inline(always)]
    pub fn surfaces<S: Simd>(&self, simd: S, epsilon: f32) -> LaneSurfaces<S> {
        let row = |row: &Row| f32x8::simd_from(simd, *row);
        let i = &self.instances;
        let d = load3(simd, &self.direction);
        let (b_x, b_y) = (row(&self.barycentric[0]), row(&self.barycentric[1]));
        let (u, v, w) = (load3(simd, &i.u), load3(simd, &i.v), load3(simd, &i.w));
        let vertices = &self.vertices;
        let v0 = load3(simd, &vertices[0]);
        let edge_1 = from_mesh(u, v, w, load3(simd, &vertices[1]) - v0);
        let edge_2 = from_mesh(u, v, w, load3(simd, &vertices[2]) - v0);
        let min_positive = b_x.splat(f32::MIN_POSITIVE);
        let scaled_normal = cross(
            edge_1 / max(largest(edge_1), min_positive),
            edge_2 / max(largest(edge_2), min_positive),
        );
        let is_valid = dot(scaled_normal, scaled_normal).gt(b_x.splat(1e-30));
        let z = Vector3::select(splat3(simd, Vec3::Z), normalize(scaled_normal), is_valid) * row(&i.side);
        let area = dot(cross(edge_1, edge_2), z);
        let determinant = select(min_positive, area, Real::abs(area).gt(min_positive));
        let instance_anchor = load3(simd, &i.anchor);
        let anchor = instance_anchor + from_mesh(u, v, w, v0);
        let triangle = LaneTriangles {
            anchor,
            x: cross(edge_2, z) / determinant,
            y: cross(z, edge_1) / determinant,
        };

        let from_anchor = edge_1 * b_x + edge_2 * b_y;
        let position = anchor + from_anchor;
        let side = side_towards(z, d);
        let normal = z * side;
        let edge = max(max(largest(edge_1), largest(edge_2)), largest(edge_2 - edge_1));
        let size = max(
            max(largest(position), largest(position - instance_anchor)),
            constant(0.25) * edge,
        ) * max(b_x.splat(1.0), constant(0.125) * row(&i.condition_number));
        let ray_origin = position + (normal - d) * (constant(epsilon) * size);

        let rows = (load3(simd, &i.x), load3(simd, &i.y), load3(simd, &i.z));
        let has_normals = row(&i.has_normals).gt(b_x.splat(0.0));
        let normal_0 = normal_from_mesh(rows, load3(simd, &self.normals[0]), has_normals);
        let normal_1 = normal_from_mesh(rows, load3(simd, &self.normals[1]), has_normals);
        let normal_2 = normal_from_mesh(rows, load3(simd, &self.normals[2]), has_normals);
        let b_0 = constant(1.0) - b_x - b_y;
        let n = normal_0 * b_0 + normal_1 * b_x + normal_2 * b_y;
        let length2 = dot(n, n);
        let unit = n / Real::sqrt(max(length2, b_x.splat(1e-12)));
        let smooth = Vector3::select(z, flipped_to(unit, z), length2.gt(b_x.splat(1e-12)));

        let lift_0 = lift(flipped_to(normal_0, normal), from_anchor, normal);
        let lift_1 = lift(flipped_to(normal_1, normal), from_anchor - edge_1, normal);
        let lift_2 = lift(flipped_to(normal_2, normal), from_anchor - edge_2, normal);
        let smooth_normal = smooth * side;
        LaneSurfaces {
            position,
            normal,
            smooth_normal,
            shading_normal: smooth_normal,
            ray_origin,
            terminator_offset: lift_0 * b_0 + lift_1 * b_x + lift_2 * b_y,
            coat_normal: smooth_normal,
            wo: -d,
            side,
            tangents: None,
            triangle: Some(triangle),
            transmits: None,
        }
    }
}

/// Hits of the kind [`SurfaceKind::Evaluated`](super::shade::SurfaceKind::Evaluated).
#[derive(Default)]
pub struct ScalarHits {
    position: Rows3,
    normal: Rows3,
    smooth_normal: Rows3,
    shading_normal: Rows3,
    ray_origin: Rows3,
    terminator_offset: Rows3,
    coat_normal: Rows3,
    wo: Rows3,
    side: Row,
    du: Rows3,
    dv: Rows3,
    face_anchor: Rows3,
    face_x: Rows3,
    face_y: Rows3,
}

impl ScalarHits {
    #[inline(always)]
    pub fn set(&mut self, lane: usize, surface: &Surface, prim: &HitPrimitive, coat_normal: Vec3) {
        self.side[lane] = surface.side;
        for (rows, v) in [
            (&mut self.position, surface.position),
            (&mut self.normal, surface.normal),
            (&mut self.smooth_normal, surface.smooth_normal),
            (&mut self.shading_normal, surface.shading_normal),
            (&mut self.ray_origin, surface.ray_origin),
            (&mut self.terminator_offset, surface.terminator_offset),
            (&mut self.coat_normal, coat_normal),
            (&mut self.wo, surface.wo),
            (&mut self.du, surface.du),
            (&mut self.dv, surface.dv),
            (&mut self.face_anchor, prim.primitive.anchor),
            (&mut self.face_x, prim.primitive.x),
            (&mut self.face_y, prim.primitive.y),
        ] {
            set3(rows, lane, v);
        }
    }

    /// Returns the surfaces. `has_tangents` is true if the evaluated tangents are frames around the shading normals.
    #[inline(always)]
    pub fn surfaces<S: Simd>(&self, simd: S, has_tangents: bool) -> LaneSurfaces<S> {
        LaneSurfaces {
            position: load3(simd, &self.position),
            normal: load3(simd, &self.normal),
            smooth_normal: load3(simd, &self.smooth_normal),
            shading_normal: load3(simd, &self.shading_normal),
            ray_origin: load3(simd, &self.ray_origin),
            terminator_offset: load3(simd, &self.terminator_offset),
            coat_normal: load3(simd, &self.coat_normal),
            wo: load3(simd, &self.wo),
            side: f32x8::simd_from(simd, self.side),
            tangents: has_tangents.then(|| Tangents {
                u: load3(simd, &self.du),
                v: load3(simd, &self.dv),
            }),
            triangle: Some(LaneTriangles {
                anchor: load3(simd, &self.face_anchor),
                x: load3(simd, &self.face_x),
                y: load3(simd, &self.face_y),
            }),
            transmits: None,
        }
    }
}

/// Maps a vector from object space to world space.
#[inline(always)]
fn from_mesh<S: Simd>(u: V<S>, v: V<S>, w: V<S>, vector: V<S>) -> V<S> {
    u * vector.x + v * vector.y + w * vector.z
}

/// Maps a vertex normal to a unit normal in world space. Returns zero where the mesh has no normals.
#[inline(always)]
fn normal_from_mesh<S: Simd>((x, y, z): (V<S>, V<S>, V<S>), n: V<S>, has_normals: mask32x8<S>) -> V<S> {
    let v = x * n.x + y * n.y + z * n.z;
    let largest = largest(v);
    let scaled = v / max(largest, largest.splat(f32::MIN_POSITIVE));
    let unit = scaled / Real::sqrt(max(dot(scaled, scaled), largest.splat(0.5)));
    Vector3::select(splat3(largest.simd, Vec3::ZERO), unit, has_normals)
}
