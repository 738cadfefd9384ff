//! No reference in a file can open files outside of the asset root.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::seeds::{SCENE_START, triangle};
use super::{RunResult, render, render_with};

/// Contents of the secret files, which no message may contain.
const SECRET: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n# secret\n";

/// Creates a scene folder with secret files next to it and, on Unix, links that lead to them.
fn create_folders() -> (tempfile::TempDir, PathBuf) {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("scene");
    fs::create_dir_all(folder.join("below")).unwrap();
    for name in ["secret.obj", "secret.bin", "secret.png", "secret.mtl", "secret.glb"] {
        fs::write(outer.path().join(name), SECRET).unwrap();
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("..", folder.join("up")).unwrap();
        for extension in ["obj", "bin", "png", "mtl", "glb"] {
            let link = folder.join(format!("link.{extension}"));
            std::os::unix::fs::symlink(format!("../secret.{extension}"), link).unwrap();
        }
    }
    (outer, folder)
}

/// Returns names that lead from the scene folder to the secret file.
fn escaping_names(outer: &Path, extension: &str) -> Vec<String> {
    let secret = outer.join(format!("secret.{extension}"));
    let absolute = secret.display().to_string();
    vec![
        format!("../secret.{extension}"),
        format!("below/../../secret.{extension}"),
        format!("./.././secret.{extension}"),
        format!("up/secret.{extension}"),
        format!("link.{extension}"),
        absolute.clone(),
        format!("//{absolute}"),
        format!("file://{absolute}"),
        format!("%2e%2e/secret.{extension}"),
        format!("..%2fsecret.{extension}"),
        format!("..\\\\secret.{extension}"),
        format!("C:\\\\secret.{extension}"),
        format!("\\\\\\\\host\\\\share\\\\secret.{extension}"),
        format!("http://localhost/secret.{extension}"),
        format!("..\\u0000/secret.{extension}"),
    ]
}

fn assert_rejected(result: &RunResult, name: &str) {
    assert_eq!(result.code, 3, "{name}: {}", result.output);
    assert!(
        !result.output.contains("secret\n") && !result.output.contains("# secret"),
        "{name}: {}",
        result.output
    );
    let rules = [
        "lies outside of",
        "which is outside the asset root",
        "cannot be read",
        "must be a relative path",
        "it must be a relative path",
        "must lie in",
        "must not leave the folder",
        "must be in the folder",
    ];
    assert!(
        rules.iter().any(|rule| result.output.contains(rule)),
        "{name}: {}",
        result.output
    );
}

#[test]
fn a_scene_reads_no_file_outside_the_asset_root() {
    let (outer, folder) = create_folders();
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
    for (extension, text) in texts {
        for name in escaping_names(outer.path(), extension) {
            fs::write(
                folder.join("a.toml"),
                SCENE_START.to_owned() + &text.replace("FILE", &name),
            )
            .unwrap();
            assert_rejected(&render_with(&folder, "a.toml", &["--strict"]), &name);
        }
    }
    // `--asset-root` permits shared files.
    let shared = format!("{SCENE_START}{material}[[shapes]]\ntype = 'mesh'\nmaterial = 'm'\nfile = '../secret.obj'\n");
    fs::write(folder.join("a.toml"), shared).unwrap();
    assert_eq!(render(&folder, "a.toml").code, 3);
    let result = render_with(&folder, "a.toml", &["--asset-root", ".."]);
    assert_eq!(result.code, 0, "{}", result.output);
    let result = render_with(&folder, "a.toml", &["--asset-root", "below"]);
    assert_eq!(result.code, 3, "{}", result.output);
}

#[test]
fn a_gltf_file_reads_no_file_outside_the_asset_root() {
    let (outer, folder) = create_folders();
    let (json, binary) = triangle();
    for extension in ["bin", "png"] {
        for name in escaping_names(outer.path(), extension) {
            let name: String = serde_json::from_str(&format!("\"{name}\"")).unwrap();
            let mut json = json.clone();
            let encoded: String = binary.iter().map(|byte| format!("%{byte:02x}")).collect();
            json["buffers"][0]["uri"] = json!(format!("data:,{encoded}"));
            match extension {
                "bin" => json["buffers"][0]["uri"] = json!(name),
                _ => {
                    json["images"] = json!([{ "uri": name }]);
                    json["textures"] = json!([{ "source": 0 }]);
                    json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
                    json["meshes"][0]["primitives"][0]["material"] = json!(0);
                }
            }
            fs::write(folder.join("a.gltf"), json.to_string()).unwrap();
            assert_rejected(&render_with(&folder, "a.gltf", &["--strict"]), &name);
            // A scene that imports this glTF file is rejected, too.
            fs::write(
                folder.join("a.toml"),
                format!("{SCENE_START}[[shapes]]\ntype = 'gltf'\nfile = 'a.gltf'\n"),
            )
            .unwrap();
            assert_rejected(&render_with(&folder, "a.toml", &["--strict"]), &name);
        }
    }
}

#[test]
fn a_mesh_reads_no_file_outside_the_asset_root() {
    let (outer, folder) = create_folders();
    fs::write(
        folder.join("a.toml"),
        format!("{SCENE_START}[[shapes]]\ntype = 'mesh'\nfile = 'a.obj'\n"),
    )
    .unwrap();
    let mesh =
        |library: &str| format!("mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
    let material = "newmtl a\nKd 1 1 1\n";
    fs::write(folder.join("in.mtl"), material).unwrap();
    fs::write(folder.join("a.obj"), mesh("in.mtl")).unwrap();
    assert_eq!(render(&folder, "a.toml").code, 0);
    fs::write(outer.path().join("secret.mtl"), material).unwrap();
    for name in escaping_names(outer.path(), "mtl") {
        fs::write(folder.join("a.obj"), mesh(&name)).unwrap();
        assert_rejected(&render_with(&folder, "a.toml", &["--strict"]), &name);
        let result = render(&folder, "a.toml");
        assert!(
            result.code == 0 && result.output.contains("cannot be read"),
            "{name}: {}",
            result.output
        );
    }
    for name in escaping_names(outer.path(), "png") {
        fs::write(folder.join("a.obj"), mesh("in.mtl")).unwrap();
        fs::write(folder.join("in.mtl"), format!("{material}map_Kd {name}\n")).unwrap();
        let result = render(&folder, "a.toml");
        // Without `--strict`, a texture that cannot be read causes only a warning.
        assert!(
            result.output.contains("map_Kd") && !result.output.contains("# secret"),
            "{name}: {}",
            result.output
        );
        assert!(result.code == 0 || result.code == 3, "{name}: {}", result.output);
        assert!(
            !result.output.contains("must be a PNG") && !result.output.contains("is damaged"),
            "{name} is read: {}",
            result.output
        );
    }
}
