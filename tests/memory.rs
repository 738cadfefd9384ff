//! Scenes, meshes and images read from memory, and images written to memory. Scenes from memory equal scenes from
//! files, and are loaded without reading a file.

use std::collections::BTreeMap;
use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use glam::DVec3;
use serde_json::json;
use wgray::image::{BitDepth, ExrType, Format, Metadata, SaveOptions, files};
use wgray::mesh::{Mesh, MeshFormat, Normals};
use wgray::scene::{
    AssetSource, Assets, Encoding, FolderFiles, Image, LoadOptions, MemoryFiles, NoFiles, SceneFormat, Texels,
};
use wgray::{Aov, Description, Device, Options, Overrides, Scene};

use crate::gltf::build::{Builder, Packing};
use crate::sources;
use crate::test_folder::TestFolder;

const CAMERA: &str = "image = { width = 8, height = 6 }
camera = { position = [0, -5, 2], look_at = [0, 0, 0.5], fov = 40 }
render = { integrator = 'path', pixel_samples = 2 }
environment = { name = 'studio' }
";

/// Returns all files below a folder with their contents.
fn files_of(folder: &Path) -> MemoryFiles {
    let mut files = MemoryFiles::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(subfolder) = folders.pop() {
        for entry in std::fs::read_dir(folder.join(&subfolder)).unwrap() {
            let entry = entry.unwrap();
            let name = subfolder.join(entry.file_name());
            match entry.path().is_dir() {
                true => folders.push(name),
                false => files.insert(name.to_str().unwrap(), std::fs::read(entry.path()).unwrap()),
            }
        }
    }
    files
}

/// Returns a folder with a scene and models in all formats, some of which refer to other files.
fn models() -> TestFolder {
    let folder = TestFolder::with_file(
        "s.toml",
        &format!("{CAMERA}shapes = [{{ type = 'gltf', file = 'g.gltf' }}]"),
    );
    folder.write(
        "json.json",
        &json!({
            "settings": { "background_color": [0.1, 0.2, 0.3], "image_width": 8, "image_height": 6, "samples_per_pixel": 1 },
        })
        .to_string(),
    );
    folder.write(
        "a.obj",
        "mtllib A.MTL\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n",
    );
    // References to these files differ in the case of letters, and one reference is a Windows path.
    folder.write("a.mtl", "newmtl m\nKd 1 1 1\nmap_Kd C:\\textures\\Color.PNG\n");
    let color = image::RgbImage::from_fn(2, 2, |x, y| image::Rgb([100, 50 * x as u8, 200 * y as u8]));
    color.save(folder.path("color.png")).unwrap();
    folder.write(
        "b.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    );
    folder.write(
        "c.stl",
        "solid c\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
    );
    let mut builder = Builder::new();
    let image = builder.add("images", json!({ "uri": "color.png" }));
    let texture = builder.add("textures", json!({ "source": image }));
    let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } } });
    let material = builder.add("materials", material);
    let mesh = builder.quad(Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    builder.write_invalid(folder.folder(), "g", Packing::Beside);
    folder
}

/// Loads a file from disk, from a folder as a source, and from memory, and asserts that the scenes or the
/// errors are equal. Returns the result from memory.
fn load_all(folder: &Path, name: &str, overrides: &Overrides) -> Result<Scene, String> {
    let path = folder.join(name);
    let bytes = std::fs::read(&path).unwrap();
    let options = LoadOptions::new().with_name(name).with_overrides(overrides.clone());
    let load = |options: LoadOptions| Scene::from_slice(&bytes, SceneFormat::of(Path::new(name)), &options);
    let memory = load(options.clone().with_source(files_of(folder))).map_err(|error| error.to_string());
    let source = load(options.with_source(FolderFiles::new(folder))).map_err(|error| error.to_string());
    let prefix = format!("{}/", folder.display());
    let disk = Scene::load_with(&path, overrides).map_err(|error| error.to_string().replace(&prefix, ""));
    let without_paths = |scene: &Result<Scene, String>, folder: &Path| {
        scene.clone().map(|mut scene| {
            let canonical = folder.canonicalize().unwrap_or_default();
            for file in &mut scene.files {
                let relative = file.strip_prefix(folder).or(file.strip_prefix(&canonical));
                *file = relative.unwrap_or(file).to_owned();
            }
            scene.files.sort();
            let notes = |scene: &Scene| format!("{:?}", scene.notes);
            (
                notes(&scene),
                scene.files,
                scene.materials,
                scene.material_names,
                scene.textures,
            )
        })
    };
    let expected = without_paths(&disk, folder);
    assert_eq!(without_paths(&source, Path::new("")), expected, "{name}");
    assert_eq!(without_paths(&memory, Path::new("")), expected, "{name}");
    if let (Ok(disk), Ok(memory)) = (&disk, &memory) {
        let options = Options {
            device: Device::Cpu,
            ..Options::default()
        };
        let pixels = |scene: &Scene| wgray::render(scene, &options).unwrap().pixels();
        assert!(pixels(disk) == pixels(memory), "{name}");
        assert!(disk.camera == memory.camera && disk.lights == memory.lights, "{name}");
    }
    memory
}

