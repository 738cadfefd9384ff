//! Validation of meshes and instances.

use crate::note::Note;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::super::assets::AssetKey;
use super::super::key_path::cut;
use super::super::limits::{LENGTHS, MAX_COORDINATE, ROTATIONS, SCALES};
use super::super::mesh_file;
use super::super::suggest::Suggestions;
use super::super::{
    Assets, Geometry, InstanceDescription, Material, MeshDescription, MeshFileDescription, Reflection, Rotation, Scale,
    Shape, ShapeDescription, Up,
};
use super::mtl::SceneMaterials;
use super::{At, Checked, Collector, MIN_SINE, Problem, between, check, list, number, point, show, unit};
use crate::mesh::{Group, Mesh, MeshError, Normals};

/// Maximum total number of groups of all shapes. The packed scene has a word for each group of each instance; the limit
/// keeps its size below 64 MiB and the indices of the words within 32 bits.
const MAX_GROUPS: usize = 1 << 24;

/// The materials and files that shapes refer to.
pub(super) struct SceneLookup<'a> {
    pub names: &'a BTreeMap<&'a str, usize>,
    pub scene_materials: SceneMaterials<'a>,
    pub assets: &'a Assets,
    /// False if the scene is invalid; meshes are then not needed.
    pub reads_files: bool,
    pub suggestions: Suggestions,
}

impl SceneLookup<'_> {
    pub fn material(&self, name: &str) -> Checked<usize> {
        let unknown = || Problem::new(self.suggestions.unknown("material", name, self.names.keys().copied()));
        self.names.get(name).copied().ok_or_else(unknown)
    }
}

/// A mesh of `[meshes.NAME]`.
pub(super) struct NamedMesh<'a> {
    /// The mesh; `None` if the mesh is invalid or not needed.
    mesh: Option<Arc<Mesh>>,
    description: &'a MeshFileDescription,
}

struct Placement<'a> {
    material: Option<&'a String>,
    materials: &'a BTreeMap<String, String>,
    translate: Option<DVec3>,
    rotate: Option<Rotation>,
    scale: Option<Scale>,
    matrix: Option<&'a Vec<[f64; 4]>>,
}

impl<'a> NamedMesh<'a> {
    /// Reads a mesh of `[meshes.NAME]`. Adds problems to `problems`.
    pub fn read(
        description: &'a MeshFileDescription,
        name: &str,
        lookup: &mut SceneLookup,
        problems: &mut Collector,
    ) -> Self {
        let mesh = load(&description.file, description.normals, lookup).at(name);
        NamedMesh {
            mesh: problems.value(mesh).flatten(),
            description,
        }
    }
}

pub(super) fn mesh(shape: &MeshDescription, lookup: &mut SceneLookup) -> Checked<Option<Shape>> {
    let mesh = load(&shape.file, shape.normals, lookup)?;
    let placement = Placement {
        material: shape.material.as_ref(),
        materials: &shape.materials,
        translate: shape.translate,
        rotate: shape.rotate,
        scale: shape.scale,
        matrix: shape.matrix.as_ref(),
    };
    place_mesh(mesh, shape.up, &shape.file, &placement, lookup)
}

pub(super) fn instance(
    instance: &InstanceDescription,
    meshes: &BTreeMap<&str, NamedMesh<'_>>,
    lookup: &mut SceneLookup,
) -> Checked<Option<Shape>> {
    let name = &instance.mesh;
    let unknown = || Problem::new(lookup.suggestions.unknown("mesh", name, meshes.keys().copied()));
    let NamedMesh {
        mesh,
        description: file,
    } = meshes.get(name.as_str()).ok_or_else(unknown).at("mesh")?;
    let placement = Placement {
        material: instance.material.as_ref(),
        materials: &instance.materials,
        translate: instance.translate,
        rotate: instance.rotate,
        scale: instance.scale,
        matrix: instance.matrix.as_ref(),
    };
    place_mesh(mesh.clone(), file.up, &file.file, &placement, lookup)
}

/// Checks the total number of groups.
pub(super) fn check_group_count(shapes: &[Shape]) -> Checked<()> {
    let groups = shapes.iter().map(|shape| match &shape.geometry {
        Geometry::Mesh { materials, .. } => materials.len(),
        _ => 0,
    });
    let groups: usize = groups.sum();
    check(groups <= MAX_GROUPS, || {
        format!("the meshes have {groups} groups in total; at most {MAX_GROUPS} are allowed")
    })
}

