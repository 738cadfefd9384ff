//! From a [`Description`] to a [`Scene`]: every rule that a value of a scene file must keep.
//!
//! The limits keep all that is computed from a scene, squares of lengths included, inside the range of `f32`.

use std::collections::BTreeMap;

use glam::DVec3;

use super::error::{At, Problem};
use super::parse::list;
use super::{
    Camera, CameraDescription, Description, EllipsoidDescription, Geometry, Light,
    LightDescription, Material, MaterialDescription, Parallelogram, Pattern, PhongDescription,
    Projection, Render, RenderDescription, Samples, SamplesDescription, Scene, Shape,
    ShapeDescription,
};

/// Largest absolute coordinate.
const FARTHEST: f64 = 1e9;
/// Smallest and largest length.
const LENGTHS: (f64, f64) = (1e-9, 1e9);
/// Largest component of a colour.
const BRIGHTEST: f64 = 1e6;
/// Most pixels along a side of the picture, and most samples.
const MOST: u32 = 65_536;
/// The sine of the smallest angle between directions that are not parallel; likewise the smallest height of a
/// triangle or tetrahedron relative to its longest edge.
const FLATTEST: f64 = 1e-6;

type Checked<T> = Result<T, Problem>;

impl Description {
    /// Checks every value and makes a scene of them.
    ///
    /// # Errors
    ///
    /// The first value that breaks a rule.
    pub fn validate(&self) -> Result<Scene, Problem> {
        // A map is sorted: a material's index is its place among the names.
        let names = self.materials.keys().map(String::as_str);
        let indices: BTreeMap<_, _> = names.zip(0..).collect();
        Ok(Scene {
            width: side(self.image.width).at("width").at("image")?,
            height: side(self.image.height).at("height").at("image")?,
            camera: camera(&self.camera).at("camera")?,
            render: render(&self.render).at("render")?,
            materials: (self.materials.iter())
                .map(|(name, description)| material(description).at(name.as_str()))
                .collect::<Checked<_>>()
                .at("materials")?,
            lights: each(&self.lights, light).at("lights")?,
            shapes: each(&self.shapes, |description| shape(description, &indices)).at("shapes")?,
        })
    }
}

impl CameraDescription {
    /// Checks a camera by itself.
    ///
    /// # Errors
    ///
    /// The first value that breaks a rule.
    pub fn validate(&self) -> Result<Camera, Problem> {
        camera(self)
    }
}

fn each<D, T>(descriptions: &[D], check: impl Fn(&D) -> Checked<T>) -> Checked<Vec<T>> {
    let descriptions = descriptions.iter().enumerate();
    descriptions
        .map(|(i, description)| check(description).at(i))
        .collect()
}

/// The number of pixels along a side.
pub(super) fn side(pixels: u32) -> Checked<u32> {
    count_to_most(pixels)
}

/// The number of samples of a pattern.
pub(super) fn sample_count(pattern: Pattern, count: u32) -> Checked<u32> {
    count_to_most(count)?;
    let valid = !pattern.needs_square() || count.isqrt().pow(2) == count;
    check(valid, || {
        format!("{count} must be a square number, as its pattern is n x n cells")
    })?;
    Ok(count)
}

fn count_to_most(count: u32) -> Checked<u32> {
    let valid = (1..=MOST).contains(&count);
    check(valid, || format!("{count} must be from 1 to {MOST}"))?;
    Ok(count)
}

fn samples(description: &SamplesDescription) -> Checked<Samples> {
    let SamplesDescription { pattern, count } = *description;
    let count = sample_count(pattern, count).at("count")?;
    Ok(Samples { pattern, count })
}

fn render(description: &RenderDescription) -> Checked<Render> {
    Ok(Render {
        integrator: description.integrator,
        ambient: color(description.ambient).at("ambient")?,
        background: color(description.background).at("background")?,
        shadow_epsilon: between(description.shadow_epsilon, 0.0, 0.1).at("shadow_epsilon")?,
        seed: description.seed,
        pixel_samples: samples(&description.pixel_samples).at("pixel_samples")?,
        light_samples: samples(&description.light_samples).at("light_samples")?,
    })
}

