//! Averaged layers and alpha: sums, closed-form values, and equal bits on all backends.

use glam::{Vec3, Vec4};
use wgray::scene::ViewSettings;
use wgray::{Aov, ChannelValues, Description, Device, Options, Picture};
use wgray_image::Region;
use wgray_render::gpu::{Gpu, Options as GpuOptions};
use wgray_render::job::WorkSplit;
use wgray_trace::film::{Film, FilmLayout, Layer};
use wgray_trace::records::Packed;

use crate::pictures::{RenderMode, backend, crop, differing, exact_modes, film, first_hits, reference, render, whole};
use crate::scenes::parse;
use crate::{adapter, sources};

pub const SCENE: &str = r#"
image = { width = 24, height = 16 }
camera = { position = [0, -5, 1], look_at = [0, 0, 1], fov = 40 }
[environment]
color = [0.2, 0.3, 0.5]
[render]
integrator = "path"
max_depth = 4
pixel_samples = { pattern = "sobol", count = 8 }
[materials.gray]
type = "diffuse"
color = [0.5, 0.4, 0.3]
[materials.mirror]
type = "mirror"
tint = [0.9, 0.8, 0.7]
[materials.light]
type = "diffuse"
color = [0.1, 0.1, 0.1]
emission = [0.4, 0.8, 0.2]
[[lights]]
type = "rectangle"
center = [0, -1, 4]
size = [2, 2]
normal = [0, 0, -1]
tangent = [1, 0, 0]
color = [3, 3, 3]
[[shapes]]
type = "sphere"
material = "gray"
center = [-0.9, 0, 1]
radius = 0.8
[[shapes]]
type = "sphere"
material = "mirror"
center = [0.9, 0, 1]
radius = 0.8
[[shapes]]
type = "sphere"
material = "light"
center = [0, -1, 0.4]
radius = 0.3
[[shapes]]
type = "rectangle"
material = "gray"
center = [0, 0, 0]
size = [4, 4]
normal = [0, 0, 1]
tangent = [1, 0, 0]
"#;

/// Returns the text of the scene with `settings` in `[render]`, which replace settings of the same names.
pub fn scene_with(settings: &str) -> String {
    let keys: Vec<&str> = settings.lines().filter_map(|line| line.split(" =").next()).collect();
    let lines = SCENE
        .lines()
        .filter(|line| !keys.iter().any(|key| line.starts_with(&format!("{key} ="))));
    let text = lines.collect::<Vec<_>>().join("\n");
    text.replace("[render]", &format!("[render]\n{settings}"))
}

pub const ADAPTIVE: &str = "adaptive = { error = 0.02, max_samples = 64 }";

/// Returns a scene for each film layout with layers.
fn subjects() -> Vec<(&'static str, Packed)> {
    let adaptive_alpha = format!("{ADAPTIVE}\nalpha = true");
    vec![
        ("plain", parse(SCENE).with_layers()),
        ("adaptive", parse(&scene_with(ADAPTIVE)).with_layers()),
        (
            "filtered",
            parse(&scene_with("filter = { type = \"mitchell\" }")).with_layers(),
        ),
        ("alpha", parse(&scene_with("alpha = true"))),
        ("adaptive, alpha", parse(&scene_with(&adaptive_alpha))),
    ]
}

fn differing_layers(a: &Film, b: &Film) -> usize {
    let layers_only = |film: &Film| Film {
        sums: vec![Vec4::ZERO; film.sums.len()],
        moments: Vec::new(),
        ..film.clone()
    };
    differing(&layers_only(a), &layers_only(b))
}

#[test]
fn layers_do_not_depend_on_backend_or_work_split() {
    let split = |band_pixels, samples_per_dispatch, rows_per_dispatch| WorkSplit {
        band_pixels,
        samples_per_dispatch,
        rows_per_dispatch,
    };
    for (name, packed) in subjects() {
        let expected = reference(&packed);
        assert!(expected.has_layers(), "{name}");
        for mode in exact_modes() {
            let mut backend = backend(&packed, mode);
            for split in [
                split(u64::MAX, None, None),
                split(24 * 5, Some(3), Some(2)),
                split(1, Some(1), None),
            ] {
                let found = film(&mut *backend, &packed, whole(&packed), &split);
                assert_eq!(differing(&found, &expected), 0, "{name}, {mode:?}, {split:?}");
            }
            for (x0, y0, x1, y1) in [(0, 0, 1, 1), (3, 2, 20, 11), (23, 15, 24, 16)] {
                let region = Region { x0, y0, x1, y1 };
                let found = film(&mut *backend, &packed, region, &WorkSplit::default());
                assert_eq!(
                    differing(&found, &crop(&expected, region)),
                    0,
                    "{name}, {mode:?}, {region}"
                );
            }
        }
        let mut reseeded = packed.clone();
        reseeded.camera.seed += 1;
        assert!(
            differing_layers(&reference(&reseeded), &expected) > 0,
            "{name}: the comparison cannot fail"
        );
    }
}

