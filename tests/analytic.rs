//! Images with closed-form pixel values, rendered on CPU and GPU. Most tests also check that wrong values are rejected.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use wgray::scene::{
    CameraDescription, ColorDescription, Description, DirectionalLightDescription, EllipsoidDescription,
    ImageDescription, LightDescription, MaterialDescription, OrthographicDescription, Pattern, PhongDescription,
    PlaneDescription, PointLightDescription, RectangleLightDescription, RenderDescription, SamplesDescription,
    ShapeDescription, SphereDescription,
};

use crate::pictures::{RenderMode, both, first_hits, means, render};
use crate::scenes::packed;

/// Width and height of the image in pixels.
const SIDE: u32 = 64;

fn grid(count: u32) -> SamplesDescription {
    SamplesDescription {
        pattern: Some(Pattern::Grid),
        count,
    }
}

fn empty_scene(camera_position: DVec3, look_at: DVec3, up: DVec3, height: f64) -> Description {
    let camera = OrthographicDescription {
        position: camera_position,
        look_at,
        up,
        height,
        path: None,
    };
    Description {
        environment: None,
        image: ImageDescription::new(SIDE, SIDE),
        camera: CameraDescription::Orthographic(camera),
        render: RenderDescription {
            pixel_samples: grid(1),
            shadow_epsilon: 1e-6,
            ..Default::default()
        },
        textures: Default::default(),
        materials: Default::default(),
        lights: Vec::new(),
        shapes: Vec::new(),
        meshes: Default::default(),
        instances: Vec::new(),
    }
}

/// Returns a scene with the plane z = 0 and a camera above it.
fn floor_scene(
    camera_position: DVec3,
    height: f64,
    [ambient, diffuse, specular]: [f64; 3],
    shininess: f64,
) -> Description {
    let mut scene = empty_scene(
        camera_position,
        DVec3::new(camera_position.x, camera_position.y, 0.0),
        DVec3::Y,
        height,
    );
    let factor = |x| Some(ColorDescription::Plain(DVec3::splat(x)));
    let phong = PhongDescription {
        color: None,
        ambient: factor(ambient),
        diffuse: factor(diffuse),
        specular: factor(specular),
        shininess,
        normal_map: None,
        emission: None,
        visible: None,
    };
    scene.materials.insert("m".into(), MaterialDescription::Phong(phong));
    scene.shapes.push(ShapeDescription::Plane(PlaneDescription {
        material: "m".into(),
        point: DVec3::ZERO,
        normal: DVec3::Z,
        tangent: Some(DVec3::X),
    }));
    scene
}

fn floor_point(camera_position: DVec3, height: f64, pixel: u32) -> DVec2 {
    let step = height / f64::from(SIDE);
    let (column, row) = (f64::from(pixel % SIDE) + 0.5, f64::from(pixel / SIDE) + 0.5);
    DVec2::new(
        camera_position.x + column * step - height / 2.0,
        camera_position.y + height / 2.0 - row * step,
    )
}

/// Returns the maximum absolute error of the green channel.
fn max_error(scene: &Description, mode: RenderMode, expected: impl Fn(u32) -> f64) -> f64 {
    let picture = means(&render(&packed(scene), mode));
    let difference = |(i, mean): (u32, &[f64; 3])| (mean[1] - expected(i)).abs();
    (0..)
        .zip(&picture)
        .map(difference)
        .fold(0.0, |a, b| if b <= a { a } else { b })
}

/// Returns an antiderivative of 1 / sqrt(x^2 + y^2 + h^2) over x and y.
fn antiderivative(x: f64, y: f64, h: f64) -> f64 {
    let r = (x * x + y * y + h * h).sqrt();
    x * (y / (x * x + h * h).sqrt()).asinh() + y * (x / (y * y + h * h).sqrt()).asinh() - h * (x * y / (h * r)).atan()
}

