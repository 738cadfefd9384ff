//! Small valid scenes of everything that a scene file can say, as strategies of proptest.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::select;
use wgray::mesh::Normals;
use wgray::pack::{MOST_OUTSIDE, Packed, pack};
use wgray::scene::*;

use crate::meshes::forms::Form;
use crate::patterns;
use crate::random::Random;
use crate::textures::write_exr;

/// Mesh files, and whether they have texture coordinates and normals. They are beside the scenes that failing tests write.
const MESHES: &[(&str, bool, bool)] = &[
    ("soup.obj", true, false),
    ("slivers.obj", false, false),
    ("ball.obj", true, true),
    ("cube.obj", true, false),
    ("rock.obj", true, true),
];

/// The folder that random scenes and their meshes are in.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<&Path> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let random = Random::new(21);
        for (name, has_uvs, has_normals) in MESHES {
            let form = match *name {
                "soup.obj" => Form::soup(60, &random),
                "slivers.obj" => Form::slivers(40, &random),
                "ball.obj" => Form::icosphere(1),
                "cube.obj" => Form::cube(),
                _ => bumpy(&random),
            };
            let uvs: Vec<[f64; 2]> = form.points.iter().map(|p| [p.x * 0.7 + p.z, p.y - 0.3 * p.x]).collect();
            let normals: Vec<DVec3> = form.points.iter().map(|p| p.normalize()).collect();
            let text = form.obj(has_normals.then_some(&normals), has_uvs.then_some(&uvs));
            // Whoever reads it sees one whole file.
            let draft = folder.join(format!("{name}.{}", std::process::id()));
            fs::write(&draft, text).expect("a place for a mesh");
            fs::rename(&draft, folder.join(name)).expect("a place for a mesh");
        }
        for (name, width, height) in AROUND {
            let draft = folder.join(format!("{}.{name}", std::process::id()));
            let value = || random.pick(&[0.0, 0.1, 0.5, 1.0, 30.0]);
            write_exr(&draft, *width, *height, |_, _| [value(), value(), value()]);
            fs::rename(&draft, folder.join(name)).expect("a place for an image");
        }
        folder
    })
}

/// A sphere with dents and horns.
fn bumpy(random: &Random) -> Form {
    let mut form = Form::icosphere(2);
    form.points.iter_mut().for_each(|p| *p *= random.between(0.4, 1.3));
    form
}

/// A random scene as the backends read it.
pub fn packed(d: &Description) -> Packed {
    let beside = Assets::beside(folder());
    pack(&d.validate_with(&beside).unwrap_or_else(|problem| panic!("{problem}")))
}

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

fn material() -> BoxedStrategy<MaterialDescription> {
    let shininess =
        prop_oneof![3 => select(&[16.0, 1.0, 2.0, 50.0, 4096.0][..]), 1 => select(&[2.5, 0.5, 1e5, 1e-3][..])];
    let visible = prop_oneof![9 => Just(None), 1 => Just(Some(false))];
    let phong =
        (paint(), paint(), paint(), shininess, visible).prop_map(|(ambient, diffuse, specular, shininess, visible)| {
            MaterialDescription::Phong(PhongDescription {
                color: None,
                ambient: Some(ambient),
                diffuse: Some(diffuse),
                specular: Some(specular),
                shininess,
                normal_map: None,
                emission: None,
                visible,
            })
        });
    let mirror = color(1.0).prop_map(|tint| {
        let tint = ColorDescription::Plain(tint);
        MaterialDescription::Mirror(MirrorDescription {
            tint,
            normal_map: None,
            emission: None,
            visible: None,
        })
    });
    let glass = (color(1.0), select(&[1.5, 1.0, 0.7, 2.4][..])).prop_map(|(tint, ior)| {
        let tint = ColorDescription::Plain(tint);
        MaterialDescription::Glass(GlassDescription {
            ior,
            tint,
            normal_map: None,
            emission: None,
            visible: None,
        })
    });
    prop_oneof![6 => phong, 1 => mirror, 1 => glass].boxed()
}