fn small_overrides() -> Overrides {
    Overrides {
        size: Some((8, 6)),
        pixel_samples: Some(1),
        ..Overrides::default()
    }
}

#[test]
fn scenes_and_models_in_memory_equal_files() {
    let scenes = sources::path("scenes");
    for name in [
        "ground-grid.toml",
        "textures.toml",
        "twisted-tube.toml",
        "materials.toml",
    ] {
        load_all(&scenes, name, &small_overrides()).unwrap();
    }
    let folder = models();
    for name in ["s.toml", "a.obj", "b.ply", "c.stl", "g.gltf"] {
        let scene = load_all(folder.folder(), name, &small_overrides()).unwrap();
        assert!(!scene.shapes.is_empty(), "{name}");
        let has_texture = ["s.toml", "a.obj", "g.gltf"].contains(&name);
        assert_eq!(!scene.textures.is_empty(), has_texture, "{name}");
    }
    let unchanged = sources::path("tests/unchanged");
    for name in ["animated-skin.glb", "ktx2.glb", "coat-normal.glb", "small.toml"] {
        load_all(&unchanged, name, &small_overrides()).unwrap();
    }
}

#[test]
fn scenes_in_subfolders_find_their_files() {
    let folder = models();
    let scene = format!("{CAMERA}shapes = [{{ type = 'mesh', file = '../models/./a.obj' }}]");
    let mut files = MemoryFiles::new();
    for name in ["a.obj", "a.mtl", "color.png"] {
        files.insert(&format!("models/{name}"), folder.read(name));
    }
    let options = LoadOptions::new().with_name("scenes/s.toml").with_source(files);
    let scene = Scene::from_slice(scene.as_bytes(), SceneFormat::Toml, &options).unwrap();
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let names: Vec<&str> = scene.files.iter().filter_map(|file| file.to_str()).collect();
    assert_eq!(names.len(), 3, "{names:?}");
}

