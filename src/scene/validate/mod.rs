//! From a [`Description`] to a [`Scene`]: every rule that a value of a scene file must keep.
//!
//! The limits keep all that is computed from a scene, squares of lengths included, inside the range of `f32`.

mod appearance;
mod camera;
mod default_material;
mod environment;
mod integrator;
mod light;
mod mesh;
mod mtl;
mod path;
mod principled;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use glam::DVec3;

use self::appearance::{Images, Textures};
use self::mesh::Known;
use self::mtl::Looks;
use super::error::{At, Problem, cut};
use super::gltf::Expanded;
use super::limits::{
    CLAMPS, COLORS, DEEPEST, FARTHEST, FILTER_RADII, LEAST_ADAPTIVE, LENGTHS, MOST, SHADOW_EPSILONS, SHARES,
};
use super::parse::list;
use super::{
    Adaptive, AdaptiveDescription, Assets, Color, Description, EllipsoidDescription, Environment, Geometry,
    ImageDescription, InstanceDescription, Integrator, Light, LightDescription, Material, Parallelogram, Pattern,
    PixelFilter, PixelFilterDescription, Render, RenderDescription, Samples, SamplesDescription, Scene, Shadows, Shape,
    ShapeDescription, Texture, ViewSettings,
};

pub(super) use self::appearance::TEXEL_MEMORY;
pub(super) use self::mesh::{placement, turned_up};
pub(super) use self::path::LIGHT_SAMPLES;

/// From which bounce on a path may end at random, if nothing is said.
const RR_DEPTH: u32 = 5;
/// The sine of the smallest angle between directions that are not parallel; likewise the smallest height of a
/// triangle or tetrahedron relative to its longest edge.
const FLATTEST: f64 = 1e-6;

type Checked<T> = Result<T, Problem>;

impl Description {
    /// Checks every value and makes a scene of them. Image files that they name are in the current folder.
    ///
    /// # Errors
    ///
    /// The first value that breaks a rule.
    pub fn validate(&self) -> Result<Scene, Problem> {
        self.validate_with(&Assets::beside(Path::new(".")))
    }

    /// Checks every value, the files that they name among them, and makes a scene of them.
    ///
    /// # Errors
    ///
    /// The first value that breaks a rule.
    pub fn validate_with(&self, assets: &Assets) -> Result<Scene, Problem> {
        self.validate_and_list(assets, &mut BTreeSet::new())
    }

    /// [`Description::validate_with`]. What files the scene is made of is told even if it breaks a rule.
    pub(super) fn validate_and_list(&self, assets: &Assets, files: &mut BTreeSet<PathBuf>) -> Result<Scene, Problem> {
        files.extend(self.files_beside(assets));
        let integrator = self.integrator();
        let has_gltf = self
            .shapes
            .iter()
            .any(|shape| matches!(shape, ShapeDescription::Gltf(_)));
        let mut scene = match has_gltf {
            false => self.validate_plain(integrator, assets, files)?,
            true => {
                let expanded = Expanded::of(self, assets, files)?;
                let scene = expanded.description.validate_plain(integrator, &expanded.assets, files);
                let mut scene = scene.map_err(|problem| expanded.place(self, problem))?;
                scene.notes.splice(0..0, expanded.notes);
                scene.imported = expanded.imported;
                scene
            }
        };
        let chosen = integrator::note(self);
        scene.notes.splice(0..0, chosen);
        Ok(scene)
    }

