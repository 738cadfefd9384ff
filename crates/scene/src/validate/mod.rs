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
    CLAMPS, COLORS, DEEPEST, FARTHEST, FILTER_RADII, LENGTHS, MIN_ADAPTIVE_SAMPLES, MOST, SHADOW_EPSILONS, SHARES,
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
pub(super) use self::mesh::{placement, turned_up};
pub(super) use self::path::LIGHT_SAMPLES;

/// Default for the first bounce with Russian roulette.
const RR_DEPTH: u32 = 5;
/// Sine of the minimum angle between directions; minimum height of a triangle or tetrahedron relative to its longest
/// edge.
const FLATTEST: f64 = 1e-6;

type Checked<T> = Result<T, Problem>;

impl Description {
    /// Validates the sections that contain no file names.
    pub(crate) fn settings(&self, integrator: Integrator) -> Result<Settings, Problems> {
        let image = both(
            image(&self.image).at("image"),
            camera::with_path(&self.camera).at("camera"),
        );
        let render = render(&self.render, integrator).at("render");
        let lights = each(&self.lights, |description| light(description).map(Some)).at("lights");
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
        let (mut textures, replaced, of_textures) = texture::textures(&self.textures, &mut images);
        let alphas = match reads_files && of_textures.is_ok() {
            true => texture::alphas(&self.materials, &self.textures, &mut images, &mut textures),
            false => BTreeMap::new(),
        };
        let known = Textures {
            names: self.textures.keys().map(String::as_str).collect(),
            textures: &textures,
            alphas,
            replaced,
            integrator,
            suggestions: Suggestions::default(),
        };
        let [stand_in, _] = default_material::default_materials(integrator);
        let mut of_materials = Collector::default();
        let materials = (self.materials.iter())
            .map(|(name, description)| of_materials.value(known.material(description).at(name.as_str())))
            .map(|material| material.unwrap_or_else(|| stand_in.clone()))
            .collect();
        let appearance = both(of_textures.at("textures"), of_materials.end(()).at("materials"));
        let environment = environment::environment(self, integrator, &mut images).at("environment");
        let own = (self.materials.keys().cloned().collect(), materials);
        let mut known = SceneLookup {
            names: &indices,
            looks: SceneMaterials::new(own, textures, images, files, integrator),
            assets,
            reads_files,
            suggestions: Suggestions::default(),
        };
        let shapes = each(&self.shapes, |description| shape(description, &mut known)).at("shapes");
        let mut of_meshes = Collector::default();
        let meshes: BTreeMap<_, _> = (self.meshes.iter())
            .map(|(name, description)| {
                let mesh = NamedMesh::read(description, name, &mut known, &mut of_meshes);
                (name.as_str(), mesh)
            })
            .collect();
        let of_meshes = of_meshes.end(()).at("meshes");
        let instance = |description: &InstanceDescription| mesh::instance(description, &meshes, &mut known);
        let instances = each(&self.instances, instance).at("instances");
        let appearance = both(appearance, environment);
        let objects = both(shapes, both(of_meshes, instances));
        let (settings, ((_, environment), (shapes, (_, instances)))) = both(settings, both(appearance, objects))?;
        let mut shapes: Vec<Shape> = shapes;
        shapes.extend(instances);
        mesh::few_groups(&shapes).at("instances")?;
        let mut notes = mesh::notes(&self.shapes, &shapes, &meshes);
        let mut looks = known.looks;
        if let Some(damage) = looks.damage() {
            return Err(damage.into());
        }
        let material_names = std::mem::take(&mut looks.names);
        let materials = std::mem::take(&mut looks.materials);
        let textures = std::mem::take(&mut looks.textures);
        let files = looks.files.iter().cloned().collect();
        notes.extend(looks.notes().map(Note::from));
        let of_paths = path::notes((&self.render, integrator), (&material_names, &materials), &textures);
        notes.extend(of_paths.into_iter().map(Note::from));
        notes.extend(environment::note(self, environment.as_ref()).map(Note::from));
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
fn each<D, T>(descriptions: &[D], mut check: impl FnMut(&D) -> Checked<Option<T>>) -> Result<Vec<T>, Problems> {
    let mut found = Collector::default();
    let descriptions = descriptions.iter().enumerate();
    let all = descriptions
        .filter_map(|(i, description)| found.value(check(description).at(i)).flatten())
        .collect();
    found.end(all)
}

pub(super) fn side(pixels: u32) -> Checked<u32> {
    count_to_most(pixels)
}

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

fn render(description: &RenderDescription, integrator: Integrator) -> Result<Render, Problems> {
    let follows_paths = integrator.follows_paths();
    let mut found = Collector::default();
    let ambient = found.or_default(color(description.ambient).at("ambient"));
    let background = found.or_default(color(description.background).at("background"));
    let shadow_epsilon = between(description.shadow_epsilon, SHADOW_EPSILONS).at("shadow_epsilon");
    let shadow_epsilon = found.or_default(shadow_epsilon);
    let max_depth = found.or_default(max_depth(description.max_depth, integrator).at("max_depth"));
    let rr_depth = found.or_default(of_path(integrator, description.rr_depth, rr_depth).at("rr_depth"));
    let clamp = found.or_default(of_path(integrator, description.clamp, clamp).at("clamp"));
    let alpha = found.or_default(of_path(integrator, description.alpha, Ok).at("alpha"));
    // Adaptive sampling depends on `pixel_samples`.
    let pixel_samples = samples(&description.pixel_samples, integrator).at("pixel_samples");
    let pixels = pixel_samples.and_then(|samples| {
        let adaptive = description.adaptive.as_ref();
        let adaptive = adaptive.map(|adaptive| self::adaptive(adaptive, &description.pixel_samples, integrator));
        Ok((samples, adaptive.transpose().at("adaptive")?))
    });
    let light_samples = samples(&description.light_samples, integrator).at("light_samples");
    let samples = both(both(pixels, light_samples), filter(&description.filter).at("filter"));
    let (_, (((pixel_samples, adaptive), light_samples), filter)) = both(found.end(()), samples)?;
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
    })
}

