//! Validation of a [`Description`] to a [`Scene`]: all rules for the values of scene files.
//!
//! The limits keep all derived values, including squared lengths, in the range of `f32`.

mod camera;
mod default_material;
mod environment;
mod images;
mod integrator;
mod light;
mod material;
mod mesh;
mod mtl;
mod path;
mod principled;
mod shape;
mod texture;

use crate::note::Note;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use glam::DVec3;

use self::images::Images;
pub(super) use self::light::light;
use self::mesh::{NamedMesh, SceneLookup};
use self::mtl::SceneMaterials;
use self::shape::shape;
use self::texture::Textures;
use super::key_path::cut;
use super::key_path::list;
use super::limits::{
    CLAMPS, COLORS, FILTER_RADII, FRACTIONS, LENGTHS, MAX_COORDINATE, MAX_COUNT, MAX_DEPTH, MIN_ADAPTIVE_SAMPLES,
    SHADOW_EPSILONS,
};
use super::problem::{At, Collector, Problem, Problems, both};
use super::suggest::Suggestions;
use super::{
    Adaptive, AdaptiveDescription, Assets, Camera, CameraPath, Color, Description, Environment, ImageDescription,
    InstanceDescription, Integrator, Light, Material, Pattern, PixelFilter, PixelFilterDescription, Render,
    RenderDescription, Samples, SamplesDescription, Scene, Shadows, Shape, Texture, ViewSettings,
};

pub(super) use self::images::TEXEL_MEMORY;
pub(crate) use self::integrator::note as integrator_note;
pub(super) use self::mesh::{placement, to_z_up};
pub(super) use self::path::LIGHT_SAMPLES;

/// Default for the first bounce with Russian roulette.
const RR_DEPTH: u32 = 5;
/// Sine of the minimum angle between directions, and minimum height of a triangle or tetrahedron, relative to the
/// longest edge.
const MIN_SINE: f64 = 1e-6;

type Checked<T> = Result<T, Problem>;

impl Description {
    /// Validates the sections that contain no file names.
    pub(crate) fn settings(&self, integrator: Integrator) -> Result<Settings, Problems> {
        let image = both(
            image(&self.image).at("image"),
            camera::with_path(&self.camera).at("camera"),
        );
        let render = render(&self.render, integrator).at("render");
        let lights = validate_each(&self.lights, |description| light(description).map(Some)).at("lights");
        let ((((width, height), view), (camera, camera_path)), (render, lights)) = both(image, both(render, lights))?;
        Ok(Settings {
            width,
            height,
            view,
            camera,
            camera_path,
            render,
            lights,
        })
    }