/// Returns the warnings about mesh files, once per file.
pub(super) fn notes(
    descriptions: &[ShapeDescription],
    shapes: &[Shape],
    meshes: &BTreeMap<&str, NamedMesh>,
) -> Vec<Note> {
    let shape_meshes = descriptions.iter().zip(shapes).filter_map(|pair| match pair {
        (
            ShapeDescription::Mesh(description),
            Shape {
                geometry: Geometry::Mesh { mesh, .. },
                ..
            },
        ) => Some((&description.file, mesh)),
        _ => None,
    });
    let named_meshes = (meshes.values()).filter_map(|named| Some((&named.description.file, named.mesh.as_ref()?)));
    let notes_of = |(file, mesh): (&String, &Arc<Mesh>)| -> Vec<Note> {
        mesh.notes.iter().map(|note| note.clone().in_file(file)).collect()
    };
    let notes: BTreeSet<Note> = shape_meshes.chain(named_meshes).flat_map(notes_of).collect();
    notes.into_iter().collect()
}

/// Returns the mesh of a file, or the mesh in memory with this name; `None` if files are not read.
fn load(file: &str, normals: Option<Normals>, lookup: &mut SceneLookup) -> Checked<Option<Arc<Mesh>>> {
    if let Some(mesh) = lookup.assets.meshes.get(file) {
        return match mesh.broken_rule() {
            None => Ok(Some(Arc::clone(mesh))),
            Some(rule) => Err(Problem::new(format!("{file:?}: {rule}"))).at("file"),
        };
    }
    let asset = lookup.assets.find(file).at("file")?;
    let AssetKey::File(path) = asset else {
        return Err(Problem::new(format!("{file:?} is an image in memory, not a mesh"))).at("file");
    };
    if !lookup.reads_files {
        return Ok(None);
    }
    let mesh = mesh_file::load(&lookup.assets.file_system, &path, normals)
        .map_err(|error| match &error {
            MeshError::Read { error: source, .. } => Problem::new(error.to_string()).with_file(file, source.kind()),
            _ => Problem::new(error.to_string()),
        })
        .at("file")?;
    if let (true, Some(defect)) = (lookup.assets.strict, mesh.defects.first()) {
        return Err(Problem::damage(defect.clone().of(Path::new(file)).to_string())).at("file");
    }
    lookup.scene_materials.register(&mesh);
    Ok(Some(mesh))
}

/// Returns a mesh as a shape with a placement. If there is no mesh, only validates the placement and its materials.
fn place_mesh(
    mesh: Option<Arc<Mesh>>,
    up: Up,
    file: &str,
    placement: &Placement,
    lookup: &mut SceneLookup,
) -> Checked<Option<Shape>> {
    let transform = self::placement(placement.translate, placement.rotate, placement.scale, placement.matrix)?;
    let Some(mesh) = mesh else {
        placement
            .material
            .map(|name| lookup.material(name))
            .transpose()
            .at("material")?;
        for (group, name) in placement.materials {
            lookup.material(name).at(group.as_str()).at("materials")?;
        }
        return Ok(None);
    };
    let to_world = transform * to_z_up(up);
    let corners: Vec<DVec3> = mesh.corners().map(|corner| to_world.transform_point3(corner)).collect();
    let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let farthest = low.abs().max(high.abs()).max_element();
    check(farthest <= MAX_COORDINATE, || {
        let (farthest, limit) = (number(farthest), number(MAX_COORDINATE));
        format!("{file:?} reaches to {farthest} in world space; coordinates must be from -{limit} to {limit}")
    })
    .at("file")?;
    let size = (high - low).max_element();
    check(size >= LENGTHS.0, || {
        format!(
            "{file:?} must be at least {} long in world space; its length is {}",
            number(LENGTHS.0),
            number(size)
        )
    })
    .at("file")?;
    let materials = materials(&mesh, file, placement, lookup)?;
    Ok(Some(Shape {
        material: materials.first().copied().unwrap_or(0),
        geometry: Geometry::Mesh {
            mesh,
            to_world,
            materials,
        },
    }))
}

