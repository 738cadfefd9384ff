//! Triangle meshes: what a mesh file holds, in memory, and how it is read.
//!
//! [`Mesh::load`] reads Wavefront OBJ, PLY and STL files.

mod cache;
mod check;
mod damage;
mod draft;
mod error;
mod finish;
mod mtl;
mod neighbours;
mod obj;
mod ply;
mod polygon;
mod stl;
mod tangents;
mod words;

use std::any::Any;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3, Vec4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::cache::Cache;
pub(crate) use self::draft::{Draft, unit};
pub use self::error::MeshError;
use self::error::{Fault, Place};
pub use self::tangents::{Tangents, VertexTangents};
use crate::note::Note;

/// The largest file, in bytes.
const LARGEST_FILE: u64 = 8 << 30;
/// The largest file of materials, in bytes.
const LARGEST_LIBRARY: u64 = 16 << 20;
/// The most triangles, and the most vertices: three times as many are numbered by 32 bits.
const MOST: usize = 1 << 30;
/// The largest red, green or blue of a vertex.
const MAX_COLOR: f32 = 1e6;
/// The largest coordinate of a position.
pub(crate) const MAX_COORDINATE: f64 = 1e9;

/// A mesh of triangles that share vertices. Positions count from [`Mesh::center`], so that one far from the origin keeps its
/// digits.
///
/// A mesh made in code is checked when a scene is made of it. Its BVH is kept in it from the first use on, and is built again for a mesh that
/// was cloned or taken out of its `Arc`; `Arc::get_mut` returns `None` from then on.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Mesh {
    /// Where positions are counted from, in the file's coordinates.
    pub center: DVec3,
    /// The vertices.
    pub positions: Vec<Vec3>,
    /// A unit normal for each vertex, outwards; empty if there are none.
    pub normals: Vec<Vec3>,
    /// Texture coordinates of each vertex; empty if there are none.
    pub uvs: Vec<Vec2>,
    /// Further sets of texture coordinates: of set k + 1 each vertex's. Empty if there are none.
    pub more_uvs: Vec<Vec<Vec2>>,
    /// A colour for each vertex, linear RGB from 0 to 1e6 and opacity from 0 to 1; empty if there are none.
    pub colors: Vec<Vec4>,
    /// For each vertex the unit tangent along which u grows, and 1 or -1 as a factor of normal x tangent, along which v grows. 0 where
    /// there is none, and then it is made from the texture coordinates; empty if there are none.
    pub tangents: Vec<Vec4>,
    /// Each triangle's vertices, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The parts that may have a material of their own, at least one.
    pub groups: Vec<Group>,
    /// Each triangle's group; empty if there is one group alone.
    pub group_of: Vec<u32>,
    /// The files of materials that come with the file, for groups to name. They are what the groups look like where a scene
    /// says nothing else.
    pub libraries: Vec<Library>,
    /// Warnings about the file, with the action taken: `1 of 12 triangles is a duplicate and was removed`.
    pub notes: Vec<Note>,
    /// Damage to the file, as the errors that it is where damage is refused.
    pub(crate) damage: Vec<Fault>,
    /// Values derived from it, such as its bounding box and BVH.
    cache: Cache,
}

/// A part of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Group {
    /// Its name in the file; empty if it has none.
    pub name: String,
    /// The name of its material in the file.
    pub material: Option<String>,
}

/// A file of materials that an OBJ file names: an MTL file.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Library {
    /// The file, in the folder of the mesh, whether or not it can be read.
    pub file: PathBuf,
    /// Its materials, in their order.
    pub materials: Vec<MtlMaterial>,
    /// Why it is not read, if it is not.
    pub problem: Option<String>,
}

