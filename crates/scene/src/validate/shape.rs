//! Validation of shapes.

use super::super::problem::At;
use super::super::{CylinderDescription, EllipsoidDescription, Geometry, Parallelogram, Shape, ShapeDescription};
use super::mesh::{self, SceneLookup, placement};
use super::{Checked, DVec3, LENGTHS, MIN_SINE, check, length, number, path, point, show, show_all, unit};

/// Returns a shape; `None` if the shape needs a file that is not read.
pub(super) fn shape(description: &ShapeDescription, lookup: &mut SceneLookup) -> Checked<Option<Shape>> {
    let (geometry, name) = match description {
        ShapeDescription::Rectangle(shape) => {
            let rectangle = rectangle(shape.center, shape.size, shape.normal, shape.tangent)?;
            (Geometry::Rectangle(rectangle), &shape.material)
        }
        ShapeDescription::Disk(shape) => {
            let center = point(shape.center).at("center")?;
            let radius = length(shape.radius).at("radius")?;
            let (tangent, bitangent) = frame(shape.normal, shape.tangent)?;
            let disk = Parallelogram {
                center,
                u: tangent * radius,
                v: bitangent * radius,
            };
            (Geometry::Disk(disk), &shape.material)
        }
        ShapeDescription::Ellipsoid(shape) => (ellipsoid(shape)?, &shape.material),
        ShapeDescription::Sphere(shape) => {
            let center = point(shape.center).at("center")?;
            let radius = length(shape.radius).at("radius")?;
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * radius);
            (Geometry::Ellipsoid { center, axes }, &shape.material)
        }
        ShapeDescription::Cylinder(shape) => (cylinder(shape)?, &shape.material),
        ShapeDescription::Triangle(shape) => (triangle(shape.vertices).at("vertices")?, &shape.material),
        ShapeDescription::Tetrahedron(shape) => (tetrahedron(shape.vertices).at("vertices")?, &shape.material),
        ShapeDescription::Mesh(shape) => return mesh::mesh(shape, lookup),
        // glTF shapes are expanded before validation, unless the scene is invalid.
        ShapeDescription::Gltf(shape) => {
            placement(shape.translate, shape.rotate, shape.scale, shape.matrix.as_ref())?;
            return lookup.assets.find(&shape.file).at("file").map(|_| None);
        }
        ShapeDescription::Plane(shape) => {
            let point = point(shape.point).at("point")?;
            let (tangent, bitangent) = frame(shape.normal, shape.tangent)?;
            let plane = Geometry::Plane {
                point,
                tangent,
                bitangent,
            };
            (plane, &shape.material)
        }
    };
    let material = lookup.material(name).at("material")?;
    let has_tangents = !matches!(geometry, Geometry::Triangles(_));
    check(
        has_tangents || lookup.scene_materials.materials[material].normal_map.is_none(),
        || format!("{name:?} must have no normal map here, because this shape has no tangents"),
    )
    .at("material")?;
    let textures = lookup.scene_materials.materials[material].textures();
    let uv_sets = textures.iter().map(|i| lookup.scene_materials.textures[*i].uv_set);
    let uv_set = uv_sets.max().unwrap_or(0);
    check(uv_set == 0, || {
        format!("{name:?} must have no texture with uv_set = {uv_set} here, because this shape has only UV set 0")
    })
    .at("material")?;
    if let Geometry::Plane { .. } = geometry {
        let emission = &lookup.scene_materials.materials[material].emission;
        let is_black = path::max_color(emission, &lookup.scene_materials.textures) == Some(DVec3::ZERO);
        check(is_black, || {
            format!("{name:?} must not emit light here, because this shape is infinite")
        })
        .at("material")?;
    }
    Ok(Some(Shape { geometry, material }))
}

pub(super) fn rectangle(
    center: DVec3,
    size: [f64; 2],
    normal: DVec3,
    tangent: Option<DVec3>,
) -> Checked<Parallelogram> {
    let center = point(center).at("center")?;
    let width = length(size[0]).at("size")?;
    let height = length(size[1]).at("size")?;
    let (tangent, bitangent) = frame(normal, tangent)?;
    Ok(Parallelogram {
        center,
        u: tangent * (width / 2.0),
        v: bitangent * (height / 2.0),
    })
}