    /// Validates a description without glTF files. If the settings are invalid, no files are read, but all other values
    /// are still validated.
    pub(crate) fn validate_plain(
        &self,
        settings: Result<Settings, Problems>,
        integrator: Integrator,
        assets: &Assets,
        files: &mut BTreeSet<PathBuf>,
    ) -> Result<Scene, Problems> {
        // The map is sorted, so the index of a material is the index of its name.
        let names = self.materials.keys().map(String::as_str);
        let indices: BTreeMap<_, _> = names.zip(0..).collect();
        let reads_files = settings.is_ok();
        let mut images = Images::new(assets, reads_files);
        let (mut textures, replaced, texture_result) = texture::textures(&self.textures, &mut images);
        let alphas = match reads_files && texture_result.is_ok() {
            true => texture::alphas(&self.materials, &self.textures, &mut images, &mut textures),
            false => BTreeMap::new(),
        };
        let texture_lookup = Textures {
            names: self.textures.keys().map(String::as_str).collect(),
            textures: &textures,
            alphas,
            replaced,
            integrator,
            suggestions: Suggestions::default(),
        };
        let [placeholder, _] = default_material::default_materials(integrator);
        let mut material_problems = Collector::default();
        let materials = (self.materials.iter())
            .map(|(name, description)| material_problems.value(texture_lookup.material(description).at(name.as_str())))
            .map(|material| material.unwrap_or_else(|| placeholder.clone()))
            .collect();
        let appearance = both(texture_result.at("textures"), material_problems.end(()).at("materials"));
        let environment = environment::environment(self, integrator, &mut images).at("environment");
        let named_materials = (self.materials.keys().cloned().collect(), materials);
        let mut lookup = SceneLookup {
            names: &indices,
            scene_materials: SceneMaterials::new(named_materials, textures, images, files, integrator),
            assets,
            reads_files,
            suggestions: Suggestions::default(),
        };
        let shapes = validate_each(&self.shapes, |description| shape(description, &mut lookup)).at("shapes");
        let mut mesh_problems = Collector::default();
        let meshes: BTreeMap<_, _> = (self.meshes.iter())
            .map(|(name, description)| {
                let mesh = NamedMesh::read(description, name, &mut lookup, &mut mesh_problems);
                (name.as_str(), mesh)
            })
            .collect();
        let mesh_result = mesh_problems.end(()).at("meshes");
        let instance = |description: &InstanceDescription| mesh::instance(description, &meshes, &mut lookup);
        let instances = validate_each(&self.instances, instance).at("instances");
        let appearance = both(appearance, environment);
        let objects = both(shapes, both(mesh_result, instances));
        let (settings, ((_, environment), (shapes, (_, instances)))) = both(settings, both(appearance, objects))?;
        let mut shapes: Vec<Shape> = shapes;
        shapes.extend(instances);
        mesh::check_group_count(&shapes).at("instances")?;
        let mut notes = mesh::notes(&self.shapes, &shapes, &meshes);
        let mut scene_materials = lookup.scene_materials;
        if let Some(damage) = scene_materials.damage() {
            return Err(damage.into());
        }
        let material_names = std::mem::take(&mut scene_materials.names);
        let materials = std::mem::take(&mut scene_materials.materials);
        let textures = std::mem::take(&mut scene_materials.textures);
        let files = scene_materials.files.iter().cloned().collect();
        notes.extend(scene_materials.notes().map(Note::from));
        let path_notes = path::notes((&self.render, integrator), (&material_names, &materials), &textures);
        notes.extend(path_notes.into_iter().map(Note::from));
        notes.extend(environment::aspect_note(self, environment.as_ref()).map(Note::from));
        let Settings {
            width,
            height,
            view,
            camera,
            camera_path,
            mut render,
            lights,
        } = settings;
        if render.integrator.needs_emitters() {
            render.background = environment
                .as_ref()
                .map_or(DVec3::ZERO, |environment| environment.color);
        }
        Ok(Scene {
            width,
            height,
            view,
            camera,
            camera_path,
            render,
            environment,
            lights,
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

/// The validated values that do not depend on files.
pub(crate) struct Settings {
    width: u32,
    height: u32,
    view: ViewSettings,
    camera: Camera,
    camera_path: Option<CameraPath>,
    render: Render,
    lights: Vec<Light>,
}

fn image(image: &ImageDescription) -> Result<((u32, u32), ViewSettings), Problems> {
    let size = both(side(image.width).at("width"), side(image.height).at("height"));
    both(size, view(image))
}

pub(super) fn view(image: &ImageDescription) -> Checked<ViewSettings> {
    let rule = |rule: String| Problem::of("exposure", format!("{} {rule}", image.exposure));
    Ok(ViewSettings {
        transform: image.view_transform,
        exposure: ViewSettings::check_exposure(image.exposure).map_err(rule)?,
    })
}

/// Validates all elements of a list. `check` returns `None` if files are not read.
fn validate_each<D, T>(
    descriptions: &[D],
    mut check: impl FnMut(&D) -> Checked<Option<T>>,
) -> Result<Vec<T>, Problems> {
    let mut problems = Collector::default();
    let descriptions = descriptions.iter().enumerate();
    let values = descriptions
        .filter_map(|(i, description)| problems.value(check(description).at(i)).flatten())
        .collect();
    problems.end(values)
}

pub(super) fn side(pixels: u32) -> Checked<u32> {
    check_count(pixels)
}

pub(super) fn sample_count(pattern: Pattern, count: u32) -> Checked<u32> {
    check_count(count)?;
    let is_valid = !pattern.needs_square() || count.isqrt().pow(2) == count;
    check(is_valid, || {
        let (name, root) = (pattern.name(), count.isqrt());
        let (below, above) = (root.pow(2), (root + 1).pow(2));
        format!(
            "{count} must be a square number, such as {below} or {above}: the pattern {name:?} is an n x n grid; \
             other patterns take any number"
        )
    })?;
    Ok(count)
}

fn check_count(count: u32) -> Checked<u32> {
    let is_valid = (1..=MAX_COUNT).contains(&count);
    check(is_valid, || format!("{count} must be from 1 to {MAX_COUNT}"))?;
    Ok(count)
}

fn samples(description: &SamplesDescription, integrator: Integrator) -> Checked<Samples> {
    let pattern = description.pattern(integrator);
    let count = sample_count(pattern, description.count).at("count")?;
    Ok(Samples { pattern, count })
}

fn render(description: &RenderDescription, integrator: Integrator) -> Result<Render, Problems> {
    let follows_paths = integrator.follows_paths();
    let mut problems = Collector::default();
    let ambient = problems.or_default(color(description.ambient).at("ambient"));
    let background = problems.or_default(color(description.background).at("background"));
    let shadow_epsilon = between(description.shadow_epsilon, SHADOW_EPSILONS).at("shadow_epsilon");
    let shadow_epsilon = problems.or_default(shadow_epsilon);
    let max_depth = problems.or_default(max_depth(description.max_depth, integrator).at("max_depth"));
    let rr_depth = problems.or_default(check_path_key(integrator, description.rr_depth, rr_depth).at("rr_depth"));
    let clamp = problems.or_default(check_path_key(integrator, description.clamp, clamp).at("clamp"));
    let alpha = problems.or_default(check_path_key(integrator, description.alpha, Ok).at("alpha"));
    // Adaptive sampling depends on `pixel_samples`.
    let pixel_samples = samples(&description.pixel_samples, integrator).at("pixel_samples");
    let pixels = pixel_samples.and_then(|samples| {
        let adaptive = description.adaptive.as_ref();
        let adaptive = adaptive.map(|adaptive| self::adaptive(adaptive, &description.pixel_samples, integrator));
        Ok((samples, adaptive.transpose().at("adaptive")?))
    });
    let light_samples = samples(&description.light_samples, integrator).at("light_samples");
    let samples = both(both(pixels, light_samples), filter(&description.filter).at("filter"));
    let (_, (((pixel_samples, adaptive), light_samples), filter)) = both(problems.end(()), samples)?;
    Ok(Render {
        integrator,
        ambient: if follows_paths { DVec3::ZERO } else { ambient },
        background,
        shadow_epsilon,
        shadows: if follows_paths {
            Shadows::Opaque
        } else {
            description.shadows
        },
        max_depth,
        rr_depth: rr_depth.unwrap_or(RR_DEPTH),
        clamp,
        alpha: alpha.unwrap_or(false),
        ray_differentials: description.ray_differentials,
        seed: description.seed,
        pixel_samples,
        light_samples,
        filter,
        adaptive,
        denoise: description.denoise.unwrap_or(false),
    })
}

fn filter(description: &PixelFilterDescription) -> Checked<PixelFilter> {
    let PixelFilterDescription { kind, radius } = *description;
    let radius = between(radius.unwrap_or(kind.radius()), FILTER_RADII).at("radius")?;
    Ok(PixelFilter { kind, radius })
}

pub(super) fn adaptive_error(error: f64) -> Checked<f64> {
    between(error, FRACTIONS)
}

pub(super) fn adaptive(
    description: &AdaptiveDescription,
    pixel_samples: &SamplesDescription,
    integrator: Integrator,
) -> Checked<Adaptive> {
    let (pattern, count) = (pixel_samples.pattern(integrator), pixel_samples.count);
    check(pattern.is_extensible(), || {
        let name = pattern.name();
        let extensible: Vec<_> = Pattern::ALL
            .into_iter()
            .filter(|pattern| pattern.is_extensible())
            .map(Pattern::name)
            .collect();
        format!(
            "the pattern of pixel_samples, {name:?}, cannot add samples; use one of {}",
            list(extensible)
        )
    })?;
    let error = adaptive_error(description.error).at("error")?;
    let default = count.saturating_mul(16).min(MAX_COUNT);
    let max_samples = description.max_samples.unwrap_or(default);
    let min = count.max(MIN_ADAPTIVE_SAMPLES); // one sample gives no error estimate
    check((min..=MAX_COUNT).contains(&max_samples), || {
        let reason = format!("the minimum is the greater of {MIN_ADAPTIVE_SAMPLES} and the count of pixel_samples");
        format!("{max_samples} must be from {min} to {MAX_COUNT}; {reason}")
    })
    .at("max_samples")?;
    Ok(Adaptive { error, max_samples })
}

pub(super) fn max_depth(depth: u32, integrator: Integrator) -> Checked<u32> {
    let (low, high) = integrator.depths();
    check((low..=high).contains(&depth), || {
        format!("{depth} must be from {low} to {high}")
    })?;
    Ok(depth)
}

fn rr_depth(depth: u32) -> Checked<u32> {
    check(depth <= MAX_DEPTH, || format!("{depth} must be from 0 to {MAX_DEPTH}"))?;
    Ok(depth)
}

fn clamp(limit: f64) -> Checked<f64> {
    between(limit, CLAMPS)
}

/// Validates an optional key that only the path tracer supports.
fn check_path_key<T>(integrator: Integrator, value: Option<T>, check: fn(T) -> Checked<T>) -> Checked<Option<T>> {
    let Some(value) = value else { return Ok(None) };
    path::needs_path(integrator)?;
    check(value).map(Some)
}

pub(super) fn point(p: DVec3) -> Checked<DVec3> {
    for x in p.to_array() {
        check(x.abs() <= MAX_COORDINATE, || {
            let (x, limit) = (number(x), number(MAX_COORDINATE));
            format!("{x} must be from -{limit} to {limit}")
        })?;
    }
    Ok(p)
}

pub(super) fn color(c: DVec3) -> Checked<DVec3> {
    for x in c.to_array() {
        let (low, high) = COLORS;
        check((low..=high).contains(&x), || {
            let (x, low, high) = (number(x), number(low), number(high));
            format!("{x} must be from {low} to {high}")
        })?;
    }
    Ok(c)
}

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
        format!("{x} must be from {low} to {high}")
    })?;
    Ok(x)
}

fn between(x: f64, (low, high): (f64, f64)) -> Checked<f64> {
    check((low..=high).contains(&x), || {
        format!("{} must be from {} to {}", number(x), number(low), number(high))
    })?;
    Ok(x)
}

fn check(is_valid: bool, message: impl FnOnce() -> String) -> Checked<()> {
    match is_valid {
        true => Ok(()),
        false => Err(Problem::new(message())),
    }
}

fn number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e6).contains(&x.abs()) {
        x.to_string()
    } else {
        format!("{x:e}").to_lowercase() // lower case, because NaN is nan in TOML
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