/// What paths have more: shines, often; two dark ones among three.
fn emission() -> impl Strategy<Value = Option<ColorDescription>> {
    let texture = select(&["checker", "lines", "constant"][..]).prop_map(str::to_string);
    prop_oneof![
        6 => Just(None),
        2 => color(5.0).prop_map(|color| Some(ColorDescription::Plain(color))),
        1 => texture.prop_map(|texture| Some(ColorDescription::Texture(TextureReference { texture }))),
    ]
}

/// A number from 0 to 1, often an end, or one of a texture's.
fn share() -> impl Strategy<Value = ValueDescription> {
    let texture = (
        select(&["checker", "lines"][..]).prop_map(str::to_string),
        select(&[Channel::R, Channel::G, Channel::B][..]),
    );
    prop_oneof![
        3 => Just(ValueDescription::Plain(0.0)),
        2 => Just(ValueDescription::Plain(1.0)),
        3 => (0.0..=1.0).prop_map(ValueDescription::Plain),
        1 => texture.prop_map(|(texture, channel)| ValueDescription::channel(texture, channel)),
    ]
}

/// A principled material with some of its lobes.
fn principled() -> impl Strategy<Value = MaterialDescription> {
    let shares = proptest::collection::vec(share(), 8);
    let volume = (select(&[0.0, 1.0][..]), color(1.0), select(&[1.0, 1.3, 1.5, 2.4][..]));
    let alpha = (
        select(&[AlphaMode::Opaque, AlphaMode::Opaque, AlphaMode::Blend, AlphaMode::Mask][..]),
        share(),
    );
    (paint(), shares, volume, alpha, -360.0..360.0).prop_map(
        |(base, shares, (thickness, color, ior), (alpha_mode, alpha), anisotropy_rotation)| {
            let mut shares = shares.into_iter();
            let mut next = || shares.next().unwrap();
            let mut m = PrincipledDescription::default();
            (m.base_color, m.metallic, m.roughness) = (base, next(), next());
            (m.anisotropy, m.anisotropy_rotation) = (next(), anisotropy_rotation);
            (m.specular, m.transmission, m.ior) = (next(), next(), ior);
            if thickness > 0.0 {
                (m.thickness, m.attenuation_color, m.attenuation_distance) = (thickness, color, Some(0.7));
            }
            (m.clearcoat, m.clearcoat_roughness, m.sheen_roughness) = (next(), next(), next());
            m.sheen_color = [0.0, 0.5, color.x].into();
            (m.alpha_mode, m.alpha) = (alpha_mode, alpha);
            MaterialDescription::Principled(m)
        },
    )
}