/// `load_all` also asserts that errors from memory equal errors from disk.
#[test]
fn errors_have_file_line_and_rule() {
    let folder = models();
    folder.write(
        "bad.toml",
        &format!("{CAMERA}[[shapes]]\ntype = 'sphere'\nradius = -1\n"),
    );
    folder.write("syntax.toml", "image = {");
    folder.write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    folder.write("empty.ply", "");
    folder.write("bad.gltf", "{ \"asset\": { \"version\": \"2.0\" }, \"scene\": 7 }");
    folder.write(
        "missing.toml",
        &format!("{CAMERA}shapes = [{{ type = 'mesh', file = 'none.obj' }}]"),
    );
    folder.write(
        "outside.toml",
        &format!("{CAMERA}shapes = [{{ type = 'mesh', file = 'folder.obj' }}]"),
    );
    std::fs::create_dir(folder.path("folder.obj")).unwrap();
    for (name, expected) in [
        ("bad.toml", "bad.toml:5: shapes[0].material is missing"),
        ("syntax.toml", "syntax.toml:1:"),
        ("bad.obj", "bad.obj:2: "),
        ("empty.ply", "empty.ply: the file is empty"),
        ("bad.gltf", "bad.gltf: "),
    ] {
        let error = load_all(folder.folder(), name, &small_overrides()).unwrap_err();
        assert!(error.starts_with(expected), "{error}");
    }
    let load = |name: &str| {
        let options = LoadOptions::new()
            .with_name(name)
            .with_source(files_of(folder.folder()));
        let scene = Scene::from_slice(&folder.read(name), SceneFormat::Toml, &options);
        scene.unwrap_err().to_string()
    };
    let rule = "\"none.obj\" cannot be read: there is no such file in memory";
    assert_eq!(load("missing.toml"), format!("missing.toml:5: shapes[0].file: {rule}"));
    let rule = "\"folder.obj\" cannot be read: there is no such file in memory";
    assert_eq!(load("outside.toml"), format!("outside.toml:5: shapes[0].file: {rule}"));
    // An error of an override names the override, and a scene without a name has a default name.
    let overrides = Overrides {
        pixel_samples: Some(0),
        ..Overrides::default()
    };
    let options = LoadOptions::new().with_overrides(overrides);
    let scene = Scene::from_slice(CAMERA.as_bytes(), SceneFormat::Toml, &options);
    assert!(scene.unwrap_err().to_string().starts_with("pixel_samples: 0 must be"));
    let scene = Scene::from_slice(b"image = 3", SceneFormat::Toml, &LoadOptions::new());
    assert!(scene.unwrap_err().to_string().starts_with("scene.toml:1: "));
    let overrides = Overrides {
        asset_root: Some("/".into()),
        ..Overrides::default()
    };
    let options = LoadOptions::new().with_overrides(overrides);
    let scene = Scene::from_slice(CAMERA.as_bytes(), SceneFormat::Toml, &options);
    assert!(scene.unwrap_err().to_string().starts_with("asset_root: does not apply"));
    for name in ["/s.toml", "../s.toml", "a/../../s.toml"] {
        let scene = Scene::from_slice(
            CAMERA.as_bytes(),
            SceneFormat::Toml,
            &LoadOptions::new().with_name(name),
        );
        let error = scene.unwrap_err().to_string();
        assert!(
            error.starts_with(&format!(
                "name: '{name}' cannot be the name of a scene in memory: it must"
            )),
            "{error}"
        );
    }
    let too_large = vec![b' '; (64 << 20) + 1];
    let scene = Scene::from_slice(&too_large, SceneFormat::Toml, &LoadOptions::new());
    assert!(scene.unwrap_err().to_string().ends_with("it is larger than 64 MiB"));
}

/// Refuses all files and records the requested names.
#[derive(Clone, Default)]
struct DenyAll(Arc<Mutex<Vec<String>>>);

impl AssetSource for DenyAll {
    fn read(&self, name: &str) -> io::Result<Arc<[u8]>> {
        self.0.lock().unwrap().push(name.to_owned());
        Err(io::Error::from(io::ErrorKind::PermissionDenied))
    }
}

/// Uses names of files that exist in the current folder: they must not be found, and errors must be the same as
/// for files that do not exist.
#[test]
fn no_file_is_read_and_no_error_reveals_which_files_exist() {
    assert!(Path::new("Cargo.toml").is_file() && Path::new("scenes/textures/grid.png").is_file());
    let root = std::env::current_dir().unwrap();
    let folder = models();
    let existing_image = folder.path("color.png");
    let templates = [
        "shapes = [{ type = 'mesh', file = 'FILE' }]",
        "shapes = [{ type = 'gltf', file = 'FILE' }]",
        "textures.a = { type = 'image', file = 'FILE' }\nmaterials.a = { type = 'diffuse', color = { texture = 'a' } }",
        "environment = { file = 'FILE' }",
    ];
    for template in templates {
        let error = |file: &str, source: DenyAll| {
            let camera = match template.starts_with("environment") {
                true => CAMERA.replace("environment = { name = 'studio' }\n", ""),
                false => CAMERA.to_owned(),
            };
            let text = format!("{camera}{}", template.replace("FILE", file));
            let options = LoadOptions::new().with_source(source.clone());
            match Scene::from_slice(text.as_bytes(), SceneFormat::Toml, &options) {
                Ok(scene) => format!("{:?}", scene.notes).replace(file, "FILE"),
                Err(error) => error.to_string().replace(file, "FILE"),
            }
        };
        let denied = DenyAll::default();
        for [existing, missing] in [
            ["Cargo.toml", "None.toml"],
            ["scenes/textures/grid.png", "scenes/textures/none.png"],
            ["scenes/meshes/../textures/grid.png", "scenes/none/../textures/grid.png"],
            [existing_image.to_str().unwrap(), "/none/color.png"],
            [root.join("scenes/meshes/knot.obj").to_str().unwrap(), "/none.obj"],
            ["../../../../../../etc/passwd", "../../../../../../none/none"],
        ] {
            let message = error(existing, denied.clone());
            assert_eq!(message, error(missing, denied.clone()), "{template}");
            assert!(message.contains("FILE"), "{message}");
        }
        let requested = denied.0.lock().unwrap();
        assert!(
            requested
                .iter()
                .all(|name| !name.starts_with('/') && !name.contains("..")),
            "{requested:?}"
        );
        assert!(requested.contains(&"Cargo.toml".to_owned()), "{requested:?}");
    }
    // All files that a model refers to are requested from the source.
    let denied = DenyAll::default();
    let options = LoadOptions::new().with_name("models/a").with_source(denied.clone());
    let scene = Scene::from_slice(&folder.read("a.obj"), SceneFormat::Mesh(MeshFormat::Obj), &options).unwrap();
    assert!(format!("{:?}", scene.notes).contains("A.MTL"), "{:?}", scene.notes);
    assert!(denied.0.lock().unwrap().contains(&"models/A.MTL".to_owned()));
    let options = LoadOptions::new().with_source(denied.clone());
    let error = Scene::from_slice(&folder.read("g.gltf"), SceneFormat::Gltf, &options).unwrap_err();
    assert!(error.to_string().starts_with("scene.gltf: buffers[0].uri: "), "{error}");
    // A symbolic link in the served folder to a file outside of it is refused.
    #[cfg(unix)]
    {
        let served = TestFolder::with_file("s.toml", "");
        std::os::unix::fs::symlink(&existing_image, served.path("link.png")).unwrap();
        let source = FolderFiles::new(served.folder());
        assert!(source.read("link.png").is_err() && !source.contains("link.png"));
        assert!(source.read("s.toml").is_ok() && source.contains("s.toml"));
        assert!(source.read("../s.toml").is_err() && source.read("").is_err());
    }
}