/// A material of an MTL file, as the file has it: what is not there is None.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct MtlMaterial {
    /// Its name: `newmtl`.
    pub name: String,
    /// The line of its name, counted from 1.
    pub line: usize,
    /// The diffuse reflectance: `Kd`.
    pub diffuse: Option<[f64; 3]>,
    /// The specular reflectance: `Ks`.
    pub specular: Option<[f64; 3]>,
    /// The exponent of the highlight: `Ns`.
    pub shininess: Option<f64>,
    /// What it emits: `Ke`.
    pub emission: Option<[f64; 3]>,
    /// How opaque it is, from 0 to 1: `d`, or 1 - `Tr`.
    pub opacity: Option<f64>,
    /// The index of refraction: `Ni`.
    pub index_of_refraction: Option<f64>,
    /// The number of the illumination model: `illum`.
    pub illumination: Option<u8>,
    /// The file of the diffuse reflectance, without options: `map_Kd`.
    pub diffuse_map: Option<String>,
    /// How metallic it is, from 0 to 1: `Pm`.
    pub metallic: Option<f64>,
    /// How rough it is, from 0 to 1: `Pr`.
    pub roughness: Option<f64>,
    /// The file of the emission: `map_Ke`.
    pub emission_map: Option<String>,
    /// The file of the opacity: `map_d`.
    pub opacity_map: Option<String>,
    /// The file of heights, or of normals as some exporters have it: `map_Bump` or `bump`.
    pub bump_map: Option<String>,
    /// The file of normals: `norm`.
    pub normal_map: Option<String>,
    /// The file of the metalness: `map_Pm`.
    pub metallic_map: Option<String>,
    /// The file of the roughness: `map_Pr`.
    pub roughness_map: Option<String>,
    /// The statements that have no effect: other maps, and options of maps.
    pub others: Vec<String>,
    /// The lines of the keywords, and of the statements that have no effect, counted from 1.
    pub(crate) lines: BTreeMap<String, usize>,
}

impl MtlMaterial {
    /// Returns the files of all maps.
    pub(crate) fn maps(&self) -> impl Iterator<Item = &String> {
        let maps = [
            &self.diffuse_map,
            &self.emission_map,
            &self.opacity_map,
            &self.bump_map,
            &self.normal_map,
            &self.metallic_map,
            &self.roughness_map,
        ];
        maps.into_iter().flatten()
    }
}

/// Which normals a mesh has: what its surface looks like under light, not where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Normals {
    /// Made from the triangles around each position, weighted by their angles there.
    Smooth,
    /// Each triangle's own: [`Mesh::normals`] is empty.
    Flat,
    /// The file's. A file without any is an error.
    File,
}

impl Mesh {
    /// Reads a mesh from a file whose name ends in `.obj`, `.ply` or `.stl`.
    ///
    /// Without a word on normals they are the file's if it has any for its vertices (OBJ, PLY), else flat ones.
    ///
    /// - Polygons become triangles. Triangles without an area are dropped.
    /// - OBJ files have a vertex for each different combination of position, texture coordinates and normal at a corner,
    ///   and a group for each different combination of `g` or `o`, the later one, with `usemtl`. The files that `mtllib`
    ///   names are read if they are in the folder of the mesh or in one below. Colors of vertices are sRGB. Smoothing groups (`s`),
    ///   fourth coordinates, lines and curves are ignored.
    /// - PLY files have the vertices that their triangles share. Colours of vertices that are whole numbers are sRGB, those that are floats
    ///   linear.
    /// - STL files have a vertex for each different position, and a group for each `solid`. Normals of facets are looked at
    ///   for [`Normals::File`] alone, and then tell vertices apart.
    ///
    /// Damaged parts are left out. [`Mesh::notes`] has warnings about them, and about other oddities.
    pub fn load(path: &Path, normals: Option<Normals>) -> Result<Mesh, MeshError> {
        let _span = tracing::debug_span!("mesh", path = %path.display()).entered();
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        let format = match ending.to_str() {
            Some("obj") => Format::Obj,
            Some("ply") => Format::Ply,
            Some("stl") => Format::Stl,
            _ => {
                let rule = "the name of a mesh must end in .obj, .ply or .stl";
                return Err(Place::File.fault(rule).of(path));
            }
        };
        let read_error = |error| MeshError::Read {
            path: path.to_owned(),
            error,
        };
        let bytes = match read_file(path, LARGEST_FILE).map_err(read_error)? {
            Some(bytes) => bytes,
            None => {
                let rule = format!("must not be larger than {} GiB", LARGEST_FILE >> 30);
                return Err(Place::File.fault(rule).of(path));
            }
        };
        let (mut mesh, libraries, damage) = read(&bytes, format, normals).map_err(|fault| fault.of(path))?;
        drop(bytes);
        mesh.damage = damage;
        for names in libraries {
            mesh.load_libraries(path, &names);
        }
        Ok(mesh)
    }

