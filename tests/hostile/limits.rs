//! Small files whose rendering could need minutes or gigabytes are rejected with a message that names the limit, or
//! they render within the limits of [`run`].

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::seeds::{SCENE_START, TEXTURE, container, ktx2, triangle};
use super::{RunResult, render, render_with, run};

fn render_glb(json: &Value, binary: &[u8]) -> RunResult {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.glb"), container(json, binary)).unwrap();
    render(folder.path(), "a.glb")
}

fn assert_rejected(json: &Value, binary: &[u8], message: &str) {
    let result = render_glb(json, binary);
    assert!(
        result.code == 3 && result.output.contains(message),
        "{}: {}",
        result.code,
        result.output
    );
}

/// Returns a float accessor without a buffer view: all of its values are 0.
fn zeros(count: u32, accessor_type: &str) -> Value {
    json!({ "componentType": 5126, "count": count, "type": accessor_type })
}

fn push(list: &mut Value, value: Value) {
    list.as_array_mut().unwrap().push(value);
}

#[test]
fn instances_are_in_proportion_to_the_file() {
    let (mut json, binary) = triangle();
    let instanced_node = |accessor| json!([{ "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": accessor } } } }]);
    push(&mut json["accessors"], zeros(1 << 20, "VEC3"));
    push(&mut json["accessors"], zeros(1 << 16, "VEC3"));
    json["nodes"] = instanced_node(1);
    assert_rejected(&json, &binary, "nodes[0]: a file of ");
    assert_rejected(&json, &binary, " bytes must have at most 656");
    json["nodes"] = instanced_node(2);
    assert_eq!(render_glb(&json, &binary).code, 0);
    // Nodes without instances need no such limit: the length of the JSON text bounds their number.
    json["nodes"] = json!(vec![json!({ "mesh": 0 }); 100_000]);
    assert_eq!(render_glb(&json, &binary).code, 0);
}

#[test]
fn the_total_number_of_triangles_is_limited() {
    let count = 40_000;
    let corners = (0..3 * count).flat_map(|i| [i % 173, i * 7 % 131, i % 11]);
    let binary: Vec<u8> = corners.flat_map(|x| (x as f32).to_le_bytes()).collect();
    let (mut json, _) = triangle();
    json["buffers"][0]["byteLength"] = json!(binary.len());
    json["bufferViews"][0]["byteLength"] = json!(binary.len());
    json["accessors"][0]["count"] = json!(3 * count);
    let set_mesh_count = |json: &mut Value, count: usize| {
        json["meshes"] = json!(vec![
            json!({ "primitives": [{ "attributes": { "POSITION": 0 } }] });
            count
        ]);
        json["nodes"] = (0..count).map(|i| json!({ "mesh": i })).collect();
    };
    set_mesh_count(&mut json, 1000);
    assert_rejected(&json, &binary, " triangles");
    set_mesh_count(&mut json, 20);
    assert_eq!(render_glb(&json, &binary).code, 0);
}

#[test]
fn repeated_reads_of_accessors_are_limited() {
    let (mut json, binary) = triangle();
    push(&mut json["accessors"], zeros(1 << 22, "VEC3"));
    push(&mut json["accessors"], zeros(1 << 20, "MAT4"));
    let rule = "counted once per read";
    let mut many_meshes = json.clone();
    many_meshes["meshes"] = json!(vec![
        json!({ "primitives": [{ "attributes": { "POSITION": 1 }, "mode": 6 }] });
        400
    ]);
    many_meshes["nodes"] = (0..400).map(|i| json!({ "mesh": i })).collect();
    assert_rejected(&many_meshes, &binary, "a file of ");
    let mut morphed = json.clone();
    morphed["meshes"] = json!([{
        "weights": vec![1; 1000],
        "primitives": [{ "attributes": { "POSITION": 1 }, "targets": vec![json!({ "POSITION": 1 }); 1000] }],
    }]);
    assert_rejected(&morphed, &binary, rule);
    let mut skinned = json.clone();
    skinned["skins"] = json!(vec![json!({ "joints": [0], "inverseBindMatrices": 2 }); 200]);
    skinned["nodes"] = (0..200).map(|i| json!({ "mesh": 0, "skin": i })).collect();
    assert_rejected(&skinned, &binary, rule);
    push(&mut json["accessors"], zeros(1 << 22, "SCALAR"));
    json["animations"] = json!([{
        "samplers": [{ "input": 3, "output": 1 }],
        "channels": vec![json!({ "sampler": 0, "target": { "node": 0, "path": "translation" } }); 1000],
    }]);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.glb"), container(&json, &binary)).unwrap();
    let result = super::render_with(folder.path(), "a.glb", &["--time", "0.5"]);
    assert!(
        result.code == 3 && result.output.contains(rule),
        "{}: {}",
        result.code,
        result.output
    );
}