#[test]
fn layers_do_not_change_the_image() {
    for (name, packed) in subjects() {
        let without_layers = packed.clone().without_layers();
        let expected = reference(&without_layers);
        assert_eq!(without_layers.film_layout().layers, expected.has_layers(), "{name}");
        for mode in exact_modes() {
            let found = render(&packed, mode);
            let found = Film {
                layers: Film::new(found.region).layers,
                ..found
            };
            assert_eq!(differing(&found, &expected), 0, "{name}, {mode:?}");
        }
    }
    let [opaque, with_alpha] =
        [SCENE, &scene_with("alpha = true")].map(|text| reference(&parse(text).without_layers()));
    assert!(
        differing(&opaque, &with_alpha) > 0,
        "alpha does not hide the background"
    );
}

#[test]
fn emission_direct_and_indirect_light_sum_to_the_image() {
    let mut cases = subjects();
    cases.push(("clamped", parse(&scene_with("clamp = 0.05")).with_layers()));
    for (name, packed) in cases {
        let film = reference(&packed);
        let mut incomplete = 0;
        for (i, mean) in film.means().enumerate() {
            let [emission, direct, indirect] =
                [Layer::Emission, Layer::Direct, Layer::Indirect].map(|layer| Vec3::from(film.layer(layer, i)));
            let (sum, mean) = (emission + direct + indirect, Vec3::from(mean));
            let matches_image = |sum: Vec3| (sum - mean).abs().max_element() <= 1e-5 * (1.0 + mean.max_element());
            assert!(matches_image(sum), "{name}, pixel {i}: {sum} for {mean}");
            incomplete +=
                usize::from(!matches_image(emission + direct)) + usize::from(!matches_image(direct + indirect));
        }
        assert!(
            incomplete > 100,
            "{name}: only {incomplete} sums without one of the layers differ"
        );
    }
}

#[test]
fn light_layers_are_split_by_path_length() {
    let sums = |depth: u32| {
        let film = reference(&parse(&scene_with(&format!("max_depth = {depth}"))).with_layers());
        [Layer::Emission, Layer::Direct, Layer::Indirect].map(|layer| {
            let pixels = 0..film.sums.len();
            pixels
                .map(|i| Vec3::from(film.layer(layer, i)).element_sum())
                .sum::<f32>()
        })
    };
    let [depth_0, depth_1, depth_4] = [0, 1, 4].map(sums);
    assert!(depth_0[0] > 0.0 && depth_0[1..] == [0.0, 0.0], "{depth_0:?}");
    assert!(depth_1[1] > 0.0 && depth_1[2] == 0.0, "{depth_1:?}");
    assert!(depth_4[2] > 0.0, "{depth_4:?}");
    // The radiance of short paths does not depend on the maximum depth.
    assert_eq!([depth_0[0], depth_1[0]], [depth_4[0]; 2]);
    assert_eq!(depth_1[1], depth_4[1]);
}

/// Returns a scene with a rectangle of 1 x 1 units, which is the size of a pixel.
fn rectangle_scene(size: (u32, u32), center: [f64; 2], settings: &str, from_behind: bool) -> String {
    let ([x, z], (width, height)) = (center, size);
    let y = if from_behind { 5 } else { -5 };
    format!(
        r#"
image = {{ width = {width}, height = {height} }}
camera = {{ type = "orthographic", position = [0, {y}, 0], look_at = [0, 0, 0], height = {height} }}
[environment]
color = [0.5, 0.25, 2]
[render]
integrator = "path"
max_depth = 0
pixel_samples = {{ pattern = "grid", count = 16 }}
{settings}
[materials.m]
type = "diffuse"
color = [0.25, 0.5, 0.75]
emission = [0.5, 0.25, 4]
[[shapes]]
type = "rectangle"
material = "m"
center = [{x}, 0, {z}]
size = [1, 1]
normal = [0, -1, 0]
tangent = [1, 0, 0]
"#
    )
}

