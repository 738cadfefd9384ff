//! Reference renderer in f64, which reads the scene description. The oracle shares no code and no formula with the
//! twins, so the twins and the oracle do not have the same errors: ellipsoids are quadrics, rectangles are bounded
//! planes, meshes are triangle lists that the oracle loads itself, and Phong shading uses the formula of
//! `docs/scene-format.md` with unit vectors.

use std::collections::HashMap;

use glam::{DMat4, DVec2, DVec3, DVec4, Vec2Swizzles};
use rayon::prelude::*;
use wgray::mesh::Normals;
use wgray::scene::{
    CameraDescription, ColorDescription, Description, DiskDescription, InstanceDescription, LightDescription,
    MaterialDescription, MeshFileDescription, PhongDescription, Rotation, Scale, Shadows, ShapeDescription,
    TextureDescription, Up,
};

use crate::sources;

/// A deliberate error in the oracle, which `tests/against_oracle.rs` must detect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flaw {
    None,
    /// The diffuse term lacks n.l.
    MissingCosine,
    SwappedAxes,
    ShiftedPixel,
    /// Samples are at the corners of their cells.
    CornerSamples,
    NoShadows,
    /// The specular exponent is too low by 1.
    Exponent,
    /// The indices of refraction are swapped.
    InvertedIndex,
    TransposedTexture,
    /// Meshes are flat-shaded.
    FlatShading,
    /// Normals of meshes are transformed without the inverse transpose.
    StretchedNormals,
}

pub struct Oracle<'a> {
    scene: &'a Description,
    surfaces: Vec<Surface>,
    flaw: Flaw,
}

struct Surface {
    geometry: Geometry,
    /// Index of the scene object, in the order shapes, instances, lights.
    object: usize,
    /// `None` for lights.
    material: Option<String>,
}

enum Geometry {
    /// The points p with (p, 1)^T Q (p, 1) = 0.
    Quadric {
        q: DMat4,
        from_local: DMat4,
    },
    Triangle([DVec3; 3]),
    /// Lateral surface of a cylinder; `tangent` is the unit vector towards u = 0.
    Side {
        start: DVec3,
        axis: DVec3,
        radius: f64,
        tangent: DVec3,
    },
    /// Blocks of 32 triangles with their bounding boxes.
    Mesh(Vec<(DVec3, DVec3, Vec<Facet>)>),
    /// A rectangle with half extents `half`, an infinite plane if `half` is `None`, or, if `round`, a disk of radius
    /// `half.x`.
    Flat {
        center: DVec3,
        tangent: DVec3,
        bitangent: DVec3,
        half: Option<DVec2>,
        round: bool,
    },
}

/// A mesh triangle in world space.
#[derive(Clone)]
struct Facet {
    corners: [DVec3; 3],
    uvs: [DVec2; 3],
    /// Vertex normals; `None` for flat shading.
    normals: Option<[DVec3; 3]>,
    /// The outward geometric normal.
    normal: DVec3,
}

pub struct Intersection {
    pub t: f64,
    /// Index of the scene object, in the order shapes, instances, lights.
    pub object: usize,
    /// The outward geometric normal.
    pub normal: DVec3,
    pub uv: DVec2,
    /// The outward shading normal.
    pub shading_normal: DVec3,
    /// Shadow-terminator offsets on the outside and on the inside.
    terminator_offsets: [DVec3; 2],
    /// The corners of the triangle on a mesh.
    corners: Option<[DVec3; 3]>,
    /// Index of the surface in the oracle.
    surface: usize,
}