#[test]
fn compressed_views_are_in_proportion() {
    let (mut json, mut binary) = triangle();
    // The stream consists only of its header; the buffer view declares 4 GiB.
    binary.push(0xa0);
    json["buffers"][0]["byteLength"] = json!(binary.len());
    json["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
    let (stride, count) = (256, 1 << 24);
    let compression = json!({ "buffer": 0, "byteOffset": 36, "byteLength": 1, "byteStride": stride, "count": count, "mode": "ATTRIBUTES" });
    let view = json!({ "buffer": 0, "byteLength": stride * count as u64, "extensions": { "EXT_meshopt_compression": compression } });
    push(&mut json["bufferViews"], view);
    assert_rejected(&json, &binary, "bytes of decompressed buffer views");
}

#[test]
fn sparse_files_are_refused_by_their_length() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (name, length) in [
        ("a.bin", 9_u64 << 30),
        ("a.obj", 9 << 30),
        ("a.png", 1 << 30),
        ("a.toml", 9 << 30),
        ("a.glb", 9 << 30),
    ] {
        fs::File::create(folder.join(name)).unwrap().set_len(length).unwrap();
    }
    let (mut json, _) = triangle();
    json["buffers"][0]["uri"] = json!("a.bin");
    fs::write(folder.join("b.gltf"), json.to_string()).unwrap();
    let material = "[materials.m]\ntype = 'diffuse'\ncolor = [1, 1, 1]\n";
    let mesh = format!("{SCENE_START}{material}[[shapes]]\ntype = 'mesh'\nmaterial = 'm'\nfile = 'a.obj'\n");
    fs::write(folder.join("mesh.toml"), mesh).unwrap();
    let texture = "[textures.t]\ntype = 'image'\nfile = 'a.png'\n[materials.m]\ntype = 'diffuse'\ncolor = { texture = 't' }\n\
        [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n";
    fs::write(folder.join("texture.toml"), format!("{SCENE_START}{texture}")).unwrap();
    for name in ["b.gltf", "a.toml", "a.glb", "mesh.toml", "texture.toml"] {
        let result = render(folder, name);
        assert!(
            result.code == 3 && result.output.contains("larger than"),
            "{name}: {}: {}",
            result.code,
            result.output
        );
    }
}

#[test]
fn shapes_that_repeat_a_file_are_limited() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (mut json, binary) = triangle();
    json["nodes"] = json!(vec![json!({ "mesh": 0 }); 2000]);
    fs::write(folder.join("a.glb"), container(&json, &binary)).unwrap();
    let shape = "[[shapes]]\ntype = 'gltf'\nfile = 'a.glb'\n";
    fs::write(folder.join("a.toml"), SCENE_START.to_owned() + &shape.repeat(20_000)).unwrap();
    let result = render(folder, "a.toml");
    assert!(
        result.code == 3 && result.output.contains("together must import at most 262144"),
        "{}",
        result.output
    );
    // 3000 shapes that import the same file load within the time limit: finding unique names for their materials does
    // not take quadratic time.
    json["nodes"] = json!([{ "mesh": 0 }]);
    fs::write(folder.join("a.glb"), container(&json, &binary)).unwrap();
    fs::write(folder.join("a.toml"), SCENE_START.to_owned() + &shape.repeat(3000)).unwrap();
    let result = render(folder, "a.toml");
    assert_eq!(result.code, 0, "{}", result.output);
}