/// Asserts that all exact modes render the same film, and returns the film.
fn render_all_modes(packed: &Packed) -> Film {
    let expected = reference(packed);
    for mode in exact_modes() {
        assert_eq!(differing(&render(packed, mode), &expected), 0, "{mode:?}");
    }
    expected
}

#[test]
fn layers_of_a_flat_shape_match_its_normal_and_material() {
    for behind in [false, true] {
        let film = render_all_modes(&parse(&rectangle_scene((3, 1), [0.0, 0.0], "", behind)).with_layers());
        for (pixel, alpha) in [(0, 0.0), (1, 1.0), (2, 0.0)] {
            let layer = |layer| Vec3::from(film.layer(layer, pixel));
            assert_eq!(film.alpha(pixel), alpha);
            assert_eq!(layer(Layer::Normal), Vec3::NEG_Y * alpha, "from behind: {behind}");
            assert_eq!(layer(Layer::Albedo), Vec3::new(0.25, 0.5, 0.75) * alpha);
            let background = Vec3::new(0.5, 0.25, 2.0) * (1.0 - alpha);
            assert_eq!(layer(Layer::Emission), Vec3::new(0.5, 0.25, 4.0) * alpha + background);
        }
    }
}

#[test]
fn mean_normals_of_flat_surfaces_equal_the_normals_of_first_hits() {
    let packed = parse(SCENE).with_layers();
    let (film, hits) = (reference(&packed), first_hits(&packed, RenderMode::Cpu));
    let (mut flat, mut shortened) = (0, 0);
    for (i, hit) in hits.iter().enumerate() {
        let mean = Vec3::from(film.layer(Layer::Normal, i));
        assert!(mean.length() < 1.0 + 1e-6, "pixel {i}: {mean}");
        match hit.shape {
            3 if film.alpha(i) == 1.0 && (mean - hit.shading_normal).length() < 1e-6 => flat += 1,
            0 if mean.length() < 0.9999 => shortened += 1,
            _ => {}
        }
    }
    assert!(
        flat > 20,
        "only {flat} pixels of the ground have the normal of the first hit"
    );
    assert!(
        shortened > 20,
        "mean normals are normalized: only {shortened} normals of the sphere are shorter than 1"
    );
}

#[test]
fn mean_normals_include_normal_maps() {
    let folder = tempfile::tempdir().unwrap();
    let tilted = Vec3::new(0.6, 0.0, 0.8);
    crate::textures::write_exr(&folder.path().join("n.exr"), 2, 2, |_, _| {
        (tilted * 0.5 + 0.5).to_array()
    });
    let text = rectangle_scene((3, 1), [0.0, 0.0], "", false).replace(
        "[materials.m]",
        "[textures.n]\ntype = 'image'\nfile = 'n.exr'\n[materials.m]\nnormal_map = { texture = 'n' }",
    );
    let packed = crate::textures::scene(&text, folder.path()).with_layers();
    let (film, hits) = (render_all_modes(&packed), first_hits(&packed, RenderMode::Cpu));
    let mean = Vec3::from(film.layer(Layer::Normal, 1));
    assert!((mean - Vec3::new(0.6, -0.8, 0.0)).length() < 1e-5, "{mean}");
    assert_eq!(
        hits[1].shading_normal,
        Vec3::NEG_Y,
        "the normal map changes the normal of the first hit"
    );
}

#[test]
fn albedo_is_recorded_through_mirrors() {
    let text = rectangle_scene((1, 1), [0.0, -0.5], "", false)
        .replace("max_depth = 0", "max_depth = 2")
        .replace(
            "[[shapes]]",
            r#"[materials.mirror]
type = "mirror"
tint = [0.5, 0.25, 1]
[[shapes]]
type = "rectangle"
material = "mirror"
center = [0, -2, 0]
size = [9, 9]
normal = [0, -1, 0]
tangent = [1, 0, 0]
[[shapes]]
type = "rectangle"
size = [99, 99]
material = "m"
center = [0, -9, 0]
normal = [0, 1, 0]
tangent = [1, 0, 0]
[[shapes]]"#,
        );
    let film = render_all_modes(&parse(&text).with_layers());
    let albedo = Vec3::from(film.layer(Layer::Albedo, 0));
    assert!((albedo - Vec3::new(0.125, 0.125, 0.75)).length() < 1e-6, "{albedo}");
    assert_eq!(
        film.layer(Layer::Normal, 0),
        [0.0, -1.0, 0.0],
        "the layer does not contain the normal of the mirror"
    );
}

