//! Random small scenes, both paths: the same bits. A scene that fails is made as small as it gets and written to a file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::{Config, RngAlgorithm, TestError, TestRng, TestRunner};
use wgray::gpu::compose::Shaders;
use wgray::scene::*;

use crate::adapter::{self, bit_exact};
use crate::nearly::Nearly;
use crate::pictures::{Way, differing, first_hits, reference, render_with};
use crate::{patterns, rounding, scenes, sources};

/// How many scenes; with this variable each run has others, else they are the same in every run.
const CASES: &str = "WGRAY_TEST_CASES";

/// Often one of a few numbers, so that things touch, coincide and lie in one plane.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => select(&[0.0, 0.5, -0.5, 1.0, -1.0][..]),
        2 => (-64i32..64).prop_map(|n| f64::from(n) / 32.0),
        1 => -2.0..2.0,
    ]
}

fn point() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array)
}

fn direction() -> impl Strategy<Value = DVec3> {
    let axes = select(vec![DVec3::Z, DVec3::X, DVec3::Y, -DVec3::Z, -DVec3::X, -DVec3::Y]);
    prop_oneof![2 => axes, 1 => point().prop_filter("a direction", |v| v.length() > 0.1)]
}

/// Perpendicular directions with equal lengths, of any orientation.
fn frame() -> impl Strategy<Value = [DVec3; 2]> {
    [direction(), direction()].prop_filter("a frame", |[a, b]| a.normalize().cross(b.normalize()).length() > 0.01)
}

fn length() -> impl Strategy<Value = f64> {
    prop_oneof![select(&[1.0, 0.5, 2.0, 0.01][..]), 0.05..2.0]
}

fn color(most: f64) -> impl Strategy<Value = DVec3> {
    let part = prop_oneof![select(vec![0.5, 0.0, 1.0]), 0.0..most];
    [part.clone(), part.clone(), part].prop_map(DVec3::from_array)
}

fn paint() -> impl Strategy<Value = ColorDescription> {
    let texture = select(&["checker", "lines", "constant"][..]).prop_map(str::to_string);
    prop_oneof![
        4 => color(1.0).prop_map(ColorDescription::Plain),
        1 => texture.prop_map(|texture| ColorDescription::Texture(TextureReference { texture })),
    ]
}

fn textures() -> impl Strategy<Value = BTreeMap<String, TextureDescription>> {
    let place = (
        select(&[1.0, 4.0, 0.3, -2.0][..]),
        select(&[0.0, 30.0, 90.0][..]),
        0.0..1.0,
    );
    (color(1.0), color(1.0), place, 0.05..0.5).prop_map(|(even, odd, (scale, rotate, offset), line_width)| {
        let (scale, offset) = ([scale, scale * 2.0], [offset, 0.0]);
        let checker = CheckerDescription {
            even,
            odd,
            scale,
            rotate,
            offset,
        };
        let lines = GridDescription {
            cell: even,
            line: odd,
            line_width,
            scale,
            rotate,
            offset,
        };
        BTreeMap::from([
            ("checker".to_string(), TextureDescription::Checker(checker)),
            ("lines".to_string(), TextureDescription::Grid(lines)),
            (
                "constant".to_string(),
                TextureDescription::Constant(ConstantDescription { color: even }),
            ),
        ])
    })
}

fn material() -> impl Strategy<Value = MaterialDescription> {
    let shininess =
        prop_oneof![3 => select(&[16.0, 1.0, 2.0, 50.0, 4096.0][..]), 1 => select(&[2.5, 0.5, 1e5, 1e-3][..])];
    let phong = (paint(), paint(), paint(), shininess).prop_map(|(ambient, diffuse, specular, shininess)| {
        MaterialDescription::Phong(PhongDescription {
            color: None,
            ambient: Some(ambient),
            diffuse: Some(diffuse),
            specular: Some(specular),
            shininess,
            normal_map: None,
        })
    });
    let mirror = color(1.0).prop_map(|tint| {
        let tint = ColorDescription::Plain(tint);
        MaterialDescription::Mirror(MirrorDescription { tint, normal_map: None })
    });
    let glass = (color(1.0), select(&[1.5, 1.0, 0.7, 2.4][..])).prop_map(|(tint, ior)| {
        let tint = ColorDescription::Plain(tint);
        MaterialDescription::Glass(GlassDescription {
            ior,
            tint,
            normal_map: None,
        })
    });
    prop_oneof![6 => phong, 1 => mirror, 1 => glass]
}

