//! Supported glTF extensions (specification, section 3.12).

use std::collections::BTreeSet;

use gltf_json::Root;
use gltf_json::accessor::Accessor;
use gltf_json::mesh::Semantic;
use gltf_json::validation::Checked;
use serde_json::{Map, Value};

use super::error::{GltfFault, quoted};

pub(super) const KNOWN: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    // Contains only metadata, which does not affect the import.
    "KHR_xmp_json_ld",
];

fn is_supported(name: &str) -> bool {
    KNOWN.contains(&name)
}

/// Rejects unsupported extensions that are required or that contain the only data of a primitive. Adds notes about
/// other unsupported extensions.
pub(super) fn check(root: &Root, notes: &mut Vec<String>) -> Result<(), GltfFault> {
    for (i, name) in root.extensions_required.iter().enumerate() {
        if !is_supported(name) {
            let rule = "is required but not supported";
            return Err(GltfFault::key(
                format!("extensionsRequired[{i}]"),
                format!("{} {rule}{}", quoted(name), remedy(name)),
            ));
        }
    }
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let Some(name) = primitive.extensions.as_ref().and_then(|all| unsupported(&all.others)) else {
                continue;
            };
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            let accessors = [positions, primitive.indices.as_ref()];
            let is_empty = |accessor: &Accessor| accessor.buffer_view.is_none() && accessor.sparse.is_none();
            let mut accessors = accessors.into_iter().flatten().filter_map(|index| root.get(*index));
            if positions.is_none() || accessors.any(is_empty) {
                return Err(only_data_fault(&format!("meshes[{i}].primitives[{k}]"), name));
            }
        }
    }
    let ignored: BTreeSet<&String> = (root.extensions_used.iter())
        .filter(|name| !is_supported(name) && !root.extensions_required.contains(name))
        .collect();
    const MAX_NOTES: usize = 20;
    for name in ignored.iter().take(MAX_NOTES) {
        notes.push(format!(
            "the extension {} is not supported and is ignored",
            quoted(name)
        ));
    }
    if ignored.len() > MAX_NOTES {
        let remaining = ignored.len() - MAX_NOTES;
        notes.push(format!(
            "number of further extensions that are not supported and are ignored: {remaining}"
        ));
    }
    Ok(())
}

fn remedy(name: &str) -> &'static str {
    match name {
        "KHR_draco_mesh_compression" => "; export without Draco compression, or run gltf-transform copy IN.glb OUT.glb",
        _ => "; export the file without this extension",
    }
}

/// Returns the fault of an object whose data is only present in an unsupported extension.
pub(super) fn only_data_fault(key: &str, name: &str) -> GltfFault {
    let rule = "is not supported, but contains the only data";
    GltfFault::key(key, format!("{} {rule}{}", quoted(name), remedy(name)))
}

/// Returns the first unsupported extension of an object.
pub(super) fn unsupported(extensions: &Map<String, Value>) -> Option<&str> {
    extensions.keys().map(String::as_str).find(|name| !is_supported(name))
}
