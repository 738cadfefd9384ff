//! Textures, mirrors and glass: GPU and CPU agree, bit for bit on software Vulkan.

use std::collections::BTreeSet;
use std::path::Path;

use wgray_render::gpu::{Device, Gpu, Options, Rounding};
use wgray_render::job::WorkSplit;
use wgray_trace::records::Packed;

use super::{cpu_picture, scene, write_exr, write_png};
use crate::meshes::procedural::Sheet;
use crate::pictures::{RenderMode, backend, film, reference, whole};
use crate::render::compare;
use crate::{adapter, sources};

fn scenes(folder: &Path) -> Vec<(String, Packed)> {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut scenes = Vec::new();
    for name in ["ground-grid", "balls-checker", "textures", "mirror-glass"] {
        let text = std::fs::read_to_string(project.join(format!("{name}.toml"))).unwrap();
        let text = text
            .replace("width = 400", "width = 90")
            .replace("height = 400", "height = 70");
        scenes.push((
            name.to_string(),
            scene(&text.replace("height = 300", "height = 70"), &project),
        ));
    }
    write_exr(&folder.join("f.exr"), 37, 11, |x, y| {
        [x as f32 / 9.0, y as f32, ((x * y) % 7) as f32 * 0.1]
    });
    write_png(&folder.join("b.png"), 21, 64, |x, y| {
        [(x * 12) as u8, (y * 4) as u8, ((x ^ y) * 9) as u8]
    });
    for filter in ["nearest", "bilinear", "trilinear", "ewa"] {
        for wrap in ["repeat", "clamp", "mirror"] {
            scenes.push((format!("{filter} {wrap}"), scene(&every_shape(filter, wrap), folder)));
        }
    }
    scenes.push(("meshes".to_string(), scene(&meshes(folder), folder)));
    scenes
}

/// Returns a scene with smooth meshes that have normal maps and cyclic or mirrored texture coordinates.
fn meshes(folder: &Path) -> String {
    let cyclic = Sheet::torus(12, 8);
    let mut mirrored = cyclic.clone();
    for [u, v] in &mut mirrored.uvs {
        (*u, *v) = ((*u - 0.5).abs() * 3.0, *v + *u);
    }
    for (name, sheet) in [("cyclic.obj", cyclic), ("mirrored.obj", mirrored)] {
        std::fs::write(folder.join(name), sheet.obj()).unwrap();
    }
    let head = every_shape("ewa", "repeat");
    format!(
        "{head}
        [[shapes]]
        type = 'mesh'
        file = 'cyclic.obj'
        material = 'float'
        scale = [0.5, -0.7, 0.4]
        rotate = [70, 20, 10]
        translate = [0.6, 0.8, 1.3]
        [[shapes]]
        type = 'mesh'
        file = 'mirrored.obj'
        material = 'glass'
        scale = 0.6
        rotate = [30, -20, 0]
        translate = [-0.7, -0.6, 1.4]
        [[shapes]]
        type = 'mesh'
        file = 'mirrored.obj'
        material = 'float'
        normals = 'flat'
        scale = 0.5
        translate = [0.2, -1, 0.3]"
    )
}

fn every_shape(filter: &str, wrap: &str) -> String {
    format!(
        "image = {{ width = 48, height = 36 }}
        camera = {{ position = [0.2, -4, 1.3], look_at = [0, 0, 0.5], fov = 45 }}
        [render]
        ambient = [0.3, 0.3, 0.3]
        background = [0.2, 0.3, 0.4]
        pixel_samples = {{ pattern = 'random', count = 3 }}
        [textures.f]
        type = 'image'
        file = 'f.exr'
        filter = '{filter}'
        wrap = '{wrap}'
        scale = [1.7, -2.3]
        rotate = 20
        offset = [-0.4, 0.3]
        max_anisotropy = 5
        [textures.b]
        type = 'image'
        file = 'b.png'
        filter = '{filter}'
        wrap = '{wrap}'
        scale = [3, 2]
        [textures.n]
        type = 'image'
        file = 'b.png'
        encoding = 'linear'
        filter = '{filter}'
        wrap = '{wrap}'
        [materials.float]
        type = 'phong'
        ambient = {{ texture = 'b' }}
        diffuse = {{ texture = 'f' }}
        specular = {{ texture = 'n' }}
        normal_map = {{ texture = 'n', strength = 0.4 }}
        [materials.plain]
        type = 'phong'
        color = {{ texture = 'b' }}
        [materials.glass]
        type = 'glass'
        ior = 1.4
        tint = {{ texture = 'b' }}
        normal_map = {{ texture = 'n', strength = 0.1 }}
        [[lights]]
        type = 'point'
        position = [-2, -3, 4]
        color = [1, 1, 1]
        [[shapes]]
        type = 'plane'
        material = 'float'
        point = [0, 0, 0]
        normal = [0, 0, 1]
        tangent = [1, 0.3, 0]
        [[shapes]]
        type = 'ellipsoid'
        material = 'float'
        center = [-0.8, 0.3, 0.6]
        a = [0.5, 0.1, 0]
        b = [0, 0.6, 0.1]
        c = [0.1, 0, 0.5]
        [[shapes]]
        type = 'sphere'
        material = 'glass'
        center = [0.5, -0.6, 0.5]
        radius = 0.5
        [[shapes]]
        type = 'tetrahedron'
        material = 'plain'
        vertices = [[0.6, 0.4, 0.1], [1.8, 0.3, 0.1], [1.1, 1.3, 0.1], [1.2, 0.6, 1.2]]"
    )
}

