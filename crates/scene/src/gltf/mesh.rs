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
use super::tangent::{generated, unturned};
use super::texture::LAST_SET;
use super::vertices::{Frames, Source, attribute};
use super::{Damage, MAX_AXIS_LENGTH};
use crate::mesh::{Group, MAX_COORDINATE, Mesh, RawMesh, unit};

#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Key {
    pub mesh: usize,
    pub skin: Option<usize>,
    /// Bits of the node's own morph weights.
    weights: Option<Vec<u32>>,
    /// Bits of a transform that is applied to the vertices, because an axis is too short or too long for an instance.
    flat: Option<[u64; 12]>,
}

impl Key {
    pub fn of(document: &Document, node: usize, mesh: usize, pose: &Pose) -> Key {
        let weights = pose.weights.as_ref();
        Key {
            mesh,
            skin: document.json.nodes[node].skin.map(|skin| skin.value()),
            weights: weights.map(|all| all.iter().map(|weight| weight.to_bits()).collect()),
            flat: None,
        }
    }

    pub fn at(&self, map: &DAffine3) -> Key {
        Key {
            flat: Some(map.to_cols_array().map(f64::to_bits)),
            ..self.clone()
        }
    }

    /// Returns true if an axis is too short; false if an axis is too long.
    pub fn is_flat(&self) -> bool {
        let is_small = |axis: DVec3| axis.length() <= MAX_AXIS_LENGTH;
        self.flat().is_some_and(|map| {
            let DMat3 { x_axis, y_axis, z_axis } = map.matrix3;
            [x_axis, y_axis, z_axis].into_iter().all(is_small)
        })
    }

    fn flat(&self) -> Option<DAffine3> {
        self.flat
            .map(|bits| DAffine3::from_cols_array(&bits.map(f64::from_bits)))
    }