fn filter(description: &PixelFilterDescription) -> Checked<PixelFilter> {
    let PixelFilterDescription { kind, radius } = *description;
    let radius = between(radius.unwrap_or(kind.radius()), FILTER_RADII).at("radius")?;
    Ok(PixelFilter { kind, radius })
}

pub(super) fn adaptive_error(error: f64) -> Checked<f64> {
    between(error, SHARES)
}

pub(super) fn adaptive(
    description: &AdaptiveDescription,
    pixel_samples: &SamplesDescription,
    integrator: Integrator,
) -> Checked<Adaptive> {
    let (pattern, count) = (pixel_samples.pattern(integrator), pixel_samples.count);
    check(pattern.is_extensible(), || {
        let name = pattern.name();
        let others: Vec<_> = Pattern::ALL
            .into_iter()
            .filter(|pattern| pattern.is_extensible())
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
    let least = count.max(MIN_ADAPTIVE_SAMPLES); // one sample gives no error estimate
    check((least..=MOST).contains(&most), || {
        format!("{most} must be from {least} to {MOST}, and at least the count of pixel_samples")
    })
    .at("max_samples")?;
    Ok(Adaptive {
        error,
        max_samples: most,
    })
}

pub(super) fn max_depth(depth: u32, integrator: Integrator) -> Checked<u32> {
    let (low, high) = integrator.depths();
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

/// Validates an optional key that only the path integrator supports.
fn of_path<T>(integrator: Integrator, value: Option<T>, check: fn(T) -> Checked<T>) -> Checked<Option<T>> {
    let Some(value) = value else { return Ok(None) };
    path::needs_path(integrator)?;
    check(value).map(Some)
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