impl<'a> Oracle<'a> {
    pub fn new(scene: &'a Description, flaw: Flaw) -> Oracle<'a> {
        let mut surfaces = Vec::new();
        for (object, description) in scene.shapes.iter().enumerate() {
            let (material, geometries) = geometries(description, flaw);
            let surface = |geometry| Surface {
                geometry,
                object,
                material: Some(material.clone()),
            };
            surfaces.extend(geometries.into_iter().map(surface));
        }
        for (i, instance) in scene.instances.iter().enumerate() {
            surfaces.push(Surface {
                geometry: mesh(instance, &scene.meshes[&instance.mesh], flaw),
                object: scene.shapes.len() + i,
                material: instance.material.clone(),
            });
        }
        for (i, light) in scene.lights.iter().enumerate() {
            if let LightDescription::Rectangle(light) = light {
                let geometry = flat(
                    light.center,
                    light.normal,
                    tangent(light.normal, light.tangent),
                    Some(light.size),
                    flaw,
                );
                surfaces.push(Surface {
                    geometry,
                    object: scene.shapes.len() + scene.instances.len() + i,
                    material: None,
                });
            }
        }
        Oracle { scene, surfaces, flaw }
    }

    /// Renders all pixels. For every pattern, samples are at the cell centers of square grids.
    pub fn picture(&self) -> Vec<[f64; 3]> {
        self.pixels(1)
    }

    /// Renders every pixel whose index is a multiple of `step`.
    pub fn pixels(&self, step: usize) -> Vec<[f64; 3]> {
        let count = self.scene.image.width * self.scene.image.height;
        let indices = (0..count).into_par_iter().step_by(step);
        indices.map(|i| self.pixel(i)).collect()
    }

    /// Renders pixel `i` in row-major order, top row first.
    pub fn pixel(&self, i: u32) -> [f64; 3] {
        let width = self.scene.image.width;
        let samples = self.grid(self.scene.render.pixel_samples.count);
        let corner = DVec2::new(f64::from(i % width), f64::from(i / width));
        let sum: DVec3 = samples
            .iter()
            .map(|offset| self.radiance(self.camera_ray(corner + *offset), 0))
            .sum();
        (sum / samples.len() as f64).to_array()
    }

    /// Returns the hits through the pixel centers.
    pub fn intersections(&self) -> Vec<Option<Intersection>> {
        let (width, height) = (self.scene.image.width, self.scene.image.height);
        let pixel = |i: u32| {
            let center = DVec2::new(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
            let (origin, direction) = self.camera_ray(center);
            self.nearest(origin, direction)
        };
        (0..width * height).map(pixel).collect()
    }

    fn grid(&self, count: u32) -> Vec<DVec2> {
        let side = f64::from(count).sqrt().round() as u32;
        assert_eq!(side * side, count, "the oracle only supports square sample grids");
        let offset = if self.flaw == Flaw::CornerSamples { 0.0 } else { 0.5 };
        let cell_point = |i: u32| (DVec2::new(f64::from(i % side), f64::from(i / side)) + offset) / f64::from(side);
        (0..count).map(cell_point).collect()
    }

    /// Returns the ray through a point in pixels, relative to the top-left corner. The image plane is at distance 1.
    fn camera_ray(&self, point: DVec2) -> (DVec3, DVec3) {
        let (width, height) = (f64::from(self.scene.image.width), f64::from(self.scene.image.height));
        let basis = |position: DVec3, look_at: DVec3, up: DVec3| {
            let forward = (look_at - position).normalize();
            let right = forward.cross(up).normalize();
            (forward, right, right.cross(forward))
        };
        let column = if self.flaw == Flaw::ShiftedPixel {
            point.x - 1.0
        } else {
            point.x
        };
        let (right_offset, top_offset) = (column - width / 2.0, height / 2.0 - point.y);
        match &self.scene.camera {
            CameraDescription::Perspective(c) => {
                let (forward, right, up) = basis(c.position, c.look_at, c.up);
                let pixel = 2.0 * (c.fov.to_radians() / 2.0).tan() / height;
                (
                    c.position,
                    (forward + right * (right_offset * pixel) + up * (top_offset * pixel)).normalize(),
                )
            }
            CameraDescription::Orthographic(c) => {
                let (forward, right, up) = basis(c.position, c.look_at, c.up);
                let pixel = c.height / height;
                (
                    c.position + right * (right_offset * pixel) + up * (top_offset * pixel),
                    forward,
                )
            }
            other => panic!("the oracle does not support the camera {other:?}"),
        }
    }

    fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<Intersection> {
        let mut nearest: Option<(f64, usize, Option<&Facet>)> = None;
        for (i, surface) in self.surfaces.iter().enumerate() {
            for (t, facet) in crossings(&surface.geometry, origin, direction) {
                if t > 0.0 && nearest.is_none_or(|(nearer, ..)| t < nearer) {
                    nearest = Some((t, i, facet));
                }
            }
        }
        let (t, i, facet) = nearest?;
        let object = self.surfaces[i].object;
        let point = origin + direction * t;
        if let Some(facet) = facet {
            return Some(Intersection {
                t,
                object,
                surface: i,
                ..facet.intersection(point, self.flaw)
            });
        }
        let (normal, uv) = normal_and_uv(&self.surfaces[i].geometry, point);
        Some(Intersection {
            t,
            object,
            normal,
            uv,
            shading_normal: normal,
            terminator_offsets: [DVec3::ZERO; 2],
            corners: None,
            surface: i,
        })
    }

    /// Returns the radiance along a ray after `bounces` specular bounces.
    fn radiance(&self, (origin, direction): (DVec3, DVec3), bounces: u32) -> DVec3 {
        let render = &self.scene.render;
        let Some(intersection) = self.nearest(origin, direction) else {
            return render.background;
        };
        let Some(material) = &self.surfaces[intersection.surface].material else {
            let first_light = self.scene.shapes.len() + self.scene.instances.len();
            return light_color(&self.scene.lights[intersection.object - first_light]);
        };
        let point = origin + direction * intersection.t;
        let is_front = intersection.normal.dot(direction) < 0.0;
        let normal = if is_front {
            intersection.normal
        } else {
            -intersection.normal
        };
        let shading_normal = if is_front {
            intersection.shading_normal
        } else {
            -intersection.shading_normal
        };
        // The offset of ray origins is relative to the largest coordinate or the hit distance. In f64, 1e-9 suffices.
        let offset = normal * (render.shadow_epsilon.max(1e-9) * point.abs().max_element().max(intersection.t));
        let follow = |origin: DVec3, direction: DVec3| self.radiance((origin, direction), bounces + 1);
        match &self.scene.materials[material] {
            MaterialDescription::Phong(phong) => {
                let shadow_origin = point + offset + intersection.terminator_offsets[usize::from(!is_front)];
                self.direct(phong, &intersection, shading_normal, point, shadow_origin, -direction)
            }
            _ if bounces == render.max_depth => render.background,
            MaterialDescription::Mirror(mirror) => {
                assert!(mirror.normal_map.is_none(), "the oracle does not support normal maps");
                // The geometric normal replaces a shading normal that faces away or mirrors the ray below the surface.
                let mirrored = direction.reflect(shading_normal);
                let is_usable = mirrored.dot(normal) > 0.0 && shading_normal.dot(direction) < 0.0;
                let mirrored = if is_usable { mirrored } else { direction.reflect(normal) };
                self.color(&mirror.tint, intersection.uv) * follow(point + offset, mirrored)
            }
            MaterialDescription::Glass(glass) => {
                assert!(glass.normal_map.is_none(), "the oracle does not support normal maps");
                let is_entering = is_front != (self.flaw == Flaw::InvertedIndex);
                let (n1, n2) = if is_entering {
                    (1.0, glass.ior)
                } else {
                    (glass.ior, 1.0)
                };
                let reflected = follow(point + offset, direction.reflect(normal));
                // Snell's law for the sines, in the plane of incidence
                let tangential = direction - normal * direction.dot(normal);
                let sine = tangential.length() * n1 / n2;
                if sine >= 1.0 {
                    return reflected;
                }
                let (cosine1, cosine2) = (-direction.dot(normal), (1.0 - sine * sine).sqrt());
                let refracted = tangential * (n1 / n2) - normal * cosine2;
                // Fresnel's equations with both indices: Hecht, "Optics", 4.6.2
                let perpendicular = (n1 * cosine1 - n2 * cosine2) / (n1 * cosine1 + n2 * cosine2);
                let parallel = (n2 * cosine1 - n1 * cosine2) / (n2 * cosine1 + n1 * cosine2);
                let reflectance = (perpendicular.powi(2) + parallel.powi(2)) / 2.0;
                let transmitted = self.color(&glass.tint, intersection.uv) * follow(point - offset, refracted);
                reflected * reflectance + transmitted * (1.0 - reflectance)
            }
            other => panic!("the oracle does not support the material {other:?}"),
        }
    }

    /// Returns direct and ambient light; `shadow_origin` is the origin of the shadow rays.
    fn direct(
        &self,
        phong: &PhongDescription,
        intersection: &Intersection,
        shading_normal: DVec3,
        point: DVec3,
        shadow_origin: DVec3,
        viewer: DVec3,
    ) -> DVec3 {
        assert!(phong.normal_map.is_none(), "the oracle does not support normal maps");
        let factor = |specific: &Option<ColorDescription>| {
            let color = specific.as_ref().or(phong.color.as_ref()).expect("a valid material");
            self.color(color, intersection.uv)
        };
        let (diffuse, specular) = (factor(&phong.diffuse), factor(&phong.specular));
        let mut sum = self.scene.render.ambient * factor(&phong.ambient);
        for light in &self.scene.lights {
            let samples = self.samples(light, point);
            for (to_light, distance) in &samples {
                // The light may be above the triangle but below the shading horizon.
                if shading_normal.dot(*to_light) <= 0.0 {
                    continue;
                }
                let reflected = self.reflected(diffuse, specular, phong.shininess, shading_normal, viewer, *to_light);
                if self.flaw == Flaw::NoShadows
                    || !self.is_occluded(shadow_origin, *to_light, *distance, intersection.corners)
                {
                    sum += light_color(light) * reflected / samples.len() as f64;
                }
            }
        }
        sum
    }

    /// Evaluates a material color; textures are unfiltered.
    fn color(&self, color: &ColorDescription, uv: DVec2) -> DVec3 {
        let name = match color {
            ColorDescription::Plain(color) => return *color,
            ColorDescription::Texture(reference) => &reference.texture,
        };
        let uv = if self.flaw == Flaw::TransposedTexture {
            uv.yx()
        } else {
            uv
        };
        let texture_point = |scale: [f64; 2], rotate: f64, offset: [f64; 2]| {
            let rotated = DVec2::from_angle(rotate.to_radians()).rotate(DVec2::from_array(scale) * uv);
            rotated + DVec2::from_array(offset)
        };
        match &self.scene.textures[name] {
            TextureDescription::Constant(texture) => texture.color,
            TextureDescription::Checker(texture) => {
                let square = texture_point(texture.scale, texture.rotate, texture.offset).floor();
                let even = (square.x + square.y).rem_euclid(2.0) == 0.0;
                if even { texture.even } else { texture.odd }
            }
            TextureDescription::Lines(texture) => {
                let point = texture_point(texture.scale, texture.rotate, texture.offset);
                let on_line = (point - point.round()).abs().min_element() < texture.line_width / 2.0;
                if on_line { texture.line } else { texture.cell }
            }
            other => panic!("the oracle does not support the texture {other:?}"),
        }
    }

    /// Returns kd max(0, n.l) + ks max(0, r.v)^shininess; 0 if n.l <= 0.
    fn reflected(
        &self,
        diffuse: DVec3,
        specular: DVec3,
        shininess: f64,
        normal: DVec3,
        viewer: DVec3,
        light: DVec3,
    ) -> DVec3 {
        let cosine = normal.dot(light);
        if cosine <= 0.0 {
            return DVec3::ZERO;
        }
        let mirrored = (-light).reflect(normal);
        let exponent = if self.flaw == Flaw::Exponent {
            shininess - 1.0
        } else {
            shininess
        };
        let highlight = mirrored.dot(viewer).max(0.0).powf(exponent);
        diffuse * if self.flaw == Flaw::MissingCosine { 1.0 } else { cosine } + specular * highlight
    }

    fn samples(&self, light: &LightDescription, point: DVec3) -> Vec<(DVec3, f64)> {
        let direction_and_distance = |target: DVec3| ((target - point).normalize(), (target - point).length());
        match light {
            LightDescription::Rectangle(light) => {
                let (tangent, bitangent) = frame(light.normal, tangent(light.normal, light.tangent));
                let [width, height] = sizes(light.size, self.flaw);
                let light_point = |square_point: DVec2| {
                    light.center
                        + tangent * (width * (square_point.x - 0.5))
                        + bitangent * (height * (square_point.y - 0.5))
                };
                self.grid(self.scene.render.light_samples.count)
                    .into_iter()
                    .map(|square_point| direction_and_distance(light_point(square_point)))
                    .collect()
            }
            LightDescription::Point(light) => vec![direction_and_distance(light.position)],
            LightDescription::Directional(light) => vec![(-light.direction.normalize(), f64::INFINITY)],
            other => panic!("the oracle does not support the light {other:?}"),
        }
    }

    /// Returns true if a surface other than the mesh triangle `excluded` occludes the ray. Lights do not occlude.
    fn is_occluded(&self, origin: DVec3, direction: DVec3, distance: f64, excluded: Option<[DVec3; 3]>) -> bool {
        let max_t = distance * (1.0 - self.scene.render.shadow_epsilon.max(1e-5));
        let transparent = self.scene.render.shadows == Shadows::Transparent;
        let is_glass = |name: &String| matches!(self.scene.materials[name], MaterialDescription::Glass(_));
        let occludes = |surface: &&Surface| {
            surface
                .material
                .as_ref()
                .is_some_and(|name| !(transparent && is_glass(name)))
        };
        let occluders = self.surfaces.iter().filter(occludes);
        occluders
            .flat_map(|surface| crossings(&surface.geometry, origin, direction))
            .any(|(t, facet)| {
                t > 0.0 && t < max_t && (excluded.is_none() || excluded != facet.map(|facet| facet.corners))
            })
    }
}

fn light_color(light: &LightDescription) -> DVec3 {
    match light {
        LightDescription::Rectangle(light) => light.color,
        LightDescription::Point(light) => light.color,
        LightDescription::Directional(light) => light.color,
        other => panic!("the oracle does not support the light {other:?}"),
    }
}

fn frame(normal: DVec3, tangent: DVec3) -> (DVec3, DVec3) {
    let bitangent = normal.cross(tangent).normalize();
    (bitangent.cross(normal.normalize()), bitangent)
}

fn sizes(size: [f64; 2], flaw: Flaw) -> [f64; 2] {
    let [width, height] = size;
    if flaw == Flaw::SwappedAxes {
        [height, width]
    } else {
        size
    }
}

fn flat(center: DVec3, normal: DVec3, tangent: DVec3, size: Option<[f64; 2]>, flaw: Flaw) -> Geometry {
    let (tangent, bitangent) = frame(normal, tangent);
    let half = size.map(|size| DVec2::from_array(sizes(size, flaw)) / 2.0);
    Geometry::Flat {
        center,
        tangent,
        bitangent,
        half,
        round: false,
    }
}

/// Returns the direction of u: `explicit` if set, else x, or y if x is nearly parallel to the normal.
fn tangent(normal: DVec3, explicit: Option<DVec3>) -> DVec3 {
    let x_is_normal = normal.normalize().x.abs() >= 0.9;
    explicit.unwrap_or(if x_is_normal { DVec3::Y } else { DVec3::X })
}

fn disk(d: &DiskDescription) -> Geometry {
    let (tangent, bitangent) = frame(d.normal, tangent(d.normal, d.tangent));
    Geometry::Flat {
        center: d.center,
        tangent,
        bitangent,
        half: Some(DVec2::splat(d.radius)),
        round: true,
    }
}

fn quadric(center: DVec3, axes: [DVec3; 3]) -> Geometry {
    let [a, b, c] = axes;
    let from_local = DMat4::from_cols(a.extend(0.0), b.extend(0.0), c.extend(0.0), center.extend(1.0));
    let to_local = from_local.inverse();
    let sphere = DMat4::from_diagonal(DVec4::new(1.0, 1.0, 1.0, -1.0));
    Geometry::Quadric {
        q: to_local.transpose() * sphere * to_local,
        from_local,
    }
}

fn geometries(shape: &ShapeDescription, flaw: Flaw) -> (String, Vec<Geometry>) {
    match shape {
        ShapeDescription::Rectangle(r) => (
            r.material.clone(),
            vec![flat(
                r.center,
                r.normal,
                tangent(r.normal, r.tangent),
                Some(r.size),
                flaw,
            )],
        ),
        ShapeDescription::Disk(d) => (d.material.clone(), vec![disk(d)]),
        ShapeDescription::Plane(p) => (
            p.material.clone(),
            vec![flat(p.point, p.normal, tangent(p.normal, p.tangent), None, flaw)],
        ),
        ShapeDescription::Ellipsoid(e) => (e.material.clone(), vec![quadric(e.center, [e.a, e.b, e.c])]),
        ShapeDescription::Sphere(s) => {
            let axes = [DVec3::X * s.radius, DVec3::Y * s.radius, DVec3::Z * s.radius];
            (s.material.clone(), vec![quadric(s.center, axes)])
        }
        ShapeDescription::Cylinder(c) => {
            let axis = c.end - c.start;
            let (tangent, _) = frame(axis, tangent(axis, c.tangent));
            let cap = |center: DVec3, normal: DVec3| {
                disk(&DiskDescription {
                    material: c.material.clone(),
                    center,
                    radius: c.radius,
                    normal,
                    tangent: Some(tangent),
                })
            };
            let side = Geometry::Side {
                start: c.start,
                axis,
                radius: c.radius,
                tangent,
            };
            (c.material.clone(), vec![side, cap(c.start, -axis), cap(c.end, axis)])
        }
        ShapeDescription::Triangle(t) => (t.material.clone(), vec![Geometry::Triangle(t.vertices)]),
        ShapeDescription::Tetrahedron(t) => {
            let [v0, mut v1, mut v2, v3] = t.vertices;
            // The face (v0, v2, v1) must face away from v3.
            if (v2 - v0).cross(v1 - v0).dot(v3 - v0) > 0.0 {
                (v1, v2) = (v2, v1);
            }
            let faces = [[v0, v2, v1], [v0, v1, v3], [v1, v2, v3], [v0, v3, v2]];
            (t.material.clone(), faces.map(Geometry::Triangle).into())
        }
        other => panic!("the oracle does not support the shape {other:?}"),
    }
}

fn mesh(instance: &InstanceDescription, file: &MeshFileDescription, flaw: Flaw) -> Geometry {
    assert!(
        instance.matrix.is_none() && instance.materials.is_empty() && file.up == Up::Z,
        "the oracle supports only meshes with z up, without matrix and without materials of groups"
    );
    let scale = match instance.scale {
        None => DVec3::ONE,
        Some(Scale::All(s)) => DVec3::splat(s),
        Some(Scale::Each(s)) => s,
    };
    // Rodrigues' rotation formula.
    let rotate = |v: DVec3, axis: DVec3, degrees: f64| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        v * cosine + axis.cross(v) * sine + axis * (axis.dot(v) * (1.0 - cosine))
    };
    let rotated = |v: DVec3| match &instance.rotate {
        None => v,
        Some(Rotation::Angles(a)) => rotate(rotate(rotate(v, DVec3::X, a.x), DVec3::Y, a.y), DVec3::Z, a.z),
        Some(Rotation::About(about)) => rotate(v, about.axis.normalize(), about.degrees),
    };
    let to_world = |p: DVec3| rotated(p * scale) + instance.translate.unwrap_or_default();
    let normal_to_world = |n: DVec3| match flaw {
        Flaw::StretchedNormals => rotated(n * scale).normalize(),
        _ => rotated(n / scale).normalize(),
    };
    let text = std::fs::read_to_string(sources::path("scenes").join(&file.file)).expect("a mesh");
    let mut lists: HashMap<&str, Vec<DVec3>> = HashMap::new();
    let mut facets = Vec::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let (Some(tag), words) = (words.next(), words.collect::<Vec<_>>()) else {
            continue;
        };
        if tag == "f" {
            let corner = |word: &str| -> [usize; 3] {
                let numbers: Vec<usize> = word.split('/').map(|n| n.parse().expect("a number")).collect();
                numbers
                    .try_into()
                    .expect("a position, texture coordinates and a normal")
            };
            let polygon: Vec<[usize; 3]> = words.into_iter().map(corner).collect();
            for i in 2..polygon.len() {
                let corners = [polygon[0], polygon[i - 1], polygon[i]];
                let [positions, uvs, normals] =
                    [0, 1, 2].map(|list| corners.map(|corner| lists[["v", "vt", "vn"][list]][corner[list] - 1]));
                let positions = positions.map(to_world);
                let orientation = (scale.x * scale.y * scale.z).signum();
                facets.push(Facet {
                    corners: positions,
                    uvs: uvs.map(|uv| uv.truncate()),
                    normals: (file.normals != Some(Normals::Flat)).then(|| normals.map(normal_to_world)),
                    normal: (positions[1] - positions[0])
                        .cross(positions[2] - positions[1])
                        .normalize()
                        * orientation,
                });
            }
        } else if ["v", "vt", "vn"].contains(&tag) {
            let numbers: Vec<f64> = words.iter().map(|n| n.parse().expect("a number")).collect();
            let third = numbers.get(2).copied().unwrap_or(0.0);
            lists
                .entry(tag)
                .or_default()
                .push(DVec3::new(numbers[0], numbers[1], third));
        }
    }
    let with_bounds = |facets: &[Facet]| {
        let points = || facets.iter().flat_map(|facet| facet.corners);
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        (low, points().fold(DVec3::NEG_INFINITY, DVec3::max), facets.to_vec())
    };
    Geometry::Mesh(facets.chunks(32).map(with_bounds).collect())
}