/// Returns a PNG of zeros, encoded row by row.
fn zero_png(width: u32, height: u32, color: png::ColorType, depth: png::BitDepth) -> Vec<u8> {
    use std::io::Write as _;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Balanced);
    let mut writer = encoder.write_header().unwrap();
    let mut stream = writer.stream_writer().unwrap();
    let bits = color.samples() * depth as usize;
    let row = vec![0; (width as usize * bits).div_ceil(8)];
    (0..height).for_each(|_| stream.write_all(&row).unwrap());
    stream.finish().unwrap();
    drop(writer);
    bytes
}

#[test]
fn images_that_decode_to_a_thousand_times_their_size_are_rejected() {
    // A PNG file of 65 KB with 67 million texels.
    let image = zero_png(8192, 8192, png::ColorType::Grayscale, png::BitDepth::Eight);
    let (mut json, mut binary) = triangle();
    let start = binary.len();
    binary.extend(&image);
    json["buffers"][0]["byteLength"] = json!(binary.len());
    push(
        &mut json["bufferViews"],
        json!({ "buffer": 0, "byteOffset": start, "byteLength": image.len() }),
    );
    let new_material = |i: usize| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": i } } });
    json["images"] = json!(vec![json!({ "bufferView": 1 }); 50]);
    json["textures"] = (0..50).map(|i| json!({ "source": i })).collect();
    json["materials"] = (0..50).map(new_material).collect();
    let primitive = |i: usize| json!({ "attributes": { "POSITION": 0 }, "material": i });
    json["meshes"][0]["primitives"] = (0..50).map(primitive).collect();
    assert_rejected(&json, &binary, "texels in total; for files of ");
    // A PNG file of 2 MB decodes to 2 GB. The limit applies although large images of models are downsampled.
    let rgba16 = zero_png(16_384, 16_384, png::ColorType::Rgba, png::BitDepth::Sixteen);
    binary.truncate(start);
    binary.extend(&rgba16);
    json["buffers"][0]["byteLength"] = json!(binary.len());
    json["bufferViews"][1]["byteLength"] = json!(rgba16.len());
    json["meshes"][0]["primitives"] = json!([primitive(0)]);
    json["materials"] = json!([new_material(0)]);
    assert_rejected(&json, &binary, "; the limit for a file of ");
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("deep.png"), &rgba16).unwrap();
    let result = run(folder.path(), &["diff", "deep.png", "deep.png"]);
    assert!(
        result.code == 1 && result.output.contains("; the limit for a file of "),
        "{}",
        result.output
    );
}

/// The first file has 24,000 bytes and would decode to 1.5 GB; the headers of the others declare too many texels.
#[test]
fn ktx2_files_are_refused_by_their_headers() {
    let folder = tempfile::tempdir().unwrap();
    let assert_rejected = |bytes: &[u8], rule: &str| {
        fs::write(folder.path().join("a.ktx2"), bytes).unwrap();
        fs::write(
            folder.path().join("a.toml"),
            SCENE_START.to_owned() + &TEXTURE.replace("FILE", "a.ktx2"),
        )
        .unwrap();
        let result = render_with(folder.path(), "a.toml", &["--strict"]);
        assert!(
            result.code == 3 && result.output.contains(rule),
            "{}: {}",
            result.code,
            result.output
        );
        assert!(result.seconds < 5.0, "{}", result.seconds);
    };
    // RFC 8878, section 3.1.1: a window of 1 KiB, 8 raw bytes, and a block of 12,000 sequences without literals that
    // copy 131,074 bytes each (codes 0, 0 and 52).
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 0];
    frame.extend([8 << 3, 0, 0]);
    frame.extend(b"ABCDEFGH");
    let count = 12_000_u32;
    let mut block = vec![0, 128 + (count >> 8) as u8, count as u8, 0b0101_0100, 0, 0, 52];
    block.extend(vec![255; 2 * count as usize]);
    block.push(1);
    frame.extend(&((block.len() as u32) << 3 | 2 << 1 | 1).to_le_bytes()[..3]);
    frame.extend(block);
    let mut bytes = ktx2("zstandard-48x20");
    let level = u64::from_le_bytes(bytes[80..88].try_into().unwrap());
    bytes.truncate(level as usize);
    bytes.extend(&frame);
    bytes[88..96].copy_from_slice(&(frame.len() as u64).to_le_bytes());
    assert_rejected(&bytes, "its Zstandard data cannot be decompressed");
    let mut bytes = ktx2("etc1s-48x20");
    bytes[20..28].copy_from_slice(&[0, 64, 0, 0, 0, 32, 0, 0]);
    assert_rejected(&bytes, "; the limit for a file of ");
    bytes[20..28].copy_from_slice(&[1, 64, 0, 0, 1, 0, 0, 0]);
    assert_rejected(&bytes, "must have at most 16384 texels along a side");
}

