//! Overrides in shaders as sliders of the development mode: kernels read the values from a uniform buffer, so that a
//! change needs no compilation.

use std::ops::Range;

use naga::{ArraySize, Expression, Handle, Literal, Module, Override, TypeInner};
use serde::{Deserialize, Serialize};

use super::compile::{ValidKernel, check};
use super::compose::{ADAPTIVE, Kernel, RENDER, Shaders, Source};
use super::functions::functions;
use super::pipeline::{DISPATCH_GROUP, GROUPS};
use crate::error::ShaderError;
use wgray_scene::Integrator;

/// Binding of the values in the dispatch group, after the bindings of all kernels.
const BINDING: usize = GROUPS[DISPATCH_GROUP].len();
/// Name of the buffer of values.
const VALUES: &str = "slider_values";

/// An override with a default value: `override NAME: TYPE = VALUE; // LOW..HIGH`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slider {
    /// File in the folder of shaders.
    pub file: String,
    /// Name of the override.
    pub name: String,
    /// Line of the declaration, counted from 1.
    pub line: usize,
    /// Type of the override.
    pub kind: Kind,
    /// Minimum value of a number.
    pub min: f64,
    /// Maximum value of a number.
    pub max: f64,
    /// Default value in the file.
    pub default: Value,
}

/// Type of an override, named as in WGSL.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// `f32`
    F32,
    /// `i32`
    I32,
    /// `u32`
    U32,
    /// `bool`
    Bool,
}

/// Value of an override.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A `bool`.
    Bool(bool),
    /// A number.
    Number(f64),
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Kind::F32 => "f32",
            Kind::I32 => "i32",
            Kind::U32 => "u32",
            Kind::Bool => "bool",
        }
    }

    fn limits(self) -> [f64; 2] {
        match self {
            Kind::F32 => [f32::MIN, f32::MAX].map(f64::from),
            Kind::I32 => [i32::MIN, i32::MAX].map(f64::from),
            Kind::U32 => [u32::MIN, u32::MAX].map(f64::from),
            Kind::Bool => [0.0, 1.0],
        }
    }
}

impl Slider {
    /// Returns a value clamped to the range, rounded for an integer; `None` if the value has a different type.
    pub fn clamped(&self, value: Value) -> Option<Value> {
        match (self.kind, value) {
            (Kind::Bool, Value::Bool(_)) => Some(value),
            (Kind::F32, Value::Number(x)) => Some(Value::Number(x.clamp(self.min, self.max))),
            (Kind::I32 | Kind::U32, Value::Number(x)) => Some(Value::Number(x.clamp(self.min, self.max).round())),
            _ => None,
        }
    }

    /// Returns a value's bits in the buffer.
    pub fn bits(&self, value: Value) -> u32 {
        match (self.kind, value) {
            (_, Value::Bool(on)) => on.into(),
            (Kind::I32, Value::Number(x)) => x as i32 as u32,
            (Kind::U32, Value::Number(x)) => x as u32,
            (_, Value::Number(x)) => (x as f32).to_bits(),
        }
    }
}

/// Returns the sliders of the rendering kernel: overrides with a default value, except overrides whose value must be
/// known at compile time.
pub fn sliders(shaders: &Shaders, integrator: Integrator, adaptive: bool) -> Vec<Slider> {
    if !shaders.files().any(|(_, text)| text.contains("override")) {
        return Vec::new();
    }
    let source = shaders.compose(if adaptive { &ADAPTIVE } else { &RENDER }, integrator, None);
    let checked = check(&source);
    checked.map_or(Vec::new(), |checked| {
        declared(&checked, &source).map(|(slider, _)| slider).collect()
    })
}

