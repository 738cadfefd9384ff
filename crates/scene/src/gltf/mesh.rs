//! glTF meshes (section 3.7), with morph targets and skins at the selected time.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::{Mutex, PoisonError};

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked;

use super::budget::Resource;
use super::document::Document;
use super::error::GltfError;
use super::materials::{MaterialUse, Materials};
use super::node::{Nodes, Pose};
use super::skin::Skin;
use super::tangent::{generate, rotate_back};
use super::texture::MAX_SET;
use super::vertices::{Frames, Source, attribute};
use super::{Damage, MAX_AXIS_LENGTH};
use crate::mesh::{Group, MAX_COORDINATE, Mesh, RawMesh, unit};

/// The inputs of a mesh. Nodes with equal keys share the mesh.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Key {
    pub mesh: usize,
    pub skin: Option<usize>,
    /// Bits of the morph weights of the node, which override the weights of the mesh.
    weights: Option<Vec<u32>>,
    /// Bits of a transform that is applied to the vertices, because an instance cannot have the transform.
    baked: Option<[u64; 12]>,
}

impl Key {
    pub fn of(document: &Document, node: usize, mesh: usize, pose: &Pose) -> Key {
        let weights = pose.weights.as_ref();
        Key {
            mesh,
            skin: document.json.nodes[node].skin.map(|skin| skin.value()),
            weights: weights.map(|all| all.iter().map(|weight| weight.to_bits()).collect()),
            baked: None,
        }
    }

    pub fn with_baked_transform(&self, transform: &DAffine3) -> Key {
        Key {
            baked: Some(transform.to_cols_array().map(f64::to_bits)),
            ..self.clone()
        }
    }

    /// Returns true if the transform is baked because it flattens the mesh, not because an axis is too long.
    pub fn is_flat(&self) -> bool {
        let is_short_enough = |axis: DVec3| axis.length() <= MAX_AXIS_LENGTH;
        self.baked_transform().is_some_and(|transform| {
            let DMat3 { x_axis, y_axis, z_axis } = transform.matrix3;
            [x_axis, y_axis, z_axis].into_iter().all(is_short_enough)
        })
    }

    fn baked_transform(&self) -> Option<DAffine3> {
        self.baked
            .map(|bits| DAffine3::from_cols_array(&bits.map(f64::from_bits)))
    }

    fn weights(&self, document: &Document) -> Vec<f32> {
        match &self.weights {
            Some(weights) => weights.iter().map(|bits| f32::from_bits(*bits)).collect(),
            None => (document.json.meshes.get(self.mesh))
                .and_then(|mesh| mesh.weights.clone())
                .unwrap_or_default(),
        }
    }
}

pub struct BuiltMesh {
    pub mesh: Mesh,
    pub materials: Vec<usize>,
}

pub struct Meshes<'a> {
    document: &'a Document,
    /// Primitives with triangles, by mesh.
    parts: BTreeMap<usize, Vec<Part<'a>>>,
    points: usize,
    lines: usize,
    /// First primitive that lacks a texture coordinate set, and the set.
    without_uvs: Option<(String, u32)>,
    without_uvs_count: usize,
    /// For each attribute, the first primitive with non-finite values, and the number of such primitives.
    non_finite: Mutex<BTreeMap<&'static str, (String, usize)>>,
    /// The first primitive that has triangles with invalid positions, and the number of such triangles.
    invalid_positions: Mutex<Option<(String, usize)>>,
}

/// A primitive with triangles.
struct Part<'a> {
    primitive: &'a Primitive,
    location: String,
    mode: Mode,
    material: usize,
}