/// Returns the material index of each group: from the scene, or else from the mesh's file, or else the default
/// material.
fn materials(mesh: &Arc<Mesh>, file: &str, placement: &Placement, lookup: &mut SceneLookup) -> Checked<Vec<usize>> {
    let material_of = |name: &String| -> Checked<usize> {
        let index = lookup.material(name)?;
        check(
            !mesh.uvs.is_empty() || !needs_uvs(&lookup.scene_materials.materials[index]),
            || format!("{name:?} must have no texture here, because {file:?} has no texture coordinates"),
        )?;
        Ok(index)
    };
    let default = placement.material.map(material_of).transpose().at("material")?;
    let mut by_name = BTreeMap::new();
    for (group, material) in placement.materials {
        let exists = (mesh.groups.iter()).any(|mesh_group| names(mesh_group).any(|name| name == group));
        check(exists, || {
            let available = mesh.groups.iter().flat_map(names).filter(|name| !name.is_empty());
            let available: BTreeSet<&str> = available.collect();
            match available.is_empty() {
                true => format!("{file:?} has no groups with names"),
                false => format!("{file:?} has no such group or material; available: {}", list(available)),
            }
        })
        .at(group.as_str())
        .at("materials")?;
        by_name.insert(
            group.as_str(),
            material_of(material).at(group.as_str()).at("materials")?,
        );
    }
    let mut indices = Vec::with_capacity(mesh.groups.len());
    let mut missing = BTreeSet::new();
    for (i, group) in mesh.groups.iter().enumerate() {
        let assigned = names(group).find_map(|name| by_name.get(name).copied()).or(default);
        let index = assigned.or_else(|| lookup.scene_materials.group_material(mesh, i));
        if index.is_none() {
            missing.extend(group.material.as_deref());
        }
        indices.push(index.unwrap_or_else(|| lookup.scene_materials.default_material(!mesh.colors.is_empty())));
    }
    if !missing.is_empty() {
        let damage = Problem::damage(missing_materials_note(mesh, file, &missing));
        lookup.scene_materials.report_missing(damage)?;
    }
    Ok(indices)
}

/// Returns the warning about undefined materials.
fn missing_materials_note(mesh: &Mesh, file: &str, missing: &BTreeSet<&str>) -> String {
    const MAX_NAMES: usize = 8;
    let shown = missing.iter().take(MAX_NAMES);
    let mut names = shown
        .map(|name| format!("{:?}", cut(name)))
        .collect::<Vec<_>>()
        .join(", ");
    if missing.len() > MAX_NAMES {
        names += &format!(" and {} more", missing.len() - MAX_NAMES);
    }
    let reason = match mesh.libraries.as_slice() {
        [] => "the file names no MTL file".to_owned(),
        libraries => {
            let unread = libraries
                .iter()
                .find_map(|library| Some((library, library.problem.as_ref()?)));
            match unread {
                Some((library, problem)) => {
                    let name = library.file.file_name().unwrap_or_default().to_string_lossy();
                    format!("the MTL file {:?} cannot be read: {problem}", cut(&name))
                }
                None => "missing from the MTL files of the mesh".to_owned(),
            }
        }
    };
    let noun = if missing.len() == 1 { "material" } else { "materials" };
    format!("{file}: undefined {noun} {names}: {reason}")
}

/// Returns the names of a group: its own name, and the name of its material in the file.
fn names(group: &Group) -> impl Iterator<Item = &str> {
    std::iter::once(group.name.as_str()).chain(group.material.as_deref())
}

/// Returns true if a material depends on texture coordinates.
fn needs_uvs(material: &Material) -> bool {
    let is_anisotropic = match &material.reflection {
        Reflection::Conductor { facets, .. } | Reflection::Dielectric { facets, .. } => facets.anisotropy > 0.0,
        _ => false,
    };
    is_anisotropic || !material.textures().is_empty()
}

/// Returns the rotation that maps an up axis to +z.
pub(crate) fn to_z_up(up: Up) -> DAffine3 {
    DAffine3::from_mat3(match up {
        Up::X => DMat3::from_cols(DVec3::Z, DVec3::X, DVec3::Y),
        Up::Y => DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
        Up::Z => DMat3::IDENTITY,
    })
}

