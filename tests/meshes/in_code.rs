//! Meshes built in code: edited clones, and meshes that violate a rule.

use std::sync::Arc;

use wgray::mesh::{Group, Mesh};
use wgray::scene::{Assets, MeshDescription, PerspectiveDescription, PhongDescription, Scene};
use wgray::{Aov, ChannelValues, DVec3, Description, Device, Options};

/// Returns a square in the plane z = 0, visible to the camera of [`scene`].
fn square() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.positions = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
        .map(|[x, y]| glam::Vec3::new(x as f32, y as f32, 0.0))
        .to_vec();
    mesh.triangles = vec![[0, 1, 2], [0, 2, 3]];
    mesh.groups = vec![Group::default()];
    mesh
}

fn description() -> Description {
    let camera = PerspectiveDescription {
        up: DVec3::Y,
        ..PerspectiveDescription::new([0.0, 0.0, 5.0], [0.0; 3], 20.0)
    };
    Description::new(8, 8, camera)
        .with_material("m", PhongDescription::new([0.5; 3]))
        .with_shape(MeshDescription::new("m", "mesh"))
}

fn scene(mesh: Arc<Mesh>) -> Result<Scene, String> {
    let mut assets = Assets::default();
    assets.meshes.insert("mesh".to_owned(), mesh);
    description()
        .validate_with(&assets)
        .map_err(|problem| problem.to_string())
}

fn depth(mesh: &Arc<Mesh>) -> f32 {
    let options = Options {
        device: Device::Cpu,
        aovs: vec![Aov::Depth],
        ..Options::default()
    };
    let picture = wgray::render(&scene(Arc::clone(mesh)).unwrap(), &options).unwrap();
    match picture.channel("depth.Z") {
        Some(ChannelValues::Floats(depths)) => depths[8 * 4 + 4],
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_edited_clone_is_rendered_with_its_edits() {
    let original = Arc::new(square());
    assert!((depth(&original) - 5.0).abs() < 0.1);
    let move_back = |mesh: &mut Mesh| mesh.positions.iter_mut().for_each(|p| p.z -= 2.0);

    let mut clone = Mesh::clone(&original);
    move_back(&mut clone);
    assert!((depth(&Arc::new(clone)) - 7.0).abs() < 0.1, "a clone has the old depth");

    let mut unshared = Arc::clone(&original);
    move_back(Arc::make_mut(&mut unshared));
    assert!((depth(&unshared) - 7.0).abs() < 0.1, "Arc::make_mut of a shared mesh");
    move_back(Arc::make_mut(&mut unshared));
    assert!(
        (depth(&unshared) - 9.0).abs() < 0.1,
        "Arc::make_mut of an unshared mesh"
    );

    let mut owned = Arc::try_unwrap(unshared).unwrap();
    move_back(&mut owned);
    assert!((depth(&Arc::new(owned)) - 11.0).abs() < 0.1, "Arc::try_unwrap");
    assert!((depth(&original) - 5.0).abs() < 0.1);
}

#[test]
fn the_bvh_of_a_mesh_is_cached() {
    let mesh = Arc::new(square());
    let pack = || wgray_render::pack::pack(&scene(Arc::clone(&mesh)).unwrap());
    let [a, b] = [pack(), pack()];
    assert!(Arc::ptr_eq(&a.bvh.meshes[0], &b.bvh.meshes[0]));
}

#[test]
fn meshes_that_violate_a_rule_are_rejected() {
    type Edit = fn(&mut Mesh);
    let cases: [(Edit, &str); 20] = [
        (|m| *m = Mesh::default(), "triangles: must not be empty"),
        (|m| m.groups.clear(), "groups: must not be empty"),
        (
            |m| m.group_of = vec![0, 1],
            "group_of[1]: group 1 does not exist; number of groups: 1",
        ),
        (
            |m| m.groups.push(Group::default()),
            "group_of: the length 0 must be 2, the number of triangles, or 0 if there is one group",
        ),
        (
            |m| m.group_of = vec![0],
            "group_of: the length 1 must be 2, the number of triangles, or 0 if there is one group",
        ),
        (
            |m| m.triangles[1] = [0, 99, 1],
            "triangles[1]: vertex 99 does not exist; number of positions: 4",
        ),
        (
            |m| m.positions.clear(),
            "triangles[0]: vertex 0 does not exist; number of positions: 0",
        ),
        (
            |m| m.positions[2].y = f32::NAN,
            "positions[2]: [1, NaN, 0] plus center must be from -1e9 to 1e9",
        ),
        (
            |m| m.positions[3].z = f32::INFINITY,
            "positions[3]: [-1, 1, inf] plus center must be from -1e9 to 1e9",
        ),
        (
            |m| m.positions[0].x = 2e9,
            "positions[0]: [2000000000, -1, 0] plus center must be from -1e9 to 1e9",
        ),
        (
            |m| m.center.x = f64::NAN,
            "center: [NaN, 0, 0] must be from -1e9 to 1e9",
        ),
        (
            |m| m.normals = vec![glam::Vec3::Z; 3],
            "normals: the length 3 must be 4, the number of positions, or 0",
        ),
        (
            |m| m.normals = vec![glam::Vec3::ZERO; 4],
            "normals[0]: [0, 0, 0] must be a unit vector",
        ),
        (
            |m| m.normals = vec![glam::Vec3::NAN; 4],
            "normals[0]: [NaN, NaN, NaN] must be a unit vector",
        ),
        (
            |m| m.uvs = vec![glam::Vec2::ZERO],
            "uvs: the length 1 must be 4, the number of positions, or 0",
        ),
        (
            |m| m.uvs = vec![glam::Vec2::NAN; 4],
            "uvs[0]: [NaN, NaN] must be finite",
        ),
        (
            |m| m.more_uvs = vec![vec![glam::Vec2::ZERO; 5]],
            "more_uvs[0]: the length 5 must be 4, the number of positions, or 0",
        ),
        (
            |m| m.colors = vec![glam::Vec4::new(0.0, 0.0, 0.0, 1.5); 4],
            "colors[0]: [0, 0, 0, 1.5] must be from 0 to 1e6, and the opacity from 0 to 1",
        ),
        (
            |m| m.tangents = vec![glam::Vec4::X; 4],
            "tangents[0]: [1, 0, 0, 0] must be a unit vector with w = 1 or w = -1, or zero",
        ),
        (|m| m.triangles.clear(), "triangles: must not be empty"),
    ];
    for (edit, expected) in cases {
        let mut mesh = square();
        edit(&mut mesh);
        let message = scene(Arc::new(mesh)).expect_err(expected);
        assert_eq!(message, format!("shapes[0].file: \"mesh\": {expected}"));
    }
    assert!(scene(Arc::new(square())).is_ok());
}

#[test]
fn unusual_but_valid_meshes_are_rendered() {
    let depth = |edit: fn(&mut Mesh)| {
        let mut mesh = square();
        edit(&mut mesh);
        depth(&Arc::new(mesh))
    };
    let expected = depth(|_| {});
    // Triangles of zero area and duplicate triangles do not change the depth.
    assert_eq!(depth(|m| m.triangles.extend([[0, 0, 0], [0, 1, 1]])), expected);
    assert_eq!(depth(|m| m.triangles = m.triangles.repeat(5000)), expected);
    assert_eq!(depth(|m| m.group_of = vec![0, 0]), expected);
    // An unused vertex does not change the depth.
    assert_eq!(depth(|m| m.positions.push(glam::Vec3::splat(-0.5))), expected);
}
