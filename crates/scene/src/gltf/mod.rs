//! Import of glTF 2.0 files, with +Z up: (x, y, z) becomes (x, -z, y). Section numbers refer to Khronos Group, "glTF
//! 2.0 Specification", 2.0.1 (ISO/IEC 12113:2022).

mod accessor;
mod animation;
mod budget;
mod buffer;
mod camera;
#[cfg(test)]
mod changed;
mod contents;
mod document;
mod error;
#[cfg(test)]
mod everything;
mod extension;
#[cfg(test)]
mod fuzz;
mod glb;
#[cfg(test)]
mod hostile;
mod instancing;
mod json;
mod light;
#[cfg(test)]
mod made;
mod material;
mod materials;
mod mesh;
mod meshopt;
mod node;
mod skin;
mod tangent;
mod texture;
mod uri;
mod vertices;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

use self::budget::Resource;
use self::document::Document;
use self::materials::Materials;
use self::mesh::{Key, Meshes};
use self::node::{Nodes, Pose};
use crate::file_system::{FileStamp, FileSystem};
use crate::limits::TIMES;
use crate::mesh::Mesh;
use crate::{
    CameraDescription, GltfDescription, LightDescription, MaterialDescription, Problem, Selection, TextureDescription,
};

pub use self::contents::ModelContents;
pub use self::error::GltfError;

/// Maximum number of instances, and maximum total number of their groups. An instance uses more than 1 KiB of memory.
const MAX_INSTANCES: usize = 1 << 20;

/// Maximum axis length of an instance's transform.
const MAX_AXIS_LENGTH: f64 = 1e6;

const NO_ANIMATIONS: &str = "the file has no animations";

/// Rotation from glTF to scene space: +Y becomes +Z.
pub const UPRIGHT: DAffine3 = DAffine3 {
    matrix3: DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
    translation: DVec3::ZERO,
};

/// The selected scene, time, animation and material variant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportOptions {
    scene: Option<Selection>,
    time: Option<f64>,
    animation: Option<Selection>,
    variant: Option<Selection>,
}

impl ImportOptions {
    /// Returns the import options of a `gltf` shape.
    pub fn of(shape: &GltfDescription) -> Result<ImportOptions, Problem> {
        if let Some(time) = shape.time
            && !(TIMES.0..=TIMES.1).contains(&time)
        {
            return Err(Problem::of("time", format!("{time} must be from 0 to 1e9 seconds")));
        }
        Ok(ImportOptions {
            scene: shape.scene.clone(),
            time: shape.time,
            animation: shape.animation.clone(),
            variant: shape.variant.clone(),
        })
    }
}

/// An imported file, with +Z up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// The meshes.
    pub meshes: Vec<Arc<Mesh>>,
    /// Mesh instances.
    pub instances: Vec<MeshInstance>,
    /// Encoded images, by name.
    pub images: BTreeMap<String, Arc<[u8]>>,
    /// Reasons why images are missing, by the name of the image.
    pub absent: BTreeMap<String, String>,
    /// The materials.
    pub materials: Vec<ImportedMaterial>,
    /// The lights.
    pub lights: Vec<LightDescription>,
    /// The cameras.
    pub cameras: Vec<ImportedCamera>,
    /// Names of the file's scenes, cameras, animations, material variants, materials and images.
    pub contents: ModelContents,
    /// Number of animations.
    pub animations: usize,
    /// Warnings for the user.
    pub notes: Vec<String>,
    /// Damage that does not prevent rendering.
    pub damage: Vec<Damage>,
    files: BTreeSet<PathBuf>,
}

/// Damage in a file that does not prevent rendering.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Location and description of the damage, for a message.
    pub what: String,
    /// Treatment of the damaged values, for a message.
    pub stand_in: &'static str,
}

/// An instance of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshInstance {
    /// Index of the mesh.
    pub mesh: usize,
    /// Object-to-world transform.
    pub to_world: DAffine3,
    /// Material of each group.
    pub materials: Vec<usize>,
}

/// A material and its textures.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedMaterial {
    /// Unique name.
    pub name: String,
    /// Parameters of the material.
    pub description: MaterialDescription,
    /// Textures by the names in the description.
    pub textures: BTreeMap<String, TextureDescription>,
}

/// A camera.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedCamera {
    /// Name in the file.
    pub name: Option<String>,
    /// Parameters of the camera.
    pub description: CameraDescription,
    /// Aspect ratio (width / height), if the file has one.
    pub aspect: Option<f64>,
}

impl Imported {
    /// Returns points that bound the scene: the vertices, or the corners of bounding boxes if there are too many
    /// vertices.
    pub fn points(&self) -> Vec<DVec3> {
        const MAX_POINTS: usize = 1 << 21;
        let vertices = self
            .instances
            .iter()
            .map(|instance| self.meshes[instance.mesh].positions.len());
        if vertices.sum::<usize>() > MAX_POINTS {
            return self.corners();
        }
        let points = self.instances.iter().flat_map(|instance| {
            let mesh = &self.meshes[instance.mesh];
            let points = mesh.positions.iter().map(|p| p.as_dvec3() + mesh.center);
            points.map(|p| instance.to_world.transform_point3(p))
        });
        points.collect()
    }