impl Facet {
    /// Returns the hit at a point; the caller sets `t`, `object` and `surface`.
    fn intersection(&self, point: DVec3, flaw: Flaw) -> Intersection {
        let [a, b, c] = self.corners;
        // Barycentric coordinates as area ratios.
        let normal = (b - a).cross(c - a);
        let area = |p: DVec3, q: DVec3| (p - point).cross(q - point).dot(normal) / normal.length_squared();
        let weights = [area(b, c), area(c, a), area(a, b)];
        let uv = (0..3).map(|i| self.uvs[i] * weights[i]).sum();
        let (mut shading_normal, mut terminator_offsets) = (self.normal, [DVec3::ZERO; 2]);
        if let Some(normals) = self.normals.filter(|_| flaw != Flaw::FlatShading) {
            let smooth: DVec3 = (0..3).map(|i| normals[i] * weights[i]).sum();
            shading_normal = smooth.normalize() * smooth.dot(self.normal).signum();
            // Offset to the tangent planes of the vertices above the triangle: Hanika, "Hacking the Shadow Terminator",
            // 2021.
            terminator_offsets = [1.0, -1.0].map(|side| {
                let lifted = |i: usize| {
                    let n = normals[i] * side;
                    point - n * (point - self.corners[i]).dot(n).min(0.0)
                };
                (0..3).map(|i| lifted(i) * weights[i]).sum::<DVec3>() - point
            });
        }
        Intersection {
            t: 0.0,
            object: 0,
            normal: self.normal,
            uv,
            shading_normal,
            terminator_offsets,
            corners: Some(self.corners),
            surface: 0,
        }
    }
}