fn light() -> impl Strategy<Value = LightDescription> {
    let rectangle =
        (point(), frame(), [length(), length()], color(2.0)).prop_map(|(center, [normal, tangent], size, color)| {
            LightDescription::Rectangle(RectangleLightDescription {
                center,
                size,
                normal,
                tangent,
                color,
            })
        });
    let delta = (point(), color(1.0))
        .prop_map(|(position, color)| LightDescription::Point(PointLightDescription { position, color }));
    let directional = (direction(), color(1.0))
        .prop_map(|(direction, color)| LightDescription::Directional(DirectionalLightDescription { direction, color }));
    prop_oneof![2 => rectangle, 1 => delta, 1 => directional]
}

fn shape() -> impl Strategy<Value = ShapeDescription> {
    let material = select(&["a", "b", "c"][..]).prop_map(str::to_string);
    let rectangle = (material.clone(), point(), frame(), [length(), length()]).prop_map(
        |(material, center, [normal, tangent], size)| {
            ShapeDescription::Rectangle(RectangleDescription {
                material,
                center,
                size,
                normal,
                tangent,
            })
        },
    );
    let sphere = (material.clone(), point(), length()).prop_map(|(material, center, radius)| {
        ShapeDescription::Sphere(SphereDescription {
            material,
            center,
            radius,
        })
    });
    let ellipsoid = (
        material.clone(),
        point(),
        frame(),
        direction(),
        [length(), length(), length()],
    )
        .prop_map(|(material, center, [a, b], c, [la, lb, lc])| {
            let (a, b, c) = (a.normalize() * la, b.normalize() * lb, c.normalize() * lc);
            ShapeDescription::Ellipsoid(EllipsoidDescription {
                material,
                center,
                a,
                b,
                c,
            })
        });
    let triangle = (material.clone(), [point(), point(), point()])
        .prop_map(|(material, vertices)| ShapeDescription::Triangle(TriangleDescription { material, vertices }));
    let tetrahedron = (material.clone(), [point(), point(), point(), point()])
        .prop_map(|(material, vertices)| ShapeDescription::Tetrahedron(TetrahedronDescription { material, vertices }));
    let plane = (material, point(), frame()).prop_map(|(material, point, [normal, tangent])| {
        ShapeDescription::Plane(PlaneDescription {
            material,
            point,
            normal,
            tangent,
        })
    });
    prop_oneof![
        2 => rectangle,
        2 => sphere,
        2 => ellipsoid,
        1 => triangle,
        1 => tetrahedron,
        1 => plane,
    ]
}

/// Anywhere: on the surface of something, in the middle of it, or away from all.
fn camera() -> impl Strategy<Value = CameraDescription> {
    let position = prop_oneof![2 => point().prop_map(|p| p * 3.0 + DVec3::new(0.01, -0.02, 0.03)), 1 => point()];
    let look_at = point().prop_map(|p| p * 0.5);
    (position, look_at, 20.0..120.0, 0.5..6.0, any::<bool>()).prop_map(|(position, look_at, fov, height, parallel)| {
        let up = if (look_at - position).cross(DVec3::Z).length() > 0.1 {
            DVec3::Z
        } else {
            DVec3::new(0.3, 1.0, 0.1)
        };
        if parallel {
            CameraDescription::Orthographic(OrthographicDescription {
                position,
                look_at,
                up,
                height,
            })
        } else {
            let focal_length = 1.0;
            CameraDescription::Perspective(PerspectiveDescription {
                position,
                look_at,
                up,
                fov,
                focal_length,
            })
        }
    })
}

fn render() -> impl Strategy<Value = RenderDescription> {
    let pattern = || {
        select(
            patterns::all()
                .into_iter()
                .map(|(_, pattern)| pattern)
                .collect::<Vec<_>>(),
        )
    };
    let samples = (pattern(), select(&[1, 4, 2][..]), pattern(), select(&[1, 4, 9, 40][..]));
    let epsilon = select(&[1e-5, 1e-4, 0.0][..]);
    let kinds = vec![
        PixelFilterKind::Box,
        PixelFilterKind::Triangle,
        PixelFilterKind::Gaussian,
        PixelFilterKind::Mitchell,
        PixelFilterKind::BlackmanHarris,
    ];
    let more = (any::<bool>(), 1u32..6, any::<bool>(), select(kinds), any::<bool>());
    (color(1.0), color(1.0), epsilon, any::<u32>(), samples, more).prop_map(
        |(
            ambient,
            background,
            shadow_epsilon,
            seed,
            (pixel, pixels, light, lights),
            (opaque, max_depth, filtered, kind, adaptive),
        )| {
            RenderDescription {
                ambient,
                background,
                shadow_epsilon,
                shadows: if opaque { Shadows::Opaque } else { Shadows::Transparent },
                max_depth,
                ray_differentials: filtered,
                seed,
                pixel_samples: patterns::samples(pixel, pixels),
                light_samples: patterns::samples(light, lights),
                filter: PixelFilterDescription { kind, radius: None },
                adaptive: (adaptive && pixel.goes_on()).then_some(AdaptiveDescription {
                    error: 0.02,
                    max_samples: Some(16),
                }),
                ..RenderDescription::default()
            }
        },
    )
}