fn camera(description: &CameraDescription) -> Checked<Camera> {
    let (position, look_at, up, projection) = match description {
        CameraDescription::Perspective(camera) => {
            length(camera.focal_length).at("focal_length")?;
            let fov = between(camera.fov, 0.001, 179.999).at("fov")?.to_radians();
            (
                camera.position,
                camera.look_at,
                camera.up,
                Projection::Perspective { fov },
            )
        }
        CameraDescription::Orthographic(camera) => {
            let height = length(camera.height).at("height")?;
            (
                camera.position,
                camera.look_at,
                camera.up,
                Projection::Orthographic { height },
            )
        }
    };
    point(position).at("position")?;
    point(look_at).at("look_at")?;
    let up = unit(up).at("up")?;
    let forward = look_at - position;
    check(forward.length() >= LENGTHS.0, || {
        format!("{} must not be the camera's position", show(look_at))
    })
    .at("look_at")?;
    let forward = forward.normalize();
    let right = forward.cross(up);
    check(right.length() > FLATTEST, || {
        let (look_at, up) = (show(look_at), show(up));
        format!("{look_at} must not lie on the line through the position along up, {up}")
    })
    .at("look_at")?;
    let right = right.normalize();
    Ok(Camera {
        position,
        right,
        up: right.cross(forward),
        forward,
        projection,
    })
}

fn material(description: &MaterialDescription) -> Checked<Material> {
    match description {
        MaterialDescription::Phong(phong) => {
            if let Some(all) = phong.color {
                color(all).at("color")?;
            }
            Ok(Material::Phong {
                ambient: factor(phong, phong.ambient, "ambient")?,
                diffuse: factor(phong, phong.diffuse, "diffuse")?,
                specular: factor(phong, phong.specular, "specular")?,
                shininess: between(phong.shininess, 1e-6, 1e6).at("shininess")?,
            })
        }
    }
}

fn factor(phong: &PhongDescription, own: Option<DVec3>, key: &str) -> Checked<DVec3> {
    let missing = || Problem::new("is missing, and there is no color to stand in for it");
    own.or(phong.color)
        .ok_or_else(missing)
        .and_then(color)
        .at(key)
}

fn light(description: &LightDescription) -> Checked<Light> {
    Ok(match description {
        LightDescription::Rectangle(light) => Light::Rectangle {
            rectangle: rectangle(light.center, light.size, light.normal, light.tangent)?,
            color: color(light.color).at("color")?,
        },
        LightDescription::Point(light) => Light::Point {
            position: point(light.position).at("position")?,
            color: color(light.color).at("color")?,
        },
        LightDescription::Directional(light) => Light::Directional {
            direction: unit(light.direction).at("direction")?,
            color: color(light.color).at("color")?,
        },
    })
}

fn shape(description: &ShapeDescription, materials: &BTreeMap<&str, usize>) -> Checked<Shape> {
    let (geometry, material) = match description {
        ShapeDescription::Rectangle(shape) => {
            let rectangle = rectangle(shape.center, shape.size, shape.normal, shape.tangent)?;
            (Geometry::Rectangle(rectangle), &shape.material)
        }
        ShapeDescription::Ellipsoid(shape) => (ellipsoid(shape)?, &shape.material),
        ShapeDescription::Sphere(shape) => {
            let center = point(shape.center).at("center")?;
            let radius = length(shape.radius).at("radius")?;
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * radius);
            (Geometry::Ellipsoid { center, axes }, &shape.material)
        }
        ShapeDescription::Triangle(shape) => {
            (triangle(shape.vertices).at("vertices")?, &shape.material)
        }
        ShapeDescription::Tetrahedron(shape) => {
            (tetrahedron(shape.vertices).at("vertices")?, &shape.material)
        }
        ShapeDescription::Plane(shape) => {
            let point = point(shape.point).at("point")?;
            let (tangent, bitangent) = frame(shape.normal, shape.tangent)?;
            let plane = Geometry::Plane {
                point,
                tangent,
                bitangent,
            };
            (plane, &shape.material)
        }
    };
    let unknown = || {
        let message = match materials.is_empty() {
            true => format!("{material:?} is no material; the file has none"),
            false => format!(
                "{material:?} is no material; there are {}",
                list(materials.keys())
            ),
        };
        Problem::new(message).at("material")
    };
    let material = *materials.get(material.as_str()).ok_or_else(unknown)?;
    Ok(Shape { geometry, material })
}