    fn corners(&self) -> Vec<DVec3> {
        let corners = self.instances.par_iter().map(|instance| {
            let corners = self.meshes[instance.mesh].corners();
            corners
                .map(|corner| instance.to_world.transform_point3(corner))
                .collect::<Vec<_>>()
        });
        corners.flatten_iter().collect()
    }
}

/// Returns the message about a selection that does not exist, with the available names.
pub fn unknown(kind: &str, selection: &Selection, names: &[Option<&str>]) -> String {
    const MAX_LISTED: usize = 20;
    let numbered = |(i, name): (usize, &Option<&str>)| match name {
        Some(name) => format!("{i} ({name:?})"),
        None => i.to_string(),
    };
    let mut entries: Vec<String> = names.iter().enumerate().take(MAX_LISTED).map(numbered).collect();
    if names.len() > MAX_LISTED {
        entries.push(format!("{} more", names.len() - MAX_LISTED));
    }
    let available = match entries.is_empty() {
        true => "none".to_owned(),
        false => entries.join(", "),
    };
    format!("the file has no {kind} {selection}; available: {available}")
}

/// Imports a file. Returns the cached import if it is still in use and its files have not changed.
pub(crate) fn load(
    path: &Path,
    root: &Path,
    file_system: &FileSystem,
    options: &ImportOptions,
    files: &mut BTreeSet<PathBuf>,
) -> Result<Arc<Imported>, GltfError> {
    static IN_USE: Mutex<Vec<CachedImport>> = Mutex::new(Vec::new());
    let is_same_import = |cached: &CachedImport| {
        let is_same_file = cached.path == path && cached.root == root && cached.source == file_system.id();
        is_same_file && cached.options == *options
    };
    {
        let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
        in_use.retain(|cached| cached.imported.strong_count() > 0);
        let cached = in_use
            .iter()
            .find(|cached| is_same_import(cached) && cached.is_fresh(file_system));
        if let Some(imported) = cached.and_then(|cached| cached.imported.upgrade()) {
            files.extend(imported.files.iter().cloned());
            return Ok(imported);
        }
    }
    let _span = tracing::debug_span!("gltf", path = %path.display()).entered();
    // The stamp is taken before reading, so that a change of the file during the import is detected.
    let old_stamp = file_system.stamp(path);
    let mut imported_files = BTreeSet::new();
    let result = import(path, root, file_system, options, &mut imported_files);
    files.extend(imported_files.iter().cloned());
    let mut imported = result?;
    let stamps = imported_files
        .iter()
        .map(|file| (file.clone(), file_system.stamp(file)));
    let stamps = stamps.chain([(path.to_owned(), old_stamp)]).collect();
    imported.files = imported_files;
    let imported = Arc::new(imported);
    let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
    in_use.retain(|cached| !is_same_import(cached));
    in_use.push(CachedImport {
        source: file_system.id(),
        path: path.to_owned(),
        root: root.to_owned(),
        options: options.clone(),
        stamps,
        imported: Arc::downgrade(&imported),
    });
    Ok(imported)
}

struct CachedImport {
    /// Identifier of the file system: [`FileSystem::id`].
    source: u64,
    path: PathBuf,
    root: PathBuf,
    options: ImportOptions,
    stamps: Vec<(PathBuf, FileStamp)>,
    imported: Weak<Imported>,
}

impl CachedImport {
    fn is_fresh(&self, file_system: &FileSystem) -> bool {
        let is_unchanged =
            |(path, recorded): &(PathBuf, FileStamp)| recorded.is_some() && file_system.stamp(path) == *recorded;
        self.stamps.iter().all(is_unchanged)
    }
}