pub fn description() -> impl Strategy<Value = Description> {
    let (shapes, lights) = (
        prop::collection::vec(shape(), 0..7),
        prop::collection::vec(light(), 0..4),
    );
    let materials = [material(), material(), material()];
    let size = (1u32..25, 1u32..25);
    let place = (select(&[1.0, 1.0, 0.001, 1000.0][..]), select(&[0.0, 0.0, 100.0][..]));
    (shapes, lights, materials, textures(), camera(), render(), size, place)
        .prop_map(
            |(shapes, lights, materials, textures, camera, render, (width, height), (scale, offset))| {
                let names = ["a", "b", "c"].map(str::to_string);
                let mut d = Description {
                    image: ImageDescription { width, height },
                    camera,
                    render,
                    textures,
                    materials: names.into_iter().zip(materials).collect(),
                    lights,
                    shapes,
                };
                moved(&mut d, scale, DVec3::new(offset, -offset, offset));
                d
            },
        )
        .prop_filter("a sound scene", |d| d.validate().is_ok())
}

/// Scales and moves all that a scene has.
fn moved(d: &mut Description, scale: f64, offset: DVec3) {
    let point = |p: &mut DVec3| *p = *p * scale + offset;
    match &mut d.camera {
        CameraDescription::Perspective(c) => [&mut c.position, &mut c.look_at].map(point),
        CameraDescription::Orthographic(c) => {
            c.height *= scale;
            [&mut c.position, &mut c.look_at].map(point)
        }
        other => panic!("no random scene has the camera {other:?}"),
    };
    for light in &mut d.lights {
        match light {
            LightDescription::Rectangle(l) => {
                point(&mut l.center);
                l.size = l.size.map(|side| side * scale);
            }
            LightDescription::Point(l) => point(&mut l.position),
            _ => {}
        }
    }
    for shape in &mut d.shapes {
        match shape {
            ShapeDescription::Rectangle(s) => {
                point(&mut s.center);
                s.size = s.size.map(|side| side * scale);
            }
            ShapeDescription::Sphere(s) => {
                point(&mut s.center);
                s.radius *= scale;
            }
            ShapeDescription::Ellipsoid(s) => {
                point(&mut s.center);
                [&mut s.a, &mut s.b, &mut s.c]
                    .into_iter()
                    .for_each(|axis| *axis *= scale);
            }
            ShapeDescription::Triangle(s) => s.vertices.iter_mut().for_each(point),
            ShapeDescription::Tetrahedron(s) => s.vertices.iter_mut().for_each(point),
            ShapeDescription::Plane(s) => point(&mut s.point),
            other => panic!("no random scene has the shape {other:?}"),
        }
    }
}

/// Renders a scene both ways.
fn check(d: &Description, shaders: &Shaders) -> Result<(), String> {
    let packed = scenes::packed(d);
    let cpu = reference(&packed);
    if !cpu.sums.iter().all(|sum| sum.is_finite()) {
        return Err("a pixel is no number".into());
    }
    for way in [Way::Baked, Way::Buffers] {
        let differ = differing(&render_with(&packed, way, shaders), &cpu);
        if differ > 0 {
            return Err(format!("{differ} of {} pixels differ, {way:?}", cpu.sums.len()));
        }
    }
    // another kernel, so only now and then
    if d.render.seed.is_multiple_of(4) {
        let (gpu, cpu) = (first_hits(&packed, Way::Buffers), first_hits(&packed, Way::Cpu));
        if bytemuck::cast_slice::<_, u8>(&gpu) != bytemuck::cast_slice::<_, u8>(&cpu) {
            return Err("the first hits differ".into());
        }
    }
    Ok(())
}

/// Runs a number of cases; returns a scene that fails, as small as it gets, and why it does.
fn failing(cases: u32, shrinks: u32, always_the_same: bool, shaders: &Shaders) -> Option<(Description, String)> {
    let config = Config {
        cases,
        max_shrink_iters: shrinks,
        failure_persistence: None,
        ..Config::default()
    };
    let mut runner = if always_the_same {
        TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
    } else {
        TestRunner::new(config)
    };
    let result = runner.run(&description(), |d| check(&d, shaders).map_err(TestCaseError::fail));
    match result {
        Ok(()) => None,
        Err(TestError::Fail(reason, d)) => Some((d, reason.to_string())),
        Err(TestError::Abort(reason)) => panic!("{reason}"),
    }
}

/// Writes a scene to a file that `wgray render` takes.
fn save(d: &Description, name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, toml::to_string(d).expect("a scene as TOML")).expect("a place for the scene");
    path
}