/// Returns a kernel's text that reads sliders from the buffer, without moving lines.
///
/// # Errors
///
/// naga rejects the kernel.
pub fn with_buffer(source: Source, kernel: &Kernel, sliders: &[Slider]) -> Result<Source, ShaderError> {
    if sliders.is_empty() {
        return Ok(source);
    }
    let checked = check(&source)?;
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    let mut loads = String::new();
    for (Slider { file, name, kind, .. }, range) in declared(&checked, &source) {
        let Some(i) = sliders
            .iter()
            .position(|slider| (&slider.file, &slider.name) == (&file, &name))
        else {
            continue;
        };
        let bits = format!("{VALUES}[{}][{}]", i / 4, i % 4);
        loads += &match kind {
            Kind::Bool => format!(" {name} = {bits} != 0u;"),
            _ => format!(" {name} = bitcast<{}>({bits});", kind.name()),
        };
        edits.push((range, format!("var<private> {name}: {};", kind.name())));
    }
    let functions = functions(&source.text);
    let Some(entry) = functions.iter().find(|function| function.name == kernel.entry_point) else {
        return Ok(source);
    };
    let start = entry.body.start + 1;
    edits.push((start..start, loads));
    edits.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
    let edited = |source: Source, (range, text): (Range<usize>, String)| source.replaced(range, &text);
    let mut source = edits.into_iter().fold(source.clone(), edited);
    let rows = sliders.len().div_ceil(4);
    let declaration =
        format!("@group({DISPATCH_GROUP}) @binding({BINDING}) var<uniform> {VALUES}: array<vec4u, {rows}>;");
    source.append("(the values of sliders)", &declaration);
    Ok(source)
}

/// Returns a kernel's sliders, and the locations of the declarations.
fn declared(checked: &ValidKernel, source: &Source) -> impl Iterator<Item = (Slider, Range<usize>)> {
    let module = checked.module();
    module.overrides.iter().filter_map(move |(handle, declaration)| {
        let Override {
            name, id: None, init, ..
        } = declaration
        else {
            return None;
        };
        if is_needed_to_compile(module, handle) {
            return None;
        }
        let (kind, default) = match module.global_expressions[(*init)?] {
            // Parses the shortest digits of the f32, such as 0.1: a direct conversion to f64 would add digits.
            Expression::Literal(Literal::F32(x)) => (Kind::F32, Value::Number(x.to_string().parse().ok()?)),
            Expression::Literal(Literal::I32(x)) => (Kind::I32, Value::Number(x.into())),
            Expression::Literal(Literal::U32(x)) => (Kind::U32, Value::Number(x.into())),
            Expression::Literal(Literal::Bool(on)) => (Kind::Bool, Value::Bool(on)),
            _ => return None,
        };
        let range = module.overrides.get_span(handle).to_range()?;
        let (file, text, start) = source.locate(range.start)?;
        let line_end = text.get(start + range.len()..)?.lines().next().unwrap_or_default();
        let [min, max] = range_of(kind, default, line_end);
        let slider = Slider {
            file: file.to_string(),
            name: name.clone()?,
            line: text[..start].matches('\n').count() + 1,
            kind,
            min,
            max,
            default,
        };
        Some((slider, range))
    })
}

/// Returns true if the size of an array or workgroup, or another declaration, depends on an override.
fn is_needed_to_compile(module: &Module, handle: Handle<Override>) -> bool {
    let in_expressions = module
        .global_expressions
        .iter()
        .any(|(_, expression)| matches!(expression, Expression::Override(found) if *found == handle));
    let is_size = |inner: &TypeInner| matches!(inner, TypeInner::Array { size: ArraySize::Pending(found), .. } if *found == handle);
    in_expressions || module.types.iter().any(|(_, ty)| is_size(&ty.inner))
}