impl<'a> Meshes<'a> {
    /// Collects the primitives of meshes and their materials.
    pub fn of<'k>(
        document: &'a Document,
        materials: &mut Materials,
        keys: impl Iterator<Item = &'k Key>,
    ) -> Result<Meshes<'a>, GltfError> {
        let mut meshes = Meshes {
            document,
            parts: BTreeMap::new(),
            points: 0,
            lines: 0,
            without_uvs: None,
            without_uvs_count: 0,
            non_finite: Mutex::default(),
            invalid_positions: Mutex::default(),
        };
        for key in keys {
            if meshes.parts.contains_key(&key.mesh) {
                continue;
            }
            let Some(mesh) = document.json.meshes.get(key.mesh) else {
                let count = document.json.meshes.len();
                return Err(document.fault(
                    "nodes",
                    format!("{} is out of range; number of meshes: {count}", key.mesh),
                ));
            };
            let mut parts = Vec::new();
            for (i, primitive) in mesh.primitives.iter().enumerate() {
                let location = format!("meshes[{}].primitives[{i}]", key.mesh);
                let Checked::Valid(mode) = primitive.mode else {
                    return Err(document.fault(format!("{location}.mode"), "must be from 0 to 6"));
                };
                match mode {
                    Mode::Points => meshes.points += 1,
                    Mode::Lines | Mode::LineLoop | Mode::LineStrip => meshes.lines += 1,
                    _ if attribute(primitive, Semantic::Positions).is_none() => {} // not drawn: section 3.7.2.1
                    _ => {
                        let is_colored = attribute(primitive, Semantic::Colors(0)).is_some();
                        let material = materials.mark_used(primitive, &location, is_colored)?;
                        let lacks = |set: &&u32| attribute(primitive, Semantic::TexCoords(**set)).is_none();
                        if let Some(set) = materials.get(material).sets.iter().find(lacks) {
                            meshes.without_uvs.get_or_insert_with(|| (location.clone(), *set));
                            meshes.without_uvs_count += 1;
                        }
                        parts.push(Part {
                            primitive,
                            location,
                            mode,
                            material,
                        });
                    }
                }
            }
            meshes.parts.insert(key.mesh, parts);
        }
        Ok(meshes)
    }

    pub fn notes(&self) -> impl Iterator<Item = String> {
        let skipped = |count: usize, kind: &str| match count {
            0 => None,
            1 => Some(format!("1 primitive of {kind} is skipped: only triangles are rendered")),
            _ => Some(format!(
                "{count} primitives of {kind} are skipped: only triangles are rendered"
            )),
        };
        let missing_uvs = self.without_uvs.as_ref().map(|(location, set)| {
            let message = format!("{location} has no TEXCOORD_{set}, which its material needs; (0, 0) is used");
            match self.without_uvs_count {
                1 => message,
                count => format!("{message} (number of such primitives: {count})"),
            }
        });
        [
            skipped(self.points, "points"),
            skipped(self.lines, "lines"),
            missing_uvs,
        ]
        .into_iter()
        .flatten()
    }

    pub fn damage(&self) -> Vec<Damage> {
        let non_finite = self.non_finite.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let non_finite = non_finite.into_iter().map(|(name, (location, count))| {
            let message = format!("{location}.attributes.{name} has non-finite numbers");
            Damage {
                what: match count {
                    1 => message,
                    count => format!("{message} (number of such primitives: {count})"),
                },
                stand_in: "these numbers are ignored",
            }
        });
        let invalid_positions = self
            .invalid_positions
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        let invalid_positions = invalid_positions.map(|(location, count)| {
            let triangles = match count {
                1 => "1 triangle has".to_owned(),
                _ => format!("{count} triangles have"),
            };
            let rule = "that is beyond 1e9 or not finite";
            Damage {
                what: format!("{location}.attributes.POSITION: {triangles} a vertex with a coordinate {rule}"),
                stand_in: if count == 1 {
                    "it is skipped"
                } else {
                    "they are skipped"
                },
            }
        });
        invalid_positions.into_iter().chain(non_finite).collect()
    }

    /// Returns the reason why there are no triangles.
    pub fn no_triangles_reason(&self) -> String {
        match (self.points, self.lines, self.damage().first()) {
            (0, 0, None) => "has no triangles".to_owned(),
            (0, 0, Some(damage)) => format!("has no triangles: {}", damage.what),
            _ => "has no triangles: points and lines are not rendered".to_owned(),
        }
    }

    fn record_invalid_positions(&self, location: &str, triangles: usize) {
        if triangles == 0 {
            return;
        }
        let mut invalid_positions = self.invalid_positions.lock().unwrap_or_else(PoisonError::into_inner);
        let (first, count) = invalid_positions.get_or_insert_with(|| (location.to_owned(), 0));
        *count += triangles;
        // Locations arrive in any order, because meshes are built in parallel.
        if (location.len(), location) < (first.len(), first.as_str()) {
            location.clone_into(first);
        }
    }

    fn record_non_finite(&self, location: &str, name: &'static str) {
        let mut non_finite = self.non_finite.lock().unwrap_or_else(PoisonError::into_inner);
        let (first, count) = non_finite.entry(name).or_insert_with(|| (location.to_owned(), 0));
        *count += 1;
        if (location.len(), location) < (first.len(), first.as_str()) {
            location.clone_into(first);
        }
    }

    /// Builds a mesh; `None` if the mesh has no triangles.
    pub fn build(&self, key: &Key, nodes: &Nodes, materials: &Materials) -> Result<Option<BuiltMesh>, GltfError> {
        let parts = self.parts.get(&key.mesh).map_or(&[][..], Vec::as_slice);
        let skin = key.skin.map(|skin| Skin::of(self.document, skin, nodes)).transpose()?;
        let mut builder = MeshBuilder::default();
        let mut material_indices = Vec::new();
        for part in parts {
            let material_use = materials.get(part.material);
            let first_vertex = builder.add_vertices(self, part, material_use, key, skin.as_ref())?;
            let count = builder.counts[&first_vertex];
            let mut triangles = self.triangles(part, count)?;
            if !builder.invalid_vertices.is_empty() {
                let is_valid = |triangle: &[u32; 3]| {
                    let is_invalid =
                        |vertex: &u32| builder.invalid_vertices.contains(&(first_vertex + *vertex as usize));
                    !triangle.iter().any(is_invalid)
                };
                let count_before = triangles.len();
                triangles.retain(is_valid);
                self.record_invalid_positions(&part.location, count_before - triangles.len());
            }
            let is_mirrored = key
                .baked_transform()
                .is_some_and(|transform| transform.matrix3.determinant() < 0.0);
            let triangles = match is_mirrored {
                true => triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect(),
                false => triangles,
            };
            let (first_vertex, triangles) = builder.with_tangents(part, material_use, first_vertex, triangles);
            builder.raw.begin_group(material_indices.len() as u32);
            builder.raw.groups.push(Group {
                name: material_indices.len().to_string(),
                material: None,
            });
            material_indices.push(part.material);
            let offset_triangles = triangles
                .into_iter()
                .map(|triangle| triangle.map(|vertex| vertex + first_vertex as u32));
            builder.raw.triangles.extend(offset_triangles);
        }
        if builder.raw.triangles.is_empty() {
            return Ok(None);
        }
        let location = || format!("meshes[{}]", key.mesh);
        let sets = parts.iter().flat_map(|part| materials.get(part.material).sets.iter());
        let max_set = sets.copied().max();
        let mesh = builder
            .finish(max_set)
            .map_err(|rule| self.document.fault(location(), rule))?;
        // Drops flattened meshes that are too small to render.
        let has_size = |mesh: &Mesh| {
            let positions = || mesh.positions.iter().copied();
            let extent = positions().fold(Vec3::NEG_INFINITY, Vec3::max) - positions().fold(Vec3::INFINITY, Vec3::min);
            extent.max_element() >= 1e-9
        };
        let mesh = mesh.filter(|mesh| !key.is_flat() || has_size(mesh));
        let built = mesh.map(|mesh| BuiltMesh {
            mesh,
            materials: material_indices,
        });
        Ok(built)
    }

    fn triangles(&self, part: &Part, count: usize) -> Result<Vec<[u32; 3]>, GltfError> {
        let indices = match part.primitive.indices {
            Some(accessor) => self.document.indices(accessor.value())?,
            None => (0..count as u32).collect(),
        };
        if let Some(invalid) = indices.iter().find(|index| **index as usize >= count) {
            let rule = format!("{invalid} is out of range; number of vertices of the primitive: {count}");
            return Err(self.document.fault(format!("{}.indices", part.location), rule));
        }
        let max_triangles = match part.mode {
            Mode::TriangleStrip | Mode::TriangleFan => indices.len(),
            _ => indices.len() / 3,
        };
        let charge = self.document.budget.take(Resource::Triangles, max_triangles as u64);
        charge.map_err(|rule| self.document.fault(&part.location, rule))?;
        let windows = indices.windows(3);
        Ok(match part.mode {
            Mode::TriangleStrip => {
                let triangle = |(i, window): (usize, &[u32])| [window[0], window[1 + i % 2], window[2 - i % 2]];
                windows.enumerate().map(triangle).collect()
            }
            Mode::TriangleFan => {
                let rim = indices.get(1..).unwrap_or_default().windows(2);
                rim.map(|edge| [edge[0], edge[1], indices[0]]).collect()
            }
            _ => indices
                .chunks_exact(3)
                .map(|chunk| [chunk[0], chunk[1], chunk[2]])
                .collect(),
        })
    }
}