/// Images and meshes of the options, overrides, and files of a source apply to the same scene.
#[test]
fn assets_and_overrides_apply_together() {
    let text = format!(
        "{CAMERA}textures.a = {{ type = 'image', file = 'a' }}
textures.b = {{ type = 'image', file = 'color.png' }}
materials.a = {{ type = 'diffuse', color = {{ texture = 'a' }} }}
materials.b = {{ type = 'diffuse', color = {{ texture = 'b' }} }}
[[shapes]]
type = 'mesh'
material = 'a'
file = 'triangle'
[[shapes]]
type = 'sphere'
material = 'b'
center = [0, 0, 1]
radius = 1
"
    );
    let triangle = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    let mesh = Mesh::from_slice(triangle, MeshFormat::Obj, None).unwrap();
    let image = Image {
        width: 1,
        height: 1,
        texels: Texels::Bytes(Encoding::Srgb, vec![[1, 2, 3]]),
    };
    let options = LoadOptions::new()
        .with_overrides(small_overrides())
        .with_mesh("triangle", mesh)
        .with_image("a", image)
        .with_source(files_of(models().folder()));
    let scene = Scene::from_slice(text.as_bytes(), SceneFormat::Toml, &options).unwrap();
    assert_eq!((scene.width, scene.shapes.len(), scene.textures.len()), (8, 2, 2));
    assert_eq!(scene.files, [PathBuf::from("color.png")]);
    // A description also uses the files of a source.
    let description = Description::parse(&text, "s.toml").unwrap();
    let mut assets = Assets::from_source(files_of(models().folder()));
    let error = description.validate_with(&assets).unwrap_err().to_string();
    assert!(
        error.contains("cannot be read: there is no such file in memory"),
        "{error}"
    );
    assets
        .images
        .insert("a".to_owned(), Arc::new(Image::clone(&image_of(&scene))));
    let mesh = Mesh::from_slice(triangle, MeshFormat::Obj, None).unwrap();
    assets.meshes.insert("triangle".to_owned(), Arc::new(mesh));
    assert_eq!(description.validate_with(&assets).unwrap().textures, scene.textures);
}

fn image_of(scene: &Scene) -> Arc<Image> {
    match &scene.textures[0].kind {
        wgray::scene::TextureKind::Image { image, .. } => Arc::clone(image),
        other => panic!("{other:?}"),
    }
}

