//! `wgray info`: counts, memory, the selected device and errors.

use serde_json::Value;

use super::{NO_DRIVER, SCENE, TestFolder, project_scene};

fn info(folder: &TestFolder, arguments: &[&str]) -> Value {
    let command = [&["info", "--json"], arguments].concat();
    let result = folder.run(&command);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""), "{arguments:?}");
    serde_json::from_str(&result.stdout).expect("JSON")
}

#[test]
fn info_counts_shapes_memory_and_samples() {
    let folder = TestFolder::new();
    let small = info(&folder, &["small.toml", "--device", "cpu"]);
    assert_eq!(
        (&small["picture"]["width"], &small["picture"]["light_samples"]),
        (&10.into(), &4.into())
    );
    assert_eq!(small["shapes"]["count"], 2);
    assert_eq!(
        small["shapes"]["by_type"],
        serde_json::json!({ "sphere": 1, "plane": 1 })
    );
    assert_eq!(
        small["bounds"],
        serde_json::json!([[-0.8, -0.8, 0.19999999999999996], [0.8, 0.8, 1.8]])
    );
    assert_eq!(
        (&small["materials"]["count"], &small["textures"]),
        (&1.into(), &serde_json::json!([]))
    );
    assert_eq!(small["lights"]["by_type"], serde_json::json!({ "rectangle": 1 }));
    assert_eq!(
        (&small["device"]["name"], &small["device"]["why"]),
        (&"cpu".into(), &"requested".into())
    );
    assert_eq!(
        (&small["kernel"]["compiled"], &small["memory"]["scene_on_device"]),
        (&false.into(), &Value::Null)
    );
    // 10 x 6 pixels of four 32-bit floats.
    assert_eq!(
        (&small["memory"]["film"], &small["memory"]["bands"]),
        (&960.into(), &1.into())
    );
    let large = info(
        &folder,
        &[
            "small.toml",
            "--device",
            "cpu",
            "--size",
            "65536x65536",
            "-D",
            "render.seed=3",
        ],
    );
    assert!(large["memory"]["bands"].as_u64() > Some(100), "{large}");
    assert_eq!(large["picture"]["seed"], 3);
    let tube = info(&folder, &[&project_scene("twisted-tube.toml"), "--device", "cpu"]);
    let shapes = &tube["shapes"];
    assert!(
        shapes["triangles"].as_u64() > shapes["mesh_triangles"].as_u64(),
        "the second instance of the mesh is not counted: {shapes}"
    );
    assert_eq!(
        shapes["triangles"], shapes["instanced_triangles"],
        "triangles outside of meshes are counted: {shapes}"
    );
    // The former names of two keys.
    assert_eq!(shapes["instanced_triangles"], shapes["placed_mesh_triangles"]);
    assert_eq!(tube["picture"]["max_samples"], tube["picture"]["most_samples"]);
    assert!(tube["picture"]["max_samples"].as_u64() > Some(0));
    let memory = &tube["memory"];
    assert_eq!(
        memory["total"].as_u64(),
        memory["scene"]
            .as_u64()
            .zip(memory["film"].as_u64())
            .map(|(scene, film)| scene + film)
    );
    // The primitives of this scene are four triangles, five rectangles, an ellipsoid and an area light.
    let cornell_info = info(&folder, &[&project_scene("cornell.toml"), "--device", "cpu"]);
    let shapes = &cornell_info["shapes"];
    assert_eq!(
        ["triangles", "mesh_triangles", "instanced_triangles", "primitives"].map(|key| shapes[key].as_u64()),
        [Some(4), Some(0), Some(0), Some(11)]
    );
    assert_eq!(shapes["by_type"]["ellipsoid"], 1);
    let cornell = ["info", &project_scene("cornell.toml"), "--device", "cpu"];
    let details = [
        "    primitives  11, including 1 area light\n",
        "    kernel      none",
        "    sampling    pattern ",
    ];
    let brief = folder.run(&cornell).stdout;
    let verbose = folder.run(&[&cornell[..], &["--verbose"]].concat()).stdout;
    for text in details {
        assert!(verbose.contains(text) && !brief.contains(text), "{text}: {verbose}");
    }
    for text in [
        "    materials   ",
        "    bounds      [",
        "    memory      ",
        "    camera      perspective at [",
    ] {
        assert!(verbose.contains(text) && brief.contains(text), "{text}: {brief}");
    }
    assert_eq!(tube["textures"][0]["type"], "checker");
    assert!(tube["kernel"]["uses"].as_array().unwrap().contains(&"BVH".into()));
    assert!(folder.files().is_empty(), "a file was written");
}

