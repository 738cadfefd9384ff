//! Proptest strategies: shapes, meshes, instances.

use std::collections::BTreeMap;

use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::select;
use wgray::mesh::Normals;
use wgray::scene::*;
use wgray_render::pack::MAX_LINEAR_PRIMITIVES;

use super::files::MESHES;
use super::values::*;

pub fn shape() -> BoxedStrategy<ShapeDescription> {
    let material = select(&["a", "b", "c"][..]).prop_map(str::to_string);
    let rectangle = (material.clone(), point(), frame(), [length(), length()]).prop_map(
        |(material, center, [normal, tangent], size)| {
            ShapeDescription::Rectangle(RectangleDescription {
                material,
                center,
                size,
                normal,
                tangent: Some(tangent),
            })
        },
    );
    let disk = (material.clone(), point(), frame(), length(), any::<bool>()).prop_map(
        |(material, center, [normal, tangent], radius, has_tangent)| {
            ShapeDescription::Disk(DiskDescription {
                material,
                center,
                radius,
                normal,
                tangent: has_tangent.then_some(tangent),
            })
        },
    );
    let sphere = (material.clone(), point(), length()).prop_map(|(material, center, radius)| {
        ShapeDescription::Sphere(SphereDescription {
            material,
            center,
            radius,
        })
    });
    let ellipsoid = (
        material.clone(),
        point(),
        frame(),
        direction(),
        [length(), length(), length()],
    )
        .prop_map(|(material, center, [a, b], c, [la, lb, lc])| {
            let (a, b, c) = (a.normalize() * la, b.normalize() * lb, c.normalize() * lc);
            ShapeDescription::Ellipsoid(EllipsoidDescription {
                material,
                center,
                a,
                b,
                c,
            })
        });
    let cylinder = (material.clone(), point(), frame(), [length(), length()], any::<bool>()).prop_map(
        |(material, start, [axis, tangent], [radius, height], has_tangent)| {
            ShapeDescription::Cylinder(CylinderDescription {
                material,
                start,
                end: start + axis.normalize() * height,
                radius,
                tangent: has_tangent.then_some(tangent),
            })
        },
    );
    let triangle = (material.clone(), [point(), point(), point()])
        .prop_map(|(material, vertices)| ShapeDescription::Triangle(TriangleDescription { material, vertices }));
    let tetrahedron = (material.clone(), [point(), point(), point(), point()])
        .prop_map(|(material, vertices)| ShapeDescription::Tetrahedron(TetrahedronDescription { material, vertices }));
    let plane = (material, point(), frame()).prop_map(|(material, point, [normal, tangent])| {
        ShapeDescription::Plane(PlaneDescription {
            material,
            point,
            normal,
            tangent: Some(tangent),
        })
    });
    prop_oneof![
        2 => rectangle,
        1 => disk,
        2 => sphere,
        2 => ellipsoid,
        2 => cylinder,
        1 => triangle,
        1 => tetrahedron,
        1 => plane,
    ]
    .boxed()
}

/// Translation, rotation and scale, or a matrix.
pub type Placement = (Option<DVec3>, Option<Rotation>, Option<Scale>, Option<Vec<[f64; 4]>>);

pub fn placement() -> BoxedStrategy<Placement> {
    let angle = || prop_oneof![2 => select(&[0.0, 90.0, -180.0, 30.0][..]), 1 => -360.0..360.0];
    let angles = [angle(), angle(), angle()].prop_map(|a| Rotation::Angles(DVec3::from_array(a)));
    let about = (direction(), angle()).prop_map(|(axis, degrees)| Rotation::About(RotationAbout { axis, degrees }));
    let rotation = prop_oneof![1 => Just(None), 1 => angles.prop_map(Some), 1 => about.prop_map(Some)];
    let size = || select(&[1.0, 0.7, 0.3, -0.5, 1.0, 1e-3, 1e3][..]);
    let per_axis = [size(), size(), size()].prop_map(|s| Scale::Each(DVec3::from_array(s)));
    let scale =
        prop_oneof![2 => Just(None), 2 => size().prop_map(|s| Some(Scale::All(s))), 1 => per_axis.prop_map(Some)];
    let components = (prop::option::of(point()), rotation, scale).prop_map(|(t, r, s)| (t, r, s, None));
    let row = || [coordinate(), coordinate(), coordinate(), coordinate()];
    let matrix = [row(), row(), row()].prop_map(|rows| (None, None, None, Some(rows.to_vec())));
    prop_oneof![5 => components, 1 => matrix].boxed()
}

pub fn normals() -> BoxedStrategy<Option<Normals>> {
    select(vec![None, Some(Normals::Smooth), Some(Normals::Flat)]).boxed()
}

pub fn up() -> BoxedStrategy<Up> {
    select(vec![Up::Z, Up::Y, Up::X]).boxed()
}

