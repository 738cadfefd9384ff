//! Triangle meshes and their files. [`Mesh::load`] reads Wavefront OBJ, PLY and STL files.

mod build;
mod builder;
mod cache;
mod check;
mod damage;
mod error;
mod mtl;
mod neighbours;
mod obj;
mod ply;
mod polygon;
mod raw_mesh;
mod stl;
mod tangents;
mod tokens;

use std::any::Any;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};

pub use self::builder::MeshBuilder;
use self::cache::Cache;
pub use self::error::MeshError;
use self::error::{Location, MeshFault};
pub(crate) use self::raw_mesh::{RawMesh, unit};
pub use self::tangents::{Tangents, VertexTangents};
use crate::file_system::{FileSystem, NoFiles};
use crate::note::Note;

/// Maximum size of a mesh file in bytes.
const MAX_FILE_BYTES: u64 = 8 << 30;
/// Maximum size of an MTL file in bytes.
const MAX_LIBRARY_BYTES: u64 = 16 << 20;
/// Maximum number of triangles, and of vertices. Three times this number fits into 32-bit indices.
const MAX_ELEMENTS: usize = 1 << 30;
/// Maximum color component of a vertex.
const MAX_COLOR: f32 = 1e6;
/// Maximum magnitude of a coordinate.
pub(crate) const MAX_COORDINATE: f64 = 1e9;

/// A triangle mesh with shared vertices. Positions are relative to [`Mesh::center`], which keeps them precise far from
/// the origin.
///
/// Meshes that are created in code are validated together with their scene. The BVH is cached in the mesh on first use;
/// from then on, `Arc::get_mut` returns `None`. The BVH is rebuilt for a clone, and for a mesh that was moved out of
/// its `Arc`.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Mesh {
    /// Origin of the positions, in the file's coordinates.
    pub center: DVec3,
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Outward unit normals, or empty.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, or empty.
    pub uvs: Vec<Vec2>,
    /// Further sets of texture coordinates, starting with set 1.
    pub more_uvs: Vec<Vec<Vec2>>,
    /// Linear RGB (0 to 1e6) and opacity (0 to 1), or empty.
    pub colors: Vec<Vec4>,
    /// Unit tangents in the direction of u, or empty. `w` is 1 or -1: v increases along w (normal × tangent). A tangent
    /// of zero is replaced by a tangent that is computed from the texture coordinates.
    pub tangents: Vec<Vec4>,
    /// Vertices of the triangles, counter-clockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Groups of triangles with separate materials; at least one group.
    pub groups: Vec<Group>,
    /// Group of each triangle; empty for a single group.
    pub group_of: Vec<u32>,
    /// MTL files. Groups use the materials of these files unless the scene overrides the materials.
    pub libraries: Vec<Library>,
    /// Warnings, with the action taken: `1 of 12 triangles is a duplicate and was removed`.
    pub notes: Vec<Note>,
    /// Defects, which are errors in strict mode.
    pub(crate) defects: Vec<MeshFault>,
    /// Bounding box, BVH and other derived data.
    cache: Cache,
}

/// A group of triangles of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Group {
    /// Name in the file, or empty.
    pub name: String,
    /// Name of the material.
    pub material: Option<String>,
}

/// An MTL file of an OBJ file.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Library {
    /// The file, in the folder of the mesh. The file may not exist.
    pub file: PathBuf,
    /// Materials in file order.
    pub materials: Vec<MtlMaterial>,
    /// The reason why the file was not read; `None` if the file was read.
    pub problem: Option<String>,
}

/// A material of an MTL file. Missing values are `None`.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct MtlMaterial {
    /// Name: `newmtl`.
    pub name: String,
    /// Line of `newmtl`, from 1.
    pub line: usize,
    /// Diffuse reflectance: `Kd`.
    pub diffuse: Option<[f64; 3]>,
    /// Specular reflectance: `Ks`.
    pub specular: Option<[f64; 3]>,
    /// Phong exponent: `Ns`.
    pub shininess: Option<f64>,
    /// Emission: `Ke`.
    pub emission: Option<[f64; 3]>,
    /// Opacity from 0 to 1: `d`, or 1 - `Tr`.
    pub opacity: Option<f64>,
    /// Index of refraction: `Ni`.
    pub index_of_refraction: Option<f64>,
    /// Illumination model: `illum`.
    pub illumination: Option<u8>,
    /// Texture of the diffuse reflectance, without options: `map_Kd`.
    pub diffuse_map: Option<String>,
    /// Metallic factor from 0 to 1: `Pm`.
    pub metallic: Option<f64>,
    /// Roughness from 0 to 1: `Pr`.
    pub roughness: Option<f64>,
    /// Texture of the emission: `map_Ke`.
    pub emission_map: Option<String>,
    /// Texture of the opacity: `map_d`.
    pub opacity_map: Option<String>,
    /// Height map, or a normal map in files of some exporters: `map_Bump` or `bump`.
    pub bump_map: Option<String>,
    /// Normal map: `norm`.
    pub normal_map: Option<String>,
    /// Texture of the metallic factor: `map_Pm`.
    pub metallic_map: Option<String>,
    /// Texture of the roughness: `map_Pr`.
    pub roughness_map: Option<String>,
    /// Statements without effect: other maps, and options.
    pub others: Vec<String>,
    /// For each keyword and each statement without effect, its line, counted from 1.
    pub(crate) lines: BTreeMap<String, usize>,
}