/// Returns the transform of a placement.
pub(crate) fn placement(
    translate: Option<DVec3>,
    rotate: Option<Rotation>,
    scale: Option<Scale>,
    matrix: Option<&Vec<[f64; 4]>>,
) -> Checked<DAffine3> {
    if let Some(matrix) = matrix {
        let has_parts = translate.is_some() || rotate.is_some() || scale.is_some();
        check(!has_parts, || {
            "cannot be combined with translate, rotate or scale, which matrix replaces".to_owned()
        })
        .at("matrix")?;
        return self::matrix(matrix).at("matrix");
    }
    let scale = match scale {
        None => DVec3::ONE,
        Some(Scale::All(s)) => factors(DVec3::splat(s)).at("scale")?,
        Some(Scale::Each(s)) => factors(s).at("scale")?,
    };
    let rotation = match rotate {
        None => DMat3::IDENTITY,
        Some(rotation) => rotation_matrix(&rotation).at("rotate")?,
    };
    let translate = translate.map_or(Ok(DVec3::ZERO), point).at("translate")?;
    Ok(DAffine3::from_mat3_translation(
        rotation * DMat3::from_diagonal(scale),
        translate,
    ))
}

fn factors(factors: DVec3) -> Checked<DVec3> {
    let (low, high) = SCALES;
    for x in factors.to_array() {
        check((low..=high).contains(&x.abs()), || {
            let (x, low, high) = (number(x), number(low), number(high));
            format!("{x} must be from {low} to {high}, or from -{high} to -{low}")
        })?;
    }
    Ok(factors)
}

pub(super) fn rotation_matrix(rotation: &Rotation) -> Checked<DMat3> {
    let angle = |degrees: f64| between(degrees, ROTATIONS);
    Ok(match rotation {
        Rotation::Angles(angles) => {
            let [x, y, z] = [angle(angles.x)?, angle(angles.y)?, angle(angles.z)?];
            rotation_about(DVec3::Z, z) * rotation_about(DVec3::Y, y) * rotation_about(DVec3::X, x)
        }
        Rotation::About(about) => {
            let axis = unit(about.axis).at("axis")?;
            rotation_about(axis, angle(about.degrees).at("degrees")?)
        }
    })
}

/// Returns the matrix of a rotation. The matrix is exact for quarter turns about coordinate axes.
fn rotation_about(axis: DVec3, degrees: f64) -> DMat3 {
    let quarters = degrees / 90.0;
    let is_axis = DVec3::AXES.iter().any(|a| a.abs() == axis.abs());
    let rotation = DMat3::from_quat(DQuat::from_axis_angle(axis, degrees.to_radians()));
    match is_axis && quarters.fract() == 0.0 {
        true => DMat3::from_cols(
            rotation.x_axis.round(),
            rotation.y_axis.round(),
            rotation.z_axis.round(),
        ),
        false => rotation,
    }
}

fn matrix(rows: &[[f64; 4]]) -> Checked<DAffine3> {
    let rows: &[[f64; 4]; 3] = match rows {
        [rows @ .., [0.0, 0.0, 0.0, 1.0]] if rows.len() == 3 => rows.try_into(),
        rows => rows.try_into(),
    }
    .map_err(|_| match rows {
        [_, _, _, [x, y, z, w]] => {
            let row = [x, y, z, w].map(|x| number(*x)).join(", ");
            Problem::new(format!("[{row}] must be [0, 0, 0, 1], or absent")).at(3)
        }
        rows => Problem::new(format!(
            "must be a list of 3 rows of 4 numbers, optionally followed by the row [0, 0, 0, 1]; number of rows: {}",
            rows.len()
        )),
    })?;
    for (i, row) in rows.iter().enumerate() {
        point(DVec3::new(row[0], row[1], row[2])).at(i)?;
        point(DVec3::splat(row[3])).at(i)?;
    }
    let column = |i: usize| DVec3::new(rows[0][i], rows[1][i], rows[2][i]);
    let columns = [column(0), column(1), column(2)];
    for (i, c) in columns.iter().enumerate() {
        let (low, high) = SCALES;
        check((low..=high).contains(&c.length()), || {
            let (c, low, high) = (show(*c), number(low), number(high));
            format!("column {i}, {c}, must have a length from {low} to {high}")
        })?;
    }
    let [a, b, c] = columns.map(DVec3::normalize);
    check(a.cross(b).dot(c).abs() > MIN_SINE, || {
        "the first three columns must not lie in one plane".to_owned()
    })?;
    Ok(DAffine3::from_mat3_translation(
        DMat3::from_cols(columns[0], columns[1], columns[2]),
        column(3),
    ))
}

#[cfg(test)]
mod tests;
