//! Slider values of shaders, as set by viewers.

use std::collections::BTreeMap;
use std::path::{Path, absolute};

use serde::Serialize;

use wgray_render::gpu::sliders::{Slider, Value};

/// The state of a slider, for the page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SliderState {
    /// The override that the slider sets.
    #[serde(flatten)]
    pub slider: Slider,
    /// The absolute path of the file, for an editor; `None` for built-in shaders.
    pub path: Option<String>,
    /// The current value.
    pub value: Value,
}

/// The slider values of a session, by file and name.
#[derive(Default)]
pub struct Sliders {
    /// Changed values, each with the value in the file at the time of the change: a later edit of the file takes
    /// precedence.
    moved: BTreeMap<(String, String), (Value, Value)>,
}

impl Sliders {
    /// Moves a slider. Returns whether the value changed, or the reason why the slider cannot be moved.
    pub fn slide(&mut self, sliders: &[Slider], file: &str, name: &str, value: Value) -> Result<bool, String> {
        let slider = sliders.iter().find(|slider| slider.file == file && slider.name == name);
        let slider = slider.ok_or_else(|| format!("{file}: no slider `{name}` exists"))?;
        let value = slider.clamped(value);
        let value = value.ok_or_else(|| format!("{file}: {name}: the value must be of type {:?}", slider.kind))?;
        let before = self.value(slider);
        let key = (file.to_string(), name.to_string());
        self.moved.insert(key, (slider.default, value));
        Ok(before != value)
    }

    /// Resets all sliders, or one slider, given by file and name.
    pub fn reset(&mut self, slider: Option<(String, String)>) {
        match slider {
            Some(key) => drop(self.moved.remove(&key)),
            None => self.moved.clear(),
        }
    }

    fn value(&self, slider: &Slider) -> Value {
        let moved = self.moved.get(&(slider.file.clone(), slider.name.clone()));
        let moved = moved.filter(|(default, _)| *default == slider.default);
        moved
            .and_then(|(_, value)| slider.clamped(*value))
            .unwrap_or(slider.default)
    }

    /// Returns the values as the bits that a kernel reads.
    pub fn bits(&self, sliders: &[Slider]) -> Vec<u32> {
        sliders.iter().map(|slider| slider.bits(self.value(slider))).collect()
    }

    pub fn states(&self, sliders: &[Slider], folder: Option<&Path>) -> Vec<SliderState> {
        let folder = folder.and_then(|folder| absolute(folder).ok());
        let state = |slider: &Slider| SliderState {
            slider: slider.clone(),
            path: folder
                .as_ref()
                .map(|folder| folder.join(&slider.file).display().to_string()),
            value: self.value(slider),
        };
        sliders.iter().map(state).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgray_render::gpu::sliders::Kind;

    #[test]
    fn a_value_lasts_until_it_is_reset_or_edited_in_the_file() {
        let mut slider = Slider {
            file: "phong.wgsl".to_string(),
            name: "a".to_string(),
            line: 1,
            kind: Kind::F32,
            min: 0.0,
            max: 1.0,
            default: Value::Number(0.5),
        };
        let mut sliders = Sliders::default();
        let value = |sliders: &Sliders, slider: &Slider| sliders.states(std::slice::from_ref(slider), None)[0].value;
        let slide = |sliders: &mut Sliders, slider: &Slider, value| {
            sliders.slide(std::slice::from_ref(slider), "phong.wgsl", "a", value)
        };
        assert_eq!(slide(&mut sliders, &slider, Value::Number(0.25)), Ok(true));
        assert_eq!(slide(&mut sliders, &slider, Value::Number(0.25)), Ok(false));
        assert_eq!(sliders.bits(&[slider.clone()]), [0.25f32.to_bits()]);
        sliders.reset(Some(("phong.wgsl".to_string(), "b".to_string())));
        assert_eq!(value(&sliders, &slider), Value::Number(0.25));
        slider.max = 0.125;
        assert_eq!(
            value(&sliders, &slider),
            Value::Number(0.125),
            "the range in the file does not apply"
        );
        slider.default = Value::Number(0.0625);
        assert_eq!(
            value(&sliders, &slider),
            slider.default,
            "the edited value in the file does not apply"
        );
        slide(&mut sliders, &slider, Value::Number(0.0)).unwrap();
        sliders.reset(None);
        assert_eq!(value(&sliders, &slider), slider.default);
        let error = slide(&mut sliders, &slider, Value::Bool(true)).unwrap_err();
        assert!(error.contains("a: the value must be of type F32"), "{error}");
        let error = sliders
            .slide(&[slider], "light.wgsl", "a", Value::Number(0.0))
            .unwrap_err();
        assert!(error.contains("no slider `a`"), "{error}");
    }
}
