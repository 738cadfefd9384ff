//! Skins (section 3.7.3). The transform of a node does not affect the skinned mesh of the node.

use glam::{DAffine3, DMat4};
use gltf_json::mesh::{Primitive, Semantic};
use gltf_json::validation::Checked;

use super::document::Document;
use super::error::GltfError;
use super::node::Nodes;

/// The joints of a skin, as transforms from object to world space.
pub struct Skin {
    joints: Vec<DAffine3>,
}

impl Skin {
    pub fn of(document: &Document, skin_index: usize, nodes: &Nodes) -> Result<Skin, GltfError> {
        let Some(skin) = document.json.skins.get(skin_index) else {
            let count = document.json.skins.len();
            return Err(document.fault(
                "nodes",
                format!("the skin {skin_index} is out of range; number of skins: {count}"),
            ));
        };
        let location = |key: &str| format!("skins[{skin_index}].{key}");
        let inverse_bind = match skin.inverse_bind_matrices {
            None => vec![DAffine3::IDENTITY; skin.joints.len()],
            Some(accessor) => {
                let matrices = document.vectors::<16>(accessor.value())?;
                let transform =
                    |columns: [f32; 16]| DAffine3::from_mat4(DMat4::from_cols_array(&columns.map(f64::from)));
                matrices.into_iter().take(skin.joints.len()).map(transform).collect()
            }
        };
        if inverse_bind.len() < skin.joints.len() {
            let (matrices, joints) = (inverse_bind.len(), skin.joints.len());
            let rule = format!("each joint must have a matrix; number of joints: {joints}, of matrices: {matrices}");
            return Err(document.fault(location("inverseBindMatrices"), rule));
        }
        let mut joints = Vec::with_capacity(skin.joints.len());
        for (joint, inverse_bind) in skin.joints.iter().zip(inverse_bind) {
            match nodes.globals.get(joint.value()) {
                Some(global) => joints.push(*global * inverse_bind),
                None => {
                    let rule = format!(
                        "{} is out of range; number of nodes: {}",
                        joint.value(),
                        nodes.globals.len()
                    );
                    return Err(document.fault(location("joints"), rule));
                }
            }
        }
        Ok(Skin { joints })
    }

    /// Returns the transform of each vertex: the weighted mean of the transforms of its joints.
    pub fn vertex_transforms(
        &self,
        document: &Document,
        primitive: &Primitive,
        location: &str,
        count: usize,
    ) -> Result<Vec<DAffine3>, GltfError> {
        let fault = |key: String, rule: String| document.fault(format!("{location}.attributes.{key}"), rule);
        let accessor = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|i| i.value());
        let mut sums = vec![(DAffine3::ZERO, 0.0); count];
        for set in 0.. {
            let (Some(joints), Some(weights)) = (accessor(Semantic::Joints(set)), accessor(Semantic::Weights(set)))
            else {
                break;
            };
            let (joints, weights) = (document.vectors::<4>(joints)?, document.vectors::<4>(weights)?);
            if joints.len() != count || weights.len() != count {
                let rule = format!(
                    "the counts of JOINTS_{set} ({}), WEIGHTS_{set} ({}) and POSITION ({count}) must be equal",
                    joints.len(),
                    weights.len()
                );
                return Err(fault(format!("JOINTS_{set}"), rule));
            }
            for (sum, (joints, weights)) in sums.iter_mut().zip(joints.iter().zip(&weights)) {
                for (joint, weight) in joints.iter().zip(weights) {
                    if *weight == 0.0 {
                        continue;
                    }
                    if !weight.is_finite() {
                        let rule = format!("the weight {weight} must be finite");
                        return Err(fault(format!("WEIGHTS_{set}"), rule));
                    }
                    let Some(transform) = self.joints.get(*joint as usize) else {
                        let rule = format!(
                            "{joint} is out of range; number of joints of the skin: {}",
                            self.joints.len()
                        );
                        return Err(fault(format!("JOINTS_{set}"), rule));
                    };
                    let weight = f64::from(*weight);
                    sum.0.matrix3 += transform.matrix3 * weight;
                    sum.0.translation += transform.translation * weight;
                    sum.1 += weight;
                }
            }
        }
        let mean = |(sum, weight): (DAffine3, f64)| match weight > 0.0 {
            // Divided by the sum of the weights, because rounded weights do not sum to exactly 1.
            true => DAffine3 {
                matrix3: sum.matrix3 * (1.0 / weight),
                translation: sum.translation / weight,
            },
            false => DAffine3::IDENTITY,
        };
        Ok(sums.into_iter().map(mean).collect())
    }
}