#[derive(Default)]
struct MeshBuilder {
    raw: RawMesh,
    /// Texture coordinate sets. A list ends at the last primitive that has the set.
    uvs: Vec<Vec<Vec2>>,
    /// The first vertex by the key of [`accessors`], because primitives with equal keys share vertices.
    first_vertices: HashMap<Vec<usize>, usize>,
    /// The number of vertices for each first vertex.
    counts: HashMap<usize, usize>,
    /// Vertices with non-finite or too large coordinates.
    invalid_vertices: HashSet<usize>,
}

impl MeshBuilder {
    /// Adds the vertices of a primitive, unless they were already added. Returns the index of the first vertex.
    fn add_vertices(
        &mut self,
        meshes: &Meshes,
        part: &Part,
        material_use: &MaterialUse,
        key: &Key,
        skin: Option<&Skin>,
    ) -> Result<usize, GltfError> {
        let mut accessors = accessors(part.primitive);
        accessors.push(usize::from(material_use.tangents.is_some()));
        // Vertices with rotated tangents cannot be shared, because the rotation depends on the material.
        let is_plain = material_use
            .tangents
            .as_ref()
            .is_none_or(|slot| !slot.rotates_tangents());
        if let Some(first) = self.first_vertices.get(&accessors).filter(|_| is_plain) {
            return Ok(*first);
        }
        let first = self.raw.positions.len();
        let report = |name: &'static str| meshes.record_non_finite(&part.location, name);
        let Some(source) = Source::of(meshes.document, (part.primitive, &part.location), &report, first)? else {
            return Ok(first);
        };
        let mut frames = source.frames(material_use.tangents.is_some())?;
        frames.morph(&source, &key.weights(meshes.document))?;
        let positions = frames.apply_transforms(&source, skin, key.baked_transform())?;
        self.add_positions(first, positions);
        self.add_frames(first, frames, material_use);
        self.add_uvs(first, &source)?;
        if let Some(colors) = source.colors()? {
            self.raw.colors.resize(first, Vec4::ONE);
            self.raw.colors.extend(colors);
        }
        if is_plain {
            self.first_vertices.insert(accessors, first);
        }
        self.counts.insert(first, source.count());
        Ok(first)
    }