    /// Validates a description without glTF files.
    fn validate_plain(
        &self,
        integrator: Integrator,
        assets: &Assets,
        files: &mut BTreeSet<PathBuf>,
    ) -> Result<Scene, Problem> {
        // A map is sorted: a material's index is its place among the names.
        let names = self.materials.keys().map(String::as_str);
        let indices: BTreeMap<_, _> = names.zip(0..).collect();
        let mut images = Images::new(assets);
        let (mut textures, damaged) = appearance::textures(&self.textures, &mut images).at("textures")?;
        let alphas = appearance::alphas(&self.materials, &self.textures, &mut images, &mut textures);
        let known = Textures {
            names: self.textures.keys().map(String::as_str).collect(),
            textures: &textures,
            alphas,
            damaged,
            integrator,
        };
        let materials = (self.materials.iter())
            .map(|(name, description)| known.material(description).at(name.as_str()))
            .collect::<Checked<Vec<_>>>()
            .at("materials")?;
        let environment = environment::environment(self, integrator, &mut images).at("environment")?;
        let own = (self.materials.keys().cloned().collect(), materials);
        let mut known = Known {
            names: &indices,
            looks: Looks::new(own, textures, images, files, integrator),
            assets,
        };
        let mut shapes = each(&self.shapes, |description| shape(description, &mut known)).at("shapes")?;
        let meshes = (self.meshes.iter())
            .map(|(name, description)| Ok((name.as_str(), mesh::named(description, &mut known).at(name.as_str())?)))
            .collect::<Checked<BTreeMap<_, _>>>()
            .at("meshes")?;
        let instance = |description: &InstanceDescription| mesh::instance(description, &meshes, &mut known);
        shapes.extend(each(&self.instances, instance).at("instances")?);
        mesh::few_groups(&shapes).at("instances")?;
        let mut notes = mesh::notes(&self.shapes, &shapes, &meshes);
        let mut looks = known.looks;
        if let Some(damage) = looks.damage() {
            return Err(damage);
        }
        let material_names = std::mem::take(&mut looks.names);
        let materials = std::mem::take(&mut looks.materials);
        let textures = std::mem::take(&mut looks.textures);
        let files = looks.files.iter().cloned().collect();
        notes.extend(looks.notes());
        notes.extend(path::notes(
            (&self.render, integrator),
            (&material_names, &materials),
            &textures,
        ));
        notes.extend(environment::note(self, environment.as_ref()));
        let mut render = render(&self.render, integrator).at("render")?;
        if render.integrator == Integrator::Path {
            render.background = environment
                .as_ref()
                .map_or(DVec3::ZERO, |environment| environment.color);
        }
        let (camera, camera_path) = camera::with_path(&self.camera).at("camera")?;
        Ok(Scene {
            width: side(self.image.width).at("width").at("image")?,
            height: side(self.image.height).at("height").at("image")?,
            view: view(&self.image).at("image")?,
            camera,
            camera_path,
            render,
            environment,
            lights: each(&self.lights, light).at("lights")?,
            textures,
            materials,
            material_names,
            shapes,
            instances: self.instances.len(),
            files,
            notes,
            imported: Vec::new(),
        })
    }
}

pub(super) fn view(image: &ImageDescription) -> Checked<ViewSettings> {
    let rule = |rule: String| Problem::of("exposure", format!("{} {rule}", image.exposure));
    Ok(ViewSettings {
        transform: image.view_transform,
        exposure: ViewSettings::check_exposure(image.exposure).map_err(rule)?,
    })
}

fn each<D, T>(descriptions: &[D], mut check: impl FnMut(&D) -> Checked<T>) -> Checked<Vec<T>> {
    let descriptions = descriptions.iter().enumerate();
    descriptions.map(|(i, description)| check(description).at(i)).collect()
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
        let (name, root) = (pattern.name(), count.isqrt());
        let (below, above) = (root.pow(2), (root + 1).pow(2));
        format!(
            "{count} must be a square number, such as {below} or {above}: the pattern {name:?} is an n x n grid; \
             other patterns take any number"
        )
    })?;
    Ok(count)
}

fn count_to_most(count: u32) -> Checked<u32> {
    let valid = (1..=MOST).contains(&count);
    check(valid, || format!("{count} must be from 1 to {MOST}"))?;
    Ok(count)
}

fn samples(description: &SamplesDescription, integrator: Integrator) -> Checked<Samples> {
    let pattern = description.pattern(integrator);
    let count = sample_count(pattern, description.count).at("count")?;
    Ok(Samples { pattern, count })
}

fn render(description: &RenderDescription, integrator: Integrator) -> Checked<Render> {
    let is_path = integrator == Integrator::Path;
    let ambient = color(description.ambient).at("ambient")?;
    Ok(Render {
        integrator,
        ambient: if is_path { DVec3::ZERO } else { ambient },
        background: color(description.background).at("background")?,
        shadow_epsilon: between(description.shadow_epsilon, SHADOW_EPSILONS).at("shadow_epsilon")?,
        shadows: if is_path { Shadows::Opaque } else { description.shadows },
        max_depth: max_depth(description.max_depth, integrator).at("max_depth")?,
        rr_depth: of_path(integrator, description.rr_depth, rr_depth)
            .at("rr_depth")?
            .unwrap_or(RR_DEPTH),
        clamp: of_path(integrator, description.clamp, clamp).at("clamp")?,
        alpha: of_path(integrator, description.alpha, Ok).at("alpha")?.unwrap_or(false),
        ray_differentials: description.ray_differentials,
        seed: description.seed,
        pixel_samples: samples(&description.pixel_samples, integrator).at("pixel_samples")?,
        light_samples: samples(&description.light_samples, integrator).at("light_samples")?,
        filter: filter(&description.filter).at("filter")?,
        adaptive: (description.adaptive.as_ref())
            .map(|adaptive| self::adaptive(adaptive, &description.pixel_samples, integrator).at("adaptive"))
            .transpose()?,
    })
}