impl MtlMaterial {
    /// Returns the texture files.
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

/// Source of the shading normals of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Normals {
    /// Angle-weighted averages of the adjacent triangles.
    Smooth,
    /// Triangle normals; [`Mesh::normals`] is empty.
    Flat,
    /// Normals of the file. A file without normals is an error.
    File,
}

impl Mesh {
    /// Reads a mesh from a `.obj`, `.ply` or `.stl` file.
    ///
    /// By default, normals are the vertex normals of OBJ and PLY files; without vertex normals, shading is flat.
    ///
    /// - Polygons are triangulated. Degenerate triangles are removed.
    /// - OBJ files have a vertex for each combination of position, texture coordinates and normal, and a group for
    ///   each combination of the last `g` or `o` with `usemtl`. Files of `mtllib` are read if they are in the folder
    ///   of the mesh or below. Vertex colors are sRGB. Smoothing groups (`s`), fourth coordinates, lines and curves
    ///   are ignored.
    /// - The vertices of PLY files are not merged. Vertex colors are sRGB if they are integers, and linear if they are
    ///   floats.
    /// - STL files have a vertex for each position, and a group for each `solid`. Facet normals are only used for
    ///   [`Normals::File`]; facets with different normals then have separate vertices.
    ///
    /// Damaged elements of the file are skipped or replaced. [`Mesh::notes`] contains warnings about damage and other
    /// defects.
    pub fn load(path: &Path, normals: Option<Normals>) -> Result<Mesh, MeshError> {
        Mesh::load_from(&FileSystem::Disk, path, normals)
    }

    pub(crate) fn load_from(
        file_system: &FileSystem,
        path: &Path,
        normals: Option<Normals>,
    ) -> Result<Mesh, MeshError> {
        let _span = tracing::debug_span!("mesh", path = %path.display()).entered();
        let Some(format) = MeshFormat::of(path) else {
            let rule = "the name of a mesh must end in .obj, .ply or .stl";
            return Err(Location::File.fault(rule).of(path));
        };
        let bytes = (file_system.read(path, MAX_FILE_BYTES)).map_err(|error| match error.kind() {
            io::ErrorKind::FileTooLarge => {
                let rule = format!("must not be larger than {} GiB", MAX_FILE_BYTES >> 30);
                Location::File.fault(rule).of(path)
            }
            _ => MeshError::Read {
                path: path.to_owned(),
                error,
            },
        })?;
        Mesh::read(file_system, path, &bytes, format, normals)
    }

    /// Reads a mesh from the bytes of a file, like [`Mesh::load`]. MTL files are not read.
    ///
    /// # Errors
    ///
    /// The bytes are not a mesh of this format. The path of the error is `mesh`.
    pub fn from_slice(bytes: &[u8], format: MeshFormat, normals: Option<Normals>) -> Result<Mesh, MeshError> {
        let no_files = FileSystem::of(Arc::new(NoFiles));
        Mesh::read(&no_files, Path::new("mesh"), bytes, format, normals)
    }

    fn read(
        file_system: &FileSystem,
        path: &Path,
        bytes: &[u8],
        format: MeshFormat,
        normals: Option<Normals>,
    ) -> Result<Mesh, MeshError> {
        let (mut mesh, libraries, defects) = read(bytes, format, normals).map_err(|fault| fault.of(path))?;
        mesh.defects = defects;
        for names in libraries {
            mesh.load_libraries(file_system, path, &names);
        }
        Ok(mesh)
    }

    /// Reads the MTL files of a line: one file whose name may contain blanks, or several files.
    fn load_libraries(&mut self, file_system: &FileSystem, mesh: &Path, names: &str) {
        let folder = file_system.folder(mesh.parent().unwrap_or(Path::new("")));
        if file_system.is_file(&file_system.resolve(folder, names)) {
            self.load_library(file_system, folder, names);
        } else {
            let names = names.split(' ').take(obj::MAX_LIBRARIES);
            names.for_each(|name| self.load_library(file_system, folder, name));
        }
    }

