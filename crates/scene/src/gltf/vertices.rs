//! The vertices of a primitive: reads accessors, and applies morph targets, skins and transforms.

use glam::{DAffine3, DMat3, DVec3, Vec3, Vec4};
use gltf_json::mesh::{Primitive, Semantic};
use gltf_json::validation::Checked;

use super::document::Document;
use super::error::GltfError;
use super::skin::Skin;
use super::texture::MAX_SET;
use crate::mesh::unit;

/// Maximum number of vertices of a mesh, including unused vertices.
const MAX_VERTICES: usize = 1 << 27;

const TEXCOORDS: [&str; MAX_SET as usize + 1] = [
    "TEXCOORD_0",
    "TEXCOORD_1",
    "TEXCOORD_2",
    "TEXCOORD_3",
    "TEXCOORD_4",
    "TEXCOORD_5",
    "TEXCOORD_6",
    "TEXCOORD_7",
];

/// Reads the vertex attributes of a primitive.
pub struct Source<'a> {
    document: &'a Document,
    primitive: &'a Primitive,
    location: &'a str,
    /// Called with the name of each attribute that has non-finite values.
    report: &'a dyn Fn(&'static str),
    positions: Vec<Vec3>,
}

impl<'a> Source<'a> {
    /// Reads the positions, if any. `first` is the number of preceding vertices of the mesh.
    pub fn of(
        document: &'a Document,
        (primitive, location): (&'a Primitive, &'a str),
        report: &'a dyn Fn(&'static str),
        first: usize,
    ) -> Result<Option<Self>, GltfError> {
        let Some(accessor) = attribute(primitive, Semantic::Positions) else {
            return Ok(None);
        };
        let source = Source {
            document,
            primitive,
            location,
            report,
            positions: vectors(document, accessor)?,
        };
        if first + source.count() > MAX_VERTICES {
            let rule = format!("all primitives of a mesh together must have at most {MAX_VERTICES} vertices");
            return Err(source.fault("attributes.POSITION", rule));
        }
        Ok(Some(source))
    }

    pub fn count(&self) -> usize {
        self.positions.len()
    }

    /// Reads normals and, if `with_tangents` is set, tangents.
    pub fn frames(&self, with_tangents: bool) -> Result<Frames, GltfError> {
        let normals = self.read::<3>("NORMAL", Semantic::Normals)?;
        let tangents = match with_tangents && normals.is_some() {
            true => self.read::<4>("TANGENT", Semantic::Tangents)?,
            false => None,
        };
        Ok(Frames {
            normals: normals.map(|all| all.into_iter().map(Vec3::from_array).collect()),
            tangents: tangents.map(|all| all.into_iter().map(Vec4::from_array).collect()),
            positions: self.positions.clone(),
        })
    }

    pub fn uvs(&self, set: u32) -> Result<Option<Vec<[f32; 2]>>, GltfError> {
        self.read(TEXCOORDS[set as usize], Semantic::TexCoords(set))
    }

    /// Reads the vertex colors, clamped to 0 ... 1.
    pub fn colors(&self) -> Result<Option<Vec<Vec4>>, GltfError> {
        let Some(accessor) = attribute(self.primitive, Semantic::Colors(0)) else {
            return Ok(None);
        };
        let colors = match self.document.components(accessor)? {
            3 => {
                let colors = self.read::<3>("COLOR_0", Semantic::Colors(0))?.unwrap_or_default();
                colors.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect()
            }
            _ => self.read::<4>("COLOR_0", Semantic::Colors(0))?.unwrap_or_default(),
        };
        let clamp = |x: f32| if x > 0.0 { x.min(1.0) } else { 0.0 };
        Ok(Some(
            colors
                .into_iter()
                .map(|color| Vec4::from_array(color.map(clamp)))
                .collect(),
        ))
    }

    /// Reads an attribute, reporting non-finite values.
    fn read<const N: usize>(&self, name: &'static str, semantic: Semantic) -> Result<Option<Vec<[f32; N]>>, GltfError> {
        let Some(accessor) = attribute(self.primitive, semantic) else {
            return Ok(None);
        };
        let vectors = self.document.vectors::<N>(accessor)?;
        self.check_count(&format!("attributes.{name}"), vectors.len())?;
        if !vectors.as_flattened().iter().all(|x| x.is_finite()) {
            (self.report)(name);
        }
        Ok(Some(vectors))
    }

    /// Reads the displacements of an attribute by the morph target with this index.
    fn displacements(
        &self,
        (target, name): (usize, &str),
        accessor: Option<usize>,
    ) -> Result<Option<Vec<Vec3>>, GltfError> {
        let Some(accessor) = accessor else { return Ok(None) };
        let vectors = vectors(self.document, accessor)?;
        self.check_count(&format!("targets[{target}].{name}"), vectors.len())?;
        Ok(Some(vectors))
    }

    fn check_count(&self, key: &str, count: usize) -> Result<(), GltfError> {
        match count == self.count() {
            true => Ok(()),
            false => Err(self.fault(
                key,
                format!("count {count} must equal {}, the count of POSITION", self.count()),
            )),
        }
    }

    fn fault(&self, key: &str, rule: String) -> GltfError {
        self.document.fault(format!("{}.{key}", self.location), rule)
    }
}

