//! glTF cameras (section 3.10). A camera looks along its -Z axis; its +Y axis is up.

use glam::{DAffine3, DVec3};

use super::document::Document;
use super::error::GltfError;
use super::light::note;
use super::{ImportedCamera, UPRIGHT};
use crate::{OrthographicDescription, PerspectiveDescription};

impl Document {
    /// Returns the camera of a node. The look-at point has the depth of the center of the scene bounds, if the center
    /// is in front of the camera.
    pub(super) fn camera(
        &self,
        node: usize,
        global: &DAffine3,
        (low, high): (DVec3, DVec3),
        notes: &mut Vec<String>,
    ) -> Result<Option<ImportedCamera>, GltfError> {
        let json = &self.json.nodes[node];
        let Some(camera_index) = json.camera.map(|camera| camera.value()) else {
            return Ok(None);
        };
        let location = format!("cameras[{camera_index}]");
        let Some(camera) = self.json.cameras.get(camera_index) else {
            return Err(self.fault(
                format!("nodes[{node}].camera"),
                format!("{camera_index} is out of range"),
            ));
        };
        let to_world = UPRIGHT * *global;
        let position = to_world.translation;
        let forward = to_world.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
        let up = to_world.transform_vector3(DVec3::Y).normalize_or_zero();
        if !position.is_finite() || !(forward.cross(up).length() > 1e-6) {
            note(
                notes,
                format!("nodes[{node}]: the camera is skipped because the node has zero scale"),
            );
            return Ok(None);
        }
        let depth = ((low + high) / 2.0 - position).dot(forward);
        let size = (high - low).max_element();
        let distance = if depth > 1e-3 * size { depth } else { size.max(1.0) };
        let look_at = position + forward * distance;
        let (description, aspect) = match (&camera.perspective, &camera.orthographic) {
            (Some(perspective), _) => {
                let fov = f64::from(perspective.yfov).to_degrees();
                if !(0.001..=179.999).contains(&fov) {
                    let rule = format!("yfov: {} must be from 0.00002 to 3.1415 radians", perspective.yfov);
                    note(notes, format!("{location}.{rule}; the camera is skipped"));
                    return Ok(None);
                }
                let description = PerspectiveDescription {
                    up,
                    ..PerspectiveDescription::new(position, look_at, fov)
                };
                (description.into(), perspective.aspect_ratio.map(f64::from))
            }
            (None, Some(orthographic)) => {
                let (width, height) = (f64::from(orthographic.xmag).abs(), f64::from(orthographic.ymag).abs());
                if !(1e-9..=1e9).contains(&height) || !(1e-9..=1e9).contains(&width) {
                    let rule = "the magnitudes of xmag and ymag must be from 1e-9 to 1e9";
                    note(notes, format!("{location}: {rule}; the camera is skipped"));
                    return Ok(None);
                }
                let description = OrthographicDescription {
                    up,
                    ..OrthographicDescription::new(position, look_at, 2.0 * height)
                };
                (description.into(), Some(width / height))
            }
            (None, None) => return Err(self.fault(location, "is neither perspective nor orthographic".to_owned())),
        };
        let name = json.name.clone().or_else(|| camera.name.clone());
        Ok(Some(ImportedCamera {
            name,
            description,
            aspect,
        }))
    }
}