fn hits_box(low: DVec3, high: DVec3, origin: DVec3, direction: DVec3) -> bool {
    let (a, b) = ((low - origin) / direction, (high - origin) / direction);
    let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
    let margin = 1e-9 * (1.0 + near.abs());
    // A ray in the plane of a face gives NaN, which counts as a hit.
    !(near > far + margin || far < -margin)
}

/// Returns the distance of each crossing, with the triangle if the geometry is a mesh.
fn crossings(geometry: &Geometry, origin: DVec3, direction: DVec3) -> Vec<(f64, Option<&Facet>)> {
    if let Geometry::Mesh(blocks) = geometry {
        let blocks = blocks
            .iter()
            .filter(|(low, high, _)| hits_box(*low, *high, origin, direction));
        let facets = blocks.flat_map(|(.., facets)| facets);
        let hits =
            facets.filter_map(|facet| triangle_crossing(&facet.corners, origin, direction).map(|t| (t, Some(facet))));
        return hits.collect();
    }
    distances(geometry, origin, direction)
        .into_iter()
        .map(|t| (t, None))
        .collect()
}

/// Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997.
fn triangle_crossing([v0, v1, v2]: &[DVec3; 3], origin: DVec3, direction: DVec3) -> Option<f64> {
    let (edge1, edge2) = (*v1 - *v0, *v2 - *v0);
    let p = direction.cross(edge2);
    let determinant = edge1.dot(p);
    let to_origin = origin - *v0;
    let u = to_origin.dot(p) / determinant;
    let q = to_origin.cross(edge1);
    let v = direction.dot(q) / determinant;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    inside.then(|| edge2.dot(q) / determinant)
}