fn import(
    path: &Path,
    root: &Path,
    file_system: &FileSystem,
    options: &ImportOptions,
    files: &mut BTreeSet<PathBuf>,
) -> Result<Imported, GltfError> {
    let document = Document::open(path, root, file_system, files)?;
    let animations = document.animations(options)?;
    let mut poses: Vec<Pose> = document.json.nodes.iter().map(Pose::of).collect();
    let mut notes = Vec::new();
    for animation in document.compatible(animations, &mut notes) {
        document.animate(&mut poses, animation, options.time.unwrap_or(0.0), &mut notes)?;
    }
    let nodes = Nodes::of(&document, &poses)?;
    let scene_nodes = nodes.in_scene(&document, document.scene(options)?)?;
    let mut placements = Vec::new();
    let mut key_indices: HashMap<Key, usize> = HashMap::new();
    let mut keys = Vec::new();
    let (mut zero_scale_count, mut instance_count) = (0, 0_usize);
    for &node_index in &scene_nodes {
        let node = &document.json.nodes[node_index];
        let Some(mesh) = node.mesh else { continue };
        let key = Key::of(&document, node_index, mesh.value(), &poses[node_index]);
        let global = match key.skin {
            Some(_) => DAffine3::IDENTITY, // skins ignore the transform of the node
            None => nodes.globals[node_index],
        };
        let mut shared_key_index = None;
        let transforms = document.instances(node_index)?;
        let charge = document.budget.take(Resource::Instances, transforms.len() as u64);
        charge.map_err(|rule| document.fault(format!("nodes[{node_index}]"), rule))?;
        for transform in transforms {
            let to_world = UPRIGHT * global * transform;
            instance_count += 1;
            if !to_world.is_finite() {
                zero_scale_count += 1;
                continue;
            }
            if !is_placeable(&to_world) {
                let key = key.with_baked_transform(&to_world);
                let key_index = *key_indices.entry(key.clone()).or_insert_with(|| {
                    keys.push(key);
                    keys.len() - 1
                });
                placements.push((key_index, DAffine3::IDENTITY));
                continue;
            }
            let key_index = shared_key_index.get_or_insert_with(|| {
                *key_indices.entry(key.clone()).or_insert_with(|| {
                    keys.push(key.clone());
                    keys.len() - 1
                })
            });
            placements.push((*key_index, to_world));
        }
    }
    let mut materials = Materials::of(&document, document.variant(options)?);
    let meshes = Meshes::of(&document, &mut materials, keys.iter())?;
    let built = keys.par_iter().map(|key| meshes.build(key, &nodes, &materials));
    let built: Vec<Option<mesh::BuiltMesh>> = built.collect::<Result<_, GltfError>>()?;
    let mut mesh_indices = vec![None; keys.len()];
    let mut imported = Imported {
        contents: ModelContents::of(&document),
        animations: document.json.animations.len(),
        ..Imported::default()
    };
    let mut mesh_materials = Vec::new();
    for ((mesh_index, built), key) in mesh_indices.iter_mut().zip(built).zip(&keys) {
        if let Some(built) = built {
            *mesh_index = Some(imported.meshes.len());
            let mut mesh = built.mesh;
            for note in mesh.notes.drain(..) {
                // Debug level, because exported meshes often have degenerate triangles.
                tracing::debug!(mesh = key.mesh, "{note}");
            }
            imported.meshes.push(Arc::new(mesh));
            mesh_materials.push(built.materials);
        }
    }
    let mut group_count = 0;
    for (key_index, to_world) in placements {
        zero_scale_count += usize::from(mesh_indices[key_index].is_none() && keys[key_index].is_flat());
        if let Some(mesh) = mesh_indices[key_index] {
            let materials: Vec<usize> = mesh_materials[mesh].clone();
            group_count += materials.len();
            if group_count > MAX_INSTANCES {
                let rule = format!("all instances of meshes together must have at most {MAX_INSTANCES} primitives");
                return Err(document.fault("nodes", rule));
            }
            imported.instances.push(MeshInstance {
                mesh,
                to_world,
                materials,
            });
        }
    }
    if zero_scale_count > 0 {
        notes.push(format!(
            "{zero_scale_count} of {instance_count} instances of meshes are skipped: their scale is zero"
        ));
    }
    notes.extend(meshes.notes());
    imported.damage = meshes.damage();
    // A scene in which all instances have zero scale is accepted, because an animation may change the scale.
    if imported.instances.is_empty() && zero_scale_count == 0 {
        return Err(document.fault("scene", meshes.no_triangles_reason()));
    }
    let corners = imported.corners();
    let first = corners.first().copied().unwrap_or_default();
    let low = corners.iter().copied().fold(first, DVec3::min);
    let high = corners.iter().copied().fold(first, DVec3::max);
    for &node_index in &scene_nodes {
        imported
            .lights
            .extend(document.light(node_index, &nodes.globals[node_index], &mut notes)?);
        imported
            .cameras
            .extend(document.camera(node_index, &nodes.globals[node_index], (low, high), &mut notes)?);
    }
    notes.extend(light::overexposure(&imported.lights, (low + high) / 2.0));
    imported.contents.cameras = imported.cameras.iter().map(|camera| camera.name.clone()).collect();
    let (materials, images) = materials.finish(&mut notes)?;
    imported.materials = materials;
    imported.images = images.read;
    imported.absent = images.absent;
    notes.splice(0..0, document.notes.iter().cloned());
    imported.notes = notes;
    Ok(imported)
}

/// Returns true if an instance can have this transform; otherwise, the transform is applied to the vertices.
fn is_placeable(transform: &DAffine3) -> bool {
    let [x, y, z] = [
        transform.matrix3.x_axis,
        transform.matrix3.y_axis,
        transform.matrix3.z_axis,
    ];
    let lengths = [x, y, z].map(DVec3::length);
    let volume = x.cross(y).dot(z).abs() / (lengths[0] * lengths[1] * lengths[2]);
    transform.is_finite() && lengths.iter().all(|length| (1e-6..=MAX_AXIS_LENGTH).contains(length)) && volume > 1e-6
}