fn filter(description: &PixelFilterDescription) -> Checked<PixelFilter> {
    let PixelFilterDescription { kind, radius } = *description;
    let radius = between(radius.unwrap_or(kind.radius()), FILTER_RADII).at("radius")?;
    Ok(PixelFilter { kind, radius })
}

/// The error that adaptive sampling aims at.
pub(super) fn adaptive_error(error: f64) -> Checked<f64> {
    between(error, SHARES)
}

/// Adaptive sampling, of pixels with these samples.
pub(super) fn adaptive(
    description: &AdaptiveDescription,
    pixel_samples: &SamplesDescription,
    integrator: Integrator,
) -> Checked<Adaptive> {
    let (pattern, count) = (pixel_samples.pattern(integrator), pixel_samples.count);
    check(pattern.goes_on(), || {
        let name = pattern.name();
        let others: Vec<_> = Pattern::ALL
            .into_iter()
            .filter(|pattern| pattern.goes_on())
            .map(Pattern::name)
            .collect();
        format!(
            "the pattern of pixel_samples, {name:?}, cannot add samples; use one of {}",
            list(others)
        )
    })?;
    let error = adaptive_error(description.error).at("error")?;
    let most = description.max_samples;
    let most = most.unwrap_or(count.saturating_mul(16).min(MOST));
    let least = count.max(LEAST_ADAPTIVE); // one sample tells nothing of an error
    check((least..=MOST).contains(&most), || {
        format!("{most} must be from {least} to {MOST}, and at least the count of pixel_samples")
    })
    .at("max_samples")?;
    Ok(Adaptive {
        error,
        max_samples: most,
    })
}

/// The fewest and the most bounces of a path.
pub(super) fn depths(integrator: Integrator) -> (u32, u32) {
    match integrator {
        Integrator::Phong => (1, 64),
        Integrator::Path => (0, DEEPEST),
    }
}

pub(super) fn max_depth(depth: u32, integrator: Integrator) -> Checked<u32> {
    let (low, high) = depths(integrator);
    check((low..=high).contains(&depth), || {
        format!("{depth} must be from {low} to {high}")
    })?;
    Ok(depth)
}

fn rr_depth(depth: u32) -> Checked<u32> {
    check(depth <= DEEPEST, || format!("{depth} must be from 0 to {DEEPEST}"))?;
    Ok(depth)
}

fn clamp(most: f64) -> Checked<f64> {
    between(most, CLAMPS)
}

/// A value of a key that only paths have, if it is there.
fn of_path<T>(integrator: Integrator, value: Option<T>, check: fn(T) -> Checked<T>) -> Checked<Option<T>> {
    let Some(value) = value else { return Ok(None) };
    path::needs_path(integrator)?;
    check(value).map(Some)
}

