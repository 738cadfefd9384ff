//! Selection of the scene, animations and variant of a glTF file, and EXT_mesh_gpu_instancing.

use glam::{DAffine3, DVec3};
use serde_json::Value;

use super::document::Document;
use super::error::GltfError;
use super::node::quaternion;
use super::{ImportOptions, NO_ANIMATIONS, unknown};
use crate::Selection;

impl Document {
    /// Returns the selected or default scene; `None` if the file has no scenes: then all nodes are shown.
    pub(super) fn scene(&self, options: &ImportOptions) -> Result<Option<usize>, GltfError> {
        let scenes = &self.json.scenes;
        let Some(selection) = &options.scene else {
            let default_scene = self
                .json
                .scene
                .map(|scene| scene.value())
                .filter(|scene| *scene < scenes.len());
            return Ok(default_scene.or((!scenes.is_empty()).then_some(0)));
        };
        let names: Vec<Option<&str>> = scenes.iter().map(|scene| scene.name.as_deref()).collect();
        self.selected_index("scene", ("scenes", "gltf_scene"), selection, &names)
            .map(Some)
    }

    /// Returns the selected animation. Without a selection, all animations play if a time is set, otherwise none.
    pub(super) fn animations(&self, options: &ImportOptions) -> Result<Vec<usize>, GltfError> {
        let animations = &self.json.animations;
        let names: Vec<Option<&str>> = animations.iter().map(|animation| animation.name.as_deref()).collect();
        match (&options.animation, options.time) {
            (Some(selection), _) => {
                let list = ("animations", "animation");
                Ok(vec![self.selected_index("animation", list, selection, &names)?])
            }
            (None, None) => Ok(Vec::new()),
            (None, Some(_)) if animations.is_empty() => {
                Err(self.not_found(("animations", "time"), NO_ANIMATIONS.to_owned()))
            }
            (None, Some(_)) => Ok((0..animations.len()).collect()),
        }
    }

    /// Returns the selected variant (KHR_materials_variants).
    pub(super) fn variant(&self, options: &ImportOptions) -> Result<Option<usize>, GltfError> {
        let Some(selection) = &options.variant else {
            return Ok(None);
        };
        let extensions = self.json.extensions.as_ref();
        let variants = extensions.and_then(|all| all.others.get("KHR_materials_variants")?.get("variants")?.as_array());
        let name = |variant: &'_ Value| variant.get("name").and_then(Value::as_str).map(str::to_owned);
        let names: Vec<Option<String>> = variants.into_iter().flatten().map(name).collect();
        let names: Vec<Option<&str>> = names.iter().map(Option::as_deref).collect();
        self.selected_index("variant", ("variants", "variant"), selection, &names)
            .map(Some)
    }

    /// Returns the index of the selected entry. `location` is the key of the list in the file, and the name of the
    /// option.
    fn selected_index(
        &self,
        kind: &str,
        location: (&'static str, &'static str),
        selection: &Selection,
        names: &[Option<&str>],
    ) -> Result<usize, GltfError> {
        let found = selection.among(names);
        found.ok_or_else(|| self.not_found(location, unknown(kind, selection, names)))
    }

    fn not_found(&self, (key, option): (&'static str, &'static str), message: String) -> GltfError {
        GltfError::Choice {
            path: self.path.clone(),
            key,
            option,
            message,
        }
    }

    /// Returns the instance transforms of a node (EXT_mesh_gpu_instancing), relative to the node.
    pub(super) fn instances(&self, node: usize) -> Result<Vec<DAffine3>, GltfError> {
        let extensions = self.json.nodes[node].extensions.as_ref();
        let Some(extension) = extensions.and_then(|all| all.others.get("EXT_mesh_gpu_instancing")) else {
            return Ok(vec![DAffine3::IDENTITY]);
        };
        let location = format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes");
        let accessor = |name: &str| {
            let index = extension.get("attributes").and_then(|all| all.get(name));
            let index = index.map(|index| {
                let number = index.as_u64().and_then(|number| usize::try_from(number).ok());
                number.ok_or_else(|| self.fault(&location, format!("{name}: {index} must be the index of an accessor")))
            });
            index.transpose()
        };
        let translations = accessor("TRANSLATION")?.map(|i| self.vectors::<3>(i)).transpose()?;
        let rotations = accessor("ROTATION")?.map(|i| self.vectors::<4>(i)).transpose()?;
        let scales = accessor("SCALE")?.map(|i| self.vectors::<3>(i)).transpose()?;
        let counts = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let counts: Vec<usize> = counts.into_iter().flatten().collect();
        let count = counts.first().copied().unwrap_or(0);
        if counts.iter().any(|other_count| *other_count != count) {
            return Err(self.fault(
                &location,
                format!("the attributes must have equal counts; found {counts:?}"),
            ));
        }
        let vector = |vectors: &Option<Vec<[f32; 3]>>, i: usize, default: DVec3| {
            vectors
                .as_ref()
                .map_or(default, |vectors| DVec3::from_array(vectors[i].map(f64::from)))
        };
        let transform = |i: usize| {
            DAffine3::from_scale_rotation_translation(
                vector(&scales, i, DVec3::ONE),
                quaternion(
                    rotations
                        .as_ref()
                        .map_or([0.0, 0.0, 0.0, 1.0], |rotations| rotations[i]),
                ),
                vector(&translations, i, DVec3::ZERO),
            )
        };
        Ok((0..count).map(transform).collect())
    }
}
