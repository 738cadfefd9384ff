//! glTF cameras (section 3.10), which look along their -Z with +Y up.

use glam::{DAffine3, DVec3};

use super::document::Document;
use super::error::GltfError;
use super::light::note;
use super::{ImportedCamera, UPRIGHT};
use crate::{OrthographicDescription, PerspectiveDescription};

impl Document {
    /// Returns the camera of a node. The look-at point has the depth of the centre of the scene bounds.
    pub(super) fn camera(
        &self,
        node: usize,
        global: &DAffine3,
        (low, high): (DVec3, DVec3),
        notes: &mut Vec<String>,
    ) -> Result<Option<ImportedCamera>, GltfError> {
        let json = &self.json.nodes[node];
        let Some(number) = json.camera.map(|camera| camera.value()) else {
            return Ok(None);
        };
        let place = format!("cameras[{number}]");
        let Some(camera) = self.json.cameras.get(number) else {
            return Err(self.fault(format!("nodes[{node}].camera"), format!("{number} is out of range")));
        };
        let map = UPRIGHT * *global;
        let position = map.translation;
        let forward = map.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
        let up = map.transform_vector3(DVec3::Y).normalize_or_zero();
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
            (Some(of), _) => {
                let fov = f64::from(of.yfov).to_degrees();
                if !(0.001..=179.999).contains(&fov) {
                    let rule = format!("yfov: {} must be from 0.00002 to 3.1415 radians", of.yfov);
                    note(notes, format!("{place}.{rule}; the camera is skipped"));
                    return Ok(None);
                }
                let camera = PerspectiveDescription {
                    up,
                    ..PerspectiveDescription::new(position, look_at, fov)
                };
                (camera.into(), of.aspect_ratio.map(f64::from))
            }
            (None, Some(of)) => {
                let (width, height) = (f64::from(of.xmag).abs(), f64::from(of.ymag).abs());
                if !(1e-9..=1e9).contains(&height) || !(1e-9..=1e9).contains(&width) {
                    let rule = format!("xmag and ymag: {} and {} must not be 0", of.xmag, of.ymag);
                    note(notes, format!("{place}: {rule}; the camera is skipped"));
                    return Ok(None);
                }
                let camera = OrthographicDescription {
                    up,
                    ..OrthographicDescription::new(position, look_at, 2.0 * height)
                };
                (camera.into(), Some(width / height))
            }
            (None, None) => return Err(self.fault(place, "is neither perspective nor orthographic".to_owned())),
        };
        let name = json.name.clone().or_else(|| camera.name.clone());
        Ok(Some(ImportedCamera {
            name,
            description,
            aspect,
        }))
    }
}
