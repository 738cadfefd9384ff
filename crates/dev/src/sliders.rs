//! Annotated constants of shaders as sliders: the values of the files, and the values that replace them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf, absolute};
use std::sync::Arc;

use serde::Serialize;

use super::save::{replace_known, wait_settled};
use wgray_render::gpu::compose::{KERNELS, Shaders, without_mark};
use wgray_render::gpu::marks::{Kind, Layer, Marks, Slider, Value, edited};
use wgray_render::gpu::{with_edits, without_values};
use wgray_scene::Integrator;

/// A slider for the page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SliderState {
    /// The file in the folder of shaders.
    pub file: String,
    /// The absolute path of the file, for an editor; `None` for built-in shaders.
    pub path: Option<String>,
    /// The name of the constant.
    pub name: String,
    /// Its line, counted from 1.
    pub line: usize,
    /// The kind of the constant.
    pub kind: Kind,
    /// The minimum of a number.
    pub min: f64,
    /// The maximum.
    pub max: f64,
    /// The interval between values, if the annotation has one.
    pub step: Option<f64>,
    /// The value that is rendered.
    pub value: Value,
    /// The value in the file.
    pub file_value: Value,
    /// True if another value must be compiled in.
    pub recompiles: bool,
    /// True if the scene's kernels contain the constant.
    pub used: bool,
}

/// The file and the name of a constant.
type Key = (String, String);

/// The sliders of a session.
#[derive(Default)]
pub struct Sliders {
    /// The shaders of the files.
    files: Option<Arc<Shaders>>,
    marks: Marks,
    /// The values that replace those of the files.
    moved: BTreeMap<Key, Value>,
    /// The shaders to be compiled, whatever the values that kernels read from a buffer.
    given: Option<Arc<Shaders>>,
    /// The constants that the running kernel reads from a buffer, once there is one.
    live: Option<BTreeSet<Key>>,
    /// The files of the last write.
    written: Vec<Written>,
}

/// A file that slider values were written into.
struct Written {
    path: PathBuf,
    before: String,
    after: String,
}

impl Written {
    /// Replaces one of its texts by the other.
    fn put(&self, text: &str) -> Result<(), String> {
        let told = |error| format!("{}: cannot be written: {error}", self.path.display());
        let other = if text == self.after { &self.before } else { &self.after };
        replace_known(&self.path, other.as_bytes(), text.as_bytes()).map_err(told)
    }
}

fn key(slider: &Slider) -> Key {
    (slider.file.clone(), slider.name.clone())
}

impl Sliders {
    /// Takes the current shaders of the files. A number that was edited there replaces the slider's value.
    pub fn read(&mut self, shaders: Arc<Shaders>) {
        let new = Marks::of(&shaders);
        let old: BTreeMap<Key, Value> = self
            .marks
            .sliders
            .iter()
            .map(|slider| (key(slider), slider.value))
            .collect();
        let kept = |known: &Key, value: &mut Value| {
            let slider = new.sliders.iter().find(|slider| key(slider) == *known);
            slider.is_some_and(|slider| old.get(known) == Some(&slider.value) && slider.rounded(*value) == Some(*value))
        };
        self.moved.retain(kept);
        self.marks = new;
        self.files = Some(shaders);
    }

    /// Returns whether the code of shaders differs from that of the files that were read last.
    pub fn differ_from(&self, shaders: &Shaders) -> bool {
        self.files.as_ref().is_some_and(|known| !known.has_same_code(shaders))
    }

    /// Returns the annotations.
    pub fn marks(&self) -> &Marks {
        &self.marks
    }

    /// Takes the constants that the running kernel reads from a buffer.
    pub fn runs(&mut self, live: &[Slider]) {
        self.live = Some(live.iter().map(key).collect());
    }

    fn is_live(&self, slider: &Slider) -> bool {
        self.live.as_ref().is_some_and(|live| live.contains(&key(slider)))
    }