#[test]
fn alpha_is_the_fraction_of_samples_that_hit() {
    for (center, coverages) in [
        ([0.0, 0.0], [0.0, 1.0, 0.0]),
        ([0.5, 0.0], [0.0, 0.5, 0.5]),
        ([-0.75, 0.5], [0.375, 0.125, 0.0]),
        ([9.0, 0.0], [0.0; 3]),
    ] {
        let packed = parse(&rectangle_scene((3, 1), center, "alpha = true", false));
        let layout = FilmLayout {
            layers: true,
            ..FilmLayout::default()
        };
        assert_eq!(packed.film_layout(), layout, "alpha does not request layers");
        let film = render_all_modes(&packed);
        for (i, coverage) in coverages.into_iter().enumerate() {
            assert_eq!(film.alpha(i), coverage, "{center:?}, pixel {i}");
            // Colors are premultiplied; the environment is invisible.
            let color = Vec3::new(0.5, 0.25, 4.0) * coverage;
            assert_eq!(
                Vec3::from(wgray_trace::film::mean(film.sums[i])),
                color,
                "{center:?}, pixel {i}"
            );
        }
    }
    // The rectangle covers a quarter of the only pixel.
    let film = render_all_modes(&parse(&rectangle_scene((1, 1), [0.5, 0.5], "alpha = true", false)));
    assert_eq!(film.alpha(0), 0.25);
}

#[test]
fn negative_filter_lobes_give_negative_alpha() {
    let filter = "filter = { type = \"mitchell\" }\nalpha = true";
    let text =
        rectangle_scene((7, 1), [-1.0, 0.0], filter, false).replace("\"grid\", count = 16", "\"sobol\", count = 1024");
    let film = reference(&parse(&text));
    let alphas: Vec<f32> = (0..7).map(|i| film.alpha(i)).collect();
    assert!(alphas.iter().any(|alpha| *alpha < 0.0), "{alphas:?}");
    for (i, mean) in film.means().enumerate() {
        let color = Vec3::new(0.5, 0.25, 4.0) * alphas[i];
        assert!(
            (Vec3::from(mean) - color).abs().max_element() < 1e-5,
            "pixel {i}: {mean:?}"
        );
    }
}

#[test]
fn png_alpha_is_straight_and_exr_alpha_premultiplied() {
    let straight_rgba8 = |color, alpha| ViewSettings::default().rgba8(color, alpha);
    assert_eq!(straight_rgba8([0.25, 0.125, 0.5], 0.5), [186, 136, 255, 128]);
    assert_eq!(straight_rgba8([0.5, 0.25, 1.0], 1.0), [186, 136, 255, 255]);
    assert_eq!(straight_rgba8([0.0; 3], 0.0), [0; 4]);
    assert_eq!(
        straight_rgba8([-0.01; 3], -0.01),
        [0; 4],
        "negative values from filter lobes"
    );
    assert_eq!(straight_rgba8([1.1, 0.55, 0.0], 1.1), [255, 186, 0, 255]);
    assert_eq!(straight_rgba8([f32::NAN; 3], f32::NAN), [0; 4]);
}

fn picture(text: &str, aovs: Vec<Aov>) -> Picture {
    let scene = Description::parse(text, "test").unwrap().validate().unwrap();
    let options = Options {
        device: Device::Cpu,
        aovs,
        ..Options::default()
    };
    wgray::render(&scene, &options).unwrap_or_else(|error| panic!("{error}"))
}

