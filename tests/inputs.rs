//! Random inputs for the probes of CPU and GPU functions. To cover every branch, most arguments are consistent, such as
//! a primitive and a ray to the primitive's interior, to its edge or past it. Some components are replaced: by edge
//! values, by neighboring floats, by other components, by multiples of 1/2 so that comparisons find equal values, or
//! by values of any magnitude.

use bytemuck::Zeroable as _;
use glam::{DMat3, DVec2, DVec3, UVec2, UVec4, Vec2, Vec3, Vec4};
use wgray_render::gpu::naga::{Handle, Module, ScalarKind, Type};
use wgray_trace::bvh::{Aabb, build};
use wgray_trace::cpu::differential::{Derivative, Differential, HitDifferential};
use wgray_trace::cpu::diffuse::Angles;
use wgray_trace::cpu::footprint::Footprint;
use wgray_trace::cpu::light::LightSegments;
use wgray_trace::cpu::mesh::{HitPrimitive, face_primitive, shear_of};
use wgray_trace::cpu::path::Path;
use wgray_trace::cpu::phong::Lobes;
use wgray_trace::cpu::primitive::Tangents;
use wgray_trace::cpu::principled::{PrincipledLobes, principled_mixture};
use wgray_trace::cpu::ray::{Hit, Ray};
use wgray_trace::cpu::shadow::{SampleBlock, light_frustum};
use wgray_trace::cpu::slab::{ray_interval, slabs};
use wgray_trace::cpu::surface::Surface;
use wgray_trace::records::{
    BOX_PAD, CYLINDER, Camera, DISK, ELLIPSOID, INFINITE_T, Instance, KINDS, Light, LightNode, MIN_SHEEN_ROUGHNESS,
    Material, NO_INDEX, NO_PRIMITIVE, Node, PRIMITIVE_KINDS, Primitive, RECTANGLE, SMALLEST_ALPHA, Sphere, TRIANGLE,
    Texture,
};

use crate::kernel::{Function, scalars};
use crate::probe_words::ProbeWords;
use crate::random::Random;
use crate::sources::type_name;

/// Values at which floating-point arithmetic changes behavior.
const EDGES: &[f32] = &[
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    2.0,
    1.0 + f32::EPSILON,
    1.0 - f32::EPSILON / 2.0,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    1e-45, // smallest denormal number
    -1e-45,
    1e-39,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    1e10,
    1e-10,
    8_388_608.0,
    16_777_216.0,
    -126.5,
    0.0001,
    4096.0, // MAX_EXTENT in procedural.wgsl
    0.333_333_34,
];

/// Returns the argument words of `calls` calls.
pub fn inputs(function: &Function, calls: usize, seed: u64) -> Vec<u32> {
    let random = Random::new(seed);
    let mut words = Vec::new();
    for _ in 0..calls {
        write_call(function, &random, &mut words);
    }
    words
}

fn write_call(function: &Function, random: &Random, words: &mut Vec<u32>) {
    let situation = Situation::new(function.name(), random);
    let mode = random.below(12);
    let mut previous = 0.0;
    for (name, ty) in function.arguments() {
        let start = words.len();
        situation.argument((function.name(), &name), function.module, ty, random, words);
        for (word, kind) in words[start..].iter_mut().zip(scalars(function.module, ty)) {
            if kind == ScalarKind::Float {
                let x = f32::from_bits(*word);
                *word = match mode {
                    0 => any_float(random),
                    1 if random.once_in(4) => random.pick(EDGES),
                    2 if random.once_in(8) => neighbor(x, random),
                    3 => (x * 2.0).round() / 2.0,
                    4 if random.once_in(4) => previous,
                    _ => x,
                }
                .to_bits();
                previous = f32::from_bits(*word);
            }
        }
    }
}

fn any_float(random: &Random) -> f32 {
    let sign = random.pick(&[1.0, -1.0]);
    (sign * random.magnitude(-44.0, 38.0)) as f32
}

fn neighbor(x: f32, random: &Random) -> f32 {
    let step = random.pick(&[-2, -1, 1, 2]);
    f32::from_bits(x.to_bits().wrapping_add_signed(step))
}

/// A consistent set of arguments for one call.
struct Situation {
    primitive: Primitive,
    /// A point in local space, often on the primitive; `target` is the same point in world space.
    local: DVec3,
    target: DVec3,
    /// The origin of the ray in world space; `local_start` is the same point in local space.
    start: DVec3,
    local_start: DVec3,
    direction: DVec3,
    light: Light,
    face: Face,
}