#[test]
fn errors_of_files_have_a_kind_and_a_source() {
    use std::error::Error as _;
    use wgray::scene::SceneError;
    let error_without_files = |text: &str, overrides: Overrides| {
        let options = LoadOptions::new().with_overrides(overrides).with_source(NoFiles);
        Scene::from_slice(format!("{CAMERA}{text}").as_bytes(), SceneFormat::Toml, &options).unwrap_err()
    };
    let strict = Overrides {
        strict: true,
        ..Overrides::default()
    };
    let texture = "textures.a = { type = 'image', file = 'wood.png' }
materials.a = { type = 'diffuse', color = { texture = 'a' } }
shapes = [{ type = 'sphere', material = 'a', center = [0, 0, 0], radius = 1 }]";
    for error in [
        error_without_files("shapes = [{ type = 'mesh', file = 'wood.png' }]", Overrides::default()),
        error_without_files(texture, strict),
    ] {
        let SceneError::Invalid { problem, .. } = &error else {
            panic!("{error:?}");
        };
        let file = problem.file.as_ref().unwrap();
        assert_eq!((file.name.as_str(), file.kind), ("wood.png", io::ErrorKind::NotFound));
    }
    let error = Scene::load("none.toml").unwrap_err();
    let source = error.source().and_then(|source| source.downcast_ref::<io::Error>());
    assert_eq!(source.map(io::Error::kind), Some(io::ErrorKind::NotFound));
    let error = Scene::load("none.glb").unwrap_err();
    assert!(error.source().is_some(), "{error:?}");
    let error = Mesh::load(Path::new("none.obj"), None).unwrap_err();
    assert!(error.source().is_some(), "{error:?}");
    let error = wgray::Error::from(Scene::load("none.toml").unwrap_err());
    assert!(error.source().is_some(), "{error:?}");
}

#[test]
fn meshes_in_memory_equal_files() {
    let folder = models();
    for (name, format) in [
        ("a.obj", MeshFormat::Obj),
        ("b.ply", MeshFormat::Ply),
        ("c.stl", MeshFormat::Stl),
    ] {
        for normals in [None, Some(Normals::Smooth), Some(Normals::Flat)] {
            let file = Mesh::load(&folder.path(name), normals).unwrap();
            let memory = Mesh::from_slice(&folder.read(name), format, normals).unwrap();
            assert_eq!(memory.positions, file.positions);
            assert_eq!(memory.triangles, file.triangles);
            assert_eq!((&memory.normals, &memory.uvs), (&file.normals, &file.uvs));
            assert_eq!(memory.center, file.center);
        }
        for bad in [&b""[..], b"v", b"\0\xff\xfe", b"ply\n"] {
            let error = Mesh::from_slice(bad, format, None).unwrap_err();
            assert!(error.to_string().starts_with("mesh"), "{error}");
        }
    }
    let mesh = Mesh::from_slice(&folder.read("a.obj"), MeshFormat::Obj, None).unwrap();
    assert!(mesh.libraries[0].problem.is_some() && mesh.center == DVec3::ZERO || mesh.libraries.len() == 1);
}

