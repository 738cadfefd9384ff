//! Small valid scenes of everything that a scene file can say, as strategies of proptest.

use std::collections::BTreeMap;

use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::select;
use wgray::scene::*;

use crate::patterns;

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
        let lines = LinesDescription {
            cell: even,
            line: odd,
            line_width,
            scale,
            rotate,
            offset,
        };
        BTreeMap::from([
            ("checker".to_string(), TextureDescription::Checker(checker)),
            ("lines".to_string(), TextureDescription::Lines(lines)),
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
    let disk = (material.clone(), point(), frame(), length(), any::<bool>()).prop_map(
        |(material, center, [normal, tangent], radius, turned)| {
            ShapeDescription::Disk(DiskDescription {
                material,
                center,
                radius,
                normal,
                tangent: turned.then_some(tangent),
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
        1 => disk,
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
            ShapeDescription::Disk(s) => {
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
