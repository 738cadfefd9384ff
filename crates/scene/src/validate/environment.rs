//! Validation of the environment.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::super::limits::{ELEVATIONS, ENVIRONMENT_SCALES, TURBIDITIES, TURNS};
use super::super::sky::{Sky, sky};
use super::super::studio::studio;
use super::super::{EnvironmentDescription, EnvironmentImage, EnvironmentName, EnvironmentRotation, Image, Rotation};
use super::images::Images;
use super::mesh::turn;
use super::path::needs_path;
use super::{At, Checked, Description, Environment, Integrator, Problem, between, check, color, show};

/// Default elevation of the sun in degrees, and turbidity.
const ELEVATION: f64 = 40.0;
const TURBIDITY: f64 = 2.0;

/// Returns the environment of its section or of the background, if it emits light or is visible.
pub(super) fn environment(
    description: &Description,
    integrator: Integrator,
    images: &mut Images,
) -> Checked<Option<Environment>> {
    let background = description.render.background;
    let environment = match &description.environment {
        None if !integrator.needs_emitters() => return Ok(None),
        None => plain(background),
        Some(environment) => {
            needs_path(integrator)?;
            check(background == DVec3::ZERO, || {
                let background = show(background);
                format!("cannot be combined with render.background, {background}; remove one")
            })?;
            described(environment, images)?
        }
    };
    let shines = environment.color != DVec3::ZERO || environment.image.as_ref().is_some_and(|image| image.scale > 0.0);
    let is_seen = environment
        .background
        .is_some_and(|background| background != DVec3::ZERO);
    Ok((shines || is_seen).then_some(environment))
}

fn plain(color: DVec3) -> Environment {
    Environment {
        color,
        image: None,
        visible: true,
        background: None,
    }
}

fn described(description: &EnvironmentDescription, images: &mut Images) -> Checked<Environment> {
    let scale = between(description.scale, ENVIRONMENT_SCALES).at("scale")?;
    let to_world = match &description.rotate {
        None => DMat3::IDENTITY,
        Some(EnvironmentRotation::Degrees(degrees)) => {
            turn(&Rotation::Angles(DVec3::new(0.0, 0.0, *degrees))).at("rotate")?
        }
        Some(EnvironmentRotation::Any(rotation)) => turn(rotation).at("rotate")?,
    };
    let background = description.background.map(|background| {
        check(description.visible, || {
            "cannot be combined with visible = false, where the camera sees black".to_owned()
        })?;
        color(background)
    });
    let background = background.transpose().at("background")?;
    let sky = sky_of(description)?;
    let with = |image: Arc<Image>| Environment {
        color: DVec3::ZERO,
        image: Some(EnvironmentImage { image, scale, to_world }),
        visible: description.visible,
        background,
    };
    let own = |name: &str, image: Image, images: &mut Images| {
        let kept = images.own(name, &image).map_err(Problem::new).at("name");
        kept.map(|()| with(Arc::new(image)))
    };
    match (description.color, &description.file, description.name) {
        (Some(plain), None, None) => Ok(Environment {
            color: color(plain).at("color")? * scale,
            image: None,
            visible: description.visible,
            background,
        }),
        (None, Some(file), None) => Ok(with(images.around(file).at("file")?)),
        (None, None, Some(EnvironmentName::Studio)) => own("studio", studio(), images),
        (None, None, Some(EnvironmentName::Sky)) => own("sky", self::sky(&sky), images),
        _ => Err(Problem::new(
            "must have exactly one of \"color\", \"file\" and \"name\"",
        )),
    }
}

/// Returns the parameters of the sky; its keys are errors for other environments.
fn sky_of(description: &EnvironmentDescription) -> Checked<Sky> {
    let is_sky = description.name == Some(EnvironmentName::Sky);
    let value = |key: &str, value: Option<f64>, default: f64, limits: (f64, f64)| {
        let Some(value) = value else { return Ok(default) };
        check(is_sky, || "needs name = \"sky\"".to_owned()).at(key)?;
        between(value, limits).at(key)
    };
    Ok(Sky {
        elevation: value("sun_elevation", description.sun_elevation, ELEVATION, ELEVATIONS)?.to_radians(),
        azimuth: value("sun_azimuth", description.sun_azimuth, 0.0, TURNS)?.to_radians(),
        turbidity: value("turbidity", description.turbidity, TURBIDITY, TURBIDITIES)?,
    })
}

/// Warns of an image with the wrong aspect ratio.
pub(super) fn note(description: &Description, environment: Option<&Environment>) -> Option<String> {
    let file = description.environment.as_ref()?.file.as_ref()?;
    let Image { width, height, .. } = *environment?.image.as_ref()?.image;
    let rule = "equirectangular images are twice as wide as high, so it is stretched";
    (width != 2 * height).then(|| format!("environment.file: {file:?} has {width} x {height} texels; {rule}"))
}
