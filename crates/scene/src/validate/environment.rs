//! Validation of the environment.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::super::limits::{ELEVATIONS, ENVIRONMENT_SCALES, ROTATIONS, TURBIDITIES};
use super::super::sky::{Sky, sky};
use super::super::studio::studio;
use super::super::{EnvironmentDescription, EnvironmentImage, EnvironmentName, EnvironmentRotation, Image, Rotation};
use super::images::Images;
use super::mesh::rotation_matrix;
use super::path::needs_path;
use super::{At, Checked, Description, Environment, Integrator, Problem, between, check, color, show};

/// Default elevation of the sun in degrees, and default turbidity of the sky.
const ELEVATION: f64 = 40.0;
const TURBIDITY: f64 = 2.0;

/// Returns the environment that `[environment]` describes, or else a constant environment with the radiance
/// `render.background`. Returns `None` if the environment emits no light and its own `background` is missing or black.
pub(super) fn environment(
    description: &Description,
    integrator: Integrator,
    images: &mut Images,
) -> Checked<Option<Environment>> {
    let background = description.render.background;
    let environment = match &description.environment {
        None if !integrator.needs_emitters() => return Ok(None),
        None => constant(background),
        Some(environment) => {
            needs_path(integrator)?;
            check(background == DVec3::ZERO, || {
                let background = show(background);
                format!("cannot be combined with render.background, {background}; remove one")
            })?;
            from_description(environment, images)?
        }
    };
    let is_emissive =
        environment.color != DVec3::ZERO || environment.image.as_ref().is_some_and(|image| image.scale > 0.0);
    let has_background = environment
        .background
        .is_some_and(|background| background != DVec3::ZERO);
    Ok((is_emissive || has_background).then_some(environment))
}

fn constant(color: DVec3) -> Environment {
    Environment {
        color,
        image: None,
        visible: true,
        background: None,
    }
}

fn from_description(description: &EnvironmentDescription, images: &mut Images) -> Checked<Environment> {
    let scale = between(description.scale, ENVIRONMENT_SCALES).at("scale")?;
    let to_world = match &description.rotate {
        None => DMat3::IDENTITY,
        Some(EnvironmentRotation::Degrees(degrees)) => {
            rotation_matrix(&Rotation::Angles(DVec3::new(0.0, 0.0, *degrees))).at("rotate")?
        }
        Some(EnvironmentRotation::Any(rotation)) => rotation_matrix(rotation).at("rotate")?,
    };
    let background = description.background.map(|background| {
        check(description.visible, || {
            "cannot be combined with visible = false, because the camera then sees black".to_owned()
        })?;
        color(background)
    });
    let background = background.transpose().at("background")?;
    let sky = sky_of(description)?;
    let with_image = |image: Arc<Image>| Environment {
        color: DVec3::ZERO,
        image: Some(EnvironmentImage { image, scale, to_world }),
        visible: description.visible,
        background,
    };
    let builtin = |name: &str, image: Image, images: &mut Images| {
        let counted = images.count_builtin(name, &image).map_err(Problem::new).at("name");
        counted.map(|()| with_image(Arc::new(image)))
    };
    match (description.color, &description.file, description.name) {
        (Some(radiance), None, None) => Ok(Environment {
            color: color(radiance).at("color")? * scale,
            image: None,
            visible: description.visible,
            background,
        }),
        (None, Some(file), None) => Ok(with_image(images.environment_map(file).at("file")?)),
        (None, None, Some(EnvironmentName::Studio)) => builtin("studio", studio(), images),
        (None, None, Some(EnvironmentName::Sky)) => builtin("sky", self::sky(&sky), images),
        _ => Err(Problem::new(
            "must have exactly one of \"color\", \"file\" and \"name\"",
        )),
    }
}

/// Returns the parameters of the sky. For other environments, keys of the sky are errors.
fn sky_of(description: &EnvironmentDescription) -> Checked<Sky> {
    let is_sky = description.name == Some(EnvironmentName::Sky);
    let value = |key: &str, value: Option<f64>, default: f64, limits: (f64, f64)| {
        let Some(value) = value else { return Ok(default) };
        check(is_sky, || "needs name = \"sky\"".to_owned()).at(key)?;
        between(value, limits).at(key)
    };
    Ok(Sky {
        elevation: value("sun_elevation", description.sun_elevation, ELEVATION, ELEVATIONS)?.to_radians(),
        azimuth: value("sun_azimuth", description.sun_azimuth, 0.0, ROTATIONS)?.to_radians(),
        turbidity: value("turbidity", description.turbidity, TURBIDITY, TURBIDITIES)?,
    })
}

/// Returns a warning about an image with the wrong aspect ratio.
pub(super) fn aspect_note(description: &Description, environment: Option<&Environment>) -> Option<String> {
    let file = description.environment.as_ref()?.file.as_ref()?;
    let Image { width, height, .. } = *environment?.image.as_ref()?.image;
    let rule = "equirectangular images are twice as wide as high, so this image is stretched";
    (width != 2 * height).then(|| format!("environment.file: {file:?} has {width} x {height} texels; {rule}"))
}