/// A triangle of a mesh and a ray, both in object space.
struct Face {
    instance: Instance,
    corners: [DVec3; 3],
    /// Barycentric coordinates of the intersection with the plane: inside, on an edge, at a corner or outside.
    barycentric: DVec2,
    origin: DVec3,
    direction: DVec3,
    /// The rays of a [`RayInterval`](wgray_trace::cpu::slab::RayInterval) have directions within `direction_spread` of
    /// `direction`, per component.
    direction_spread: DVec3,
}

impl Face {
    fn new(random: &Random, anchor: DVec3, columns: DMat3) -> Face {
        let size = random.pick(&[1.0, 1.0, 1e-3, 1e3]);
        let offset = vector(random) * random.pick(&[0.0, 1.0, 100.0]);
        let mut corners = [(); 3].map(|()| (offset + vector(random)) * size);
        match random.below(8) {
            0 => corners[2] = corners[0].lerp(corners[1], random.unit()), // degenerate
            1 => corners.iter_mut().for_each(|corner| corner.z = size),
            _ => {}
        }
        let corners = corners.map(|corner| corner.as_vec3().as_dvec3());
        let (x, y) = (random.unit(), random.unit());
        let barycentric = match random.below(8) {
            0 => random.pick(&[DVec2::ZERO, DVec2::X, DVec2::Y]),
            1 => random.pick(&[DVec2::new(x, 0.0), DVec2::new(0.0, x), DVec2::new(x, 1.0 - x)]),
            2 => DVec2::new(x, y) * 3.0 - 1.0,
            _ => DVec2::new(x * 0.5, y * 0.5),
        };
        let intersection = point_of(&corners, barycentric);
        let away = match random.below(6) {
            0 => random.pick(&DVec3::AXES) * random.pick(&[1.0, -1.0]),
            1 => (corners[1] - corners[0]) / size, // parallel to the triangle's plane
            _ => vector(random),
        };
        let origin = intersection - away * size * random.pick(&[0.1, 1.0, 100.0, -1.0]);
        let rows = columns.inverse().transpose();
        let has_uvs = random.below(2);
        let instance = Instance {
            x: rows.x_axis.as_vec3(),
            y: rows.y_axis.as_vec3(),
            z: rows.z_axis.as_vec3(),
            anchor: anchor.as_vec3(),
            u: columns.x_axis.as_vec3(),
            v: columns.y_axis.as_vec3(),
            w: columns.z_axis.as_vec3(),
            shape: random.below(4),
            attributes: random.pick(&[NO_INDEX, 9]),
            has_uvs,
            size: corners
                .iter()
                .map(|corner| corner.abs().max_element())
                .fold(0.0, f64::max) as f32,
            condition_number: random.magnitude(0.0, 2.0) as f32,
            side: random.pick(&[1.0, -1.0]),
            ..bytemuck::Zeroable::zeroed()
        };
        Face {
            instance,
            corners,
            barycentric,
            origin,
            direction: away * random.pick(&[1.0, size, 1e-3]),
            direction_spread: vector(random).abs() * size * random.pick(&[0.0, 0.01, 1.0]),
        }
    }

    fn edges(&self) -> [DVec3; 2] {
        [self.corners[1] - self.corners[0], self.corners[2] - self.corners[0]]
    }

    fn hit_primitive(&self, random: &Random) -> HitPrimitive {
        let instance = &self.instance;
        let columns = [instance.u, instance.v, instance.w].map(Vec3::as_dvec3);
        let to_world = DMat3::from_cols(columns[0], columns[1], columns[2]);
        let [edge_1, edge_2] = self.edges().map(|edge| (to_world * edge).as_vec3());
        let normal = edge_1.as_dvec3().cross(edge_2.as_dvec3()).normalize_or(DVec3::Z);
        let vertex_normal = || (normal + vector(random) * 0.3).normalize().as_vec3();
        let has_normals = !random.once_in(4);
        let [normal_0, normal_1, normal_2] = [(); 3].map(|()| if has_normals { vertex_normal() } else { Vec3::ZERO });
        let has_tangents = random.once_in(2);
        let [tangents_0, tangents_1, tangents_2] = [(); 3].map(|()| match has_tangents {
            true => Tangents {
                u: vector(random).as_vec3(),
                v: vector(random).as_vec3(),
            },
            false => Tangents::default(),
        });
        let uv = || Vec2::new(random.unit() as f32, random.unit() as f32);
        let uv_0 = uv();
        HitPrimitive {
            primitive: face_primitive(instance, self.corners[0].as_vec3(), edge_1, edge_2, random.below(4)),
            edge_1,
            edge_2,
            uv_0,
            uv_1: if random.once_in(8) { uv_0 } else { uv() },
            uv_2: uv(),
            normal_0,
            normal_1,
            normal_2,
            tangents_0,
            tangents_1,
            tangents_2,
            anchor: instance.anchor,
            condition_number: instance.condition_number,
        }
    }