    /// Returns the shaders to compile: the same pointer as before, which later stages compare, unless anything
    /// changed that is not read from a buffer.
    pub fn shaders(&mut self) -> Option<Arc<Shaders>> {
        let files = self.files.as_ref()?;
        let moved = |slider: &Slider| self.moved.get(&key(slider)).filter(|_| !self.is_live(slider));
        let wanted = match self.moved.is_empty() {
            true => files.clone(),
            false => Arc::new(with_edits(files, &|slider, text| {
                moved(slider).map_or(Vec::new(), |value| slider.edits(text, *value))
            })),
        };
        let common = |shaders: &Shaders| without_values(shaders, &|slider| self.is_live(slider));
        let same = |given: &Arc<Shaders>| *given == wanted || common(given) == common(&wanted);
        if !self.given.as_ref().is_some_and(same) {
            self.given = Some(wanted);
        }
        self.given.clone()
    }

    /// Moves a slider. Returns whether its value changed, or why it is not allowed.
    pub fn slide(&mut self, file: &str, name: &str, value: Value) -> Result<bool, String> {
        let slider = self
            .marks
            .sliders
            .iter()
            .find(|slider| (slider.file.as_str(), slider.name.as_str()) == (file, name));
        let slider = slider.ok_or_else(|| format!("{file}: there is no slider `{name}`"))?;
        let value = slider
            .checked(value)
            .map_err(|rule| format!("{file}: {name}: {rule}"))?;
        let before = self.value(slider);
        match value == slider.value {
            true => self.moved.remove(&key(slider)),
            false => self.moved.insert(key(slider), value),
        };
        Ok(before != value)
    }

    /// Resets all sliders, or one. Returns whether any changed.
    pub fn reset(&mut self, one: Option<(&str, &str)>) -> bool {
        let before = self.moved.len();
        self.moved
            .retain(|(file, name), _| one.is_some_and(|one| (file.as_str(), name.as_str()) != one));
        self.moved.len() != before
    }

    fn value(&self, slider: &Slider) -> Value {
        self.moved.get(&key(slider)).copied().unwrap_or(slider.value)
    }

    /// Returns the values of constants that a kernel reads from a buffer, in its order.
    pub fn values(&self, live: &[Slider]) -> Vec<[u32; 4]> {
        let value = |slider: &Slider| {
            let known = self.marks.sliders.iter().find(|known| key(known) == key(slider));
            slider.bits(known.map_or(slider.value, |known| self.value(known)))
        };
        live.iter().map(value).collect()
    }

    /// Returns the shaders of the files.
    pub fn files(&self) -> Option<&Shaders> {
        self.files.as_deref()
    }

    /// Returns the shaders with all values written.
    pub fn as_written(&self) -> Option<Shaders> {
        let edits = |slider: &Slider, text: &str| {
            let value = self.moved.get(&key(slider));
            value.map_or(Vec::new(), |value| slider.edits(text, *value))
        };
        Some(with_edits(self.files.as_ref()?, &edits))
    }

    /// Writes the values into the files of a folder, changing only the numbers. Returns the number of files.
    ///
    /// # Errors
    ///
    /// The message for the user. Files before the one that fails have been written.
    pub fn write(&mut self, folder: &Path) -> Result<usize, String> {
        let files: BTreeSet<&String> = self.moved.keys().map(|(file, _)| file).collect();
        let mut new = Vec::new();
        for file in files {
            let path = folder.join(file);
            let failed = |error| format!("{}: {error}", path.display());
            // Keeps a link, and replaces its target.
            let target = fs::canonicalize(&path).map_err(failed)?;
            let mut before = fs::read_to_string(&target).map_err(failed)?;
            let known = self.files.as_ref().map(|shaders| shaders.text(file));
            if known != Some(&without_mark(before.clone())) {
                wait_settled(&target)?; // an unknown text may be half written
                before = fs::read_to_string(&target).map_err(failed)?;
            }
            let plain = without_mark(before.clone());
            let there = Marks::of_file(file, &plain).sliders;
            let mut edits = Vec::new();
            for ((_, name), value) in self.moved.iter().filter(|((known, _), _)| known == file) {
                let slider = there.iter().find(|slider| slider.name == *name);
                let slider = slider.ok_or_else(|| format!("{}: `{name}` is not a slider any more", path.display()))?;
                edits.extend(slider.edits(&before, *value));
            }
            let after = edited(&before, edits);
            new.push(Written {
                path: target,
                before,
                after,
            });
        }
        self.written.clear();
        for file in new {
            file.put(&file.after)?;
            self.written.push(file);
        }
        Ok(self.written.len())
    }