/// Returns the range in a comment after a declaration, `// LOW..HIGH`; without a comment, a range that includes 0 and
/// twice the value.
fn range_of(kind: Kind, default: Value, line_end: &str) -> [f64; 2] {
    let Value::Number(value) = default else {
        return kind.limits();
    };
    let comment = line_end
        .trim_start()
        .strip_prefix("//")
        .unwrap_or_default()
        .trim_start();
    let bounds = comment.strip_prefix("slider").unwrap_or(comment).split_once("..");
    let parsed = bounds.and_then(|(low, high)| {
        let high = high.split_whitespace().next()?;
        Some([low.trim().parse::<f64>().ok()?, high.parse().ok()?])
    });
    let default_range = || {
        [
            0.0f64.min(2.0 * value),
            (2.0 * value).max(if kind == Kind::F32 { 1.0 } else { 8.0 }),
        ]
    };
    let [low, high] = parsed.filter(|[low, high]| low < high).unwrap_or_else(default_range);
    let [min, max] = kind.limits();
    [low.min(value).max(min), high.max(value).min(max)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const PHONG: Integrator = Integrator::Phong;

    fn shaders(appended: &str) -> Shaders {
        let text = Shaders::built_in().text("phong.wgsl").to_string();
        Shaders::built_in().with("phong.wgsl", text + appended)
    }

    fn sliders_of(appended: &str) -> Vec<Slider> {
        sliders(&shaders(appended), PHONG, false)
    }

    #[test]
    fn overrides_with_values_are_sliders() {
        let lines = Shaders::built_in().text("phong.wgsl").lines().count();
        let found = sliders_of(
            "override gain: f32 = 0.1; // 0..4\n  override passes: i32 = -3; // slider -8..8 steps\n\
             override copies = 20u;\noverride on: bool = true; // whether\noverride wide: f32 = 2.0 * 1.5; // 0..1\n",
        );
        let slider = |line, name: &str, kind, [min, max]: [f64; 2], default| Slider {
            file: "phong.wgsl".to_string(),
            name: name.to_string(),
            line: lines + line,
            kind,
            min,
            max,
            default,
        };
        assert_eq!(
            found,
            [
                slider(1, "gain", Kind::F32, [0.0, 4.0], Value::Number(0.1)),
                slider(2, "passes", Kind::I32, [-8.0, 8.0], Value::Number(-3.0)),
                slider(3, "copies", Kind::U32, [0.0, 40.0], Value::Number(20.0)),
                slider(4, "on", Kind::Bool, [0.0, 1.0], Value::Bool(true)),
                slider(5, "wide", Kind::F32, [0.0, 3.0], Value::Number(3.0)),
            ]
        );
        let [gain, steps, copies, on, _] = found.as_slice() else {
            panic!("{found:?}")
        };
        assert_eq!(gain.clamped(Value::Number(7.0)), Some(Value::Number(4.0)));
        assert_eq!(gain.clamped(Value::Bool(true)), None);
        assert_eq!(gain.bits(Value::Number(0.1)), 0.1f32.to_bits());
        assert_eq!(steps.clamped(Value::Number(-2.6)), Some(Value::Number(-3.0)));
        assert_eq!(steps.bits(Value::Number(-3.0)), -3i32 as u32);
        assert_eq!(copies.clamped(Value::Number(-1.0)), Some(Value::Number(0.0)));
        assert_eq!(on.clamped(Value::Number(1.0)), None);
        assert_eq!(on.bits(Value::Bool(true)), 1);
    }

    #[test]
    fn overrides_that_compilation_needs_are_not_sliders() {
        let free = "override free: f32 = 0.5; // 0..1\nfn half_of(x: f32) -> f32 { return x * free; }\n";
        assert_eq!(sliders_of(free).len(), 1);
        for excluded in [
            "override size: u32 = 3u;\nvar<workgroup> group_bins: array<f32, size>;\n",
            "override size: u32 = 3u;\nvar<workgroup> group_bins: array<f32, size * 2u>;\n",
            "override half_gain: f32 = 0.5;\noverride full_gain: f32 = half_gain * 2.0;\n",
            "override half_gain: f32 = 0.5;\nvar<private> private_gain: f32 = half_gain;\n",
            "@id(7) override numbered: f32 = 0.5;\n",
            "const constant: f32 = 0.5; // slider 0..1\n",
        ] {
            let names: Vec<String> = sliders_of(&(free.to_string() + excluded))
                .into_iter()
                .map(|slider| slider.name)
                .collect();
            assert_eq!(names, ["free"], "{excluded}");
        }
        assert_eq!(sliders_of("override broken: f32 = missing;\n"), []);
    }

    #[test]
    fn kernels_read_the_values_and_keep_their_lines() {
        let edited = shaders(
            "override a: f32 = 0.5; override b: bool = true;\nfn used() -> f32 { return select(0.0, a, b); }\n",
        );
        let all = sliders(&edited, PHONG, false);
        let before = edited.compose(&RENDER, PHONG, None);
        let after = with_buffer(before.clone(), &RENDER, &all).unwrap();
        check(&after).unwrap_or_else(|error| panic!("{error}"));
        let line = |source: &Source, code: &str| source.text.lines().position(|line| line.contains(code));
        for code in ["fn used()", "fn render(", "fn advance("] {
            assert!(line(&before, code).is_some());
            assert_eq!(line(&after, code), line(&before, code), "{code}");
        }
        assert!(
            after
                .text
                .contains(" a = bitcast<f32>(slider_values[0][0]); b = slider_values[0][1] != 0u;")
        );
        assert_eq!(with_buffer(before.clone(), &RENDER, &[]).unwrap(), before);
    }
}
