//! Tests of materials from MTL files, and of warnings about these materials.

use std::fs;
use std::path::PathBuf;

use glam::DVec3;
use tempfile::TempDir;

use crate::{Color, Geometry, Material, Reflection, Scene, SceneError, TextureKind};

const SCENE: &str = "image = { width = 4, height = 4 }\n\
                     camera = { position = [0, -9, 0], look_at = [0, 0, 0], fov = 40 }\n\
                     [materials.own]\ntype = 'mirror'\n";
const MESH: &str = "[[shapes]]\ntype = 'mesh'\nfile = 'in/a.obj'\n";

/// Triangles with texture coordinates: red, red with a group name, and blue.
const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 2 4\nv 0 0 5\nv 1 0 5\nv 0 2 9\nv 0 0 6\nv 1 0 6\nv 0 2 8\nvt 0 0\n\
                   usemtl red\nf 1/1 2/1 3/1\ng door\nf 4/1 5/1 6/1\nusemtl blue\nf 7/1 8/1 9/1\n";

struct TestFolder(TempDir);

impl TestFolder {
    /// Creates a folder with a mesh, its MTL file and images.
    fn new(mtl: &str) -> TestFolder {
        let folder = TestFolder(tempfile::tempdir().unwrap());
        fs::create_dir(folder.path("in")).unwrap();
        folder.write("in/a.obj", OBJ);
        folder.write("in/a.mtl", mtl);
        let image = image::RgbImage::from_pixel(2, 1, image::Rgb([255, 0, 0]));
        image.save(folder.path("in/red wood.png")).unwrap();
        fs::write(folder.path("in/damaged.png"), "no image").unwrap();
        image.save(folder.path("outside.png")).unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn scene(&self, shapes: &str) -> Result<Scene, SceneError> {
        let name = self.path("s.toml");
        Scene::parse(&format!("{SCENE}{shapes}"), &name.display().to_string())
    }
}

fn names(scene: &Scene, shape: usize) -> Vec<&str> {
    match &scene.shapes[shape].geometry {
        Geometry::Mesh { materials, .. } => materials.iter().map(|i| scene.material_names[*i].as_str()).collect(),
        other => panic!("shape {shape} is not a mesh: {other:?}"),
    }
}

fn material_named<'a>(scene: &'a Scene, name: &str) -> &'a Material {
    let i = scene
        .material_names
        .iter()
        .position(|material_name| material_name == name)
        .unwrap();
    &scene.materials[i]
}

/// Returns the ambient, diffuse and specular factors and the exponent.
fn phong(material: &Material) -> (Color, Color, Color, f64) {
    assert_eq!((material.emission, material.normal_map), (Color::BLACK, None));
    match material.reflection {
        Reflection::Phong {
            ambient,
            diffuse,
            specular,
            shininess,
        } => (ambient, diffuse, specular, shininess),
        ref other => panic!("not a Phong material: {other:?}"),
    }
}

const TWO_MATERIALS: &str = "newmtl red\nKa 1 1 1\nKd 0.5 0.25 0\nKs 0.125\nNs 96.5\nd 1\nKe 0 0 0\nnewmtl unused\nKe 1 1 1\n\
                   newmtl blue\nKs 0.5 0.5 0.5\nillum 1\n";

#[test]
fn groups_have_the_materials_of_their_file() {
    let folder = TestFolder::new(TWO_MATERIALS);
    let scene = folder.scene(MESH).unwrap();
    assert_eq!(scene.notes, Vec::<String>::new());
    assert_eq!(scene.material_names, ["own", "red", "blue"]);
    assert_eq!(names(&scene, 0), ["red", "red", "blue"]);
    let plain = |r, g, b| Color::Plain(DVec3::new(r, g, b));
    let red = plain(0.5, 0.25, 0.0);
    assert_eq!(
        phong(material_named(&scene, "red")),
        (red, red, plain(0.125, 0.125, 0.125), 96.5)
    );
    // `Kd` and `Ns` have the defaults of MTL files, and the illumination model 1 has no highlights.
    let gray = plain(0.8, 0.8, 0.8);
    assert_eq!(
        phong(material_named(&scene, "blue")),
        (gray, gray, plain(0.0, 0.0, 0.0), 16.0)
    );
}