/// Returns the mean of h / r, the cosine at the plane, over a parallel rectangle at height h, where r is the distance
/// from a point in the plane. `point` is relative to the rectangle's center.
fn mean_cosine([width, height]: [f64; 2], h: f64, point: DVec2) -> f64 {
    let (x0, x1) = (-width / 2.0 - point.x, width / 2.0 - point.x);
    let (y0, y1) = (-height / 2.0 - point.y, height / 2.0 - point.y);
    let integral =
        antiderivative(x1, y1, h) - antiderivative(x0, y1, h) - antiderivative(x1, y0, h) + antiderivative(x0, y0, h);
    h * integral / (width * height)
}

#[test]
fn the_closed_form_of_the_mean_cosine_is_correct() {
    let (size, h) = ([1.5, 0.5], 0.8);
    for point in [DVec2::ZERO, DVec2::new(0.3, -0.2), DVec2::new(2.0, 1.0)] {
        let n = 1000;
        let mut sum = 0.0;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let coordinate = |k: i32, size: f64| ((f64::from(k) + 0.5) / f64::from(n) - 0.5) * size;
            let offset = DVec3::new(coordinate(i, size[0]) - point.x, coordinate(j, size[1]) - point.y, h);
            sum += h / offset.length();
        }
        let mean = sum / f64::from(n * n);
        assert!((mean - mean_cosine(size, h, point)).abs() < 1e-6, "{point}: {mean}");
    }
}

/// Pixels equal the mean cosine up to the error of the sample grid, which is a midpoint rule.
#[test]
fn a_rectangle_light_gives_the_mean_cosine_on_a_plane() {
    let (camera_position, height) = (DVec3::new(0.3, 0.2, 0.5), 4.0);
    let (size, h) = ([1.5, 0.5], 0.8);
    let mut scene = floor_scene(camera_position, height, [0.0, 0.7, 0.0], 1.0);
    scene.render.light_samples = grid(1024);
    scene
        .lights
        .push(LightDescription::Rectangle(RectangleLightDescription {
            center: DVec3::new(0.0, 0.0, h),
            size,
            normal: -DVec3::Z,
            tangent: Some(DVec3::X),
            color: DVec3::splat(0.9),
            visible: true,
        }));
    let swapped = [size[1], size[0]];
    for mode in both() {
        let error_against = |expected: &dyn Fn(DVec2) -> f64| {
            max_error(&scene, mode, |pixel| {
                0.9 * 0.7 * expected(floor_point(camera_position, height, pixel))
            })
        };
        let error = error_against(&|point| mean_cosine(size, h, point));
        println!("{mode:?}: the maximum error of the light of a rectangle is {error:.1e}");
        assert!(error < 1e-4, "{mode:?}: {error}");
        assert!(!(error_against(&|_| 1.0) < 1e-2), "a missing cosine is accepted");
        assert!(
            !(error_against(&|point| mean_cosine(swapped, h, point)) < 1e-2),
            "swapped axes are accepted"
        );
        let pixel = height / f64::from(SIDE);
        assert!(
            !(error_against(&|point| mean_cosine(size, h, point + DVec2::X * pixel)) < 1e-2),
            "a shifted pixel is accepted"
        );
    }
}