#[test]
fn images_agree_on_gpu_and_cpu() {
    if adapter::device().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let small_dispatches = WorkSplit {
        band_pixels: 700,
        samples_per_dispatch: Some(1),
        rows_per_dispatch: Some(3),
    };
    for (i, (name, scene)) in scenes(folder.path()).into_iter().enumerate() {
        let expected = reference(&scene);
        let colors: BTreeSet<_> = expected.means().map(|pixel| pixel.map(f32::to_bits)).collect();
        assert!(colors.len() > 100, "{name}: the image is almost constant");
        let modes = [
            (RenderMode::Buffers, small_dispatches),
            (RenderMode::Baked, WorkSplit::default()),
        ];
        // Every other scene also as constants, because kernels take long to compile.
        for (mode, work_split) in modes.into_iter().take(1 + (i + 1) % 2) {
            let found = film(&mut *backend(&scene, mode), &scene, whole(&scene), &work_split);
            let problem = compare(mode, &scene, &found, &expected);
            assert!(problem.is_ok(), "{name}, {mode:?}: {}", problem.unwrap_err());
        }
    }
}

/// Negative control: a render without ray differentials.
#[test]
fn a_wrong_footprint_is_detected() {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let text = std::fs::read_to_string(project.join("textures.toml")).unwrap();
    let mut scene = scene(
        &text
            .replace("width = 400", "width = 60")
            .replace("height = 300", "height = 45"),
        &project,
    );
    let expected = cpu_picture(&scene);
    scene.specialization.differentials = 0;
    let without_differentials = cpu_picture(&scene);
    assert!(
        expected
            .iter()
            .zip(&without_differentials)
            .filter(|(a, b)| a != b)
            .count()
            > 100
    );
}

#[test]
fn texels_in_several_buffers_give_the_same_image() {
    let Some(device) = adapter::device() else { return };
    let folder = tempfile::tempdir().unwrap();
    let scenes = scenes(folder.path());
    let (_, scene) = scenes.iter().find(|(name, _)| name == "ewa repeat").unwrap();
    let mut small_device = device.clone();
    small_device.info.largest_binding = 4096;
    assert!(
        scene.textures.texels.len() > 3 * 1024,
        "the texels fit in fewer buffers"
    );
    let new_gpu = |small_device: &Device, baked: bool| {
        let exact = device.info.exact.then_some(Rounding::Device);
        Gpu::new(small_device, scene, sources::shaders(), Options { exact, baked })
    };
    let expected = reference(scene);
    for (mode, baked) in [(RenderMode::Baked, true), (RenderMode::Buffers, false)] {
        let found = film(
            &mut new_gpu(&small_device, baked).unwrap(),
            scene,
            whole(scene),
            &WorkSplit::default(),
        );
        let problem = compare(mode, scene, &found, &expected);
        assert!(problem.is_ok(), "{mode:?}: {}", problem.unwrap_err());
    }
    small_device.info.storage_buffers = 9;
    let error = new_gpu(&small_device, false).err().unwrap().to_string();
    assert!(
        error.contains("the scene's images need 0.0 MiB; the limit is 2 x 0.0 MiB"),
        "{error}"
    );
    assert!(error.ends_with("the CPU has no such limit"), "{error}");
}