    /// Returns the root of a BVH over the triangle and other triangles.
    fn node(&self, random: &Random) -> Node {
        let size = self.edges()[0].length();
        let random_offset = || vector(random) * size * random.pick(&[0.5, 3.0]);
        let bounds = |offset: DVec3| Aabb::around(&self.corners.map(|corner| (corner + offset).as_vec3()));
        let boxes: Vec<Aabb> = (0..=random.below(40))
            .map(|i| bounds(if i == 0 { DVec3::ZERO } else { random_offset() }))
            .collect();
        bytemuck::cast(build(&boxes, 1 + random.below(4)).nodes[0])
    }

    fn bounds(&self) -> Aabb {
        Aabb::around(&self.corners.map(|corner| corner.as_vec3()))
    }

    fn pad(&self) -> f32 {
        let farthest = self.origin.abs().max_element() as f32 + self.instance.size;
        BOX_PAD * farthest
    }

    fn vector(&self, name: &str) -> Option<Vec3> {
        Some(
            match name {
                "v0" => self.corners[0],
                "v1" | "v" => self.corners[1],
                "v2" => self.corners[2],
                "low" => self.bounds().low.as_dvec3(),
                "high" => self.bounds().high.as_dvec3(),
                "edge_1" => self.edges()[0],
                "edge_2" => self.edges()[1],
                "origin" => self.origin,
                "direction" => self.direction,
                "min_direction" => self.direction - self.direction_spread,
                "max_direction" => self.direction + self.direction_spread,
                _ => return None,
            }
            .as_vec3(),
        )
    }
}

/// Returns orthogonal axes, two of equal length.
fn cylinder_columns(random: &Random, scale: f64) -> DMat3 {
    let axis = vector(random).normalize();
    let perpendicular = axis.cross(vector(random)).normalize_or(axis.any_orthonormal_vector());
    let height = scale * random.pick(&[1.0, random.magnitude(-3.0, 3.0)]);
    DMat3::from_cols(perpendicular * scale, axis.cross(perpendicular) * scale, axis * height)
}

fn point_of(corners: &[DVec3; 3], barycentric: DVec2) -> DVec3 {
    let [a, b, c] = *corners;
    a + (b - a) * barycentric.x + (c - a) * barycentric.y
}

/// Functions whose vector arguments come from a [`Face`].
const FACE_FUNCTIONS: &[&str] = &[
    "slabs",
    "box_interval",
    "ray_interval",
    "ray_interval_box",
    "octant_of",
    "shear_of",
    "permuted",
    "sheared",
    "triangle_crossing",
    "lowest",
    "highest",
    "face_primitive",
    "mesh_pad",
    "vector_from_mesh",
];