    /// Reads an MTL file, or sets [`Library::problem`].
    fn load_library(&mut self, file_system: &FileSystem, folder: &Path, name: &str) {
        let mut library = Library {
            file: file_system.resolve(folder, name),
            ..Library::default()
        };
        // Each file is read once, and the number of files is limited.
        let is_known = self.libraries.iter().any(|existing| existing.file == library.file);
        if is_known || self.libraries.len() >= obj::MAX_LIBRARIES {
            return;
        }
        let result = read_library(file_system, folder, &library.file).and_then(|bytes| mtl::read(&bytes));
        match result {
            Ok(mtl::Mtl {
                materials,
                problems,
                problem_count,
            }) => {
                library.materials = materials;
                if let Some(problem) = problems.first() {
                    let more = match problem_count - 1 {
                        0 => String::new(),
                        1 => "; 1 more line cannot be read".to_owned(),
                        count => format!("; {count} more lines cannot be read"),
                    };
                    self.notes.push(format!("{name}:{problem}{more}").into());
                }
            }
            Err(reason) => library.problem = Some(reason),
        }
        self.libraries.push(library);
    }
}

impl Mesh {
    /// Returns the value of type `T`, computed on the first call. A mesh caches one value per type.
    pub fn cached<T: Any + Send + Sync>(self: &Arc<Self>, compute: impl FnOnce(&Mesh) -> T) -> Arc<T> {
        self.cache.get_or_init(self, || compute(self))
    }

    /// Returns the first rule that the mesh violates. Only meshes that are created in code can violate rules.
    pub(crate) fn broken_rule(self: &Arc<Self>) -> Option<String> {
        struct BrokenRule(Option<String>);
        self.cached(|mesh| BrokenRule(check::check(mesh).err())).0.clone()
    }

    /// Returns the corners of the bounding box in file coordinates.
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

/// A format of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// PLY, as text or binary.
    Ply,
    /// STL, as text or binary.
    Stl,
}

impl MeshFormat {
    /// All formats.
    pub const ALL: [MeshFormat; 3] = [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl];

    /// Returns the extension of file names, in lower case.
    pub const fn extension(self) -> &'static str {
        match self {
            MeshFormat::Obj => "obj",
            MeshFormat::Ply => "ply",
            MeshFormat::Stl => "stl",
        }
    }

    /// Returns the format that the extension of a file name selects.
    pub fn of(name: &Path) -> Option<MeshFormat> {
        let extension = name.extension()?;
        let mut formats = MeshFormat::ALL.into_iter();
        formats.find(|format| extension.eq_ignore_ascii_case(format.extension()))
    }
}

/// Returns the mesh, the names of its MTL files and the defects.
fn read(
    bytes: &[u8],
    format: MeshFormat,
    normals: Option<Normals>,
) -> Result<(Mesh, Vec<String>, Vec<MeshFault>), MeshFault> {
    if bytes.is_empty() {
        return Err(Location::File.fault("the file is empty"));
    }
    let uses_normals = matches!(normals, None | Some(Normals::File));
    let (mut raw, libraries) = match format {
        MeshFormat::Obj => {
            let obj = obj::read(&tokens::utf8(bytes), uses_normals)?;
            (obj.raw, obj.libraries)
        }
        MeshFormat::Ply => (ply::read(bytes, uses_normals)?, Vec::new()),
        MeshFormat::Stl => (stl::read(bytes, normals == Some(Normals::File))?, Vec::new()),
    };
    if let (true, Some(fault)) = (raw.triangles.is_empty(), raw.defects.first()) {
        return Err(fault.clone());
    }
    let (defects, notes) = std::mem::take(&mut raw.defects).into_parts();
    raw.notes.splice(0..0, notes);
    let mesh = build::build_mesh(raw, normals).map_err(|fault| match defects.first() {
        Some(first) if fault.is_empty => first.clone(),
        _ => fault,
    })?;
    Ok((mesh, libraries, defects))
}

/// Reads an MTL file in the folder of the mesh.
fn read_library(file_system: &FileSystem, folder: &Path, file: &Path) -> Result<Vec<u8>, String> {
    let message = |error: io::Error| error.to_string();
    let path = file_system.canonical_file(file).map_err(message)?;
    if !path.starts_with(file_system.canonical_folder(folder).map_err(message)?) {
        return Err("it must be in the folder of the mesh".to_string());
    }
    let result = file_system.read(&path, MAX_LIBRARY_BYTES);
    result.map_err(|error| match error.kind() {
        io::ErrorKind::FileTooLarge => format!("it must not be larger than {} MiB", MAX_LIBRARY_BYTES >> 20),
        _ => message(error),
    })
}