#[test]
fn materials_of_the_scene_override_those_of_the_file() {
    let folder = TestFolder::new(TWO_MATERIALS);
    let materials = |keys: &str| {
        let scene = folder.scene(&format!("{MESH}{keys}")).unwrap();
        names(&scene, 0).join(" ")
    };
    assert_eq!(materials("material = 'own'"), "own own own");
    assert_eq!(materials("materials = { door = 'own' }"), "red own own");
    assert_eq!(materials("materials = { red = 'own' }"), "own own blue");
    // Unused materials are neither loaded nor validated.
    folder.write("in/a.mtl", "newmtl red\nKe 1 1 1\nmap_Kd none.png\nnewmtl blue\n");
    let scene = folder.scene(&format!("{MESH}materials = {{ red = 'own' }}")).unwrap();
    assert_eq!((scene.material_names.len(), scene.textures.len()), (2, 0));
    assert_eq!(scene.notes, Vec::<String>::new());
}

#[test]
fn instances_share_materials() {
    let folder = TestFolder::new(TWO_MATERIALS);
    folder.write("in/b.obj", &OBJ.replace("red", "unused"));
    let meshes = "[meshes.a]\nfile = 'in/a.obj'\n[meshes.b]\nfile = 'in/b.obj'\n";
    let instances =
        "[[instances]]\nmesh = 'a'\n[[instances]]\nmesh = 'a'\ntranslate = [1, 2, 3]\n[[instances]]\nmesh = 'b'\n";
    let scene = folder.scene(&format!("{meshes}{instances}")).unwrap();
    assert_eq!(scene.material_names, ["own", "red", "blue", "unused"]);
    assert_eq!(names(&scene, 1), ["red", "red", "blue"]);
    assert_eq!(names(&scene, 2), ["unused", "unused", "blue"]);
    assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
}

#[test]
fn maps_are_textures() {
    let folder = TestFolder::new("newmtl red\nmap_Kd red wood.png\nnewmtl blue\nmap_Kd ..\\in\\red wood.png\n");
    folder.write(
        "in/far.mtl",
        "newmtl red\nmap_Kd C:\\far\\away\\red wood.png\nnewmtl blue\nmap_Kd /far/red wood.png\n",
    );
    folder.write("in/far.obj", &OBJ.replace("a.mtl", "far.mtl"));
    let absolute_paths = folder.scene(&MESH.replace("a.obj", "far.obj")).unwrap();
    assert_eq!((absolute_paths.textures.len(), &absolute_paths.notes[..]), (1, &[][..]));
    let scene = folder.scene(MESH).unwrap();
    let texture = Color::Texture(0);
    let (ambient, diffuse, ..) = phong(material_named(&scene, "red"));
    assert_eq!((ambient, diffuse), (texture, texture));
    assert_eq!(phong(material_named(&scene, "blue")).1, texture);
    let TextureKind::Image { image, .. } = &scene.textures[0].kind else {
        panic!("{:?}", scene.textures)
    };
    assert_eq!((scene.textures.len(), image.width), (1, 2));
    let names: Vec<_> = (scene.files.iter())
        .map(|file| file.strip_prefix(folder.0.path()).unwrap())
        .collect();
    assert!(names.contains(&"in/red wood.png".as_ref()), "{names:?}");
    assert!(
        names.contains(&"in/a.mtl".as_ref()) && names.contains(&"in/a.obj".as_ref()),
        "{names:?}"
    );
}

#[test]
fn invalid_and_unsupported_statements_cause_one_warning() {
    for (mtl, warning) in [
        (
            "Kd -1 0 0",
            "\"red\": Kd: each of [-1, 0, 0] must be from 0 to 1e6; [0, 0, 0] is used instead",
        ),
        (
            "Kd 255 0 0.5",
            "\"red\": Kd: [255, 0, 0.5] is used, but colors of MTL files are from 0 to 1",
        ),
        (
            "Ks 0 2e6 0",
            "\"red\": Ks: each of [0, 2e6, 0] must be from 0 to 1e6; [0, 1e6, 0] is used instead",
        ),
        (
            "Ks 1\nNs 0",
            "\"red\": Ns: 0 must be from 1e-6 to 1e6; 1e-6 is used instead",
        ),
        (
            "Ks 1\nNs 1e9",
            "\"red\": Ns: 1e9 must be from 1e-6 to 1e6; 1e6 is used instead",
        ),
        ("Ke 0 0 2", "\"red\": Ke: ignored: it needs integrator = \"path\""),
        ("Tr 0.5", "\"red\": d: ignored: it needs integrator = \"path\""),
        (
            "map_bump b.png",
            "\"red\": map_Bump: ignored: it needs integrator = \"path\"",
        ),
        ("map_Kd none.png", "\"red\": map_Kd: \"in/none.png\" cannot be read: "),
        (
            "map_Kd damaged.png",
            "\"red\": map_Kd: \"in/damaged.png\" must be a PNG, JPEG, WebP, KTX2, EXR or HDR file; Kd is used instead",
        ),
        ("map_Kd ../../outside.png", "\"red\": map_Kd: \"in/../../outside.png\" "),
        ("map_Kd -s 2 red wood.png", "\"red\": option \"-s\" of map_Kd: ignored"),
        ("disp a.png", "\"red\": disp: ignored"),
    ] {
        let folder = TestFolder::new(&format!("newmtl red\n{mtl}\n# all of it\nnewmtl blue\n"));
        let scene = folder.scene(MESH).unwrap();
        let [note] = &scene.notes[..] else {
            panic!("{:?}", scene.notes)
        };
        // The warning is about the last line of `mtl`.
        let line = 1 + mtl.lines().count();
        let start = format!("in/a.mtl:{line}: material {warning}");
        assert!(note.message.starts_with(&start), "{note}\n{start}");
        let folder = TestFolder::new(&format!("newmtl red\n{mtl}\nnewmtl blue\n{mtl}\n"));
        let notes = folder.scene(MESH).unwrap().notes;
        assert!(
            notes.len() == 1 && notes[0].message.ends_with(" (and 1 more material)"),
            "{notes:?}"
        );
    }
    // Keywords without an effect, and a line without a file name, cause no warning.
    let folder = TestFolder::new(
        "newmtl red\nKs 0\nNs 0\nd 1\nTr 0\nKe 0 0 0\nmap_Ka a.png\nPr 1\nNi 1.5\nillum 2\nnewmtl blue\n",
    );
    folder.write("in/a.obj", &format!("mtllib\n{OBJ}"));
    assert_eq!(folder.scene(MESH).unwrap().notes, Vec::<String>::new());
}