impl Situation {
    /// Returns a situation for a function. If the function's name contains a kind of primitive, the primitive is of
    /// this kind.
    fn new(function: &str, random: &Random) -> Situation {
        let center = DVec3::from_array([(); 3].map(|()| random.between(-2.0, 2.0))) * random.pick(&[0.0, 1.0, 100.0]);
        let scale = random.magnitude(-3.0, 3.0);
        let mut columns = DMat3::from_cols(vector(random), vector(random), vector(random)) * scale;
        if random.once_in(4) {
            columns = DMat3::from_diagonal(DVec3::splat(scale)); // axis-aligned
        }
        let random_kind = random.below(KINDS);
        let kind_in_name = PRIMITIVE_KINDS
            .iter()
            .position(|kind| function.contains(&kind.name.to_lowercase()));
        let kind = kind_in_name.map_or(random_kind, |kind| kind as u32);
        // Half of the solids have their anchor on or near the surface, the others at the center.
        let (mut middle, mut level) = (DVec3::ZERO, -1.0);
        if kind == ELLIPSOID && random.once_in(2) {
            middle = -local_point(kind, random).normalize_or(DVec3::Z) * random.pick(&[1.0, 1.0, 1.1]);
            level = middle.length_squared() - 1.0;
        }
        if kind == CYLINDER {
            columns = cylinder_columns(random, scale);
            if random.once_in(2) {
                let point = local_point(kind, random);
                middle = -point.truncate().normalize_or(DVec2::X).extend(point.z.clamp(-1.0, 1.0));
                level = middle.truncate().length_squared() - 1.0;
            }
        }
        let rows = columns.inverse().transpose();
        let local = local_point(kind, random);
        let away = vector(random) * random.pick(&[0.3, 1.0, 3.0, 300.0]);
        let local_start = if random.once_in(8) {
            local + DVec3::new(away.x, away.y, 0.0)
        } else {
            local + away
        };
        let target = center + columns * (local + middle);
        let start = center + columns * (local_start + middle);
        let primitive = Primitive {
            anchor: center.as_vec3(),
            material: random.below(4),
            x: rows.x_axis.as_vec3(),
            shape: random.below(4),
            y: rows.y_axis.as_vec3(),
            kind,
            z: rows.z_axis.as_vec3(),
            determinant: rows.determinant() as f32,
            middle: middle.as_vec3(),
            level: level as f32,
        };
        let directional = random.once_in(4);
        let size = scale * random.pick(&[0.0, 0.3, 3.0]);
        let light = Light {
            center: if directional {
                (target - start).normalize_or(DVec3::Z)
            } else {
                target + (target - start)
            }
            .as_vec3(),
            t_max: if directional { 1e10 } else { 1.0 - 1e-5 },
            u: (vector(random) * size).as_vec3(),
            finite: if directional { 0.0 } else { 1.0 },
            v: (vector(random) * size).as_vec3(),
            primitive: NO_INDEX,
            color: color(random),
            number: random.below(4),
            normal: vector(random).normalize().as_vec3(),
            cone: random.pick(&[0.0, 2.0, 1.0, random.unit() * 2.0, random.magnitude(-9.0, 0.0)]) as f32,
            falloff: random.magnitude(-0.3, 12.0) as f32,
            ..Light::zeroed()
        };
        let direction = target - start;
        let face = Face::new(random, center, columns);
        Situation {
            primitive,
            local,
            target,
            start,
            local_start,
            direction,
            light,
            face,
        }
    }

    /// Writes the words of an argument. The values depend on the type, and for numbers and vectors also on the name.
    fn argument(
        &self,
        (function, name): (&str, &str),
        module: &Module,
        ty: Handle<Type>,
        random: &Random,
        words: &mut Vec<u32>,
    ) {
        match type_name(module, ty).as_str() {
            "Primitive" => self.primitive.write(words),
            "Light" => self.light.write(words),
            "LightNode" => self.light_node(random).write(words),
            "Ray" => self.ray(random).write(words),
            "Hit" => {
                Hit {
                    t: random.pick(&[INFINITE_T, self.t() as f32]),
                    instance: random.pick(&[0, 0, 1, 2]),
                    primitive: random.pick(&[NO_INDEX, 0, 7]),
                    slot: random.below(9),
                    barycentric: self.face.barycentric.as_vec2(),
                }
                .write(words);
            }
            "Surface" => self.surface(random).write(words),
            "LightSegments" => {
                let towards = (self.target - self.start).as_vec3();
                LightSegments {
                    towards,
                    u: self.light.u,
                    v: self.light.v,
                }
                .write(words);
            }
            "SampleBlock" => block(random).write(words),
            "Path" => self.path(random).write(words),
            "Derivative" => derivative(random).write(words),
            "Differential" => differential(random).write(words),
            "HitDifferential" => hit_differential(random).write(words),
            "Footprint" => footprint(random).write(words),
            "Texture" => texture(random).write(words),
            "i32" => words.push((random.pick(&[random.below(20), random.below(40_000)]) as i32 - 20) as u32),
            "Sphere" => self.sphere(random).write(words),
            "ShadowFrustum" => light_frustum(&self.light, self.start.as_vec3()).write(words),
            "Material" => material(random).write(words),
            "PrincipledLobes" => mixture(random).write(words),
            "Angles" => Angles {
                wi: random.between(-0.2, 1.0) as f32,
                wo: random.unit() as f32,
                between: random.between(-1.0, 1.0) as f32,
            }
            .write(words),
            "Camera" => self.camera(random).write(words),
            "Lobes" => Lobes {
                diffuse: random.unit() as f32,
                specular: random.unit() as f32,
            }
            .write(words),
            "Instance" => self.face.instance.write(words),
            "Node" => self.face.node(random).write(words),
            "HitPrimitive" => self.face.hit_primitive(random).write(words),
            "Slabs" => {
                let (origin, direction) = (self.face.origin.as_vec3(), self.face.direction.as_vec3());
                slabs(origin, direction, self.face.pad()).write(words);
            }
            "Shear" => shear_of(self.face.direction.as_vec3()).write(words),
            "RayInterval" => {
                let argument = |name| self.face.vector(name).unwrap_or_default();
                ray_interval(
                    argument("origin"),
                    argument("min_direction"),
                    argument("max_direction"),
                    self.face.pad(),
                )
                .write(words);
            }
            "vec3<f32>" if FACE_FUNCTIONS.contains(&function) && self.face.vector(name).is_some() => {
                self.face.vector(name).unwrap_or_default().write(words);
            }
            "vec2<f32>" if function.starts_with("face_") => self.face.barycentric.as_vec2().write(words),
            "vec2<f32>" if name == "interval" => {
                let near = random.between(-1.0, 2.0) as f32;
                Vec2::new(near, near + random.between(-0.3, 1.0) as f32).write(words);
            }
            "vec3<f32>" => self.vector(name, random).write(words),
            "f32" => self.number(name, random).write(words),
            "u32" => integer(function, name, random).write(words),
            "vec2<f32>" if ["long", "short", "a", "b", "tail", "head"].contains(&name) => {
                let edge = vector(random).truncate() * random.magnitude(-3.0, 2.5);
                edge.as_vec2().write(words);
            }
            "vec2<f32>" if name == "levels" => {
                let o = self.local_start;
                let levels = DVec2::new(o.truncate().length_squared() - 1.0, o.z.abs() - 1.0);
                levels.as_vec2().write(words);
            }
            "vec2<f32>" if name == "alpha" => alpha(random).write(words),
            "vec2<f32>" => {
                let size = random.pick(&[1.0, 1.0, 400.0]);
                words.extend([(); 2].map(|()| ((random.unit() * size) as f32).to_bits()));
            }
            _ => write_arbitrary(&scalars(module, ty), random, words),
        }
    }