fn rectangle(
    center: DVec3,
    size: [f64; 2],
    normal: DVec3,
    tangent: DVec3,
) -> Checked<Parallelogram> {
    let center = point(center).at("center")?;
    let width = length(size[0]).at("size")?;
    let height = length(size[1]).at("size")?;
    let (tangent, bitangent) = frame(normal, tangent)?;
    Ok(Parallelogram {
        center,
        u: tangent * (width / 2.0),
        v: bitangent * (height / 2.0),
    })
}

fn ellipsoid(shape: &EllipsoidDescription) -> Checked<Geometry> {
    let center = point(shape.center).at("center")?;
    let x = unit(shape.a).at("a")?;
    let y = unit(shape.b).at("b")?;
    let z = unit(shape.c).at("c")?;
    check(x.cross(y).length() > FLATTEST, || {
        format!(
            "{} must not be parallel to a, {}",
            show(shape.b),
            show(shape.a)
        )
    })
    .at("b")?;
    check(x.cross(y).dot(z).abs() > FLATTEST, || {
        let (a, b, c) = (show(shape.a), show(shape.b), show(shape.c));
        format!("{c} must not lie in the plane of a and b, {a} and {b}")
    })
    .at("c")?;
    Ok(Geometry::Ellipsoid {
        center,
        axes: [shape.a, shape.b, shape.c],
    })
}

fn triangle(vertices: [DVec3; 3]) -> Checked<Geometry> {
    let longest = longest_edge(&vertices)?;
    let [v0, v1, v2] = vertices;
    let area = (v1 - v0).cross(v2 - v1).length();
    check(area > FLATTEST * longest * longest, || {
        format!("{} must not lie on one line", show_all(&vertices))
    })?;
    Ok(Geometry::Triangles(vec![vertices]))
}

fn tetrahedron(vertices: [DVec3; 4]) -> Checked<Geometry> {
    let longest = longest_edge(&vertices)?;
    let [v0, mut v1, mut v2, v3] = vertices;
    let volume = (v1 - v0).cross(v2 - v0).dot(v3 - v0);
    check(volume.abs() > FLATTEST * longest.powi(3), || {
        format!("{} must not lie in one plane", show_all(&vertices))
    })?;
    if volume < 0.0 {
        // Mirrored: without this the faces would look inwards.
        (v1, v2) = (v2, v1);
    }
    let faces = vec![[v0, v2, v1], [v0, v1, v3], [v1, v2, v3], [v0, v3, v2]];
    Ok(Geometry::Triangles(faces))
}

/// Checks the vertices one by one, then that they are not all the same.
fn longest_edge(vertices: &[DVec3]) -> Checked<f64> {
    for (i, &vertex) in vertices.iter().enumerate() {
        point(vertex).at(i)?;
    }
    let from = |a: &DVec3| vertices.iter().map(|b| a.distance(*b)).fold(0.0, f64::max);
    let longest = vertices.iter().map(from).fold(0.0, f64::max);
    check(longest >= LENGTHS.0, || {
        format!(
            "{} must be at least {} apart",
            show_all(vertices),
            number(LENGTHS.0)
        )
    })?;
    Ok(longest)
}

/// The unit vectors of u and v: the part of the tangent that is orthogonal to the normal, and normal x tangent.
fn frame(normal: DVec3, tangent: DVec3) -> Checked<(DVec3, DVec3)> {
    let n = unit(normal).at("normal")?;
    let t = unit(tangent).at("tangent")?;
    let t = t - n * n.dot(t);
    check(t.length() > FLATTEST, || {
        format!(
            "{} must not be parallel to the normal, {}",
            show(tangent),
            show(normal)
        )
    })
    .at("tangent")?;
    let t = t.normalize();
    Ok((t, n.cross(t)))
}

fn point(p: DVec3) -> Checked<DVec3> {
    for x in p.to_array() {
        check(x.abs() <= FARTHEST, || {
            let (x, limit) = (number(x), number(FARTHEST));
            format!("{x} must be finite, from -{limit} to {limit}")
        })?;
    }
    Ok(p)
}

fn color(c: DVec3) -> Checked<DVec3> {
    for x in c.to_array() {
        check((0.0..=BRIGHTEST).contains(&x), || {
            let (x, limit) = (number(x), number(BRIGHTEST));
            format!("{x} must be finite, from 0 to {limit}")
        })?;
    }
    Ok(c)
}

/// A direction of any length, made a unit vector.
fn unit(direction: DVec3) -> Checked<DVec3> {
    let length = point(direction)?.length();
    check(length >= LENGTHS.0, || {
        let (direction, limit) = (show(direction), number(LENGTHS.0));
        format!("{direction} must not be zero: its length must be at least {limit}")
    })?;
    Ok(direction / length)
}

