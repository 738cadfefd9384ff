//! Selection of the scene, animations and variant of a glTF file, and EXT_mesh_gpu_instancing.

use glam::{DAffine3, DVec3};
use serde_json::Value;

use super::document::Document;
use super::error::GltfError;
use super::node::quaternion;
use super::{ImportOptions, STILL, unknown};
use crate::Selection;

impl Document {
    /// Returns the selected or default scene; `None` shows all nodes.
    pub(super) fn scene(&self, choice: &ImportOptions) -> Result<Option<usize>, GltfError> {
        let scenes = &self.json.scenes;
        let Some(wanted) = &choice.scene else {
            let named = self
                .json
                .scene
                .map(|scene| scene.value())
                .filter(|scene| *scene < scenes.len());
            return Ok(named.or((!scenes.is_empty()).then_some(0)));
        };
        let names: Vec<Option<&str>> = scenes.iter().map(|scene| scene.name.as_deref()).collect();
        self.selected("scene", ("scenes", "gltf_scene"), wanted, &names)
            .map(Some)
    }

    /// Returns the selected animations; all animations if only a time is given.
    pub(super) fn animations(&self, choice: &ImportOptions) -> Result<Vec<usize>, GltfError> {
        let animations = &self.json.animations;
        let names: Vec<Option<&str>> = animations.iter().map(|animation| animation.name.as_deref()).collect();
        match (&choice.animation, choice.time) {
            (Some(wanted), _) => {
                let list = ("animations", "animation");
                Ok(vec![self.selected("animation", list, wanted, &names)?])
            }
            (None, None) => Ok(Vec::new()),
            (None, Some(_)) if animations.is_empty() => Err(self.not_found(("animations", "time"), STILL.to_owned())),
            (None, Some(_)) => Ok((0..animations.len()).collect()),
        }
    }

    /// Returns the selected variant (KHR_materials_variants).
    pub(super) fn variant(&self, choice: &ImportOptions) -> Result<Option<usize>, GltfError> {
        let Some(wanted) = &choice.variant else {
            return Ok(None);
        };
        let extensions = self.json.extensions.as_ref();
        let variants = extensions.and_then(|all| all.others.get("KHR_materials_variants")?.get("variants")?.as_array());
        let name = |variant: &'_ Value| variant.get("name").and_then(Value::as_str).map(str::to_owned);
        let names: Vec<Option<String>> = variants.into_iter().flatten().map(name).collect();
        let names: Vec<Option<&str>> = names.iter().map(Option::as_deref).collect();
        self.selected("variant", ("variants", "variant"), wanted, &names)
            .map(Some)
    }

    /// `place` contains the list in the file, and the option.
    fn selected(
        &self,
        what: &str,
        place: (&'static str, &'static str),
        wanted: &Selection,
        names: &[Option<&str>],
    ) -> Result<usize, GltfError> {
        let found = wanted.among(names);
        found.ok_or_else(|| self.not_found(place, unknown(what, wanted, names)))
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
        let place = format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes");
        let accessor = |name: &str| {
            let index = extension.get("attributes").and_then(|all| all.get(name));
            let index = index.map(|index| {
                let number = index.as_u64().and_then(|number| usize::try_from(number).ok());
                number.ok_or_else(|| self.fault(&place, format!("{name}: {index} must be the index of an accessor")))
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
        if counts.iter().any(|other| *other != count) {
            return Err(self.fault(&place, format!("they must have the same count; they have {counts:?}")));
        }
        let vector = |of: &Option<Vec<[f32; 3]>>, i: usize, default: DVec3| {
            of.as_ref()
                .map_or(default, |of| DVec3::from_array(of[i].map(f64::from)))
        };
        let map = |i: usize| {
            DAffine3::from_scale_rotation_translation(
                vector(&scales, i, DVec3::ONE),
                quaternion(rotations.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |of| of[i])),
                vector(&translations, i, DVec3::ZERO),
            )
        };
        Ok((0..count).map(map).collect())
    }
}