    /// Returns the ray parameter of the target.
    fn t(&self) -> f64 {
        (self.target - self.start).length()
    }

    fn ray(&self, random: &Random) -> Ray {
        let along = match random.below(8) {
            0 => DVec3::Z,
            1 => -self.direction,
            _ => self.direction,
        };
        let origin = if random.once_in(8) {
            self.primitive.anchor.as_dvec3()
        } else {
            self.start
        };
        Ray {
            origin: origin.as_vec3(),
            direction: along.normalize_or(DVec3::X).as_vec3(),
        }
    }

    fn surface(&self, random: &Random) -> Surface {
        let normal = vector(random).normalize().as_vec3();
        let position = self.start.as_vec3();
        let wo = if random.once_in(4) {
            normal
        } else {
            vector(random).normalize().as_vec3()
        };
        Surface {
            position,
            normal,
            smooth_normal: random.pick(&[normal, vector(random).normalize().as_vec3()]),
            shading_normal: random.pick(&[normal, vector(random).normalize().as_vec3()]),
            wo,
            ray_origin: position + normal * 1e-5,
            side: random.pick(&[1.0, -1.0]),
            terminator_offset: vector(random).as_vec3() * 1e-3,
            exclude_front: random.pick(&[NO_PRIMITIVE, UVec2::new(0, 3), UVec2::new(2, 3)]),
            exclude_back: random.pick(&[NO_PRIMITIVE, UVec2::new(0, 3), UVec2::new(2, 3)]),
            uv: self.local.truncate().as_vec2(),
            du: vector(random).as_vec3(),
            dv: vector(random).as_vec3(),
        }
    }

    fn path(&self, random: &Random) -> Path {
        Path {
            ray: self.ray(random),
            differential: differential(random),
            throughput: color(random),
            depth: random.below(10),
            branch: random.below(4),
            origin_prim: random.pick(&[NO_PRIMITIVE, UVec2::new(0, 3)]),
            inside_prim: random.pick(&[NO_PRIMITIVE, UVec2::new(0, 3)]),
        }
    }

    /// Returns a sphere on or near the segment to the light.
    fn sphere(&self, random: &Random) -> Sphere {
        let away = self.direction.length() * random.pick(&[0.0, 0.1, 0.5, 2.0]);
        let center = self.start + self.direction * random.between(-0.5, 1.5) + vector(random) * away;
        Sphere {
            center: center.as_vec3(),
            radius: (away * random.pick(&[0.5, 1.0, 0.1, 1e18])) as f32,
        }
    }