/// A material of any kind, for paths.
fn material_of_paths() -> BoxedStrategy<MaterialDescription> {
    let texture = select(&["checker", "lines"][..]).prop_map(str::to_string);
    let roughness = prop_oneof![
        2 => Just(ValueDescription::Plain(0.0)),
        1 => (0.0..=1.0).prop_map(ValueDescription::Plain),
        1 => texture.prop_map(ValueDescription::texture),
    ];
    let diffuse = (paint(), roughness.clone()).prop_map(|(color, roughness)| {
        let mut diffuse = DiffuseDescription::new(color);
        diffuse.roughness = roughness;
        MaterialDescription::Diffuse(diffuse)
    });
    let facets = (
        prop_oneof![1 => Just(ValueDescription::default()), 3 => roughness],
        prop_oneof![3 => Just(0.0), 1 => 0.0..=1.0],
        -360.0..=360.0,
        any::<bool>(),
    );
    let metal = prop_oneof![
        2 => paint().prop_map(ConductorDescription::new),
        1 => Just(ConductorDescription { metal: Some("gold".to_owned()), ..ConductorDescription::default() }),
        1 => (color(3.0), color(3.0)).prop_map(|(eta, k)| ConductorDescription {
            eta: Some(eta + 0.01),
            k: Some(k),
            ..ConductorDescription::default()
        }),
    ];
    let conductor = (metal, facets.clone()).prop_map(|(mut conductor, facets)| {
        (
            conductor.roughness,
            conductor.anisotropy,
            conductor.anisotropy_rotation,
            conductor.energy_compensation,
        ) = facets;
        MaterialDescription::Conductor(conductor)
    });
    let absorption = prop_oneof![Just(DVec3::ZERO), color(3.0)];
    let clear = (select(&[1.5, 1.0, 0.7, 2.4][..]), paint(), absorption, any::<bool>());
    let dielectric = (clear, facets).prop_map(|((ior, color, absorption, thin), facets)| {
        let mut dielectric = DielectricDescription::new(ior);
        (dielectric.color, dielectric.thin) = (color, thin);
        dielectric.absorption = if thin { DVec3::ZERO } else { absorption };
        (
            dielectric.roughness,
            dielectric.anisotropy,
            dielectric.anisotropy_rotation,
            dielectric.energy_compensation,
        ) = facets;
        MaterialDescription::Dielectric(dielectric)
    });
    let any = prop_oneof![4 => diffuse, 1 => conductor, 1 => dielectric, 2 => principled(), 3 => material()];
    (any, emission())
        .prop_map(|(mut material, emission)| {
            let own = match &mut material {
                MaterialDescription::Phong(m) => &mut m.emission,
                MaterialDescription::Mirror(m) => &mut m.emission,
                MaterialDescription::Glass(m) => &mut m.emission,
                MaterialDescription::Diffuse(m) => &mut m.emission,
                MaterialDescription::Conductor(m) => &mut m.emission,
                MaterialDescription::Dielectric(m) => &mut m.emission,
                MaterialDescription::Principled(m) => &mut m.emission,
                other => panic!("no random scene has the material {other:?}"),
            };
            *own = emission;
            material
        })
        .boxed() // the tree of a strategy that is not is on the stack
}

/// What a scene has for the integrator `path`.
#[derive(Clone, Debug)]
struct OfPaths {
    materials: [MaterialDescription; 3],
    environment: Option<EnvironmentDescription>,
    max_depth: u32,
    rr_depth: Option<u32>,
    clamp: Option<f64>,
    alpha: bool,
}

/// Images around scenes, beside their meshes: their sizes.
const AROUND: &[(&str, u32, u32)] = &[("dot.exr", 1, 1), ("odd.exr", 5, 3), ("wide.exr", 64, 32)];

fn surroundings() -> BoxedStrategy<EnvironmentDescription> {
    let image = (
        select(AROUND),
        select(&[1.0, 0.3, 0.0][..]),
        prop::option::of(-180.0..180.0),
        any::<bool>(),
    );
    let image = image.prop_map(|((file, ..), scale, turn, visible)| {
        let mut environment = EnvironmentDescription::image(file);
        environment.scale = scale;
        environment.rotate = turn.map(|turn| EnvironmentRotation::Any(Rotation::Angles(DVec3::new(turn, 20.0, -turn))));
        environment.visible = visible;
        environment
    });
    prop_oneof![1 => color(1.0).prop_map(EnvironmentDescription::new), 1 => image].boxed()
}

fn of_paths() -> BoxedStrategy<OfPaths> {
    let materials = [material_of_paths(), material_of_paths(), material_of_paths()];
    let environment = prop::option::of(surroundings());
    let depths = (
        select(&[0, 1, 2, 5, 12][..]),
        prop::option::of(select(&[0, 1, 3, 1024][..])),
    );
    let clamp = prop::option::of(select(&[0.1, 2.0][..]));
    (materials, environment, depths, clamp, any::<bool>())
        .prop_map(
            |(materials, environment, (max_depth, rr_depth), clamp, alpha)| OfPaths {
                materials,
                environment,
                max_depth,
                rr_depth,
                clamp,
                alpha,
            },
        )
        .boxed()
}