fn distances(geometry: &Geometry, origin: DVec3, direction: DVec3) -> Vec<f64> {
    match geometry {
        Geometry::Mesh(_) => Vec::new(),
        Geometry::Quadric { q, .. } => {
            let (o, d) = (origin.extend(1.0), direction.extend(0.0));
            let (a, b, c) = (d.dot(*q * d), 2.0 * d.dot(*q * o), o.dot(*q * o));
            let discriminant = b * b - 4.0 * a * c;
            if discriminant < 0.0 {
                return Vec::new();
            }
            let root = discriminant.sqrt();
            vec![(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)]
        }
        Geometry::Side {
            start, axis, radius, ..
        } => {
            // Quadratic equation for the points of the ray whose distance from the axis is the radius.
            let unit = axis.normalize();
            let perpendicular = |v: DVec3| v - unit * v.dot(unit);
            let (o, d) = (perpendicular(origin - *start), perpendicular(direction));
            let (a, b, c) = (d.dot(d), 2.0 * d.dot(o), o.dot(o) - radius * radius);
            let root = (b * b - 4.0 * a * c).sqrt();
            let axial = |t: f64| (origin + direction * t - *start).dot(unit);
            let roots = [(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)];
            roots
                .into_iter()
                .filter(|t| (0.0..=axis.length()).contains(&axial(*t)))
                .collect()
        }
        Geometry::Triangle(corners) => triangle_crossing(corners, origin, direction).into_iter().collect(),
        Geometry::Flat {
            center,
            tangent,
            bitangent,
            half,
            round,
        } => {
            let normal = tangent.cross(*bitangent);
            let t = (*center - origin).dot(normal) / direction.dot(normal);
            let offset = origin + direction * t - *center;
            let inside = half.is_none_or(|half| match round {
                true => offset.length() <= half.x,
                false => offset.dot(*tangent).abs() <= half.x && offset.dot(*bitangent).abs() <= half.y,
            });
            if inside && t.is_finite() { vec![t] } else { Vec::new() }
        }
    }
}