    /// Returns a light-tree node whose children are at the target or around it.
    fn light_node(&self, random: &Random) -> LightNode {
        let children = [(); 4].map(|()| {
            let center = self.target + vector(random) * random.pick(&[0.0, 0.0, self.direction.length()]);
            let axis = random.pick(&[vector(random).normalize(), -self.direction.normalize_or(DVec3::X)]);
            let radius = self.direction.length() * random.pick(&[0.0, 0.01, 0.5, 1.0, 2.0]);
            (center.as_vec3(), axis.as_vec3(), radius as f32)
        });
        let per_child = |value: &dyn Fn(&(Vec3, Vec3, f32)) -> f32| Vec4::from_array(children.each_ref().map(value));
        let integers = |n: u32| UVec4::from_array([(); 4].map(|()| random.below(n)));
        LightNode {
            x: per_child(&|(center, ..)| center.x),
            y: per_child(&|(center, ..)| center.y),
            z: per_child(&|(center, ..)| center.z),
            radius: per_child(&|(.., radius)| *radius),
            axis_x: per_child(&|(_, axis, _)| axis.x),
            axis_y: per_child(&|(_, axis, _)| axis.y),
            axis_z: per_child(&|(_, axis, _)| axis.z),
            cosine: per_child(&|_| random.pick(&[1.0, -1.0, random.between(-1.0, 1.0)]) as f32),
            intensity: per_child(&|_| random.pick(&[random.magnitude(-9.0, 0.0), 0.0]) as f32),
            edge: per_child(&|_| random.pick(&[0.0, random.unit()]) as f32),
            sides: integers(2) + 1,
            parent: UVec4::new(random.pick(&[NO_INDEX, 0]), 0, 0, 0),
            children: UVec4::splat(random.pick(&[NO_INDEX, 1])),
            density: per_child(&|_| random.magnitude(-9.0, 9.0) as f32),
            instance: integers(2),
            index: integers(4),
        }
    }

    fn camera(&self, random: &Random) -> Camera {
        Camera {
            position: self.start.as_vec3(),
            projection: random.below(3),
            right: vector(random).as_vec3(),
            width: 1 + random.below(1000),
            up: vector(random).as_vec3(),
            height: 1 + random.below(1000),
            forward: self.direction.normalize_or(DVec3::X).as_vec3(),
            seed: random.bits() as u32,
            lens_u: vector(random).as_vec3(),
            blades: random.pick(&[0, 3, 5, 16]),
            lens_v: vector(random).as_vec3(),
            inverse_focus: random.pick(&[random.magnitude(-9.0, 9.0) as f32, random.unit() as f32, 0.0]),
        }
    }

    fn vector(&self, name: &str, random: &Random) -> Vec3 {
        let v = match name {
            "o" => self.local_start,
            "d" => (self.local - self.local_start) * random.pick(&[0.5, 1.0, 1.0 + 1e-5, 2.0, -1.0]),
            "local" => self.local,
            "p" => random.pick(&[self.start, self.target]),
            "from_anchor" => self.local + self.primitive.middle.as_dvec3(),
            "to_light" | "direction" => self.direction,
            "wi" | "wo" | "normal" | "coat_normal" | "half" | "w" | "m" => vector(random).normalize(),
            _ => vector(random) * random.magnitude(-2.0, 2.0),
        };
        v.as_vec3()
    }

    fn number(&self, name: &str, random: &Random) -> f32 {
        match name {
            "pad" => self.face.pad(),
            "side" => random.pick(&[1.0, -1.0]),
            "far_low" | "far_high" => random.pick(&[0.0, random.between(-2.0, 2.0) as f32]),
            "limit" => random.pick(&[INFINITE_T, INFINITE_T, self.t() as f32, (2.0 * self.t()) as f32]),
            "t" => random.pick(&[self.t() as f32, INFINITE_T]),
            "start_level" => (self.local_start.length_squared() - 1.0) as f32,
            "t_max" => random.pick(&[self.light.t_max, 1.0 - 1e-5, 1e10, 1.0]),
            "cosine" | "cosine_i" | "cosine_t" | "random" | "line_width" | "duty" | "surface_level" => {
                random.unit() as f32
            }
            "alpha" => alpha(random).x,
            "roughness" => random.between(f64::from(MIN_SHEEN_ROUGHNESS), 1.0) as f32,
            "eta" | "anisotropy" => random.magnitude(-1.0, 1.0) as f32,
            "epsilon" => random.pick(&[2e-6, 1e-4, 0.0]),
            _ => {
                let (unit, sign) = (random.unit(), random.pick(&[1.0, -1.0]));
                random.pick(&[
                    unit,
                    unit * sign,
                    sign * random.magnitude(-5.0, 3.0),
                    1000.0 * unit.floor(),
                ]) as f32
            }
        }
    }
}