/// The outline of the shadow is a conic section, here an ellipse.
#[test]
fn the_shadow_of_a_sphere_is_an_ellipse() {
    let (camera_position, height) = (DVec3::new(1.6, 0.0, 1.0), 2.4);
    let (center, radius, light) = (DVec3::new(0.0, 0.0, 2.0), 0.5, DVec3::new(-3.0, 0.0, 6.0));
    let mut scene = floor_scene(camera_position, height, [0.0, 1.0, 0.0], 1.0);
    scene.materials.insert("s".into(), scene.materials["m"].clone());
    scene.shapes.push(ShapeDescription::Sphere(SphereDescription {
        material: "s".into(),
        center,
        radius,
    }));
    let point = PointLightDescription {
        position: light,
        color: DVec3::ONE,
    };
    scene.lights.push(LightDescription::Point(point));
    let axis = center - light;
    let half_angle = (radius / axis.length()).asin();
    // Signed angle to the surface of the shadow cone, positive inside.
    let signed_angle = |position: DVec2| half_angle - (position.extend(0.0) - light).angle_between(axis);
    for mode in both() {
        let picture = means(&render(&packed(&scene), mode));
        let is_lit = |pixel: u32| picture[pixel as usize][1] > 0.0;
        let wrong_pixels = |shift: DVec2, margin: f64| {
            let pixels = (0..SIDE * SIDE)
                .filter(|pixel| signed_angle(floor_point(camera_position, height, *pixel)).abs() > margin);
            pixels
                .filter(|pixel| {
                    is_lit(*pixel) == (signed_angle(floor_point(camera_position, height, *pixel) + shift) > 0.0)
                })
                .count()
        };
        assert_eq!(wrong_pixels(DVec2::ZERO, 1e-5), 0, "{mode:?}");
        let pixel = height / f64::from(SIDE);
        assert!(wrong_pixels(DVec2::X * pixel, 1e-5) > 20, "a shifted pixel is accepted");
        assert!(wrong_pixels(DVec2::Y * pixel, 1e-5) > 20, "a shifted pixel is accepted");
        // Semi-axes of the ellipse; `tilt` is the angle between the cone's axis and the vertical.
        let tilt = (axis.x / axis.z).abs().atan();
        let major_axis = light.z * ((tilt + half_angle).tan() - (tilt - half_angle).tan()) / 2.0;
        let minor_axis = major_axis * (1.0 - (tilt.sin() / half_angle.cos()).powi(2)).sqrt();
        let shadow_area = (0..SIDE * SIDE).filter(|pixel| !is_lit(*pixel)).count() as f64 * pixel * pixel;
        println!(
            "{mode:?}: the area of the shadow is {shadow_area:.4}, expected {:.4}",
            PI * major_axis * minor_axis
        );
        assert!(
            (shadow_area / (PI * major_axis * minor_axis) - 1.0).abs() < 0.01,
            "{mode:?}: {shadow_area}"
        );
        assert!(
            !((shadow_area / (PI * major_axis * major_axis) - 1.0).abs() < 0.05),
            "a circle is accepted"
        );
        // Outside the shadow, only the cosine remains, because a point light has no falloff.
        let errors = (0..SIDE * SIDE).filter(|pixel| is_lit(*pixel)).map(|pixel| {
            let to_light = light - floor_point(camera_position, height, pixel).extend(0.0);
            (picture[pixel as usize][1] - to_light.z / to_light.length()).abs()
        });
        assert!(errors.fold(0.0, f64::max) < 1e-5);
    }
}