#[test]
fn images_are_decoded_from_bytes() {
    let mut encoded = BTreeMap::new();
    let color = image::RgbImage::from_fn(3, 2, |x, y| image::Rgb([100, 50 * x as u8, 200 * y as u8]));
    for (name, format) in [
        ("png", image::ImageFormat::Png),
        ("webp", image::ImageFormat::WebP),
        ("jpeg", image::ImageFormat::Jpeg),
    ] {
        let mut bytes = Cursor::new(Vec::new());
        color.write_to(&mut bytes, format).unwrap();
        encoded.insert(name, bytes.into_inner());
    }
    for name in ["png", "webp"] {
        let image = Image::from_slice(&encoded[name], None).unwrap();
        let texels: Vec<[u8; 3]> = color.pixels().map(|pixel| pixel.0).collect();
        assert_eq!((image.width, image.height), (3, 2));
        assert_eq!(image.texels, Texels::Bytes(Encoding::Srgb, texels));
        let linear = Image::from_slice(&encoded[name], Some(Encoding::Linear)).unwrap();
        assert!(matches!(linear.texels, Texels::Bytes(Encoding::Linear, _)));
    }
    assert_eq!(Image::from_slice(&encoded["jpeg"], None).unwrap().width, 3);
    for (bytes, expected) in [
        (&b""[..], "must be a PNG"),
        (b"hello", "must be a PNG"),
        (&encoded["png"][..40], "damaged or truncated"),
    ] {
        let error = Image::from_slice(bytes, None).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// A writer that fails after `left` bytes, like a full disk.
struct FullDisk {
    left: usize,
}

impl Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.left = self.left.checked_sub(bytes.len()).ok_or(io::ErrorKind::StorageFull)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for FullDisk {
    fn seek(&mut self, _: SeekFrom) -> io::Result<u64> {
        Ok(0)
    }
}

#[test]
fn images_written_to_memory_equal_files() {
    let scene = Scene::load_with(sources::path("scenes/materials.toml"), &small_overrides()).unwrap();
    let options = Options {
        device: Device::Cpu,
        aovs: vec![Aov::Depth, Aov::Normal],
        ..Options::default()
    };
    let picture = wgray::render(&scene, &options).unwrap();
    let folder = TestFolder::with_file("a", "");
    let save_options = [
        SaveOptions::default(),
        SaveOptions {
            bit_depth: BitDepth::Sixteen,
            exr_type: ExrType::Half,
            metadata: Metadata {
                pairs: vec![("Software".to_owned(), "test".to_owned())],
            },
            ..SaveOptions::default()
        },
    ];
    for options in &save_options {
        for format in Format::ALL {
            let path = folder.path(&format!("a.{}", format.name()));
            picture.save_with(&path, options).unwrap();
            let mut memory = Cursor::new(Vec::new());
            picture.write_to(&mut memory, format, options).unwrap();
            assert!(memory.into_inner() == std::fs::read(&path).unwrap(), "{format:?}");
            let layer_files = files(&path, format, picture.aovs());
            for (file, layer) in layer_files[1..].iter().zip(picture.aovs()) {
                let mut memory = Cursor::new(Vec::new());
                picture.write_layer_to(*layer, &mut memory, options).unwrap();
                assert!(
                    memory.into_inner() == std::fs::read(file).unwrap(),
                    "{}",
                    file.display()
                );
            }
            for left in [0, 20, 60] {
                let error = picture.write_to(FullDisk { left }, format, options).unwrap_err();
                assert!(!error.to_string().is_empty());
            }
        }
    }
    // Content before the image is kept.
    let mut alone = Cursor::new(Vec::new());
    let mut appended = Cursor::new(b"content".to_vec());
    appended.set_position(7);
    for writer in [&mut alone, &mut appended] {
        picture
            .write_to(&mut *writer, Format::Exr, &SaveOptions::default())
            .unwrap();
        writer.write_all(b"end").unwrap();
    }
    assert_eq!(appended.into_inner(), [&b"content"[..], alone.get_ref()].concat());
    // Exif tags of a JPEG are limited.
    let with_text = |length: usize| SaveOptions {
        metadata: Metadata {
            pairs: vec![("note".to_owned(), "x".repeat(length))],
        },
        ..SaveOptions::default()
    };
    for (length, fits) in [(65_000, true), (65_535, false), (70_000, false), (131_000, false)] {
        let mut jpeg = Cursor::new(Vec::new());
        let written = picture.write_to(&mut jpeg, Format::Jpeg, &with_text(length));
        assert_eq!(written.is_ok(), fits, "{length}");
        match written {
            Ok(()) => assert!(image::load_from_memory(jpeg.get_ref()).is_ok()),
            Err(error) => assert!(error.to_string().contains("exceed the limit of a JPEG"), "{error}"),
        }
    }
    let denoised = wgray::render(
        &scene,
        &Options {
            device: Device::Cpu,
            aovs: vec![Aov::Denoised],
            ..Options::default()
        },
    );
    let layer = denoised
        .unwrap()
        .write_layer_to(Aov::Denoised, Cursor::new(Vec::new()), &SaveOptions::default());
    assert!(layer.is_err_and(|error| error.to_string().contains("use write_to")));
    let missing = picture.write_layer_to(Aov::Albedo, Cursor::new(Vec::new()), &SaveOptions::default());
    assert_eq!(
        missing.unwrap_err().to_string(),
        "the image does not have the layer albedo"
    );
}

#[test]
fn asset_sources_contain_only_their_files() {
    let files = MemoryFiles::new()
        .with("./a/b.png", *b"x")
        .with("/c", *b"x")
        .with("../d", *b"x");
    assert!(files.contains("a/b.png") && !files.contains("/c"));
    assert_eq!(format!("{files:?}"), "{\"a/b.png\": 1}");
    assert_eq!(NoFiles.read("a").unwrap_err().kind(), io::ErrorKind::NotFound);
    assert!(!NoFiles.contains("a") && NoFiles.find_ignoring_case("a").is_none());
    assert_eq!(files.find_ignoring_case("A/B.png").as_deref(), Some("a/b.png"));
    let folder = FolderFiles::new(sources::path("."));
    assert_eq!(
        folder.find_ignoring_case("Scenes/cornell.TOML").as_deref(),
        Some("scenes/cornell.toml")
    );
    assert_eq!(folder.find_ignoring_case("Scenes/none.toml"), None);
}
