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
            |value: Option<[f32; 3]>, default: DVec3| value.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
        let rotation = node.rotation.map_or(DQuat::IDENTITY, |rotation| quaternion(rotation.0));
        Pose {
            translation: vector(node.translation, DVec3::ZERO),
            rotation,
            scale: vector(node.scale, DVec3::ONE),
            matrix: node.matrix.map(|columns| {
                let matrix = DMat4::from_cols_array(&columns.map(f64::from));
                DAffine3::from_mat4(matrix)
            }),
            weights: node.weights.clone(),
        }
    }

    fn local(&self) -> DAffine3 {
        let from_components = || DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation);
        self.matrix.unwrap_or_else(from_components)
    }
}

/// Normalizes a quaternion. A zero or non-finite quaternion becomes the identity.
pub fn quaternion(components: [f32; 4]) -> DQuat {
    let quaternion = DQuat::from_array(components.map(f64::from));
    let length = quaternion.length();
    match length > 0.0 && length.is_finite() {
        true => quaternion / length,
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
                let location = || format!("nodes[{i}].children");
                if child >= count {
                    return Err(
                        document.fault(location(), format!("{child} is out of range; number of nodes: {count}"))
                    );
                }
                if let Some(first_parent) = parents[child].replace(i) {
                    let rule =
                        format!("node {child} has two parents, {first_parent} and {i}; a node must have at most one");
                    return Err(document.fault(location(), rule));
                }
                children[i].push(child);
            }
        }
        let mut globals = vec![DAffine3::IDENTITY; count];
        let mut visited = 0;
        let mut stack: Vec<usize> = (0..count).filter(|i| parents[*i].is_none()).collect();
        while let Some(i) = stack.pop() {
            let parent_transform = parents[i].map_or(DAffine3::IDENTITY, |parent| globals[parent]);
            globals[i] = parent_transform * poses[i].local();
            visited += 1;
            stack.extend(&children[i]);
        }
        if visited < count {
            let rule = "a node is its own ancestor; nodes must form trees".to_owned();
            return Err(document.fault("nodes", rule));
        }
        Ok(Nodes { globals, children })
    }

    /// Returns the nodes of a scene in depth-first order, or all nodes if `scene` is `None`.
    pub fn in_scene(&self, document: &Document, scene: Option<usize>) -> Result<Vec<usize>, GltfError> {
        let Some(scene) = scene else {
            return Ok((0..self.globals.len()).collect());
        };
        let mut nodes = Vec::new();
        let mut is_visited = vec![false; self.globals.len()];
        let roots = document.json.scenes[scene].nodes.iter().map(|root| root.value());
        let mut stack: Vec<usize> = roots.collect();
        stack.reverse();
        while let Some(i) = stack.pop() {
            match is_visited.get_mut(i) {
                None => {
                    let rule = format!("{i} is out of range; number of nodes: {}", is_visited.len());
                    return Err(document.fault(format!("scenes[{scene}].nodes"), rule));
                }
                Some(true) => continue,
                Some(is_visited) => *is_visited = true,
            }
            nodes.push(i);
            stack.extend(self.children[i].iter().rev());
        }
        Ok(nodes)
    }
}