    /// Adds positions. Invalid positions become zero and are added to `invalid_vertices`.
    fn add_positions(&mut self, first: usize, mut positions: Vec<DVec3>) {
        for (i, position) in positions.iter_mut().enumerate() {
            if !(position.is_finite() && position.abs().max_element() <= MAX_COORDINATE) {
                *position = DVec3::ZERO;
                self.invalid_vertices.insert(first + i);
            }
        }
        self.raw.positions.extend(positions.iter().map(|p| *p + DVec3::ZERO));
    }

    fn add_frames(&mut self, first: usize, frames: Frames, material_use: &MaterialUse) {
        if let Some(normals) = frames.normals {
            self.raw.normals.resize(first, Vec3::ZERO);
            self.raw
                .normals
                .extend(normals.into_iter().map(|normal| unit(normal.as_dvec3())));
        }
        if let Some(tangents) = frames.tangents {
            self.raw.tangents.resize(first, Vec4::ZERO);
            let normals = &self.raw.normals[first..];
            let slot = material_use.tangents.as_ref();
            let tangents = tangents.into_iter().zip(normals).map(|(tangent, normal)| {
                let side = if tangent.w < 0.0 { -1.0 } else { 1.0 };
                let tangent = unit(tangent.truncate().as_dvec3()).extend(side);
                let tangent = slot.map_or(tangent, |slot| rotate_back(tangent, *normal, slot));
                match tangent.truncate() == Vec3::ZERO {
                    true => Vec4::ZERO,
                    false => tangent,
                }
            });
            self.raw.tangents.extend(tangents);
        }
    }

    fn add_uvs(&mut self, first: usize, source: &Source) -> Result<(), GltfError> {
        for set in 0..=MAX_SET {
            let Some(vectors) = source.uvs(set)? else { continue };
            let set = set as usize;
            if self.uvs.len() <= set {
                self.uvs.resize(set + 1, Vec::new());
            }
            let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
            self.uvs[set].resize(first, Vec2::ZERO);
            // In the top row of an image, v is 0 in glTF, but 1 in wgray.
            let uvs = vectors.into_iter().map(|[u, v]| Vec2::new(finite(u), 1.0 - finite(v)));
            self.uvs[set].extend(uvs);
        }
        Ok(())
    }