#[test]
fn windows_of_exr_files_are_refused_by_their_headers() {
    let folder = tempfile::tempdir().unwrap();
    let valid = folder.path().join("valid.exr");
    image::Rgb32FImage::new(8, 6).save(&valid).unwrap();
    let valid = fs::read(valid).unwrap();
    let window_offset = |name: &str| {
        let window = [name.as_bytes(), b"\0box2i\0\x10\0\0\0"].concat();
        let found = valid.windows(window.len()).position(|bytes| bytes == window);
        found.expect("a window") + window.len()
    };
    let (data, display) = (window_offset("dataWindow"), window_offset("displayWindow"));
    let scene = "image = { width = 8, height = 6 }\ncamera = { position = [0, -4, 1], look_at = [0, 0, 0], fov = 40 }\n\
                 [textures.t]\ntype = 'image'\nfile = 'a.exr'\n[materials.m]\ntype = 'phong'\ncolor = { texture = 't' }\n\
                 [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n";
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    for (window, indices, value, code, rule) in [
        // The data window may exceed the display window.
        (data, 0..1, 0, 0, ""),
        (data, 0..1, -(1 << 28), 3, "must have at most 16384 texels along a side"),
        (data, 2..3, 1 << 28, 3, "must have at most 16384 texels along a side"),
        // The display window may exceed the data window.
        (display, 2..4, 999, 0, ""),
        (
            display,
            2..4,
            3999,
            3,
            "declares 4000 x 4000 texels and stores 48; the missing texels need ",
        ),
    ] {
        let mut file = valid.clone();
        for index in indices {
            let offset = window + 4 * index;
            file[offset..offset + 4].copy_from_slice(&i32::to_le_bytes(value));
        }
        fs::write(folder.path().join("a.exr"), file).unwrap();
        let result = super::render(folder.path(), "s.toml");
        assert!(
            result.code == code && result.output.contains(rule),
            "{value}: {} {}",
            result.code,
            result.output
        );
    }
}

#[test]
fn pipes_and_devices_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    super::seeds::write_referenced_files(folder);
    for name in ["pipe", "pipe.gltf", "pipe.obj", "pipe.png"] {
        let created = std::process::Command::new("mkfifo").arg(folder.join(name)).status();
        assert!(created.unwrap().success());
    }
    let render_plain = ["render", "plain.toml", "--device", "cpu", "-o", "out.png"];
    for name in ["pipe", "/dev/zero"] {
        for (arguments, codes) in [
            (vec!["check", name], [3]),
            (vec!["diff", name, "t.png"], [1]),
            (vec!["merge", name, "-o", "out.exr"], [1]),
            ([&render_plain[..], &["--checkpoint", name, "--resume"]].concat(), [2]),
            (
                [&render_plain[..], &["--environment", name, "--integrator", "path"]].concat(),
                [2],
            ),
        ] {
            let result = run(folder, &arguments);
            assert!(
                codes.contains(&result.code),
                "{arguments:?}: {}: {}",
                result.code,
                result.output
            );
        }
    }
    assert_eq!(run(folder, &["check", "pipe.gltf"]).code, 3);
    for (file, text) in [
        (
            "pipe.obj",
            "[materials.m]\ntype = 'diffuse'\ncolor = [1, 1, 1]\n[[shapes]]\ntype = 'mesh'\nmaterial = 'm'\nfile = 'FILE'\n",
        ),
        ("pipe.png", "[textures.t]\ntype = 'image'\nfile = 'FILE'\n"),
        ("pipe.png", "[environment]\nfile = 'FILE'\n"),
    ] {
        fs::write(
            folder.join("a.toml"),
            format!("{SCENE_START}{}", text.replace("FILE", file)),
        )
        .unwrap();
        let result = run(folder, &["check", "a.toml"]);
        assert!(
            result.code == 3 && result.output.contains("must be a file"),
            "{}",
            result.output
        );
    }
    // The pipes of a shell have a writer, so they can be read.
    let result = shell(
        folder,
        "\"$0\" check <(cat plain.toml) && \"$0\" check /dev/stdin < plain.toml && cat plain.toml | \"$0\" check /dev/stdin",
    );
    assert_eq!(result.matches("ok: 8 x 6 pixels").count(), 3, "{result}");
}