fn floats(picture: &Picture, name: &str) -> Vec<f32> {
    match picture.channel(name) {
        Some(ChannelValues::Floats(values)) => values,
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn the_library_returns_layers_and_alpha() {
    let text = rectangle_scene((3, 1), [0.5, 0.0], "alpha = true", false);
    let with_alpha = picture(&text, vec![Aov::Albedo, Aov::ShadingNormal, Aov::Depth]);
    assert_eq!(with_alpha.alpha(), Some(vec![0.0, 0.5, 0.5]));
    assert_eq!(floats(&with_alpha, "A"), [0.0, 0.5, 0.5]);
    assert_eq!(floats(&with_alpha, "R"), [0.0, 0.25, 0.25]);
    assert_eq!(floats(&with_alpha, "albedo.B"), [0.0, 0.375, 0.375]);
    assert_eq!(floats(&with_alpha, "shading_normal.Y"), [0.0, -0.5, -0.5]);
    assert_eq!(
        with_alpha.channel("direct.R"),
        None,
        "a layer that was not requested is written"
    );
    let [clear, covered] = [[0; 4], [186, 136, 255, 128]];
    assert_eq!(with_alpha.rgba8(), [clear, covered, covered].concat());
    assert_eq!(with_alpha.rgb8()[3..6], [0.25, 0.125, 2.0].map(wgray::image::encode));
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    with_alpha.save(path("a.png")).unwrap();
    let png = image::open(path("a.png")).unwrap();
    assert_eq!(png.color(), image::ColorType::Rgba8);
    assert_eq!(png.into_bytes(), with_alpha.rgba8());
    assert_eq!(
        image::open(path("a.albedo.png")).unwrap().color(),
        image::ColorType::Rgb8
    );
    with_alpha.save(path("a.exr")).unwrap();
    assert_eq!(wgray::image::read_exr(&path("a.exr")).unwrap(), with_alpha.pixels());

    let opaque = picture(&text.replace("alpha = true", ""), Vec::new());
    assert_eq!((opaque.alpha(), opaque.channel("A")), (None, None));
    assert_eq!(opaque.rgba8().chunks(4).map(|p| p[3]).collect::<Vec<_>>(), [255; 3]);
    opaque.save(path("b.png")).unwrap();
    assert_eq!(image::open(path("b.png")).unwrap().color(), image::ColorType::Rgb8);
}

#[test]
fn path_layers_are_rejected_with_other_integrators() {
    let text = SCENE
        .replace("\"path\"", "\"phong\"")
        .replace("\"diffuse\"", "\"phong\"");
    let text: String = text
        .lines()
        .filter(|line| !line.starts_with("emission"))
        .collect::<Vec<_>>()
        .join("\n");
    let text = text.replace("[environment]\ncolor = [0.2, 0.3, 0.5]\n", "");
    let scene = Description::parse(&text.replace("count = 8", "count = 4"), "test").unwrap();
    let scene = scene.validate().unwrap_or_else(|error| panic!("{error}"));
    for aov in Aov::ALL {
        let options = Options {
            device: Device::Cpu,
            aovs: vec![aov],
            ..Options::default()
        };
        let message = wgray::render(&scene, &options).err().map(|error| error.to_string());
        let name = aov.name();
        let expected = match aov {
            Aov::Albedo | Aov::Direct | Aov::Indirect | Aov::Emission => {
                Some(format!("aov.{name}: needs integrator = \"path\""))
            }
            _ => None,
        };
        assert_eq!(message, expected, "{name}");
    }
    let packed = wgray_render::pack::pack(&scene);
    assert_eq!(
        packed.clone().with_layers(),
        packed,
        "`with_layers` changes a scene of another integrator"
    );
}

#[test]
fn film_layouts_have_their_own_kernels() {
    let without_layers = parse(SCENE);
    let layered = without_layers.clone().with_layers();
    assert!(!without_layers.same_but_camera(&layered));
    let Some(device) = adapter::device() else {
        return;
    };
    let options = GpuOptions {
        exact: device.info.exact.then_some(wgray_render::gpu::Rounding::Device),
        baked: false,
    };
    let mut gpu = Gpu::new(device, &without_layers, sources::shaders(), options).unwrap();
    assert!(
        gpu.update(&parse(&SCENE.replace("0.9, 0.8, 0.7", "0.7, 0.8, 0.9")))
            .unwrap()
    );
    assert!(
        !gpu.update(&layered).unwrap(),
        "a kernel without layers accepts a scene with layers"
    );
    let mut gpu = Gpu::new(device, &layered, sources::shaders(), options).unwrap();
    let recolored = parse(&SCENE.replace("0.9, 0.8, 0.7", "0.7, 0.8, 0.9"));
    assert!(
        !gpu.update(&recolored).unwrap(),
        "a kernel with layers accepts a scene without layers"
    );
    let recolored = recolored.with_layers();
    assert!(gpu.update(&recolored).unwrap());
    let found = film(&mut gpu, &recolored, whole(&recolored), &WorkSplit::default());
    assert!(found.has_layers());
    if adapter::bit_exact(device) {
        assert_eq!(differing(&found, &reference(&recolored)), 0);
        assert!(
            differing_layers(&found, &reference(&layered)) > 0,
            "the comparison cannot fail"
        );
    }
}