pub(super) fn light(description: &LightDescription) -> Checked<Light> {
    Ok(match description {
        LightDescription::Spot(light) => return light::spot(light),
        LightDescription::Rectangle(light) => Light::Rectangle {
            rectangle: rectangle(light.center, light.size, light.normal, light.tangent)?,
            color: color(light.color).at("color")?,
            visible: light.visible,
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

fn shape(description: &ShapeDescription, known: &mut Known) -> Checked<Shape> {
    let (geometry, name) = match description {
        ShapeDescription::Rectangle(shape) => {
            let rectangle = rectangle(shape.center, shape.size, shape.normal, shape.tangent)?;
            (Geometry::Rectangle(rectangle), &shape.material)
        }
        ShapeDescription::Disk(shape) => {
            let center = point(shape.center).at("center")?;
            let radius = length(shape.radius).at("radius")?;
            let (tangent, bitangent) = frame(shape.normal, shape.tangent)?;
            let disk = Parallelogram {
                center,
                u: tangent * radius,
                v: bitangent * radius,
            };
            (Geometry::Disk(disk), &shape.material)
        }
        ShapeDescription::Ellipsoid(shape) => (ellipsoid(shape)?, &shape.material),
        ShapeDescription::Sphere(shape) => {
            let center = point(shape.center).at("center")?;
            let radius = length(shape.radius).at("radius")?;
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * radius);
            (Geometry::Ellipsoid { center, axes }, &shape.material)
        }
        ShapeDescription::Triangle(shape) => (triangle(shape.vertices).at("vertices")?, &shape.material),
        ShapeDescription::Tetrahedron(shape) => (tetrahedron(shape.vertices).at("vertices")?, &shape.material),
        ShapeDescription::Mesh(shape) => return mesh::mesh(shape, known),
        ShapeDescription::Gltf(_) => return Err(Problem::new("is expanded before it is checked")),
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
    let material = known.material(name).at("material")?;
    let has_tangents = !matches!(geometry, Geometry::Triangles(_));
    check(
        has_tangents || known.looks.materials[material].normal_map.is_none(),
        || format!("{name:?} must have no normal map here, because this shape has no tangents"),
    )
    .at("material")?;
    let textures = known.looks.materials[material].textures();
    let sets = textures.iter().map(|i| known.looks.textures[*i].uv_set);
    let set = sets.max().unwrap_or(0);
    check(set == 0, || {
        format!("{name:?} must have no texture with uv_set = {set} here, because this shape has only the set 0")
    })
    .at("material")?;
    if let Geometry::Plane { .. } = geometry {
        let emission = &known.looks.materials[material].emission;
        let is_dark = path::most(emission, &known.looks.textures) == Some(DVec3::ZERO);
        check(is_dark, || {
            format!("{name:?} must not emit light here, because this shape is infinite")
        })
        .at("material")?;
    }
    Ok(Shape { geometry, material })
}

fn rectangle(center: DVec3, size: [f64; 2], normal: DVec3, tangent: Option<DVec3>) -> Checked<Parallelogram> {
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
        format!("{} must not be parallel to a, {}", show(shape.b), show(shape.a))
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
        format!("{} must be at least {} apart", show_all(vertices), number(LENGTHS.0))
    })?;
    Ok(longest)
}

/// Returns the unit vectors of u and v: the part of the tangent that is orthogonal to the normal, and normal x tangent. Without a
/// tangent u is along x, or along y if the normal is nearly along x.
fn frame(normal: DVec3, tangent: Option<DVec3>) -> Checked<(DVec3, DVec3)> {
    let n = unit(normal).at("normal")?;
    let tangent = tangent.unwrap_or(if n.x.abs() < 0.9 { DVec3::X } else { DVec3::Y });
    let t = unit(tangent).at("tangent")?;
    let t = t - n * n.dot(t);
    check(t.length() > FLATTEST, || {
        format!("{} must not be parallel to the normal, {}", show(tangent), show(normal))
    })
    .at("tangent")?;
    let t = t.normalize();
    Ok((t, n.cross(t)))
}

pub(super) fn point(p: DVec3) -> Checked<DVec3> {
    for x in p.to_array() {
        check(x.abs() <= FARTHEST, || {
            let (x, limit) = (number(x), number(FARTHEST));
            format!("{x} must be finite, from -{limit} to {limit}")
        })?;
    }
    Ok(p)
}

pub(super) fn color(c: DVec3) -> Checked<DVec3> {
    for x in c.to_array() {
        let (low, high) = COLORS;
        check((low..=high).contains(&x), || {
            let (x, low, high) = (number(x), number(low), number(high));
            format!("{x} must be finite, from {low} to {high}")
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

fn between(x: f64, (low, high): (f64, f64)) -> Checked<f64> {
    check((low..=high).contains(&x), || {
        format!("{} must be from {} to {}", number(x), number(low), number(high))
    })?;
    Ok(x)
}

fn check(valid: bool, message: impl FnOnce() -> String) -> Checked<()> {
    match valid {
        true => Ok(()),
        false => Err(Problem::new(message())),
    }
}

/// A number as a person would write it.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e6).contains(&x.abs()) {
        x.to_string()
    } else {
        format!("{x:e}").to_lowercase() // NaN among them, which TOML writes nan
    }
}

fn show(v: DVec3) -> String {
    format!("[{}, {}, {}]", number(v.x), number(v.y), number(v.z))
}

fn show_pair([x, y]: [f64; 2]) -> String {
    format!("[{}, {}]", number(x), number(y))
}

fn show_all(points: &[DVec3]) -> String {
    let points: Vec<_> = points.iter().map(|&point| show(point)).collect();
    format!("[{}]", points.join(", "))
}

#[cfg(test)]
mod tests;