    /// Restores the texts of the files before the last [`Sliders::write`]. Returns the number of files.
    ///
    /// # Errors
    ///
    /// The message for the user: a file has changed since, or cannot be read or written.
    pub fn take_back(&mut self) -> Result<usize, String> {
        let written = std::mem::take(&mut self.written);
        for file in &written {
            let place = file.path.display();
            let now = fs::read(&file.path).map_err(|error| format!("{place}: {error}"))?;
            if now != file.after.as_bytes() {
                return Err(format!(
                    "{place}: has changed since the sliders were saved; nothing was undone"
                ));
            }
        }
        for file in &written {
            file.put(&file.before)?;
        }
        Ok(written.len())
    }

    /// Returns whether the last write can be undone.
    pub fn can_take_back(&self) -> bool {
        !self.written.is_empty()
    }

    /// Returns the sliders for the page.
    pub fn told(&self, folder: Option<&Path>, integrator: Option<Integrator>) -> Vec<SliderState> {
        let short = |slider: &Slider, value: Value| match value {
            Value::Number(x) => Value::Number(slider.short(x)),
            Value::Color(c) => Value::Color(c.map(|x| slider.short(x))),
            Value::Bool(_) => value,
        };
        let folder = folder.and_then(|folder| absolute(folder).ok());
        let told = |slider: &Slider| SliderState {
            file: slider.file.clone(),
            path: folder
                .as_ref()
                .map(|folder| folder.join(&slider.file).display().to_string()),
            name: slider.name.clone(),
            line: slider.line,
            kind: slider.kind,
            min: slider.short(slider.min),
            max: slider.short(slider.max),
            step: slider.step.map(|step| slider.short(step)),
            value: short(slider, self.value(slider)),
            file_value: short(slider, slider.value),
            recompiles: self.live.is_some() && !self.is_live(slider),
            used: integrator.is_none_or(|integrator| KERNELS.iter().any(|kernel| kernel.has(&slider.file, integrator))),
        };
        self.marks.sliders.iter().map(told).collect()
    }

    /// Returns whether any slider differs from its file.
    pub fn are_moved(&self) -> bool {
        !self.moved.is_empty()
    }