/// Positions, normals and tangents, which morph targets, skins and transforms change.
pub struct Frames {
    positions: Vec<Vec3>,
    pub normals: Option<Vec<Vec3>>,
    /// The fourth component is the sign of the bitangent.
    pub tangents: Option<Vec<Vec4>>,
}

impl Frames {
    /// Adds the weighted displacements of morph targets.
    pub fn morph(&mut self, source: &Source, weights: &[f32]) -> Result<(), GltfError> {
        for (i, (target, weight)) in source.primitive.targets.iter().flatten().zip(weights).enumerate() {
            if *weight == 0.0 {
                continue;
            }
            let displacements = |name, accessor| source.displacements((i, name), accessor);
            let positions = displacements("POSITION", target.positions.map(|accessor| accessor.value()))?;
            let normals = displacements("NORMAL", target.normals.map(|accessor| accessor.value()))?;
            let tangents = displacements("TANGENT", target.tangents.map(|accessor| accessor.value()))?;
            for (p, d) in self.positions.iter_mut().zip(positions.into_iter().flatten()) {
                *p += d * *weight;
            }
            for (n, d) in self.normals.iter_mut().flatten().zip(normals.into_iter().flatten()) {
                *n += d * *weight;
            }
            for (t, d) in self.tangents.iter_mut().flatten().zip(tangents.into_iter().flatten()) {
                *t += (d * *weight).extend(0.0);
            }
        }
        Ok(())
    }

    /// Transforms all vertices by the skin and the transform, if any. Returns the positions.
    pub fn apply_transforms(
        &mut self,
        source: &Source,
        skin: Option<&Skin>,
        transform: Option<DAffine3>,
    ) -> Result<Vec<DVec3>, GltfError> {
        let mut positions: Vec<DVec3> = self.positions.iter().map(|p| p.as_dvec3()).collect();
        if let Some(skin) = skin {
            let transforms =
                skin.vertex_transforms(source.document, source.primitive, source.location, source.count())?;
            for (i, transform) in transforms.iter().enumerate() {
                self.transform(transform, i, &mut positions[i]);
            }
        }
        if let Some(transform) = transform {
            for (i, position) in positions.iter_mut().enumerate() {
                self.transform(&transform, i, position);
            }
        }
        Ok(positions)
    }

    /// Transforms a vertex. Its normal is transformed by the cofactor matrix, which exists even for singular
    /// transforms.
    fn transform(&mut self, transform: &DAffine3, i: usize, position: &mut DVec3) {
        let DMat3 { x_axis, y_axis, z_axis } = transform.matrix3;
        *position = transform.transform_point3(*position);
        if let Some(normals) = &mut self.normals {
            let cofactors = DMat3::from_cols(y_axis.cross(z_axis), z_axis.cross(x_axis), x_axis.cross(y_axis));
            normals[i] = unit(cofactors * normals[i].as_dvec3());
        }
        if let Some(tangents) = &mut self.tangents {
            let tangent = unit(transform.matrix3 * tangents[i].truncate().as_dvec3());
            let side = if transform.matrix3.determinant() < 0.0 {
                -1.0
            } else {
                1.0
            };
            tangents[i] = tangent.extend(tangents[i].w * side);
        }
    }
}

pub fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    let accessor = primitive.attributes.get(&Checked::Valid(semantic));
    accessor.map(|accessor| accessor.value())
}

fn vectors(document: &Document, accessor: usize) -> Result<Vec<Vec3>, GltfError> {
    let vectors = document.vectors::<3>(accessor)?;
    Ok(vectors.into_iter().map(Vec3::from_array).collect())
}