    /// Generates missing tangents. The returned triangles use copies of the vertices, split where tangents differ.
    fn with_tangents(
        &mut self,
        part: &Part,
        material_use: &MaterialUse,
        first: usize,
        triangles: Vec<[u32; 3]>,
    ) -> (usize, Vec<[u32; 3]>) {
        let has_tangents = attribute(part.primitive, Semantic::Tangents).is_some();
        let has_normals = attribute(part.primitive, Semantic::Normals).is_some();
        let Some(slot) = material_use.tangents.as_ref().filter(|_| has_normals && !has_tangents) else {
            return (first, triangles);
        };
        let count = self.counts[&first];
        let Some(uvs) = self.uvs.get(slot.set as usize).filter(|uvs| uvs.len() >= first + count) else {
            return (first, triangles);
        };
        let range = first..first + count;
        let positions = &self.raw.positions[range.clone()];
        let Some(generated) = generate(positions, &self.raw.normals[range.clone()], &uvs[range], &triangles) else {
            return (first, triangles);
        };
        let source_vertex = |vertex: u32| first + vertex as usize;
        let first_copy = self.raw.positions.len();
        self.raw.tangents.resize(first_copy, Vec4::ZERO);
        fn append_copies<T: Copy>(list: &mut Vec<T>, first_copy: usize, origins: impl Iterator<Item = usize>) {
            if list.len() >= first_copy {
                let copies: Vec<T> = origins.map(|i| list[i]).collect();
                list.extend(copies);
            }
        }
        let origins = || generated.origins.iter().map(|vertex| source_vertex(*vertex));
        // Each list ends at the last primitive that has the attribute.
        let covers = |length: usize| length >= first + count;
        if covers(self.raw.normals.len()) {
            self.raw.normals.resize(first_copy, Vec3::ZERO);
        }
        if covers(self.raw.colors.len()) {
            self.raw.colors.resize(first_copy, Vec4::ONE);
        }
        for uvs in &mut self.uvs {
            if covers(uvs.len()) {
                uvs.resize(first_copy, Vec2::ZERO);
                append_copies(uvs, first_copy, origins());
            }
        }
        append_copies(&mut self.raw.positions, first_copy, origins());
        append_copies(&mut self.raw.normals, first_copy, origins());
        append_copies(&mut self.raw.colors, first_copy, origins());
        self.raw.tangents.extend(&generated.tangents);
        self.counts.insert(first_copy, generated.origins.len());
        (first_copy, generated.triangles)
    }

    /// Builds the mesh; `None` if all triangles have zero area. `max_set` is the last required texture coordinate set.
    fn finish(mut self, max_set: Option<u32>) -> Result<Option<Mesh>, String> {
        let count = self.raw.positions.len();
        let fill = |list: &mut Vec<Vec2>| list.resize(count, Vec2::ZERO);
        if !self.raw.normals.is_empty() {
            self.raw.normals.resize(count, Vec3::ZERO);
        }
        if !self.raw.colors.is_empty() {
            self.raw.colors.resize(count, Vec4::ONE);
        }
        if !self.raw.tangents.is_empty() {
            self.raw.tangents.resize(count, Vec4::ZERO);
        }
        let sets = max_set
            .map_or(0, |max_set| max_set as usize + 1)
            .max(self.uvs.len().min(1));
        self.uvs.resize(sets, Vec::new());
        self.uvs.iter_mut().for_each(fill);
        let mut uvs = self.uvs.into_iter();
        self.raw.uvs = uvs.next().unwrap_or_default();
        self.raw.more_uvs = uvs.collect();
        self.raw.finish()
    }
}

/// Returns a key that is equal for primitives with equal vertices: the indices of all accessors and their attributes.
fn accessors(primitive: &Primitive) -> Vec<usize> {
    let none = usize::MAX;
    let attributes = primitive.attributes.iter();
    let mut key: Vec<usize> = attributes.map(|(_, accessor)| accessor.value()).collect();
    for target in primitive.targets.iter().flatten() {
        let displacements = [target.positions, target.normals, target.tangents];
        key.extend(displacements.map(|accessor| accessor.map_or(none, |accessor| accessor.value())));
    }
    // Primitives may use the same accessors for different attributes.
    let semantics = primitive.attributes.keys().map(|name| match name {
        Checked::Valid(Semantic::Positions) => 0,
        Checked::Valid(Semantic::Normals) => 1,
        Checked::Valid(Semantic::Tangents) => 2,
        Checked::Valid(Semantic::Colors(i)) => 16 + 8 * *i as usize,
        Checked::Valid(Semantic::TexCoords(i)) => 17 + 8 * *i as usize,
        Checked::Valid(Semantic::Joints(i)) => 18 + 8 * *i as usize,
        Checked::Valid(Semantic::Weights(i)) => 19 + 8 * *i as usize,
        _ => none,
    });
    let semantics: Vec<usize> = semantics.collect();
    key.extend(semantics);
    key
}