#[test]
fn random_scenes_are_the_same_on_gpu_and_cpu() {
    if !adapter::device().is_some_and(bit_exact) {
        return;
    }
    let cases = std::env::var(CASES).ok();
    let number = cases
        .as_deref()
        .map_or(12, |n| n.parse().expect("WGRAY_TEST_CASES is a number"));
    if let Some((d, reason)) = failing(number, 300, cases.is_none(), sources::shaders()) {
        let path = save(&d, "failing-scene.toml");
        panic!("{reason}: wgray render {}", path.display());
    }
    println!("{number} random scenes, each from buffers and as constants: every pixel has the same bits");
}

/// Where bits are not promised, the pixels of random scenes are near, together: by plain WGSL, on devices that are not
/// software Vulkan, and on one with poor quotients and square roots. But for scenes without `shadow_epsilon`: a surface
/// hides its own light there, or does not, by the last digit.
#[test]
fn random_scenes_are_nearly_the_same_where_bits_are_not_promised() {
    let Some(device) = adapter::device() else { return };
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let strategy = description();
    let (mut plain, mut poor, mut shifted) = (Nearly::default(), Nearly::default(), Nearly::default());
    for _ in 0..24 {
        let mut d = strategy.new_tree(&mut runner).expect("a scene").current();
        d.render.shadow_epsilon = d.render.shadow_epsilon.max(1e-5);
        let packed = scenes::packed(&d);
        let cpu = reference(&packed);
        let by_plain_wgsl = render_with(&packed, Way::Plain, sources::shaders());
        if bit_exact(device) {
            plain.add(Nearly::by_plain_wgsl(&by_plain_wgsl, &cpu));
            let found = render_with(&packed, Way::Rounded, rounding::poor_shaders());
            poor.add(Nearly::of(&packed, &found, &cpu));
        } else {
            plain.add(Nearly::of(&packed, &by_plain_wgsl, &cpu));
            poor.add(Nearly::of(
                &packed,
                &render_with(&packed, Way::Buffers, sources::shaders()),
                &cpu,
            ));
        }
        let mut moved = cpu.clone();
        moved.sums.rotate_right(1);
        shifted.add(Nearly::of(&packed, &moved, &cpu));
    }
    println!("random scenes: by plain WGSL {plain}; with poor quotients {poor}");
    assert!(plain.judge().is_ok(), "plain WGSL: {}", plain.judge().unwrap_err());
    assert!(poor.judge().is_ok(), "poor quotients: {}", poor.judge().unwrap_err());
    assert!(shifted.judge().is_err(), "the comparison cannot fail");
}

/// One unit in the last place of one constant is found, and the scene that shows it is a scene.
#[test]
fn shaders_that_differ_by_one_ulp_are_found_by_random_scenes() {
    if !adapter::device().is_some_and(bit_exact) {
        return;
    }
    let shaders = sources::edited_shaders("camera.wgsl", "y = 1.0 - at.y", "y = 1.0000001 - at.y");
    let (d, reason) = failing(40, 10, true, &shaders).expect("a scene that differs");
    assert!(reason.contains("pixels differ"), "{reason}");
    let path = save(&d, "scene-of-a-negative-control.toml");
    let scene = Scene::load(&path, &Overrides::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(wgray::pack::pack(&scene), scenes::packed(&d));
}

/// Random scenes have everything that scene files can: every type that the parser knows, but for these.
#[test]
fn random_scenes_have_everything() {
    const NEVER: &[(&str, &str)] = &[("image", "files; tests/textures compares images on both paths")];
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let strategy = description();
    let mut found = BTreeSet::new();
    for _ in 0..300 {
        let d = strategy.new_tree(&mut runner).expect("a scene").current();
        let text = toml::to_string(&d).expect("a scene as TOML");
        found.extend(
            text.lines()
                .filter_map(|line| line.strip_prefix("type = "))
                .map(|t| t.trim_matches('"').to_string()),
        );
        found.extend(
            text.lines()
                .filter_map(|l| l.strip_prefix("pattern = "))
                .map(|t| t.trim_matches('"').to_string()),
        );
    }
    let mut known: BTreeSet<String> = patterns::all().into_iter().map(|(name, _)| name).collect();
    for file in ["src/scene/description.rs", "src/scene/describe_texture.rs"] {
        let text = std::fs::read_to_string(sources::path(file)).expect("the descriptions");
        let tags = text
            .lines()
            .filter_map(|line| line.trim().strip_prefix('"')?.split_once("\" => "));
        known.extend(
            tags.filter(|(_, variant)| variant.ends_with("Description),"))
                .map(|(tag, _)| tag.to_string()),
        );
    }
    assert!(known.len() > 15, "the types were not found: {known:?}");
    known.retain(|name| !NEVER.iter().any(|(never, _)| never == name));
    let missing: Vec<_> = known.difference(&found).collect();
    assert!(missing.is_empty(), "no random scene has {missing:?}");
}
