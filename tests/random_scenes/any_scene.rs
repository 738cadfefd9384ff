//! Proptest strategies for small valid scenes with all features of the scene format, except image textures and glTF
//! files.

mod files;
mod materials;
mod moved;
mod shapes;
mod values;

use std::collections::BTreeMap;

use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::select;
use wgray::scene::*;
use wgray_render::pack::pack;
use wgray_trace::records::Packed;

use self::files::ENVIRONMENT_MAPS;
pub use self::files::folder;
use self::materials::*;
pub use self::moved::scale_and_translate;
use self::shapes::*;
use self::values::*;
use crate::patterns;

pub fn packed(description: &Description) -> Packed {
    let assets = Assets::beside(folder());
    pack(
        &description
            .validate_with(&assets)
            .unwrap_or_else(|problem| panic!("{problem}")),
    )
}

#[derive(Clone, Debug)]
struct PathSettings {
    materials: [MaterialDescription; 3],
    environment: Option<EnvironmentDescription>,
    max_depth: u32,
    rr_depth: Option<u32>,
    clamp: Option<f64>,
    alpha: bool,
}

fn environment_map_or_color() -> BoxedStrategy<EnvironmentDescription> {
    let image = (
        select(ENVIRONMENT_MAPS),
        select(&[1.0, 0.3, 0.0][..]),
        prop::option::of(-180.0..180.0),
        prop_oneof![2 => Just((true, None)), 1 => Just((false, None)), 1 => color(2.0).prop_map(|background| (true, Some(background)))],
    );
    let image = image.prop_map(|((file, ..), scale, degrees, (visible, background))| {
        let mut environment = EnvironmentDescription::image(file);
        environment.scale = scale;
        environment.rotate =
            degrees.map(|degrees| EnvironmentRotation::Any(Rotation::Angles(DVec3::new(degrees, 20.0, -degrees))));
        environment.visible = visible;
        environment.background = background;
        environment
    });
    prop_oneof![1 => color(1.0).prop_map(EnvironmentDescription::new), 1 => image].boxed()
}

fn path_settings() -> BoxedStrategy<PathSettings> {
    let materials = [path_material(), path_material(), path_material()];
    let environment = prop::option::of(environment_map_or_color());
    let depths = (
        select(&[0, 1, 2, 5, 12][..]),
        prop::option::of(select(&[0, 1, 3, 1024][..])),
    );
    let clamp = prop::option::of(select(&[0.1, 2.0][..]));
    (materials, environment, depths, clamp, any::<bool>())
        .prop_map(
            |(materials, environment, (max_depth, rr_depth), clamp, alpha)| PathSettings {
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

fn light() -> BoxedStrategy<LightDescription> {
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
                tangent: Some(tangent),
                color,
            })
        });
    let point_light = (point(), color(1.0))
        .prop_map(|(position, color)| LightDescription::Point(PointLightDescription { position, color }));
    let directional = (direction(), color(1.0))
        .prop_map(|(direction, color)| LightDescription::Directional(DirectionalLightDescription { direction, color }));
    let angles = (select(&[180.0, 90.0, 40.0, 15.0][..]), select(&[0.0, 0.5, 1.0][..]));
    let spot =
        (point(), direction(), color(1.0), angles).prop_map(|(position, direction, color, (cone_angle, fraction))| {
            LightDescription::Spot(SpotLightDescription {
                position,
                direction: Some(direction),
                look_at: None,
                color,
                cone_angle,
                inner_angle: fraction * cone_angle,
            })
        });
    prop_oneof![4 => rectangle, 2 => point_light, 2 => directional, 1 => spot].boxed()
}

/// Generates cameras on surfaces, inside shapes, or outside.
fn camera() -> BoxedStrategy<CameraDescription> {
    let position = prop_oneof![2 => point().prop_map(|p| p * 3.0 + DVec3::new(0.01, -0.02, 0.03)), 1 => point()];
    let look_at = point().prop_map(|p| p * 0.5);
    // A pinhole, a thin lens, or a panorama if the number of blades exceeds the maximum.
    let lens = (
        prop_oneof![2 => Just(None), 1 => (0.0..1.0).prop_map(Some)],
        prop::option::of(0.1..8.0),
        0u32..18,
    );
    let sizes = (20.0..120.0, 0.5..6.0);
    (position, look_at, sizes, any::<bool>(), lens)
        .prop_map(|(position, look_at, (fov, height), is_orthographic, lens)| {
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
            } else if is_orthographic {
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
        .boxed()
}

fn render() -> BoxedStrategy<RenderDescription> {
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
    let options = (any::<bool>(), 1u32..6, any::<bool>(), select(kinds), any::<bool>());
    (color(1.0), color(1.0), epsilon, any::<u32>(), samples, options)
        .prop_map(
            |(
                ambient,
                background,
                shadow_epsilon,
                seed,
                (pixel_pattern, pixel_samples, light_pattern, light_samples),
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
                    pixel_samples: patterns::samples(pixel_pattern, pixel_samples),
                    light_samples: patterns::samples(light_pattern, light_samples),
                    filter: PixelFilterDescription { kind, radius: None },
                    adaptive: (adaptive && pixel_pattern.is_extensible()).then_some(AdaptiveDescription {
                        error: 0.02,
                        max_samples: Some(16),
                    }),
                    ..RenderDescription::default()
                }
            },
        )
        .boxed()
}

/// Generates scenes of both integrators.
pub fn description() -> BoxedStrategy<Description> {
    description_with((shapes(), meshes()), prop::option::of(path_settings())).boxed()
}

pub fn direct_light_description() -> BoxedStrategy<Description> {
    description_with((shapes(), meshes()), Just(None)).boxed()
}

/// Generates scenes with too few primitives for a BVH.
pub fn without_trees() -> BoxedStrategy<Description> {
    description_with(
        (prop::collection::vec(shape(), 0..7), Just(Default::default())),
        Just(None),
    )
    .boxed()
}

type Shapes = (
    Vec<ShapeDescription>,
    (BTreeMap<String, MeshFileDescription>, Vec<InstanceDescription>),
);

fn description_with(
    shapes: impl Strategy<Value = Shapes> + 'static,
    paths: impl Strategy<Value = Option<PathSettings>> + 'static,
) -> BoxedStrategy<Description> {
    // Sometimes, the lights are enough for a light tree.
    let few = prop::collection::vec(light(), 0..4);
    let lights = prop_oneof![9 => few, 1 => prop::collection::vec(light(), 17..40)];
    let materials = [material(), material(), material()];
    let size = (1u32..25, 1u32..25);
    let placement = (select(&[1.0, 1.0, 0.001, 1000.0][..]), select(&[0.0, 0.0, 100.0][..]));
    let settings = (render().boxed(), paths.boxed());
    (
        shapes,
        lights,
        materials,
        textures(),
        camera(),
        settings,
        size,
        placement,
    )
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
                let mut description = Description {
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
                    description.materials = names.into_iter().zip(paths.materials).collect();
                    if let Some(environment) = paths.environment {
                        description.render.background = DVec3::ZERO;
                        description.environment = Some(environment);
                    }
                    description.render.integrator = Some(Integrator::Path);
                    description.render.max_depth = paths.max_depth;
                    description.render.rr_depth = paths.rr_depth;
                    description.render.clamp = paths.clamp;
                    description.render.alpha = paths.alpha.then_some(true);
                }
                scale_and_translate(&mut description, scale, DVec3::new(offset, -offset, offset));
                description
            },
        )
        .prop_filter("a valid scene", |description| {
            description.validate_with(&Assets::beside(folder())).is_ok()
        })
        .boxed()
}