fn length(x: f64) -> Checked<f64> {
    let (low, high) = LENGTHS;
    check((low..=high).contains(&x), || {
        let (x, low, high) = (number(x), number(low), number(high));
        format!("{x} must be finite and greater than 0, from {low} to {high}")
    })?;
    Ok(x)
}

fn between(x: f64, low: f64, high: f64) -> Checked<f64> {
    check((low..=high).contains(&x), || {
        format!(
            "{} must be from {} to {}",
            number(x),
            number(low),
            number(high)
        )
    })?;
    Ok(x)
}

fn check(valid: bool, message: impl FnOnce() -> String) -> Checked<()> {
    match valid {
        true => Ok(()),
        false => Err(Problem::new(message())),
    }
}

/// A number as a file has it.
fn number(x: f64) -> String {
    let text = format!("{x:?}").to_lowercase();
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

fn show(v: DVec3) -> String {
    format!("[{}, {}, {}]", number(v.x), number(v.y), number(v.z))
}

fn show_all(points: &[DVec3]) -> String {
    let points: Vec<_> = points.iter().map(|&point| show(point)).collect();
    format!("[{}]", points.join(", "))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::super::{Overrides, SceneError};
    use super::*;

    /// One of everything; every line is there once, so that a test can put another in its place.
    const GOOD: &str = r#"
[image]
width = 8
height = 4
[camera]
position = [0, -4, 1]
look_at = [0, 0, 1]
fov = 90
focal_length = 2
[render]
ambient = [0.1, 0.1, 0.1]
background = [0.2, 0.2, 0.2]
shadow_epsilon = 1e-4
seed = 7
pixel_samples = { pattern = "grid", count = 4 }
light_samples = { pattern = "random", count = 3 }
[materials.white]
type = "phong"
color = [0.7, 0.7, 0.7]
specular = [1, 1, 1]
shininess = 20
[materials."dark red"]
type = "phong"
ambient = [0.3, 0, 0]
diffuse = [0.4, 0, 0]
specular = [0.5, 0, 0]
[[lights]]
type = "rectangle"
center = [0, 0, 9]
size = [2, 4]
normal = [0, 0, -3]
tangent = [5, 0, 1]
color = [1, 0.5, 0]
[[lights]]
type = "point"
position = [0, 0, 8]
color = [1, 0.6, 0]
[[lights]]
type = "directional"
direction = [0, 3, -4]
color = [1, 0.7, 0]
[[shapes]] # 0
type = "rectangle"
material = "white"
center = [0, 0, 1.5]
size = [6, 2]
normal = [0, 0, 1]
tangent = [0, 1, 0]
[[shapes]] # 1
type = "ellipsoid"
material = "dark red"
center = [0, 0, 2]
a = [1, 0, 0]
b = [1, 2, 0]
c = [0, 0, 3]
[[shapes]] # 2
type = "sphere"
material = "white" # sphere
center = [0, 0, 3]
radius = 0.5
[[shapes]] # 3
type = "triangle"
material = "white" # triangle
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
[[shapes]] # 4
type = "tetrahedron"
material = "white" # tetrahedron
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
[[shapes]] # 5
type = "plane"
material = "white" # plane
point = [0, 0, 0.5]
normal = [0, 0, 2]
tangent = [1, 1, 0]
"#;

    fn parse(text: &str) -> Result<Scene, SceneError> {
        Scene::parse(text, "s.toml", &Overrides::default())
    }

    /// The good scene with a line changed.
    fn with(line: &str, changed: &str) -> String {
        let line = format!("\n{line}\n");
        assert_eq!(GOOD.matches(&line).count(), 1, "{line}");
        GOOD.replace(&line, &format!("\n{changed}\n"))
    }

    #[test]
    fn a_good_scene_is_what_its_file_says() {
        let scene = parse(GOOD).unwrap();
        assert_eq!((scene.width, scene.height), (8, 4));
        let camera = Camera {
            position: DVec3::new(0.0, -4.0, 1.0),
            right: DVec3::X,
            up: DVec3::Z,
            forward: DVec3::Y,
            projection: Projection::Perspective { fov: FRAC_PI_2 },
        };
        assert_eq!(scene.camera, camera);
        let phong = |ambient, diffuse, specular, shininess| Material::Phong {
            ambient,
            diffuse,
            specular,
            shininess,
        };
        let (white, red) = (DVec3::splat(0.7), DVec3::X);
        let dark_red = phong(red * 0.3, red * 0.4, red * 0.5, 16.0);
        assert_eq!(
            scene.materials,
            [dark_red, phong(white, white, DVec3::ONE, 20.0)]
        );
        let square = |z, u, v| Parallelogram {
            center: DVec3::new(0.0, 0.0, z),
            u,
            v,
        };
        let lights = [
            Light::Rectangle {
                // The tangent's part along the normal is gone; the bitangent is -Z x X.
                rectangle: square(9.0, DVec3::X, DVec3::NEG_Y * 2.0),
                color: DVec3::new(1.0, 0.5, 0.0),
            },
            Light::Point {
                position: DVec3::new(0.0, 0.0, 8.0),
                color: DVec3::new(1.0, 0.6, 0.0),
            },
            Light::Directional {
                direction: DVec3::new(0.0, 0.6, -0.8),
                color: DVec3::new(1.0, 0.7, 0.0),
            },
        ];
        assert_eq!(scene.lights, lights);
        let geometries: Vec<_> = scene.shapes.iter().map(|shape| &shape.geometry).collect();
        let rectangle = square(1.5, DVec3::Y * 3.0, DVec3::NEG_X);
        assert_eq!(geometries[0], &Geometry::Rectangle(rectangle));
        let sphere = Geometry::Ellipsoid {
            center: DVec3::Z * 3.0,
            axes: [DVec3::X * 0.5, DVec3::Y * 0.5, DVec3::Z * 0.5],
        };
        assert_eq!(geometries[2], &sphere);
        let materials: Vec<_> = scene.shapes.iter().map(|shape| shape.material).collect();
        assert_eq!(materials, [1, 0, 1, 1, 1, 1]);
    }

    #[test]
    fn faces_of_a_tetrahedron_look_outwards_however_it_is_given() {
        let line = "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]";
        let mirrored = "vertices = [[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1]]";
        for text in [GOOD.to_owned(), with(line, mirrored)] {
            let scene = parse(&text).unwrap();
            let Geometry::Triangles(faces) = &scene.shapes[4].geometry else {
                panic!("{:?}", scene.shapes[4]);
            };
            assert_eq!(faces.len(), 4);
            for [v0, v1, v2] in faces {
                let normal = (v1 - v0).cross(v2 - v1);
                assert!(normal.dot(*v0 - DVec3::splat(0.2)) > 0.0, "{v0} {v1} {v2}");
            }
        }
    }

    /// A line of the good scene, a bad one in its place, and what is said of it.
    const BAD: &[(&str, &str, &str)] = &[
        (
            "width = 8",
            "width = 0",
            "image.width: 0 must be from 1 to 65536",
        ),
        (
            "height = 4",
            "height = 65537",
            "image.height: 65537 must be from 1 to 65536",
        ),
        (
            "position = [0, -4, 1]",
            "position = [0, nan, 1]",
            "camera.position: nan must be finite, from -1e9 to 1e9",
        ),
        (
            "position = [0, -4, 1]",
            "position = [0, 0, 1]",
            "camera.look_at: [0, 0, 1] must not be the camera's position",
        ),
        (
            "look_at = [0, 0, 1]",
            "look_at = [0, 0, -inf]",
            "camera.look_at: -inf must be finite, from -1e9 to 1e9",
        ),
        (
            "look_at = [0, 0, 1]",
            "look_at = [0, -4, 5]",
            "camera.look_at: [0, -4, 5] must not lie on the line through the position along up, [0, 0, 1]",
        ),
        (
            "fov = 90",
            "fov = 90\nup = [0, 0, 0]",
            "camera.up: [0, 0, 0] must not be zero: its length must be at least 1e-9",
        ),
        (
            "fov = 90",
            "fov = 0",
            "camera.fov: 0 must be from 0.001 to 179.999",
        ),
        (
            "fov = 90",
            "fov = 180",
            "camera.fov: 180 must be from 0.001 to 179.999",
        ),
        (
            "fov = 90",
            "fov = nan",
            "camera.fov: nan must be from 0.001 to 179.999",
        ),
        (
            "focal_length = 2",
            "focal_length = 0",
            "camera.focal_length: 0 must be finite and greater than 0, from 1e-9 to 1e9",
        ),
        (
            "fov = 90\nfocal_length = 2",
            "height = -2\ntype = 'orthographic'",
            "camera.height: -2 must be finite and greater than 0, from 1e-9 to 1e9",
        ),
        (
            "ambient = [0.1, 0.1, 0.1]",
            "ambient = [0, 0, -0.1]",
            "render.ambient: -0.1 must be finite, from 0 to 1000000",
        ),
        (
            "background = [0.2, 0.2, 0.2]",
            "background = [0, inf, 0]",
            "render.background: inf must be finite, from 0 to 1000000",
        ),
        (
            "shadow_epsilon = 1e-4",
            "shadow_epsilon = -1e-9",
            "render.shadow_epsilon: -1e-9 must be from 0 to 0.1",
        ),
        (
            r#"pixel_samples = { pattern = "grid", count = 4 }"#,
            "pixel_samples = { count = 15 }",
            "render.pixel_samples.count: 15 must be a square number, as its pattern is n x n cells",
        ),
        (
            r#"light_samples = { pattern = "random", count = 3 }"#,
            "light_samples = { pattern = 'random', count = 0 }",
            "render.light_samples.count: 0 must be from 1 to 65536",
        ),
        (
            "color = [0.7, 0.7, 0.7]",
            "color = [-1, 0, 0]",
            "materials.white.color: -1 must be finite, from 0 to 1000000",
        ),
        (
            "diffuse = [0.4, 0, 0]",
            "diffuse = [0, 2e6, 0]",
            "materials.\"dark red\".diffuse: 2000000 must be finite, from 0 to 1000000",
        ),
        (
            "shininess = 20",
            "shininess = 0",
            "materials.white.shininess: 0 must be from 1e-6 to 1000000",
        ),
        (
            "center = [0, 0, 9]",
            "center = [2e9, 0, 0]",
            "lights[0].center: 2000000000 must be finite, from -1e9 to 1e9",
        ),
        (
            "size = [2, 4]",
            "size = [2, inf]",
            "lights[0].size: inf must be finite and greater than 0, from 1e-9 to 1e9",
        ),
        (
            "tangent = [5, 0, 1]",
            "tangent = [0, 0, 5]",
            "lights[0].tangent: [0, 0, 5] must not be parallel to the normal, [0, 0, -3]",
        ),
        (
            "color = [1, 0.5, 0]",
            "color = [nan, 0, 0]",
            "lights[0].color: nan must be finite, from 0 to 1000000",
        ),
        (
            "position = [0, 0, 8]",
            "position = [0, 0, inf]",
            "lights[1].position: inf must be finite, from -1e9 to 1e9",
        ),
        (
            "direction = [0, 3, -4]",
            "direction = [0, 0, 0]",
            "lights[2].direction: [0, 0, 0] must not be zero: its length must be at least 1e-9",
        ),
        (
            "size = [6, 2]",
            "size = [6, -1]",
            "shapes[0].size: -1 must be finite and greater than 0, from 1e-9 to 1e9",
        ),
        (
            "size = [6, 2]",
            "size = [0, 2]",
            "shapes[0].size: 0 must be finite and greater than 0, from 1e-9 to 1e9",
        ),
        (
            "normal = [0, 0, 1]",
            "normal = [0, 0, 0]",
            "shapes[0].normal: [0, 0, 0] must not be zero: its length must be at least 1e-9",
        ),
        (
            "tangent = [0, 1, 0]",
            "tangent = [0, 1e-7, 1]",
            "shapes[0].tangent: [0, 1e-7, 1] must not be parallel to the normal, [0, 0, 1]",
        ),
        (
            "a = [1, 0, 0]",
            "a = [0, 0, 0]",
            "shapes[1].a: [0, 0, 0] must not be zero: its length must be at least 1e-9",
        ),
        (
            "b = [1, 2, 0]",
            "b = [-2, 0, 0]",
            "shapes[1].b: [-2, 0, 0] must not be parallel to a, [1, 0, 0]",
        ),
        (
            "c = [0, 0, 3]",
            "c = [1, 1, 0]",
            "shapes[1].c: [1, 1, 0] must not lie in the plane of a and b, [1, 0, 0] and [1, 2, 0]",
        ),
        (
            "radius = 0.5",
            "radius = -0.5",
            "shapes[2].radius: -0.5 must be finite and greater than 0, from 1e-9 to 1e9",
        ),
        (
            "radius = 0.5",
            "radius = nan",
            "shapes[2].radius: nan must be finite and greater than 0, from 1e-9 to 1e9",
        ),
        (
            "material = \"white\" # sphere",
            "material = \"blue\"",
            "shapes[2].material: \"blue\" is no material; there are \"dark red\", \"white\"",
        ),
        (
            "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
            "vertices = [[0, 0, 0], [1, 1, 1], [2, 2, 2]]",
            "shapes[3].vertices: [[0, 0, 0], [1, 1, 1], [2, 2, 2]] must not lie on one line",
        ),
        (
            "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
            "vertices = [[1, 2, 3], [1, 2, 3], [1, 2, 3]]",
            "shapes[3].vertices: [[1, 2, 3], [1, 2, 3], [1, 2, 3]] must be at least 1e-9 apart",
        ),
        (
            "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
            "vertices = [[0, 0, 0], [1, nan, 0], [0, 1, 0]]",
            "shapes[3].vertices[1]: nan must be finite, from -1e9 to 1e9",
        ),
        (
            "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
            "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]",
            "shapes[4].vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]] must not lie in one plane",
        ),
        (
            "tangent = [1, 1, 0]",
            "tangent = [0, 0, -1]",
            "shapes[5].tangent: [0, 0, -1] must not be parallel to the normal, [0, 0, 2]",
        ),
    ];

    #[test]
    fn bad_values_are_told_with_line_key_value_and_rule() {
        for &(line, bad, told) in BAD {
            let text = with(line, bad);
            // The line of the key that is told; the text is searched from the change on, or from the camera's.
            let key = told.split(": ").next().unwrap().rsplit('.').next().unwrap();
            let key = key.split('[').next().unwrap();
            let in_change = bad.lines().position(|line| line.starts_with(key));
            let place = match in_change {
                Some(offset) => text[..text.find(bad).unwrap()].lines().count() + 1 + offset,
                None => text.lines().position(|line| line.starts_with(key)).unwrap() + 1,
            };
            let message = parse(&text).unwrap_err().to_string();
            assert_eq!(message, format!("s.toml:{place}: {told}"));
        }
    }

    #[test]
    fn values_at_the_limits_are_good() {
        for (line, good) in [
            ("width = 8", "width = 65536"),
            ("height = 4", "height = 1"),
            ("look_at = [0, 0, 1]", "look_at = [1e9, 0, -1e9]"),
            ("fov = 90", "fov = 179.999"),
            ("fov = 90", "fov = 0.001"),
            ("shadow_epsilon = 1e-4", "shadow_epsilon = 0"),
            (
                r#"pixel_samples = { pattern = "grid", count = 4 }"#,
                "pixel_samples = { count = 65536 }",
            ),
            ("color = [0.7, 0.7, 0.7]", "color = [0, -0.0, 1e6]"),
            ("size = [6, 2]", "size = [1e-9, 1e9]"),
            ("tangent = [0, 1, 0]", "tangent = [0, 1e-5, 1]"),
            ("c = [0, 0, 3]", "c = [1, 1, 1e-5]"),
            (
                "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
                "vertices = [[0, 0, 0], [1, 1e-5, 0], [2, 0, 0]]",
            ),
        ] {
            parse(&with(line, good)).unwrap();
        }
    }

    #[test]
    fn a_factor_without_color_is_missing() {
        let message = parse(&with("diffuse = [0.4, 0, 0]", ""))
            .unwrap_err()
            .to_string();
        let line = GOOD
            .lines()
            .position(|line| line.starts_with("[materials.\"dark"))
            .unwrap()
            + 1;
        let told = "is missing, and there is no color to stand in for it";
        assert_eq!(
            message,
            format!("s.toml:{line}: materials.\"dark red\".diffuse: {told}")
        );
    }

    #[test]
    fn a_scene_may_be_empty_but_not_name_a_material_that_is_not_there() {
        let empty = "image = { width = 1, height = 1 }\ncamera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 1 }\n";
        assert_eq!(parse(empty).unwrap().shapes, []);
        let text = format!(
            "{empty}[[shapes]]\ntype = 'sphere'\ncenter = [0, 0, 0]\nradius = 1\nmaterial = 'a'\n"
        );
        let told = "s.toml:7: shapes[0].material: \"a\" is no material; the file has none";
        assert_eq!(parse(&text).unwrap_err().to_string(), told);
    }
}