fn normal_and_uv(geometry: &Geometry, point: DVec3) -> (DVec3, DVec2) {
    match geometry {
        Geometry::Mesh(_) => unreachable!("`Facet::intersection` returns the normal of a mesh triangle"),
        Geometry::Quadric { q, from_local } => {
            let gradient = *q * point.extend(1.0);
            let local = from_local.inverse().transform_point3(point);
            let turn = std::f64::consts::TAU;
            let longitude = local.y.atan2(local.x) / turn;
            let latitude = 0.5 + local.z.clamp(-1.0, 1.0).asin() / (turn / 2.0);
            (
                gradient.truncate().normalize(),
                DVec2::new(longitude - longitude.floor(), latitude),
            )
        }
        Geometry::Side {
            start, axis, tangent, ..
        } => {
            let unit = axis.normalize();
            let along = (point - *start).dot(unit);
            let normal = (point - *start - unit * along).normalize();
            let longitude = normal.dot(unit.cross(*tangent)).atan2(normal.dot(*tangent)) / std::f64::consts::TAU;
            (normal, DVec2::new(longitude - longitude.floor(), along / axis.length()))
        }
        Geometry::Triangle([v0, v1, v2]) => {
            let normal = (*v1 - *v0).cross(*v2 - *v1);
            let area = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - b).dot(normal);
            let total_area = area(*v0, *v1, *v2);
            (
                normal.normalize(),
                DVec2::new(area(*v0, point, *v2), area(*v0, *v1, point)) / total_area,
            )
        }
        Geometry::Flat {
            center,
            tangent,
            bitangent,
            half,
            ..
        } => {
            let offset = DVec2::new((point - *center).dot(*tangent), (point - *center).dot(*bitangent));
            let uv = half.map_or(offset, |half| offset / (2.0 * half) + 0.5);
            (tangent.cross(*bitangent), uv)
        }
    }
}