    /// Reads the files of materials of one line: one whose name may have blanks, or several.
    fn load_libraries(&mut self, mesh: &Path, names: &str) {
        let folder = match mesh.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        if file_beside(folder, names).is_file() {
            self.load_library(folder, names);
        } else {
            let names = names.split(' ').take(obj::MOST_LIBRARIES);
            names.for_each(|name| self.load_library(folder, name));
        }
    }

    /// Reads an MTL file. [`Library::problem`] has the reason if that fails.
    fn load_library(&mut self, folder: &Path, name: &str) {
        let mut library = Library {
            file: file_beside(folder, name),
            ..Library::default()
        };
        // Each is read once, however often it is named, and no more of them than lines may name.
        let is_known = self.libraries.iter().any(|known| known.file == library.file);
        if is_known || self.libraries.len() >= obj::MOST_LIBRARIES {
            return;
        }
        let read = read_library(folder, &library.file).and_then(|bytes| mtl::read(&bytes));
        match read {
            Ok(mtl::Mtl {
                materials,
                problems,
                problem_count,
            }) => {
                library.materials = materials;
                if let Some(problem) = problems.first() {
                    let others = match problem_count - 1 {
                        0 => String::new(),
                        1 => "; 1 more line cannot be read".to_owned(),
                        count => format!("; {count} more lines cannot be read"),
                    };
                    self.notes.push(format!("{name}:{problem}{others}").into());
                }
            }
            Err(why) => library.problem = Some(why),
        }
        self.libraries.push(library);
    }
}

impl Mesh {
    /// Returns the value of type `T` that is computed from the mesh on the first call, and kept with it. Each type has one value.
    pub fn cached<T: Any + Send + Sync>(self: &Arc<Self>, compute: impl FnOnce(&Mesh) -> T) -> Arc<T> {
        self.cache.get_or_init(self, || compute(self))
    }

    /// Returns the first rule that the mesh breaks. Meshes that were read from files break none.
    pub(crate) fn broken_rule(self: &Arc<Self>) -> Option<String> {
        struct BrokenRule(Option<String>);
        self.cached(|mesh| BrokenRule(check::check(mesh).err())).0.clone()
    }

    /// Returns the corners of the bounding box, in the file's coordinates.
    pub fn corners(self: &Arc<Self>) -> impl Iterator<Item = DVec3> + use<> {
        struct Bounds([Vec3; 2]);
        let bounds = self.cached(|mesh| {
            let start = [Vec3::INFINITY, Vec3::NEG_INFINITY];
            Bounds(
                mesh.positions
                    .iter()
                    .fold(start, |[low, high], &p| [low.min(p), high.max(p)]),
            )
        });
        let [low, high] = bounds.0.map(|corner| corner.as_dvec3() + self.center);
        (0..8).map(move |i| {
            let side = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
            DVec3::new(side(0), side(1), side(2))
        })
    }
}

#[derive(Clone, Copy)]
enum Format {
    Obj,
    Ply,
    Stl,
}