/// Generates materials of mesh groups.
pub fn group_materials() -> BoxedStrategy<BTreeMap<String, String>> {
    prop::option::of(select(&["a", "b", "c"][..]))
        .prop_map(|material| {
            let group_material = material.map(|material| ("second".to_string(), material.to_string()));
            group_material.into_iter().collect()
        })
        .boxed()
}

pub fn mesh() -> BoxedStrategy<ShapeDescription> {
    let material = select(&["a", "b", "c"][..]).prop_map(str::to_string);
    let file = select(MESHES).prop_map(|(name, ..)| name.to_string());
    (file, normals(), up(), material, group_materials(), placement())
        .prop_map(
            |(file, normals, up, material, materials, (translate, rotate, scale, matrix))| {
                ShapeDescription::Mesh(MeshDescription {
                    file,
                    normals,
                    up,
                    material: Some(material),
                    materials,
                    translate,
                    rotate,
                    scale,
                    matrix,
                })
            },
        )
        .boxed()
}

pub fn instance() -> BoxedStrategy<InstanceDescription> {
    let name = || select(&["a", "b", "c"][..]).prop_map(str::to_string);
    (name(), name(), group_materials(), placement())
        .prop_map(
            |(mesh, material, materials, (translate, rotate, scale, matrix))| InstanceDescription {
                mesh,
                material: Some(material),
                materials,
                translate,
                rotate,
                scale,
                matrix,
            },
        )
        .boxed()
}

/// Generates mesh files and instances, often none.
pub fn meshes() -> BoxedStrategy<(BTreeMap<String, MeshFileDescription>, Vec<InstanceDescription>)> {
    let file = || {
        (select(MESHES), normals(), up()).prop_map(|((name, ..), normals, up)| {
            let mut mesh = MeshFileDescription::new(name.to_string());
            (mesh.normals, mesh.up) = (normals, up);
            mesh
        })
    };
    let files = [file(), file(), file()].prop_map(|files| {
        let names = ["a", "b", "c"].map(str::to_string);
        names.into_iter().zip(files).collect()
    });
    let with_instances = (files, prop::collection::vec(instance(), 1..5));
    prop_oneof![3 => Just(Default::default()), 1 => with_instances].boxed()
}

/// Generates a few shapes, or enough for a BVH. Meshes are rare, because kernels with mesh traversal take seconds to
/// compile.
pub fn shapes() -> BoxedStrategy<Vec<ShapeDescription>> {
    let shape = || prop_oneof![9 => shape(), 1 => mesh()];
    let many = MAX_LINEAR_PRIMITIVES + 1..MAX_LINEAR_PRIMITIVES + 20;
    prop_oneof![11 => prop::collection::vec(shape(), 0..7), 1 => prop::collection::vec(shape(), many)].boxed()
}

/// Scales a shape about the origin, then translates it by `offset`.
pub fn scale_and_translate_shape(shape: &mut ShapeDescription, scale: f64, offset: DVec3) {
    let move_point = |p: &mut DVec3| *p = *p * scale + offset;
    match shape {
        ShapeDescription::Rectangle(s) => {
            move_point(&mut s.center);
            s.size = s.size.map(|side| side * scale);
        }
        ShapeDescription::Sphere(s) => {
            move_point(&mut s.center);
            s.radius *= scale;
        }
        ShapeDescription::Disk(s) => {
            move_point(&mut s.center);
            s.radius *= scale;
        }
        ShapeDescription::Ellipsoid(s) => {
            move_point(&mut s.center);
            [&mut s.a, &mut s.b, &mut s.c]
                .into_iter()
                .for_each(|axis| *axis *= scale);
        }
        ShapeDescription::Cylinder(s) => {
            [&mut s.start, &mut s.end].into_iter().for_each(move_point);
            s.radius *= scale;
        }
        ShapeDescription::Triangle(s) => s.vertices.iter_mut().for_each(move_point),
        ShapeDescription::Tetrahedron(s) => s.vertices.iter_mut().for_each(move_point),
        ShapeDescription::Plane(s) => move_point(&mut s.point),
        ShapeDescription::Mesh(s) => move_placement(&mut s.translate, &mut s.scale, &mut s.matrix, scale, offset),
        other => panic!("no random scene has the shape {other:?}"),
    }
}

/// Scales and translates a mesh or an instance.
pub fn move_placement(
    translate: &mut Option<DVec3>,
    factors: &mut Option<Scale>,
    matrix: &mut Option<Vec<[f64; 4]>>,
    scale: f64,
    offset: DVec3,
) {
    if let Some(rows) = matrix {
        for (row, offset) in rows.iter_mut().zip(offset.to_array()) {
            *row = row.map(|x| x * scale);
            row[3] += offset;
        }
        return;
    }
    *translate = Some(translate.unwrap_or_default() * scale + offset);
    *factors = Some(match factors {
        None => Scale::All(scale),
        Some(Scale::All(s)) => Scale::All(*s * scale),
        Some(Scale::Each(s)) => Scale::Each(*s * scale),
    });
}