fn ellipsoid(shape: &EllipsoidDescription) -> Checked<Geometry> {
    let center = point(shape.center).at("center")?;
    let unit_a = unit(shape.a).at("a")?;
    let unit_b = unit(shape.b).at("b")?;
    let unit_c = unit(shape.c).at("c")?;
    check(unit_a.cross(unit_b).length() > MIN_SINE, || {
        format!("{} must not be parallel to a, {}", show(shape.b), show(shape.a))
    })
    .at("b")?;
    check(unit_a.cross(unit_b).dot(unit_c).abs() > MIN_SINE, || {
        let (a, b, c) = (show(shape.a), show(shape.b), show(shape.c));
        format!("{c} must not lie in the plane of a and b, {a} and {b}")
    })
    .at("c")?;
    Ok(Geometry::Ellipsoid {
        center,
        axes: [shape.a, shape.b, shape.c],
    })
}

fn cylinder(shape: &CylinderDescription) -> Checked<Geometry> {
    let start = point(shape.start).at("start")?;
    let end = point(shape.end).at("end")?;
    let radius = length(shape.radius).at("radius")?;
    let axis = end - start;
    check(axis.length() >= LENGTHS.0, || {
        let (end, start, min) = (show(end), show(start), number(LENGTHS.0));
        format!("{end} must be at least {min} from the start, {start}")
    })
    .at("end")?;
    let (u, v) = frame_of_unit(axis / axis.length(), axis, shape.tangent, "the axis")?;
    Ok(Geometry::Cylinder {
        center: (start + end) / 2.0,
        axes: [u * radius, v * radius, axis / 2.0],
    })
}

fn triangle(vertices: [DVec3; 3]) -> Checked<Geometry> {
    let longest = longest_edge(&vertices)?;
    let [v0, v1, v2] = vertices;
    let area = (v1 - v0).cross(v2 - v1).length();
    check(area > MIN_SINE * longest * longest, || {
        format!("{} must not lie on one line", show_all(&vertices))
    })?;
    Ok(Geometry::Triangles(vec![vertices]))
}

fn tetrahedron(vertices: [DVec3; 4]) -> Checked<Geometry> {
    let longest = longest_edge(&vertices)?;
    let [v0, mut v1, mut v2, v3] = vertices;
    let volume = (v1 - v0).cross(v2 - v0).dot(v3 - v0);
    check(volume.abs() > MIN_SINE * longest.powi(3), || {
        format!("{} must not lie in one plane", show_all(&vertices))
    })?;
    if volume < 0.0 {
        // Makes the normals point outwards.
        (v1, v2) = (v2, v1);
    }
    let faces = vec![[v0, v2, v1], [v0, v1, v3], [v1, v2, v3], [v0, v3, v2]];
    Ok(Geometry::Triangles(faces))
}

/// Checks each vertex, then checks that the vertices differ. Returns the length of the longest edge.
fn longest_edge(vertices: &[DVec3]) -> Checked<f64> {
    for (i, &vertex) in vertices.iter().enumerate() {
        point(vertex).at(i)?;
    }
    let longest_from = |a: &DVec3| vertices.iter().map(|b| a.distance(*b)).fold(0.0, f64::max);
    let longest = vertices.iter().map(longest_from).fold(0.0, f64::max);
    check(longest >= LENGTHS.0, || {
        format!("{} must be at least {} apart", show_all(vertices), number(LENGTHS.0))
    })?;
    Ok(longest)
}

/// Returns the unit vectors of u and v: the tangent, made orthogonal to the normal, and normal x tangent. If there is
/// no tangent, u is along x, or along y if the normal is nearly along x.
fn frame(normal: DVec3, tangent: Option<DVec3>) -> Checked<(DVec3, DVec3)> {
    frame_of_unit(unit(normal).at("normal")?, normal, tangent, "the normal")
}

/// Returns [`frame`] for a unit normal `n`. In messages, the normal is called `name` and has the value `original`.
fn frame_of_unit(n: DVec3, original: DVec3, tangent: Option<DVec3>, name: &str) -> Checked<(DVec3, DVec3)> {
    let tangent = tangent.unwrap_or(if n.x.abs() < 0.9 { DVec3::X } else { DVec3::Y });
    let t = unit(tangent).at("tangent")?;
    let t = t - n * n.dot(t);
    check(t.length() > MIN_SINE, || {
        format!("{} must not be parallel to {name}, {}", show(tangent), show(original))
    })
    .at("tangent")?;
    let t = t.normalize();
    Ok((t, n.cross(t)))
}