/// Reads a mesh, the names of its MTL files, and the damage that was dealt with, from the bytes of a file.
fn read(bytes: &[u8], format: Format, normals: Option<Normals>) -> Result<(Mesh, Vec<String>, Vec<Fault>), Fault> {
    if bytes.is_empty() {
        return Err(Place::File.fault("the file is empty"));
    }
    let are_wanted = matches!(normals, None | Some(Normals::File));
    let (mut draft, libraries) = match format {
        Format::Obj => {
            let obj = obj::read(&words::utf8(bytes), are_wanted)?;
            (obj.draft, obj.libraries)
        }
        Format::Ply => (ply::read(bytes, are_wanted)?, Vec::new()),
        Format::Stl => (stl::read(bytes, normals == Some(Normals::File))?, Vec::new()),
    };
    if let (true, Some(fault)) = (draft.triangles.is_empty(), draft.damages.first()) {
        return Err(fault.clone());
    }
    let (damage, notes) = std::mem::take(&mut draft.damages).into_parts();
    draft.notes.splice(0..0, notes);
    let mesh = finish::finish(draft, normals).map_err(|fault| match damage.first() {
        Some(first) if fault.is_empty => first.clone(),
        _ => fault,
    })?;
    Ok((mesh, libraries, damage))
}

/// The bytes of a file; None if it is too large.
fn read_file(path: &Path, largest: u64) -> io::Result<Option<Vec<u8>>> {
    // A pipe could keep its reader waiting for ever.
    let data = fs::metadata(path)?;
    if !data.is_file() {
        return Err(io::Error::other("it must be a file"));
    }
    if data.len() > largest {
        return Ok(None);
    }
    let mut bytes = Vec::with_capacity(data.len() as usize);
    fs::File::open(path)?.take(largest + 1).read_to_end(&mut bytes)?;
    Ok(Some(bytes).filter(|bytes| bytes.len() as u64 <= largest))
}

/// The bytes of a file of materials; or why there are none.
fn read_library(folder: &Path, file: &Path) -> Result<Vec<u8>, String> {
    let told = |error: io::Error| error.to_string();
    let path = file.canonicalize().map_err(told)?;
    if !path.starts_with(folder.canonicalize().map_err(told)?) {
        return Err("it must be in the folder of the mesh".to_string());
    }
    match read_file(&path, LARGEST_LIBRARY).map_err(told)? {
        Some(bytes) => Ok(bytes),
        None => Err(format!("it must not be larger than {} MiB", LARGEST_LIBRARY >> 20)),
    }
}

/// Returns a file that another one in a folder names. If it does not exist, as with a path of another machine, this is the file of that
/// name in the folder itself, then one whose name differs in the case of letters only.
pub(crate) fn file_beside(folder: &Path, name: &str) -> PathBuf {
    let slashes = name.replace('\\', "/"); // written on Windows
    let last = slashes.rsplit('/').next().unwrap_or(&slashes);
    let tried = [name, &slashes, last].map(|name| folder.join(name));
    let [_, plain, _] = &tried;
    let found = tried.iter().find(|path| path.is_file()).cloned();
    let found = found.or_else(|| in_other_case(folder, &slashes));
    found
        .or_else(|| in_other_case(folder, last))
        .unwrap_or_else(|| plain.clone())
}

/// Returns an existing file in a folder whose path differs in the case of letters only.
pub(crate) fn in_other_case(folder: &Path, path: &str) -> Option<PathBuf> {
    let (parents, name) = path.rsplit_once('/').unwrap_or(("", path));
    let mut folder = folder.to_owned();
    for parent in parents.split('/').filter(|parent| !parent.is_empty()) {
        let exact = folder.join(parent);
        folder = match exact.is_dir() {
            true => exact,
            false => entry_in_other_case(&folder, parent, Path::is_dir)?,
        };
    }
    entry_in_other_case(&folder, name, Path::is_file)
}

fn entry_in_other_case(folder: &Path, name: &str, is_wanted: fn(&Path) -> bool) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let name = name.to_lowercase();
    let entries = fs::read_dir(folder).ok()?.filter_map(Result::ok);
    let same = entries.filter(|entry| entry.file_name().to_string_lossy().to_lowercase() == name);
    same.map(|entry| folder.join(entry.file_name()))
        .filter(|path| is_wanted(path))
        .min()
}
