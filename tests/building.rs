//! Scenes built in code with handles; invalid input is an error, never a panic.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use wgray::mesh::Mesh;
use wgray::scene::{
    ColorDescription, DiffuseDescription, Encoding, EnvironmentDescription, Image, ImageTextureDescription,
    InstanceDescription, Integrator, MeshFileDescription, PerspectiveDescription, RenderDescription,
    SamplesDescription, SceneBuilder, SphereDescription, Texels,
};
use wgray::{Description, Device, Options};

fn camera() -> PerspectiveDescription {
    PerspectiveDescription::new([0.0, -5.0, 2.0], [0.0, 0.0, 0.5], 40.0)
}

fn settings() -> RenderDescription {
    RenderDescription {
        integrator: Some(Integrator::Path),
        pixel_samples: SamplesDescription::new(2),
        ..RenderDescription::default()
    }
}

fn image() -> Image {
    Image {
        width: 2,
        height: 1,
        texels: Texels::Bytes(Encoding::Srgb, vec![[200, 30, 30], [30, 30, 200]]),
    }
}

fn square() -> Arc<Mesh> {
    Mesh::builder()
        .positions(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
        .triangles(&[[0, 1, 2], [0, 2, 3]])
        .uvs(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        .groups(&["lower", "upper"], &[0, 1])
        .build()
        .expect("a mesh")
}

#[test]
fn handles_give_the_same_scene_as_names() {
    let mut builder = SceneBuilder::new(16, 12, camera());
    builder.render(settings());
    let map = builder.image(image());
    builder.environment_map(&map);
    let texture = builder.image_texture(&map);
    let textured = builder.material(DiffuseDescription::new(ColorDescription::texture(&texture)));
    let plain = builder.material(DiffuseDescription::new([0.5, 0.5, 0.5]));
    let mesh = builder.mesh(square());
    let transform = DAffine3::from_mat3_translation(DMat3::from_rotation_z(0.3), DVec3::new(-0.5, 0.0, 0.0));
    builder.instance(&mesh, &textured, transform);
    builder.shape(SphereDescription::new(&plain, [1.0, 0.0, 0.5], 0.5));
    let built = builder.build().expect("a scene");

    let rows = |t: &DAffine3| {
        let row = |i: usize| [t.x_axis[i], t.y_axis[i], t.z_axis[i], t.translation[i]];
        vec![row(0), row(1), row(2)]
    };
    let mut assets = wgray::scene::Assets::default();
    assets.images.insert("map".to_owned(), Arc::new(image()));
    assets.meshes.insert("square".to_owned(), square());
    let named = Description::new(16, 12, camera())
        .with_render(settings())
        .with_environment(EnvironmentDescription::image("map"))
        .with_texture("a", ImageTextureDescription::new("map"))
        .with_material("a", DiffuseDescription::new(ColorDescription::texture("a")))
        .with_material("b", DiffuseDescription::new([0.5, 0.5, 0.5]))
        .with_mesh("square", MeshFileDescription::new("square"))
        .with_instance(InstanceDescription {
            matrix: Some(rows(&transform)),
            ..InstanceDescription::new("a", "square")
        })
        .with_shape(SphereDescription::new("b", [1.0, 0.0, 0.5], 0.5))
        .validate_with(&assets)
        .expect("a scene");
    let options = Options {
        device: Device::Cpu,
        ..Options::default()
    };
    let pixels = |scene| wgray::render(scene, &options).expect("an image").pixels();
    assert_eq!(built.material_names, ["material 3", "material 4"]);
    assert!(pixels(&built) == pixels(&named));
    assert!(
        pixels(&built).colors.iter().any(|color| color[0] > 2.0 * color[2]),
        "the texture is not used"
    );
}

#[test]
fn invalid_meshes_are_errors() {
    let triangle = || Mesh::builder().positions(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert!(triangle().triangles(&[[0, 1, 2]]).build().is_ok());
    let valid = || triangle().triangles(&[[0, 1, 2]]);
    for (builder, rule) in [
        (Mesh::builder(), "triangles: must not be empty"),
        (triangle(), "triangles: must not be empty"),
        (triangle().triangles(&[[0, 1, 3]]), "vertex 3 does not exist"),
        (
            triangle().triangles(&[[0, 1, u32::MAX]]),
            "vertex 4294967295 does not exist",
        ),
        (valid().positions(&[[f32::NAN; 3]; 3]), "positions"),
        (valid().positions(&[[f32::INFINITY; 3]; 3]), "positions"),
        (valid().center([f64::NAN; 3]), "center"),
        (valid().center([1e300; 3]), "center"),
        (valid().normals(&[[0.0, 0.0, 1.0]]), "normals"),
        (valid().normals(&[[0.0, 0.0, 2.0]; 3]), "normals"),
        (valid().uvs(&[[0.0, 0.0]; 4]), "uvs"),
        (valid().uvs(&[[f32::NAN, 0.0]; 3]), "uvs"),
        (valid().colors(&[[0.0, 0.0, 0.0, 2.0]; 3]), "colors"),
        (valid().groups(&["a", "b"], &[]), "group_of"),
        (valid().groups(&["a", "b"], &[2]), "group 2 does not exist"),
        (valid().groups(&["a"], &[0, 0]), "group_of"),
    ] {
        let error = builder.build().expect_err(rule).to_string();
        assert!(error.contains(rule), "{error}");
    }
    // Without group names, the mesh has one group.
    assert_eq!(valid().groups(&[], &[]).build().expect("a mesh").groups.len(), 1);
}

#[test]
fn invalid_scenes_are_errors() {
    let error = |edit: &dyn Fn(&mut SceneBuilder)| {
        let mut builder = SceneBuilder::new(16, 12, camera());
        builder.render(settings());
        edit(&mut builder);
        builder.build().expect_err("an error").to_string()
    };
    let mut other_builder = SceneBuilder::new(1, 1, camera());
    let other_builders_material = other_builder.material(DiffuseDescription::new([0.5; 3]));
    let message = error(&|builder| builder.shape(SphereDescription::new(&other_builders_material, [0.0; 3], 1.0)));
    assert!(message.starts_with("shapes[0].material"), "{message}");
    let message = error(&|builder| {
        let empty = builder.image(Image {
            width: 4,
            height: 4,
            texels: Texels::Floats(Vec::new()),
        });
        builder.image_texture(&empty);
    });
    assert!(message.contains("has 0 texels; its size is 4 x 4"), "{message}");
    // A mesh whose fields were edited after it was built.
    let message = error(&|builder| {
        let mut mesh = Mesh::clone(&square());
        mesh.triangles.push([9, 9, 9]);
        let mesh = builder.mesh(mesh);
        let material = builder.material(DiffuseDescription::new([0.5; 3]));
        builder.instance(&mesh, &material, DAffine3::IDENTITY);
    });
    assert!(
        message.contains("does not exist") || message.contains("group_of"),
        "{message}"
    );
    let message = error(&|builder| {
        let mesh = builder.mesh(square());
        let material = builder.material(DiffuseDescription::new([0.5; 3]));
        builder.instance(&mesh, &material, DAffine3::from_scale(DVec3::splat(f64::NAN)));
    });
    assert!(message.starts_with("instances[0].matrix"), "{message}");
}
