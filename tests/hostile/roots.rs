//! No reference in a file can open files outside of the asset root.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::seeds::{START, triangle};
use super::{Ran, render, render_with};

/// Contents that no message may contain.
const SECRET: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n# secret\n";

/// Creates a scene folder, with secret files next to it.
fn place() -> (tempfile::TempDir, PathBuf) {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("scene");
    fs::create_dir_all(folder.join("below")).unwrap();
    for name in ["secret.obj", "secret.bin", "secret.png", "secret.mtl", "secret.glb"] {
        fs::write(outer.path().join(name), SECRET).unwrap();
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("..", folder.join("up")).unwrap();
        for ending in ["obj", "bin", "png", "mtl", "glb"] {
            let link = folder.join(format!("link.{ending}"));
            std::os::unix::fs::symlink(format!("../secret.{ending}"), link).unwrap();
        }
    }
    (outer, folder)
}

fn names(outer: &Path, ending: &str) -> Vec<String> {
    let secret = outer.join(format!("secret.{ending}"));
    let absolute = secret.display().to_string();
    vec![
        format!("../secret.{ending}"),
        format!("below/../../secret.{ending}"),
        format!("./.././secret.{ending}"),
        format!("up/secret.{ending}"),
        format!("link.{ending}"),
        absolute.clone(),
        format!("//{absolute}"),
        format!("file://{absolute}"),
        format!("%2e%2e/secret.{ending}"),
        format!("..%2fsecret.{ending}"),
        format!("..\\\\secret.{ending}"),
        format!("C:\\\\secret.{ending}"),
        format!("\\\\\\\\host\\\\share\\\\secret.{ending}"),
        format!("http://localhost/secret.{ending}"),
        format!("..\\u0000/secret.{ending}"),
    ]
}

fn is_refused(ran: &Ran, name: &str) {
    assert_eq!(ran.code, 3, "{name}: {}", ran.said);
    assert!(
        !ran.said.contains("secret\n") && !ran.said.contains("# secret"),
        "{name}: {}",
        ran.said
    );
    let rules = [
        "lies outside of",
        "cannot be read",
        "must be a relative path",
        "it must be a relative path",
        "must lie in",
        "must not leave the folder",
        "must be in the folder",
    ];
    assert!(rules.iter().any(|rule| ran.said.contains(rule)), "{name}: {}", ran.said);
}

#[test]
fn a_scene_reads_no_file_outside_the_asset_root() {
    let (outer, folder) = place();
    let material = "\n[materials.m]\ntype = 'diffuse'\ncolor = [1, 1, 1]\n";
    let sphere = "[[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n";
    let texts: [(&str, String); 5] = [
        (
            "png",
            format!("{material}{sphere}[textures.t]\ntype = 'image'\nfile = \"FILE\"\n"),
        ),
        ("png", format!("{material}{sphere}[environment]\nfile = \"FILE\"\n")),
        (
            "obj",
            format!("{material}[[shapes]]\ntype = 'mesh'\nmaterial = 'm'\nfile = \"FILE\"\n"),
        ),
        (
            "obj",
            format!("{material}{sphere}[meshes.a]\nfile = \"FILE\"\n[[instances]]\nmesh = 'a'\nmaterial = 'm'\n"),
        ),
        (
            "glb",
            format!("{material}{sphere}[[shapes]]\ntype = 'gltf'\nfile = \"FILE\"\n"),
        ),
    ];
    for (ending, text) in texts {
        for name in names(outer.path(), ending) {
            fs::write(folder.join("a.toml"), START.to_owned() + &text.replace("FILE", &name)).unwrap();
            is_refused(&render_with(&folder, "a.toml", &["--strict"]), &name);
        }
    }
    // `--asset-root` permits shared files.
    let shared = format!("{START}{material}[[shapes]]\ntype = 'mesh'\nmaterial = 'm'\nfile = '../secret.obj'\n");
    fs::write(folder.join("a.toml"), shared).unwrap();
    assert_eq!(render(&folder, "a.toml").code, 3);
    let ran = render_with(&folder, "a.toml", &["--asset-root", ".."]);
    assert_eq!(ran.code, 0, "{}", ran.said);
    let ran = render_with(&folder, "a.toml", &["--asset-root", "below"]);
    assert_eq!(ran.code, 3, "{}", ran.said);
}

#[test]
fn a_gltf_file_reads_no_file_outside_the_asset_root() {
    let (outer, folder) = place();
    let (json, binary) = triangle();
    for ending in ["bin", "png"] {
        for name in names(outer.path(), ending) {
            let name: String = serde_json::from_str(&format!("\"{name}\"")).unwrap();
            let mut json = json.clone();
            let coded: String = binary.iter().map(|byte| format!("%{byte:02x}")).collect();
            json["buffers"][0]["uri"] = json!(format!("data:,{coded}"));
            match ending {
                "bin" => json["buffers"][0]["uri"] = json!(name),
                _ => {
                    json["images"] = json!([{ "uri": name }]);
                    json["textures"] = json!([{ "source": 0 }]);
                    json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
                    json["meshes"][0]["primitives"][0]["material"] = json!(0);
                }
            }
            fs::write(folder.join("a.gltf"), json.to_string()).unwrap();
            is_refused(&render_with(&folder, "a.gltf", &["--strict"]), &name);
            // The same in a scene.
            fs::write(
                folder.join("a.toml"),
                format!("{START}[[shapes]]\ntype = 'gltf'\nfile = 'a.gltf'\n"),
            )
            .unwrap();
            is_refused(&render_with(&folder, "a.toml", &["--strict"]), &name);
        }
    }
}

#[test]
fn a_mesh_reads_no_file_outside_the_asset_root() {
    let (outer, folder) = place();
    fs::write(
        folder.join("a.toml"),
        format!("{START}[[shapes]]\ntype = 'mesh'\nfile = 'a.obj'\n"),
    )
    .unwrap();
    let mesh =
        |library: &str| format!("mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
    let material = "newmtl a\nKd 1 1 1\n";
    fs::write(folder.join("in.mtl"), material).unwrap();
    fs::write(folder.join("a.obj"), mesh("in.mtl")).unwrap();
    assert_eq!(render(&folder, "a.toml").code, 0);
    fs::write(outer.path().join("secret.mtl"), material).unwrap();
    for name in names(outer.path(), "mtl") {
        fs::write(folder.join("a.obj"), mesh(&name)).unwrap();
        is_refused(&render_with(&folder, "a.toml", &["--strict"]), &name);
        let ran = render(&folder, "a.toml");
        assert!(
            ran.code == 0 && ran.said.contains("cannot be read"),
            "{name}: {}",
            ran.said
        );
    }
    for name in names(outer.path(), "png") {
        fs::write(folder.join("a.obj"), mesh("in.mtl")).unwrap();
        fs::write(folder.join("in.mtl"), format!("{material}map_Kd {name}\n")).unwrap();
        let ran = render(&folder, "a.toml");
        // A warning without `--strict`.
        assert!(
            ran.said.contains("map_Kd") && !ran.said.contains("# secret"),
            "{name}: {}",
            ran.said
        );
        assert!(ran.code == 0 || ran.code == 3, "{name}: {}", ran.said);
        assert!(
            !ran.said.contains("must be a PNG") && !ran.said.contains("is damaged"),
            "{name} is read: {}",
            ran.said
        );
    }
}