    fn weights(&self, document: &Document) -> Vec<f32> {
        match &self.weights {
            Some(own) => own.iter().map(|bits| f32::from_bits(*bits)).collect(),
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
    bare: Option<(String, u32)>,
    bare_count: usize,
    /// For each attribute, the first primitive with non-finite values, and the number of such primitives.
    non_finite: Mutex<BTreeMap<&'static str, (String, usize)>>,
    /// The first primitive that has triangles with invalid positions, and the number of such triangles.
    unplaced: Mutex<Option<(String, usize)>>,
}

struct Part<'a> {
    primitive: &'a Primitive,
    place: String,
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
            bare: None,
            bare_count: 0,
            non_finite: Mutex::default(),
            unplaced: Mutex::default(),
        };
        for key in keys {
            if meshes.parts.contains_key(&key.mesh) {
                continue;
            }
            let Some(mesh) = document.json.meshes.get(key.mesh) else {
                let count = document.json.meshes.len();
                return Err(document.fault(
                    "nodes",
                    format!("{} is out of range; the file has {count} meshes", key.mesh),
                ));
            };
            let mut parts = Vec::new();
            for (i, primitive) in mesh.primitives.iter().enumerate() {
                let place = format!("meshes[{}].primitives[{i}]", key.mesh);
                let Checked::Valid(mode) = primitive.mode else {
                    return Err(document.fault(format!("{place}.mode"), "must be from 0 to 6"));
                };
                match mode {
                    Mode::Points => meshes.points += 1,
                    Mode::Lines | Mode::LineLoop | Mode::LineStrip => meshes.lines += 1,
                    _ if attribute(primitive, Semantic::Positions).is_none() => {} // not drawn: section 3.7.2.1
                    _ => {
                        let is_colored = attribute(primitive, Semantic::Colors(0)).is_some();
                        let material = materials.number(primitive, &place, is_colored)?;
                        let lacks = |set: &&u32| attribute(primitive, Semantic::TexCoords(**set)).is_none();
                        if let Some(set) = materials.get(material).sets.iter().find(lacks) {
                            meshes.bare.get_or_insert_with(|| (place.clone(), *set));
                            meshes.bare_count += 1;
                        }
                        parts.push(Part {
                            primitive,
                            place,
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
        let ignored = |count: usize, of: &str| match count {
            0 => None,
            1 => Some(format!("1 primitive of {of} is skipped: only triangles are rendered")),
            _ => Some(format!(
                "{count} primitives of {of} are skipped: only triangles are rendered"
            )),
        };
        let bare = self.bare.as_ref().map(|(place, set)| {
            let rule = format!("{place} has no TEXCOORD_{set}, which its material needs; (0, 0) is used");
            match self.bare_count {
                1 => rule,
                2 => format!("{rule} (and 1 more primitive)"),
                count => format!("{rule} (and {} more primitives)", count - 1),
            }
        });
        [ignored(self.points, "points"), ignored(self.lines, "lines"), bare]
            .into_iter()
            .flatten()
    }

    pub fn damage(&self) -> Vec<Damage> {
        let non_finite = self.non_finite.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let non_finite = non_finite.into_iter().map(|(name, (place, count))| {
            let what = format!("{place}.attributes.{name} has numbers that are not finite");
            Damage {
                what: match count {
                    1 => what,
                    2 => format!("{what}, as has 1 more primitive"),
                    count => format!("{what}, as have {} more primitives", count - 1),
                },
                stand_in: "they are ignored",
            }
        });
        let unplaced = self.unplaced.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let unplaced = unplaced.map(|(place, count)| {
            let triangles = match count {
                1 => "1 triangle has".to_owned(),
                _ => format!("{count} triangles have"),
            };
            let rule = "that is not finite or beyond 1e9";
            Damage {
                what: format!("{place}.attributes.POSITION: {triangles} a vertex with a coordinate {rule}"),
                stand_in: if count == 1 {
                    "it is skipped"
                } else {
                    "they are skipped"
                },
            }
        });
        unplaced.into_iter().chain(non_finite).collect()
    }

    /// Returns the reason why there are no triangles.
    pub fn nothing(&self) -> String {
        match (self.points, self.lines, self.damage().first()) {
            (0, 0, None) => "has no triangles".to_owned(),
            (0, 0, Some(damage)) => format!("has no triangles: {}", damage.what),
            _ => "has no triangles: points and lines are not rendered".to_owned(),
        }
    }

    fn lacks_positions(&self, place: &str, triangles: usize) {
        if triangles == 0 {
            return;
        }
        let mut unplaced = self.unplaced.lock().unwrap_or_else(PoisonError::into_inner);
        let (first, count) = unplaced.get_or_insert_with(|| (place.to_owned(), 0));
        *count += triangles;
        // Reports arrive in any order, because meshes are built in parallel.
        if (place.len(), place) < (first.len(), first.as_str()) {
            place.clone_into(first);
        }
    }

    fn record_non_finite(&self, place: &str, name: &'static str) {
        let mut non_finite = self.non_finite.lock().unwrap_or_else(PoisonError::into_inner);
        let (first, count) = non_finite.entry(name).or_insert_with(|| (place.to_owned(), 0));
        *count += 1;
        if (place.len(), place) < (first.len(), first.as_str()) {
            place.clone_into(first);
        }
    }

    /// Builds a mesh; `None` if it has no triangles.
    pub fn build(&self, key: &Key, nodes: &Nodes, materials: &Materials) -> Result<Option<BuiltMesh>, GltfError> {
        let parts = self.parts.get(&key.mesh).map_or(&[][..], Vec::as_slice);
        let skin = key.skin.map(|skin| Skin::of(self.document, skin, nodes)).transpose()?;
        let mut whole = MeshBuilder::default();
        let mut numbers = Vec::new();
        for part in parts {
            let used = materials.get(part.material);
            let first = whole.vertices(self, part, used, key, skin.as_ref())?;
            let count = whole.counts[&first];
            let mut triangles = self.triangles(part, count)?;
            if !whole.unplaced.is_empty() {
                let has_positions = |triangle: &[u32; 3]| {
                    let is_unplaced = |vertex: &u32| whole.unplaced.contains(&(first + *vertex as usize));
                    !triangle.iter().any(is_unplaced)
                };
                let before = triangles.len();
                triangles.retain(has_positions);
                self.lacks_positions(&part.place, before - triangles.len());
            }
            let mirrors = key.flat().is_some_and(|map| map.matrix3.determinant() < 0.0);
            let triangles = match mirrors {
                true => triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect(),
                false => triangles,
            };
            let (first, triangles) = whole.with_tangents(part, used, first, triangles);
            whole.draft.begin(numbers.len() as u32);
            whole.draft.groups.push(Group {
                name: numbers.len().to_string(),
                material: None,
            });
            numbers.push(part.material);
            let placed = triangles
                .into_iter()
                .map(|triangle| triangle.map(|vertex| vertex + first as u32));
            whole.draft.triangles.extend(placed);
        }
        if whole.draft.triangles.is_empty() {
            return Ok(None);
        }
        let place = || format!("meshes[{}]", key.mesh);
        let sets = parts.iter().flat_map(|part| materials.get(part.material).sets.iter());
        let most = sets.copied().max();
        let mesh = whole.finish(most).map_err(|rule| self.document.fault(place(), rule))?;
        // Drops flattened meshes that are too small to render.
        let has_size = |mesh: &Mesh| {
            let positions = || mesh.positions.iter().copied();
            let extent = positions().fold(Vec3::NEG_INFINITY, Vec3::max) - positions().fold(Vec3::INFINITY, Vec3::min);
            extent.max_element() >= 1e-9
        };
        let mesh = mesh.filter(|mesh| !key.is_flat() || has_size(mesh));
        let built = mesh.map(|mesh| BuiltMesh {
            mesh,
            materials: numbers,
        });
        Ok(built)
    }

    fn triangles(&self, part: &Part, count: usize) -> Result<Vec<[u32; 3]>, GltfError> {
        let indices = match part.primitive.indices {
            Some(accessor) => self.document.indices(accessor.value())?,
            None => (0..count as u32).collect(),
        };
        if let Some(beyond) = indices.iter().find(|index| **index as usize >= count) {
            let rule = format!("{beyond} is out of range; the primitive has {count} vertices");
            return Err(self.document.fault(format!("{}.indices", part.place), rule));
        }
        let most = match part.mode {
            Mode::TriangleStrip | Mode::TriangleFan => indices.len(),
            _ => indices.len() / 3,
        };
        let room = self.document.budget.take(Resource::Triangles, most as u64);
        room.map_err(|rule| self.document.fault(&part.place, rule))?;
        let windows = indices.windows(3);
        Ok(match part.mode {
            Mode::TriangleStrip => {
                let turned = |(i, of): (usize, &[u32])| [of[0], of[1 + i % 2], of[2 - i % 2]];
                windows.enumerate().map(turned).collect()
            }
            Mode::TriangleFan => {
                let around = indices.get(1..).unwrap_or_default().windows(2);
                around.map(|of| [of[0], of[1], indices[0]]).collect()
            }
            _ => indices.chunks_exact(3).map(|of| [of[0], of[1], of[2]]).collect(),
        })
    }
}

#[derive(Default)]
struct MeshBuilder {
    draft: RawMesh,
    /// Texture coordinate sets, each up to the last primitive that has it.
    uvs: Vec<Vec<Vec2>>,
    /// The first vertex for each set of accessors; primitives may share accessors.
    known: HashMap<Vec<usize>, usize>,
    counts: HashMap<usize, usize>,
    /// Vertices with non-finite or too large coordinates.
    unplaced: HashSet<usize>,
}

impl MeshBuilder {
    /// Adds the vertices of a primitive, unless they were already added. Returns the index of the first vertex.
    fn vertices(
        &mut self,
        meshes: &Meshes,
        part: &Part,
        used: &MaterialUse,
        key: &Key,
        skin: Option<&Skin>,
    ) -> Result<usize, GltfError> {
        let mut accessors = accessors(part.primitive);
        accessors.push(usize::from(used.tangents.is_some()));
        // Vertices with rotated tangents cannot be shared.
        let is_plain = used.tangents.as_ref().is_none_or(|slot| !slot.is_turned());
        if let Some(first) = self.known.get(&accessors).filter(|_| is_plain) {
            return Ok(*first);
        }
        let first = self.draft.positions.len();
        let report = |name: &'static str| meshes.record_non_finite(&part.place, name);
        let Some(source) = Source::of(meshes.document, (part.primitive, &part.place), &report, first)? else {
            return Ok(first);
        };
        let mut frames = source.frames(used.tangents.is_some())?;
        frames.morph(&source, &key.weights(meshes.document))?;
        let positions = frames.place(&source, skin, key.flat())?;
        self.add_positions(first, positions);
        self.add_frames(first, frames, used);
        self.add_uvs(first, &source)?;
        if let Some(colors) = source.colors()? {
            self.draft.colors.resize(first, Vec4::ONE);
            self.draft.colors.extend(colors);
        }
        if is_plain {
            self.known.insert(accessors, first);
        }
        self.counts.insert(first, source.count());
        Ok(first)
    }

    /// Adds positions. Invalid positions become zero and are added to `unplaced`.
    fn add_positions(&mut self, first: usize, mut positions: Vec<DVec3>) {
        for (i, position) in positions.iter_mut().enumerate() {
            if !(position.is_finite() && position.abs().max_element() <= MAX_COORDINATE) {
                *position = DVec3::ZERO;
                self.unplaced.insert(first + i);
            }
        }
        self.draft.positions.extend(positions.iter().map(|p| *p + DVec3::ZERO));
    }

    fn add_frames(&mut self, first: usize, frames: Frames, used: &MaterialUse) {
        if let Some(normals) = frames.normals {
            self.draft.normals.resize(first, Vec3::ZERO);
            self.draft
                .normals
                .extend(normals.into_iter().map(|normal| unit(normal.as_dvec3())));
        }
        if let Some(tangents) = frames.tangents {
            self.draft.tangents.resize(first, Vec4::ZERO);
            let normals = &self.draft.normals[first..];
            let slot = used.tangents.as_ref();
            let tangents = tangents.into_iter().zip(normals).map(|(tangent, normal)| {
                let side = if tangent.w < 0.0 { -1.0 } else { 1.0 };
                let tangent = unit(tangent.truncate().as_dvec3()).extend(side);
                let tangent = slot.map_or(tangent, |slot| unturned(tangent, *normal, slot));
                match tangent.truncate() == Vec3::ZERO {
                    true => Vec4::ZERO,
                    false => tangent,
                }
            });
            self.draft.tangents.extend(tangents);
        }
    }

    fn add_uvs(&mut self, first: usize, source: &Source) -> Result<(), GltfError> {
        for set in 0..=LAST_SET {
            let Some(vectors) = source.uvs(set)? else { continue };
            let set = set as usize;
            if self.uvs.len() <= set {
                self.uvs.resize(set + 1, Vec::new());
            }
            let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
            self.uvs[set].resize(first, Vec2::ZERO);
            // At the first image row, v is 0 in glTF, but 1 here.
            let uvs = vectors.into_iter().map(|[u, v]| Vec2::new(finite(u), 1.0 - finite(v)));
            self.uvs[set].extend(uvs);
        }
        Ok(())
    }

    /// Generates missing tangents. The triangles get separate vertices, which are split where tangents differ.
    fn with_tangents(
        &mut self,
        part: &Part,
        used: &MaterialUse,
        first: usize,
        triangles: Vec<[u32; 3]>,
    ) -> (usize, Vec<[u32; 3]>) {
        let has_tangents = attribute(part.primitive, Semantic::Tangents).is_some();
        let has_normals = attribute(part.primitive, Semantic::Normals).is_some();
        let Some(slot) = used.tangents.as_ref().filter(|_| has_normals && !has_tangents) else {
            return (first, triangles);
        };
        let count = self.counts[&first];
        let Some(uvs) = self.uvs.get(slot.set as usize).filter(|uvs| uvs.len() >= first + count) else {
            return (first, triangles);
        };
        let range = first..first + count;
        let positions = &self.draft.positions[range.clone()];
        let Some(made) = generated(positions, &self.draft.normals[range.clone()], &uvs[range], &triangles) else {
            return (first, triangles);
        };
        let from = |vertex: u32| first + vertex as usize;
        let own = self.draft.positions.len();
        self.draft.tangents.resize(own, Vec4::ZERO);
        fn again<T: Copy>(list: &mut Vec<T>, own: usize, from: impl Iterator<Item = usize>) {
            if list.len() >= own {
                let copies: Vec<T> = from.map(|i| list[i]).collect();
                list.extend(copies);
            }
        }
        let origins = || made.origins.iter().map(|vertex| from(*vertex));
        // Each list ends at the last primitive that has the attribute.
        let reach = |length: usize| length >= first + count;
        if reach(self.draft.normals.len()) {
            self.draft.normals.resize(own, Vec3::ZERO);
        }
        if reach(self.draft.colors.len()) {
            self.draft.colors.resize(own, Vec4::ONE);
        }
        for uvs in &mut self.uvs {
            if reach(uvs.len()) {
                uvs.resize(own, Vec2::ZERO);
                again(uvs, own, origins());
            }
        }
        again(&mut self.draft.positions, own, origins());
        again(&mut self.draft.normals, own, origins());
        again(&mut self.draft.colors, own, origins());
        self.draft.tangents.extend(&made.tangents);
        self.counts.insert(own, made.origins.len());
        (own, made.triangles)
    }

    /// Builds the mesh; `None` if it has zero area. `most` is the last required texture coordinate set.
    fn finish(mut self, most: Option<u32>) -> Result<Option<Mesh>, String> {
        let count = self.draft.positions.len();
        let fill = |list: &mut Vec<Vec2>| list.resize(count, Vec2::ZERO);
        if !self.draft.normals.is_empty() {
            self.draft.normals.resize(count, Vec3::ZERO);
        }
        if !self.draft.colors.is_empty() {
            self.draft.colors.resize(count, Vec4::ONE);
        }
        if !self.draft.tangents.is_empty() {
            self.draft.tangents.resize(count, Vec4::ZERO);
        }
        let sets = most.map_or(0, |most| most as usize + 1).max(self.uvs.len().min(1));
        self.uvs.resize(sets, Vec::new());
        self.uvs.iter_mut().for_each(fill);
        let mut uvs = self.uvs.into_iter();
        self.draft.uvs = uvs.next().unwrap_or_default();
        self.draft.more_uvs = uvs.collect();
        self.draft.finish()
    }
}

fn accessors(primitive: &Primitive) -> Vec<usize> {
    let none = usize::MAX;
    let attributes = primitive.attributes.iter();
    let mut all: Vec<usize> = attributes.map(|(_, accessor)| accessor.value()).collect();
    for target in primitive.targets.iter().flatten() {
        let of = [target.positions, target.normals, target.tangents];
        all.extend(of.map(|accessor| accessor.map_or(none, |accessor| accessor.value())));
    }
    // The same accessors may be different attributes.
    let names = primitive.attributes.keys().map(|name| match name {
        Checked::Valid(Semantic::Positions) => 0,
        Checked::Valid(Semantic::Normals) => 1,
        Checked::Valid(Semantic::Tangents) => 2,
        Checked::Valid(Semantic::Colors(i)) => 16 + 8 * *i as usize,
        Checked::Valid(Semantic::TexCoords(i)) => 17 + 8 * *i as usize,
        Checked::Valid(Semantic::Joints(i)) => 18 + 8 * *i as usize,
        Checked::Valid(Semantic::Weights(i)) => 19 + 8 * *i as usize,
        _ => none,
    });
    let names: Vec<usize> = names.collect();
    all.extend(names);
    all
}