fn shell(folder: &Path, script: &str) -> String {
    let mut command = std::process::Command::new("bash");
    command
        .args(["-c", script, env!("CARGO_BIN_EXE_wgray")])
        .current_dir(folder);
    let out = command.output().unwrap();
    String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned()
}

#[test]
fn deeply_nested_and_unterminated_values_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let depth = 100_000;
    let dotted_key = vec!["a"; depth].join(".");
    let toml_rule = "max recursion depth";
    let json_rule = "lists and objects must be nested at most 127 levels deep";
    for (name, text, message) in [
        (
            "a.toml",
            format!("x = {}{}", "[".repeat(depth), "]".repeat(depth)),
            toml_rule,
        ),
        (
            "a.toml",
            format!("x = {}1{}", "{a = ".repeat(depth), "}".repeat(depth)),
            toml_rule,
        ),
        (
            "a.toml",
            format!("b = 1\n{dotted_key} = 1"),
            "a.toml:1:1: recursion limit",
        ),
        ("a.toml", format!("[{dotted_key}]"), "a.toml:1:1: recursion limit"),
        ("a.toml", "[".repeat(depth), "a.toml:1:"),
        (
            "a.toml",
            format!("x = \"{}", "a".repeat(3_000_000)),
            "invalid basic string",
        ),
        ("a.json", "[".repeat(depth), json_rule),
        ("a.gltf", format!("{{\"x\":{}", "[".repeat(depth)), json_rule),
        ("a.gltf", format!("{{\"asset\":{}", "{\"a\":".repeat(depth)), json_rule),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        let result = run(folder.path(), &["check", name]);
        assert!(
            result.code == 3 && result.output.contains(message),
            "{name}: expected {message}: {}: {}",
            result.code,
            result.output
        );
    }
}

#[test]
fn control_characters_are_escaped_in_messages() {
    // `run` panics if the output contains control characters.
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    super::seeds::write_referenced_files(folder);
    for text in [
        "a\u{1b}[31m=1",
        "a=\u{7f}\u{9b}31m",
        "\u{202e}a=1",
        "[[shapes]]\ntype=\"\\u009b\\u202ex\\nerror: b\"\n",
        "[materials.\"a\\u001b[31m\"]\ntype=\"nope\\u001b\"\n",
        "[[shapes]]\ntype=\"mesh\"\nfile=\"a\\u001b[31m\\n.obj\"\n",
    ] {
        fs::write(folder.join("a.toml"), format!("{SCENE_START}{text}")).unwrap();
        let result = run(folder, &["check", "a.toml"]);
        assert_eq!(
            (result.code, result.output.lines().count()),
            (3, 1),
            "{text:?}: {}",
            result.output
        );
        assert!(!result.output.contains('\u{202e}'), "{}", result.output);
    }
    let name = "a\u{1b}[31m\nerror: b.toml";
    fs::copy(folder.join("plain.toml"), folder.join(name)).unwrap();
    let result = run(folder, &["check", name]);
    assert!(
        result.code == 0 && result.output.starts_with("a\\u{1b}[31m\\nerror: b.toml: ok"),
        "{}",
        result.output
    );
    assert_eq!(result.output.lines().count(), 1);
}
