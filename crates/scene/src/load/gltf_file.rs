//! Loads glTF files as scenes: a shape of type `gltf` with a camera, and an environment if the file has no lights.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::gltf_choice::GltfChoice;
use super::model::{self, SIDE};
use super::overrides::Overrides;
use crate::error::SceneError;
use crate::framing::check_extent;
use crate::gltf::{GltfError, ImportOptions, Imported, ImportedCamera, ModelContents, UPRIGHT, load};
use crate::problem::Problem;
use crate::{Assets, CameraDescription, Description, Framing, GltfDescription, Scene, Selection, framed};

/// Sine of the minimum angle between a view direction and +z. Views at smaller angles count as vertical.
const VERTICAL: f64 = 1e-6;

/// Returns true if a file name ends in `.gltf` or `.glb`.
pub fn is_gltf(name: &Path) -> bool {
    let extension = name.extension();
    extension.is_some_and(|extension| extension.eq_ignore_ascii_case("gltf") || extension.eq_ignore_ascii_case("glb"))
}

impl Scene {
    /// Returns true if a glTF file of the scene has animations, for [`GltfChoice::time`].
    pub fn has_animations(&self) -> bool {
        self.imported.iter().any(|imported| imported.animations > 0)
    }

    /// Returns the names of the parts of each glTF file.
    pub fn models(&self) -> impl Iterator<Item = &ModelContents> {
        self.imported.iter().map(|imported| &imported.contents)
    }

    /// Returns true if a glTF file of the scene has cameras.
    pub fn has_model_cameras(&self) -> bool {
        self.imported.iter().any(|imported| !imported.cameras.is_empty())
    }
}

/// Describes a glTF file as a scene. The caller must keep the import alive until the scene refers to the import.
pub(crate) fn describe(
    path: &Path,
    assets: &Assets,
    overrides: &Overrides,
    files: &mut BTreeSet<PathBuf>,
) -> Result<(Description, Arc<Imported>), SceneError> {
    let GltfChoice {
        scene,
        camera,
        view,
        time,
        animation,
        variant,
    } = overrides.gltf.clone();
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let mut shape = GltfDescription {
        scene,
        time,
        animation,
        variant,
        ..GltfDescription::new(file)
    };
    let canonical = assets
        .file_system
        .canonical_file(path)
        .map_err(|error| SceneError::Read {
            path: path.to_owned(),
            error,
        })?;
    let choice = ImportOptions::of(&shape).map_err(SceneError::Override)?;
    let imported = load(&canonical, &assets.root, &assets.file_system, &choice, files);
    let imported = imported.map_err(|error| overrides.gltf.error(error.at(path)))?;
    let presentation = &overrides.presentation;
    let camera = match view.is_some() || presentation.orbit.is_some() {
        true => None,
        false => select_camera(&imported.cameras, camera.as_ref()).map_err(SceneError::Override)?,
    };
    let (width, height) = overrides
        .size
        .unwrap_or_else(|| size(camera.and_then(|camera| camera.aspect)));
    if let (Some(_), Some(option)) = (camera, presentation.camera_option()) {
        let rule = "only applies to the automatic camera, and the file has its own camera; add --view or --orbit";
        return Err(SceneError::Override(Problem::of(option, rule)));
    }
    let to_scene = |axis: DVec3| UPRIGHT.transform_vector3(axis);
    let up_rotation = presentation.up.and_then(|up| up.rotation(to_scene));
    let mut points = Vec::new();
    if camera.is_none() || presentation.ground {
        points = imported.points();
    }
    if let Some((rotation, matrix)) = up_rotation {
        shape.rotate = Some(rotation);
        points.iter_mut().for_each(|point| *point = matrix * *point);
    }
    let aspect = f64::from(width.max(1)) / f64::from(height.max(1));
    let framing = Framing {
        turns: overrides.turntable.is_some(),
        ..presentation.framing(view, aspect).map_err(SceneError::Override)?
    };
    let camera = match camera {
        Some(camera) => match overrides.turntable {
            Some(_) => with_horizontal_orbit(camera.description.clone()),
            None => camera.description.clone(),
        },
        None => {
            check_extent(points.iter().copied()).map_err(|rule| {
                SceneError::Gltf(GltfError::File {
                    path: path.to_owned(),
                    message: rule,
                })
            })?;
            framed(points.iter().copied(), framing).into()
        }
    };
    let mut description = model::scene(overrides, (width, height), camera, shape, &points);
    if imported.lights.is_empty() {
        description = description.with_environment(model::studio(overrides)?);
    }
    Ok((description, imported))
}

/// Makes orbits horizontal: sets `up` to +z unless the view is vertical. The `up` of a glTF camera is perpendicular to
/// the view direction, so an orbit around this `up` would be tilted.
fn with_horizontal_orbit(mut camera: CameraDescription) -> CameraDescription {
    let (position, look_at, up) = match &mut camera {
        CameraDescription::Perspective(camera) => (camera.position, camera.look_at, &mut camera.up),
        CameraDescription::Orthographic(camera) => (camera.position, camera.look_at, &mut camera.up),
        CameraDescription::Panorama(_) => return camera,
    };
    let forward = (look_at - position).normalize_or_zero();
    if forward.cross(DVec3::Z).length() > VERTICAL {
        *up = DVec3::Z;
    }
    camera
}

/// Returns the selected camera, or the first camera if no camera is selected.
fn select_camera<'a>(
    cameras: &'a [ImportedCamera],
    selection: Option<&Selection>,
) -> Result<Option<&'a ImportedCamera>, Problem> {
    let Some(selection) = selection else {
        return Ok(cameras.first());
    };
    let names: Vec<Option<&str>> = cameras.iter().map(|camera| camera.name.as_deref()).collect();
    let found = selection.among(&names).and_then(|i| cameras.get(i));
    let unknown = || Problem::of("camera", crate::gltf::unknown("camera", selection, &names));
    found.map(Some).ok_or_else(unknown)
}

/// Returns the default size of an image with this aspect ratio.
fn size(aspect: Option<f64>) -> (u32, u32) {
    let side = |ratio: f64| (f64::from(SIDE) * ratio).round().clamp(1.0, f64::from(SIDE)) as u32;
    match aspect {
        Some(aspect) if aspect > 0.0 => (side(aspect), side(1.0 / aspect)),
        _ => (SIDE, SIDE),
    }
}