fn light() -> impl Strategy<Value = LightDescription> {
    let rectangle = (
        point(),
        frame(),
        [length(), length()],
        color(2.0),
        prop::bool::weighted(0.8),
    )
        .prop_map(|(center, [normal, tangent], size, color, visible)| {
            LightDescription::Rectangle(RectangleLightDescription {
                visible,
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
    let angles = (select(&[180.0, 90.0, 40.0, 15.0][..]), select(&[0.0, 0.5, 1.0][..]));
    let spot =
        (point(), direction(), color(1.0), angles).prop_map(|(position, direction, color, (cone_angle, share))| {
            LightDescription::Spot(SpotLightDescription {
                position,
                direction: Some(direction),
                look_at: None,
                color,
                cone_angle,
                inner_angle: share * cone_angle,
            })
        });
    prop_oneof![4 => rectangle, 2 => delta, 2 => directional, 1 => spot]
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

/// What places a mesh: translate, rotate and scale, or a matrix.
type Placement = (Option<DVec3>, Option<Rotation>, Option<Scale>, Option<Vec<[f64; 4]>>);

fn placement() -> impl Strategy<Value = Placement> {
    let angle = || prop_oneof![2 => select(&[0.0, 90.0, -180.0, 30.0][..]), 1 => -360.0..360.0];
    let angles = [angle(), angle(), angle()].prop_map(|a| Rotation::Angles(DVec3::from_array(a)));
    let about = (direction(), angle()).prop_map(|(axis, degrees)| Rotation::About(RotationAbout { axis, degrees }));
    let rotation = prop_oneof![1 => Just(None), 1 => angles.prop_map(Some), 1 => about.prop_map(Some)];
    let size = || select(&[1.0, 0.7, 0.3, -0.5, 1.0, 1e-3, 1e3][..]);
    let each = [size(), size(), size()].prop_map(|s| Scale::Each(DVec3::from_array(s)));
    let scale = prop_oneof![2 => Just(None), 2 => size().prop_map(|s| Some(Scale::All(s))), 1 => each.prop_map(Some)];
    let parts = (prop::option::of(point()), rotation, scale).prop_map(|(t, r, s)| (t, r, s, None));
    let row = || [coordinate(), coordinate(), coordinate(), coordinate()];
    let matrix = [row(), row(), row()].prop_map(|rows| (None, None, None, Some(rows.to_vec())));
    prop_oneof![5 => parts, 1 => matrix]
}

fn normals() -> impl Strategy<Value = Option<Normals>> {
    select(vec![None, Some(Normals::Smooth), Some(Normals::Flat)])
}

fn up() -> impl Strategy<Value = Up> {
    select(vec![Up::Z, Up::Y, Up::X])
}

/// Materials of groups that have others than the rest.
fn materials_of_groups() -> impl Strategy<Value = BTreeMap<String, String>> {
    prop::option::of(select(&["a", "b", "c"][..])).prop_map(|material| {
        let named = material.map(|material| ("second".to_string(), material.to_string()));
        named.into_iter().collect()
    })
}

fn mesh() -> impl Strategy<Value = ShapeDescription> {
    let material = select(&["a", "b", "c"][..]).prop_map(str::to_string);
    let file = select(MESHES).prop_map(|(name, ..)| name.to_string());
    (file, normals(), up(), material, materials_of_groups(), placement()).prop_map(
        |(file, normals, up, material, materials, (translate, rotate, scale, matrix))| {
            ShapeDescription::Mesh(MeshDescription {
                file,
                normals,
                up,
                material: Some(material),
                materials,
                translate,
                rotate,
                scale,
                matrix,
            })
        },
    )
}

fn instance() -> impl Strategy<Value = InstanceDescription> {
    let name = || select(&["a", "b", "c"][..]).prop_map(str::to_string);
    (name(), name(), materials_of_groups(), placement()).prop_map(
        |(mesh, material, materials, (translate, rotate, scale, matrix))| InstanceDescription {
            mesh,
            material: Some(material),
            materials,
            translate,
            rotate,
            scale,
            matrix,
        },
    )
}

/// Meshes for instances, which some scenes have.
fn meshes() -> impl Strategy<Value = (BTreeMap<String, MeshFileDescription>, Vec<InstanceDescription>)> {
    let file = || {
        (select(MESHES), normals(), up()).prop_map(|((name, ..), normals, up)| {
            let mut mesh = MeshFileDescription::new(name.to_string());
            (mesh.normals, mesh.up) = (normals, up);
            mesh
        })
    };
    let files = [file(), file(), file()].prop_map(|files| {
        let names = ["a", "b", "c"].map(str::to_string);
        names.into_iter().zip(files).collect()
    });
    let some = (files, prop::collection::vec(instance(), 1..5));
    prop_oneof![3 => Just(Default::default()), 1 => some]
}

/// A few shapes, or so many that they are in a tree. Meshes are few among them, as kernels that walk through trees take seconds
/// to compile.
fn shapes() -> impl Strategy<Value = Vec<ShapeDescription>> {
    let shape = || prop_oneof![9 => shape(), 1 => mesh()];
    let many = MOST_OUTSIDE + 1..MOST_OUTSIDE + 20;
    prop_oneof![11 => prop::collection::vec(shape(), 0..7), 1 => prop::collection::vec(shape(), many)]
}

/// Anywhere: on the surface of something, in the middle of it, or away from all.
fn camera() -> impl Strategy<Value = CameraDescription> {
    let position = prop_oneof![2 => point().prop_map(|p| p * 3.0 + DVec3::new(0.01, -0.02, 0.03)), 1 => point()];
    let look_at = point().prop_map(|p| p * 0.5);
    // Pinholes, lenses and, where one draws a number of blades beyond the most, panoramas.
    let lens = (
        prop_oneof![2 => Just(None), 1 => (0.0..1.0).prop_map(Some)],
        prop::option::of(0.1..8.0),
        0u32..18,
    );
    let sizes = (20.0..120.0, 0.5..6.0);
    (position, look_at, sizes, any::<bool>(), lens).prop_map(|(position, look_at, (fov, height), parallel, lens)| {
        let (aperture, focus_distance, blades) = lens;
        let up = if (look_at - position).cross(DVec3::Z).length() > 0.1 {
            DVec3::Z
        } else {
            DVec3::new(0.3, 1.0, 0.1)
        };
        if blades > 16 {
            CameraDescription::Panorama(PanoramaDescription {
                position,
                look_at,
                up,
                path: None,
            })
        } else if parallel {
            CameraDescription::Orthographic(OrthographicDescription {
                position,
                look_at,
                up,
                height,
                path: None,
            })
        } else {
            CameraDescription::Perspective(PerspectiveDescription {
                up,
                aperture,
                focus_distance,
                blades: if blades < 3 { 0 } else { blades },
                blade_rotation: fov,
                ..PerspectiveDescription::new(position, look_at, fov)
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

/// Scenes of everything.
pub fn description() -> impl Strategy<Value = Description> {
    described((shapes(), meshes()), prop::option::of(of_paths()))
}

/// Scenes of the integrator `phong`.
pub fn of_direct_light() -> impl Strategy<Value = Description> {
    described((shapes(), meshes()), Just(None))
}

/// Scenes of a few primitives, none of which is in a tree.
pub fn without_trees() -> impl Strategy<Value = Description> {
    described(
        (prop::collection::vec(shape(), 0..7), Just(Default::default())),
        Just(None),
    )
}

type Shapes = (
    Vec<ShapeDescription>,
    (BTreeMap<String, MeshFileDescription>, Vec<InstanceDescription>),
);

fn described(
    shapes: impl Strategy<Value = Shapes>,
    paths: impl Strategy<Value = Option<OfPaths>> + 'static,
) -> impl Strategy<Value = Description> {
    // Sometimes so many that a tree chooses among them.
    let few = prop::collection::vec(light(), 0..4);
    let lights = prop_oneof![9 => few, 1 => prop::collection::vec(light(), 17..40)];
    let materials = [material(), material(), material()];
    let size = (1u32..25, 1u32..25);
    let place = (select(&[1.0, 1.0, 0.001, 1000.0][..]), select(&[0.0, 0.0, 100.0][..]));
    let settings = (render().boxed(), paths.boxed());
    (shapes, lights, materials, textures(), camera(), settings, size, place)
        .prop_map(
            |(
                (shapes, (meshes, instances)),
                lights,
                materials,
                textures,
                camera,
                (render, paths),
                (width, height),
                (scale, offset),
            )| {
                let names = ["a", "b", "c"].map(str::to_string);
                let mut d = Description {
                    environment: None,
                    image: ImageDescription::new(width, height),
                    camera,
                    render,
                    textures,
                    materials: names.into_iter().zip(materials).collect(),
                    lights,
                    shapes,
                    meshes,
                    instances,
                };
                if let Some(paths) = paths {
                    let names = ["a", "b", "c"].map(str::to_string);
                    d.materials = names.into_iter().zip(paths.materials).collect();
                    if let Some(environment) = paths.environment {
                        d.render.background = DVec3::ZERO;
                        d.environment = Some(environment);
                    }
                    d.render.integrator = Integrator::Path;
                    d.render.max_depth = paths.max_depth;
                    d.render.rr_depth = paths.rr_depth;
                    d.render.clamp = paths.clamp;
                    d.render.alpha = paths.alpha.then_some(true);
                }
                moved(&mut d, scale, DVec3::new(offset, -offset, offset));
                d
            },
        )
        .prop_filter("a sound scene", |d| d.validate_with(&Assets::beside(folder())).is_ok())
}

/// Scales and moves all that a scene has.
fn moved(d: &mut Description, scale: f64, offset: DVec3) {
    let point = |p: &mut DVec3| *p = *p * scale + offset;
    match &mut d.camera {
        CameraDescription::Perspective(c) => {
            for length in [&mut c.aperture, &mut c.focus_distance].into_iter().flatten() {
                *length *= scale;
            }
            [&mut c.position, &mut c.look_at].map(point)
        }
        CameraDescription::Panorama(c) => [&mut c.position, &mut c.look_at].map(point),
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
            LightDescription::Spot(l) => point(&mut l.position),
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
            ShapeDescription::Mesh(s) => placed(&mut s.translate, &mut s.scale, &mut s.matrix, scale, offset),
            other => panic!("no random scene has the shape {other:?}"),
        }
    }
    for i in &mut d.instances {
        placed(&mut i.translate, &mut i.scale, &mut i.matrix, scale, offset);
    }
}

/// Scales and moves a mesh.
fn placed(
    translate: &mut Option<DVec3>,
    factors: &mut Option<Scale>,
    matrix: &mut Option<Vec<[f64; 4]>>,
    scale: f64,
    offset: DVec3,
) {
    if let Some(rows) = matrix {
        for (row, offset) in rows.iter_mut().zip(offset.to_array()) {
            *row = row.map(|x| x * scale);
            row[3] += offset;
        }
        return;
    }
    *translate = Some(translate.unwrap_or_default() * scale + offset);
    *factors = Some(match factors {
        None => Scale::All(scale),
        Some(Scale::All(s)) => Scale::All(*s * scale),
        Some(Scale::Each(s)) => Scale::Each(*s * scale),
    });
}