/// The projected area of an ellipsoid with axes a, b, c along d is pi |((a x b).d, (b x c).d, (c x a).d)|.
#[test]
fn outlines_of_ellipsoids_have_the_projected_area() {
    let ellipsoids = [
        (
            DVec3::new(0.1, 0.2, -0.1),
            [
                DVec3::new(0.9, 0.3, 0.0),
                DVec3::new(-0.2, 0.6, 0.1),
                DVec3::new(0.1, 0.0, 0.4),
            ],
        ),
        (DVec3::new(-0.3, 0.1, 0.2), [DVec3::X, DVec3::Y, DVec3::Z]),
        (
            DVec3::new(0.2, -0.4, 0.0),
            [DVec3::X * 1.2, DVec3::new(0.6, 0.5, 0.0), DVec3::Z * 0.2],
        ), // sheared
    ];
    let views = [
        DVec3::new(0.0, -5.0, 0.0),
        DVec3::new(3.0, -3.0, 2.0),
        DVec3::new(-2.0, 1.0, 4.0),
    ];
    for ((center, [a, b, c]), view) in ellipsoids.into_iter().flat_map(|e| views.map(|view| (e, view))) {
        let height = 4.0;
        let mut scene = floor_scene(DVec3::Z, 1.0, [1.0, 0.0, 0.0], 1.0);
        scene.camera = empty_scene(view, DVec3::ZERO, DVec3::Z, height).camera;
        (scene.image.width, scene.image.height) = (256, 256);
        scene.shapes = vec![ShapeDescription::Ellipsoid(EllipsoidDescription {
            material: "m".into(),
            center,
            a,
            b,
            c,
        })];
        let forward = -view.normalize();
        let right = forward.cross(DVec3::Z).normalize();
        let up = right.cross(forward);
        let projection = DVec3::new(
            a.cross(b).dot(forward),
            b.cross(c).dot(forward),
            c.cross(a).dot(forward),
        );
        let area = PI * projection.length();
        let pixel = height / 256.0;
        // Offset from the image center in pixels, to the right and down.
        let expected_center = DVec2::new(center.dot(right), -center.dot(up)) / pixel;
        for mode in both() {
            let hits = first_hits(&packed(&scene), mode);
            let covered: Vec<DVec2> = (0u32..)
                .zip(&hits)
                .filter(|(_, hit)| hit.shape == 0)
                .map(|(i, _)| DVec2::new(f64::from(i % 256) - 127.5, f64::from(i / 256) - 127.5))
                .collect();
            let covered_area = covered.len() as f64 * pixel * pixel;
            let centroid = covered.iter().sum::<DVec2>() / covered.len() as f64;
            assert!(
                (covered_area / area - 1.0).abs() < 0.005,
                "{mode:?} {center} from {view}: the area is {covered_area}, expected {area}"
            );
            assert!(
                (centroid - expected_center).length() < 0.1,
                "{mode:?} {center} from {view}: the center is {centroid}, expected {expected_center}"
            );
            assert!(
                !((centroid + DVec2::X - expected_center).length() < 0.1),
                "a shifted pixel is accepted"
            );
            // Depth of the center minus the half-extent along the view direction.
            let half_extent = [a, b, c]
                .map(|axis| axis.dot(forward))
                .map(|h| h * h)
                .iter()
                .sum::<f64>()
                .sqrt();
            let expected = (center - view).dot(forward) - half_extent;
            let nearest = hits
                .iter()
                .filter(|hit| hit.shape == 0)
                .map(|hit| f64::from(hit.depth))
                .fold(1e9, f64::min);
            assert!(
                (0.0..1e-3).contains(&(nearest - expected + 1e-6)),
                "{mode:?}: the depth is {nearest}, expected {expected}"
            );
        }
    }
}

/// The radiance along the normal is constant: kd n.l + ks (r.v)^s.
#[test]
fn a_directional_light_gives_constant_radiance_on_a_plane() {
    for (exponent, wrong_exponent) in [(16.0, 15.0), (2.5, 2.4), (0.5, 0.6), (1.0, 1.5)] {
        let mut scene = floor_scene(DVec3::new(5.0, -3.0, 2.0), 1.0, [0.0, 0.4, 0.6], exponent);
        let direction = DVec3::new(0.3, -0.2, -1.0);
        scene
            .lights
            .push(LightDescription::Directional(DirectionalLightDescription {
                direction,
                color: DVec3::ONE,
            }));
        let cosine = -direction.z / direction.length();
        // The view direction v is the normal, hence r.v equals n.l.
        let expected = |exponent: f64| 0.4 * cosine + 0.6 * cosine.powf(exponent);
        for mode in both() {
            let error = max_error(&scene, mode, |_| expected(exponent));
            assert!(error < 1e-6, "{mode:?}, shininess {exponent}: {error}");
            assert!(
                !(max_error(&scene, mode, |_| expected(wrong_exponent)) < 1e-4),
                "a wrong shininess is accepted"
            );
        }
        // Seen from below, the plane is black: the normal faces the viewer, so the light is behind the surface.
        scene.camera = empty_scene(-DVec3::Z, DVec3::ZERO, DVec3::Y, 1.0).camera;
        for mode in both() {
            assert_eq!(max_error(&scene, mode, |_| 0.0), 0.0, "{mode:?}");
        }
    }
}