#[test]
fn info_selects_the_same_device_as_a_render() {
    let folder = TestFolder::new();
    let cornell = project_scene("cornell.toml");
    for scene in ["small.toml", &cornell, &project_scene("twisted-tube.toml")] {
        let workload = [scene, "--spp", "1", "--size", "8x6"];
        let planned = info(&folder, &workload);
        let outputs = ["-o", "a.png", "--stats", "stats.json", "-q"];
        let result = folder.run(&[&["render"][..], &workload, &outputs].concat());
        assert_eq!(result.code, 0, "{}", result.stderr);
        let stats: Value = serde_json::from_slice(&folder.read("stats.json")).unwrap();
        assert_eq!(planned["device"]["name"], stats["device"], "{scene}");
        assert!(
            planned["device"]["why"].as_str().is_some_and(|why| why.len() > 10),
            "{planned}"
        );
    }
    let large = info(&folder, &[&cornell, "--spp", "65536"]);
    assert_ne!(large["device"]["name"], "cpu", "{large}");
    let reason = large["device"]["why"].as_str().unwrap();
    assert!(
        !reason.contains("no GPU") || reason.contains(" the CPU is predicted to take "),
        "{reason}"
    );
    let on_gpu = info(&folder, &["small.toml", "--device", "gpu"]);
    assert!(on_gpu["memory"]["scene_on_device"].as_u64() > Some(500), "{on_gpu}");
    assert_eq!(on_gpu["kernel"]["entry"], "render");
    let result = folder.run_with(&["info", "small.toml"], &NO_DRIVER);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(
        result.stdout.contains("    device      cpu: no Vulkan"),
        "{}",
        result.stdout
    );
    let result = folder.run_with(&["info", "small.toml", "--device", "gpu"], &NO_DRIVER);
    assert_eq!((result.code, result.stdout.as_str()), (4, ""));
    let result = folder.run(&["info", "small.toml", "--device", "nonesuch"]);
    assert_eq!((result.code, result.stdout.as_str()), (4, ""));
}

#[test]
fn info_describes_empty_and_large_scenes_and_rejects_invalid_ones() {
    let folder = TestFolder::new();
    let head = SCENE.split("[materials.gray]").next().unwrap();
    folder.write("empty.toml", head);
    let result = folder.run(&["info", "empty.toml"]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(
        result.stdout.contains("shapes      0\n")
            && result.stdout.contains("bounds      none")
            && result
                .stdout
                .contains("warning     the scene has no shapes; the image shows only the background\n"),
        "{}",
        result.stdout
    );
    let mut text = format!("{head}[materials.gray]\ntype = 'phong'\ncolor = [1, 1, 1]\n");
    for i in 0..100_000 {
        let x = i % 1000;
        text += &format!("[[shapes]]\ntype = 'sphere'\nmaterial = 'gray'\ncenter = [{x}, {i}, 0]\nradius = 0.4\n");
    }
    folder.write("many.toml", &text);
    let many = info(&folder, &["many.toml", "--device", "cpu"]);
    assert_eq!(
        (&many["shapes"]["count"], &many["shapes"]["primitives"]),
        (&100_000.into(), &100_000.into())
    );
    assert_eq!(many["bounds"][1], serde_json::json!([999.4, 99_999.4, 0.4]));
    folder.write("bad.toml", &SCENE.replace("radius = 0.8", "radius = -1"));
    let result = folder.run(&["info", "bad.toml", "--json"]);
    assert_eq!((result.code, result.stdout.as_str()), (3, ""));
    assert!(
        result.stderr.contains("shapes[0].radius: -1 must be"),
        "{}",
        result.stderr
    );
}