    /// Returns the layers that an integrator's kernels can show.
    pub fn layers(&self, integrator: Integrator) -> impl Iterator<Item = &Layer> {
        let shown = move |layer: &&Layer| {
            KERNELS
                .iter()
                .any(|kernel| kernel.integrates && kernel.has(&layer.file, integrator))
        };
        self.marks.layers.iter().filter(shown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shaders(more: &str) -> Arc<Shaders> {
        let new = |file: &str, text: &str| (file == "phong.wgsl").then(|| format!("{text}{more}\n"));
        Arc::new(Shaders::built_in().changed(new))
    }

    const TEXT: &str = "const a: f32 = 0.5; // slider 0..1\nconst n: u32 = 3u; // slider 1..9";

    /// Returns the sliders of a text, of which a kernel reads `a` from a buffer.
    fn sliders(text: &str) -> Sliders {
        let mut sliders = Sliders::default();
        sliders.read(shaders(text));
        let live: Vec<Slider> = sliders
            .marks
            .sliders
            .iter()
            .filter(|slider| slider.name == "a")
            .cloned()
            .collect();
        sliders.shaders();
        sliders.runs(&live);
        sliders
    }

    #[test]
    fn what_is_read_from_a_buffer_takes_no_other_shaders() {
        let mut sliders = sliders(TEXT);
        let first = sliders.shaders().unwrap();
        assert_eq!(sliders.slide("phong.wgsl", "a", Value::Number(0.25)), Ok(true));
        assert_eq!(sliders.slide("phong.wgsl", "a", Value::Number(0.25)), Ok(false));
        assert!(Arc::ptr_eq(&first, &sliders.shaders().unwrap()));
        let live = sliders.marks.sliders[..1].to_vec();
        assert_eq!(sliders.values(&live), [[0.25f32.to_bits(), 0, 0, 0]]);
        sliders.read(shaders(&TEXT.replace("0.5", "0.75")));
        assert!(
            Arc::ptr_eq(&first, &sliders.shaders().unwrap()),
            "nor does another number in the file"
        );
        assert_eq!(
            sliders.values(&live),
            [[0.75f32.to_bits(), 0, 0, 0]],
            "which is what counts"
        );
        assert!(!sliders.are_moved());
        sliders.read(shaders(&TEXT.replace("f32 = 0.5", "f32 =  0.5")));
        assert!(!Arc::ptr_eq(&first, &sliders.shaders().unwrap()), "anything else does");
    }

    #[test]
    fn what_is_needed_to_compile_is_in_the_shaders() {
        let mut sliders = sliders(TEXT);
        let first = sliders.shaders().unwrap();
        assert_eq!(sliders.slide("phong.wgsl", "n", Value::Number(5.0)), Ok(true));
        let second = sliders.shaders().unwrap();
        assert!(second.text("phong.wgsl").contains("n: u32 = 5u; // slider"));
        assert!(sliders.reset(Some(("phong.wgsl", "n"))));
        assert_eq!(sliders.shaders().unwrap(), first);
        let told = sliders.told(None, Some(Integrator::Phong));
        let recompile: Vec<_> = told
            .iter()
            .map(|slider| (slider.name.as_str(), slider.recompiles, slider.used))
            .collect();
        assert_eq!(recompile, [("a", false, true), ("n", true, true)]);
        // Before there is a kernel a slider may be either.
        sliders.live = None;
        sliders.slide("phong.wgsl", "a", Value::Number(0.125)).unwrap();
        assert!(
            sliders
                .shaders()
                .unwrap()
                .text("phong.wgsl")
                .contains("a: f32 = 0.125;")
        );
    }

    #[test]
    fn values_that_a_slider_cannot_have_are_refused() {
        let mut sliders = sliders(TEXT);
        assert!(
            sliders
                .slide("phong.wgsl", "b", Value::Number(0.5))
                .unwrap_err()
                .contains("`b`")
        );
        assert!(
            sliders
                .slide("phong.wgsl", "a", Value::Bool(true))
                .unwrap_err()
                .contains("a: cannot")
        );
        assert!(sliders.slide("light.wgsl", "a", Value::Number(0.5)).is_err());
        assert!(!sliders.are_moved());
    }

    #[test]
    fn values_are_written_into_the_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("phong.wgsl");
        let mut sliders = sliders(TEXT);
        let text = format!("\u{feff}// mine\r\n{}\r\n", TEXT.replace('\n', "\r\n"));
        fs::write(&file, &text).unwrap();
        let known = |name: &str| (name == "phong.wgsl").then(|| without_mark(text.clone()));
        sliders.read(Arc::new(Shaders::built_in().changed(|name, _| known(name))));
        sliders.slide("phong.wgsl", "a", Value::Number(0.1)).unwrap();
        sliders.slide("phong.wgsl", "n", Value::Number(4.0)).unwrap();
        assert_eq!(sliders.write(folder.path()), Ok(1));
        assert_eq!(
            fs::read_to_string(&file).unwrap(),
            text.replace("0.5", "0.1").replace("3u", "4u")
        );
        assert_eq!(sliders.take_back(), Ok(1));
        assert_eq!(fs::read_to_string(&file).unwrap(), text);
        assert!(!sliders.can_take_back());
        assert_eq!(sliders.write(folder.path()), Ok(1));
        // The save of another program is kept.
        fs::write(&file, text.replace("mine", "theirs")).unwrap();
        assert_eq!(sliders.write(folder.path()), Ok(1));
        let both = text.replace("mine", "theirs").replace("0.5", "0.1").replace("3u", "4u");
        assert_eq!(fs::read_to_string(&file).unwrap(), both);
        fs::write(&file, "// nothing").unwrap();
        assert!(sliders.take_back().unwrap_err().contains("has changed since"));
        assert!(
            sliders
                .write(folder.path())
                .unwrap_err()
                .contains("is not a slider any more")
        );
        assert_eq!(fs::read_to_string(&file).unwrap(), "// nothing");
    }
}
