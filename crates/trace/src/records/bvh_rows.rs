//! Rows of the buffers at which the lists of BVHs and meshes start.

use glam::Vec4;

use super::{Instance, NO_INDEX, Node, PackedBvh};

const NODE_ROWS: u32 = (size_of::<Node>() / 16) as u32;
const TANGENT_ROWS: u32 = (size_of::<[Vec4; 2]>() / 16) as u32;
const INSTANCE_ROWS: u32 = (size_of::<Instance>() / 16) as u32;

impl PackedBvh {
    /// Stores in each instance the rows at which the lists of its mesh start. The nodes of meshes are at the end of the
    /// buffer `nodes`; all other lists are in the buffer `meshes`.
    pub fn set_mesh_rows(&mut self) {
        let mut node_row = self.mesh_nodes_row();
        let mut row = 0;
        let first_rows: Vec<[u32; 8]> = self
            .meshes
            .iter()
            .map(|mesh| {
                let triangles = row;
                let vertices = triangles + mesh.triangles.len() as u32;
                let attributes = vertices + mesh.vertices.len() as u32;
                let tangents = attributes + mesh.attributes.len() as u32;
                let groups = tangents + TANGENT_ROWS * mesh.tangents.len() as u32;
                let colors = groups + mesh.groups.len().div_ceil(4) as u32;
                let more_uvs = colors + mesh.colors.len() as u32;
                row = more_uvs + mesh.more_uvs.len() as u32;
                let nodes = node_row;
                node_row += NODE_ROWS * mesh.nodes.len() as u32;
                let row_or_none = |row: u32, exists: bool| if exists { row } else { NO_INDEX };
                [
                    nodes,
                    triangles,
                    vertices,
                    row_or_none(attributes, !mesh.attributes.is_empty()),
                    row_or_none(tangents, !mesh.tangents.is_empty()),
                    row_or_none(groups, !mesh.groups.is_empty()),
                    row_or_none(colors, !mesh.colors.is_empty()),
                    row_or_none(more_uvs, !mesh.more_uvs.is_empty()),
                ]
            })
            .collect();
        for instance in &mut self.instances {
            let rows = first_rows[instance.mesh as usize];
            [
                instance.nodes,
                instance.triangles,
                instance.vertices,
                instance.attributes,
                instance.tangents,
                instance.groups,
                instance.colors,
                instance.more_uvs,
            ] = rows;
        }
    }

    /// Returns the first rows of items, instances, group words and mesh nodes.
    pub fn rows(&self) -> [u32; 4] {
        let items = NODE_ROWS * self.nodes.len() as u32;
        let instances = items + 2 * self.items.len() as u32;
        let words = instances + INSTANCE_ROWS * self.instances.len() as u32;
        [
            items,
            instances,
            words,
            words + self.group_words.len().div_ceil(4) as u32,
        ]
    }

    fn mesh_nodes_row(&self) -> u32 {
        self.rows()[3]
    }
}