fn alpha(random: &Random) -> Vec2 {
    let component = || random.pick(&[SMALLEST_ALPHA, 1.0, (random.unit() as f32).max(SMALLEST_ALPHA)]);
    let x = component();
    random.pick(&[Vec2::splat(x), Vec2::new(x, component())])
}

/// Returns a vector that is longer than 0.1, with components from -1 to 1.
fn vector(random: &Random) -> DVec3 {
    loop {
        let v = DVec3::from_array([(); 3].map(|()| random.between(-1.0, 1.0)));
        if v.length() > 0.1 {
            return v;
        }
    }
}

fn color(random: &Random) -> Vec3 {
    Vec3::from_array([(); 3].map(|()| random.unit() as f32))
}

/// Returns a point in local space on or near a primitive of kind `kind`, sometimes at an edge or a corner.
fn local_point(kind: u32, random: &Random) -> DVec3 {
    let coordinate = || random.between(-1.2, 1.2);
    let p = DVec3::new(coordinate(), coordinate(), coordinate());
    let side = || random.pick(&[-1.0, 0.0, 1.0]);
    let on_circle = p.truncate().normalize_or(DVec2::X);
    let case = random.below(5);
    match (kind, case) {
        (_, 0) => p,
        (RECTANGLE, 1) => DVec3::new(side(), p.y, 0.0),
        (RECTANGLE, 2) => DVec3::new(side(), side(), 0.0),
        (TRIANGLE, 1) => DVec3::new(p.x.abs(), 1.0 - p.x.abs(), 0.0),
        (TRIANGLE, 2) => DVec3::new(0.0, p.y, 0.0),
        (TRIANGLE, _) => DVec3::new(random.between(0.0, 0.6), random.between(0.0, 0.6), 0.0),
        (ELLIPSOID, _) => p.normalize_or(DVec3::Z),
        (DISK, 1) => on_circle.extend(0.0),
        (CYLINDER, 1) => on_circle.extend(side()),
        (CYLINDER, 2) => p.truncate().extend(random.pick(&[-1.0, 1.0])),
        (CYLINDER, _) => on_circle.extend(p.z),
        _ => DVec3::new(p.x, p.y, 0.0),
    }
}

fn derivative(random: &Random) -> Derivative {
    let random_vector = || (vector(random) * random.pick(&[0.0, 1e-3, 1e-3, 1.0])).as_vec3();
    Derivative {
        position: random_vector(),
        direction: random_vector(),
    }
}

fn differential(random: &Random) -> Differential {
    Differential {
        x: derivative(random),
        y: derivative(random),
    }
}

fn hit_differential(random: &Random) -> HitDifferential {
    let Differential { x, y } = differential(random);
    HitDifferential {
        x,
        y,
        normal_x: derivative(random).position,
        normal_y: derivative(random).direction,
    }
}

/// Returns a footprint of any size from a point to many repetitions of the texture, axis-aligned or not.
fn footprint(random: &Random) -> Footprint {
    let uv = Vec2::new(random.between(-3.0, 3.0) as f32, random.between(-3.0, 3.0) as f32);
    let size = random.magnitude(-4.0, 1.5);
    let edge = |size: f64| {
        let v = vector(random) * size;
        random
            .pick(&[v.truncate(), v.truncate(), DVec2::new(v.x, 0.0), DVec2::ZERO])
            .as_vec2()
    };
    Footprint {
        uv,
        dx: edge(size),
        dy: edge(size * random.pick(&[1.0, 0.1, 0.01])),
    }
}

fn texture(random: &Random) -> Texture {
    Texture {
        first: color(random),
        kind: random.below(6),
        second: color(random),
        parameter: random.unit() as f32,
        u: vector(random).as_vec3(),
        format: random.below(3),
        v: vector(random).as_vec3(),
        wrap: random.below(3) + 4 * random.below(3),
        texels: 0,
        width: 1 + random.below(300),
        height: 1 + random.below(300),
        levels: 1 + random.below(9),
    }
}