#[test]
fn a_map_needs_texture_coordinates() {
    let folder = TestFolder::new("newmtl red\nKd 1 0 0\nmap_Kd red wood.png\nnewmtl blue\n");
    folder.write("in/a.obj", &OBJ.replace("/1", ""));
    let scene = folder.scene(MESH).unwrap();
    let warning = "in/a.mtl:3: material \"red\": map_Kd: the mesh has no texture coordinates; Kd is used instead";
    assert_eq!(scene.notes, [warning]);
    assert_eq!(phong(material_named(&scene, "red")).1, Color::Plain(DVec3::X));
}

#[test]
fn undefined_materials_are_replaced_by_a_default() {
    let folder = TestFolder::new("newmtl red\n");
    let note = |details: &str| format!("in/a.obj: undefined {details}; a gray material is used instead");
    let notes = |keys: &str| folder.scene(&format!("{MESH}{keys}")).unwrap().notes;
    let scene = folder.scene(MESH).unwrap();
    assert_eq!(
        scene.notes,
        [note("material \"blue\": missing from the MTL files of the mesh")]
    );
    assert_eq!(names(&scene, 0), ["red", "red", "default"]);
    let gray = Color::Plain(DVec3::splat(0.8));
    assert_eq!(phong(material_named(&scene, "default")).1, gray);
    fs::remove_file(folder.path("in/a.mtl")).unwrap();
    let start = "in/a.obj: undefined materials \"blue\", \"red\": the MTL file \"a.mtl\" cannot be read: ";
    let found = notes("");
    assert!(found.len() == 1 && found[0].message.starts_with(start), "{found:?}");
    folder.write("in/a.obj", &OBJ.replace("mtllib a.mtl\n", ""));
    let expected = note("material \"blue\": the file names no MTL file");
    assert_eq!(notes("materials = { red = 'own' }"), [expected]);
    // A group without a material causes no warning.
    folder.write("in/a.obj", &OBJ.replace("mtllib a.mtl\n", "").replace("usemtl ", "g "));
    assert_eq!(notes(""), Vec::<String>::new());
    let many = (0..20).fold(OBJ.replace("mtllib a.mtl\n", ""), |text, i| {
        format!("{text}usemtl m{i}\nf 1/1 2/1 {}/1\n", i % 6 + 4)
    });
    folder.write("in/a.obj", &many);
    let details = "materials \"blue\", \"m0\", \"m1\", \"m10\", \"m11\", \"m12\", \"m13\", \"m14\" and 14 more: \
                   the file names no MTL file";
    let found = notes("");
    assert!(found.iter().any(|found| *found == note(details)), "{found:?}");
}

#[test]
fn changed_mtl_files_are_read_again() {
    let folder = TestFolder::new("newmtl red\nKd 1 0 0\nnewmtl blue\n");
    let first = folder.scene(MESH).unwrap();
    folder.write("in/a.mtl", "newmtl red\nKd 0.25 0 0\nnewmtl blue\n");
    let second = folder.scene(MESH).unwrap();
    assert_eq!(phong(material_named(&first, "red")).1, Color::Plain(DVec3::X));
    assert_eq!(phong(material_named(&second, "red")).1, Color::Plain(DVec3::X * 0.25));
}
