//! The glTF node hierarchy and its transforms (section 3.5).

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf_json::scene::Node;

use super::document::Document;
use super::error::GltfError;

#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    pub translation: DVec3,
    pub rotation: DQuat,
    pub scale: DVec3,
    /// Overrides the translation, rotation and scale.
    pub matrix: Option<DAffine3>,
    /// Overrides the weights of the mesh.
    pub weights: Option<Vec<f32>>,
}

impl Pose {
    pub fn of(node: &Node) -> Pose {
        let vector =
            |of: Option<[f32; 3]>, default: DVec3| of.map_or(default, |of| DVec3::from_array(of.map(f64::from)));
        let rotation = node.rotation.map_or(DQuat::IDENTITY, |of| quaternion(of.0));
        Pose {
            translation: vector(node.translation, DVec3::ZERO),
            rotation,
            scale: vector(node.scale, DVec3::ONE),
            matrix: node.matrix.map(|of| {
                let whole = DMat4::from_cols_array(&of.map(f64::from));
                DAffine3::from_mat4(whole)
            }),
            weights: node.weights.clone(),
        }
    }

    fn local(&self) -> DAffine3 {
        let plain = || DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation);
        self.matrix.unwrap_or_else(plain)
    }
}

/// Converts a quaternion; a zero quaternion becomes the identity.
pub fn quaternion(of: [f32; 4]) -> DQuat {
    let of = DQuat::from_array(of.map(f64::from));
    let length = of.length();
    match length > 0.0 && length.is_finite() {
        true => of / length,
        false => DQuat::IDENTITY,
    }
}

pub struct Nodes {
    /// For each node, the transform to glTF world space.
    pub globals: Vec<DAffine3>,
    children: Vec<Vec<usize>>,
}

impl Nodes {
    pub fn of(document: &Document, poses: &[Pose]) -> Result<Nodes, GltfError> {
        let count = poses.len();
        let mut parents = vec![None; count];
        let mut children = vec![Vec::new(); count];
        for (i, node) in document.json.nodes.iter().enumerate() {
            for child in node.children.iter().flatten().map(|child| child.value()) {
                let place = || format!("nodes[{i}].children");
                if child >= count {
                    return Err(document.fault(place(), format!("{child} is out of range; the file has {count} nodes")));
                }
                if let Some(other) = parents[child].replace(i) {
                    let rule = format!("node {child} has two parents, {other} and {i}; a node must have at most one");
                    return Err(document.fault(place(), rule));
                }
                children[i].push(child);
            }
        }
        let mut globals = vec![DAffine3::IDENTITY; count];
        let mut seen = 0;
        let mut open: Vec<usize> = (0..count).filter(|i| parents[*i].is_none()).collect();
        while let Some(i) = open.pop() {
            let above = parents[i].map_or(DAffine3::IDENTITY, |parent| globals[parent]);
            globals[i] = above * poses[i].local();
            seen += 1;
            open.extend(&children[i]);
        }
        if seen < count {
            let rule = "a node is its own ancestor; nodes must form trees".to_owned();
            return Err(document.fault("nodes", rule));
        }
        Ok(Nodes { globals, children })
    }

    /// Returns the nodes of a scene in depth-first order, or all nodes if `scene` is `None`.
    pub fn of_scene(&self, document: &Document, scene: Option<usize>) -> Result<Vec<usize>, GltfError> {
        let Some(scene) = scene else {
            return Ok((0..self.globals.len()).collect());
        };
        let mut shown = Vec::new();
        let mut is_shown = vec![false; self.globals.len()];
        let roots = document.json.scenes[scene].nodes.iter().map(|root| root.value());
        let mut open: Vec<usize> = roots.collect();
        open.reverse();
        while let Some(i) = open.pop() {
            match is_shown.get_mut(i) {
                None => {
                    let rule = format!("{i} is out of range; the file has {} nodes", is_shown.len());
                    return Err(document.fault(format!("scenes[{scene}].nodes"), rule));
                }
                Some(true) => continue,
                Some(shown) => *shown = true,
            }
            shown.push(i);
            open.extend(self.children[i].iter().rev());
        }
        Ok(shown)
    }
}