fn block(random: &Random) -> SampleBlock {
    SampleBlock {
        pattern: integer("block_sample", "pattern", random),
        side: integer("block_sample", "side", random),
        first: 32 * random.below(4),
        count: 1 + random.below(32),
        group: random.below(16),
        key: glam::UVec2::new(random.bits() as u32, random.bits() as u32),
    }
}

fn material(random: &Random) -> Material {
    let exponent = random.pick(&[0, 1, 2, 16, 50, 4096]);
    let mut material: Material = bytemuck::Zeroable::zeroed();
    material.ambient = color(random);
    material.kind = random.below(9);
    material.roughness = random.pick(&[0.0, random.unit() as f32]);
    material.absorption = color(random);
    material.density = random.magnitude(-6.0, 3.0) as f32;
    material.diffuse = color(random);
    material.specular = color(random);
    material.tint = color(random);
    material.ior = random.magnitude(-1.0, 1.0) as f32;
    if random.once_in(2) {
        material.eta = color(random) * 4.0 + 0.01;
        material.k = color(random) * 8.0;
    }
    material.rotation = random.between(-2.0, 2.0) as f32;
    material.loss = random.pick(&[0.0, random.unit() as f32]);
    material.exponent = exponent;
    for parameter in [
        &mut material.metallic,
        &mut material.transmission,
        &mut material.specular_weight,
        &mut material.clearcoat,
        &mut material.clearcoat_roughness,
        &mut material.sheen_roughness,
        &mut material.anisotropy,
    ] {
        *parameter = random.pick(&[0.0, 1.0, random.unit() as f32]);
    }
    material.sheen = color(random);
    material.thin = random.below(2);
    material.shininess = if random.once_in(2) {
        exponent as f32
    } else {
        random.magnitude(-6.0, 6.0) as f32
    };
    material
}

fn mixture(random: &Random) -> PrincipledLobes {
    let material = Material {
        ior: random.between(1.0, 3.0) as f32,
        ..material(random)
    };
    let wo = vector(random).normalize().as_vec3();
    let normal = random.pick(&[DVec3::Z, vector(random).normalize()]).as_vec3();
    let outside = random.once_in(2);
    // The albedo tables have values from 0 to 1.
    let albedo = || random.pick(&[0.0, 1e-4, 0.3, 0.7, 1.0]) as f32;
    let energy = Vec3::new(albedo(), albedo(), albedo());
    principled_mixture(
        &material,
        wo.with_z(wo.z.abs()),
        outside,
        normal,
        random.below(32),
        energy,
    )
}

/// Returns an integer; counts and indices are small.
fn integer(function: &str, name: &str, random: &Random) -> u32 {
    match name {
        "lobes" => random.below(32),
        "kind" | "pattern" | "wrap" | "format" => random.below(8),
        "size" => 1 + random.pick(&[random.below(20), random.below(16_384)]),
        "level" => random.below(15),
        "blades" | "corners" => random.pick(&[0, 3, 4, 5, 6, 16]),
        // Covers both hemispheres of an environment map.
        "width" => 1 + random.pick(&[random.below(4), random.below(16_384)]),
        "height" => 5 + random.pick(&[random.below(4), random.below(16_380)]),
        "row" => random.below(6),
        "column" => random.pick(&[random.below(4), random.below(16_384)]),
        "bins" => 1 + random.below(512),
        "count" => 1 + random.below(256),
        "i" if function == "block_sample" => random.below(32),
        "exponent_bits" => random.below(14),
        "bits" if function == "power_whole" => random.below(14),
        "bits" if function == "in_order" => random.below(256),
        "octant" | "slot" => random.below(8),
        "axis" => random.below(3),
        "side" => 1 + random.below(16),
        "pilot_samples" | "step" => 1 + random.below(64),
        "max_samples" => random.below(65_537),
        _ => random.pick(&[
            0,
            1,
            random.below(300),
            random.below(1 << 16),
            random.bits() as u32,
            u32::MAX,
        ]),
    }
}

fn write_arbitrary(kinds: &[ScalarKind], random: &Random, words: &mut Vec<u32>) {
    for kind in kinds {
        words.push(match kind {
            ScalarKind::Float => (random.between(-1.0, 1.0) as f32).to_bits(),
            ScalarKind::Bool => random.below(2),
            _ => random.pick(&[random.below(4), random.below(300), random.bits() as u32]),
        });
    }
}
