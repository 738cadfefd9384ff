//! Kernels of the development mode: marked constants are read from a buffer, so that another value takes no compiler, and
//! a layer may take the place of light.

use std::ops::Range;

use super::compile::check;
use super::compose::{ADAPTIVE, FIRST_HITS, Kernel, RENDER, Shaders, Source};
use super::functions::{FunctionText, functions, without_comments};
use super::marks::{Kind, Layer, Marks, Slider, edited};
use super::pipeline::{CALL, GROUPS};
use crate::error::ShaderError;
use wgray_scene::Integrator;

/// The binding of the constants' values in the first group, behind those of every kernel.
const BINDING: usize = 3;
const _: () = assert!(BINDING == GROUPS[CALL].len());

/// The name of the buffer of slider values in a kernel.
const VALUES: &str = "values_of_sliders";
/// The statement by which a kernel adds the radiance of a sample, which a layer replaces, and the replacement.
const ADDED: &str = "sum +=";
const HELD: &str = "held_in_place_of_light";

/// The changes that kernels need for sliders and layers.
#[derive(Clone, Debug, Default)]
pub struct Live {
    /// The constants that are read from a buffer, in its order.
    sliders: Vec<Slider>,
    /// The layer that replaces color.
    layer: Option<Layer>,
}

impl Live {
    /// All marked constants that a scene's kernels can read from a buffer, and a layer in place of light. Others are needed
    /// where a kernel is compiled, such as sizes of arrays.
    pub fn of(shaders: &Shaders, adaptive: bool, integrator: Integrator, layer: Option<Layer>) -> Live {
        let kernels = [if adaptive { &ADAPTIVE } else { &RENDER }, &FIRST_HITS];
        let with = |sliders: Vec<Slider>| Live {
            sliders,
            layer: layer.clone(),
        };
        let works = |sliders: &[Slider]| {
            let live = Live {
                sliders: sliders.to_vec(),
                layer: None,
            };
            kernels.iter().all(|kernel| {
                let source = live.applied(kernel, shaders.compose(kernel, integrator, None));
                source.and_then(|source| check(&source).map(drop)).is_ok()
            })
        };
        let all = Marks::of(shaders).sliders;
        if all.is_empty() || works(&all) {
            return with(all);
        }
        let each = all.into_iter().filter(|slider| works(std::slice::from_ref(slider)));
        let each: Vec<Slider> = each.collect();
        // Two edits that work alone may fail together: then no edit is made.
        with(if works(&each) { each } else { Vec::new() })
    }

    /// The constants that are read from a buffer, in its order.
    pub fn sliders(&self) -> &[Slider] {
        &self.sliders
    }

    /// Returns the layer that replaces color.
    pub fn layer(&self) -> Option<&Layer> {
        self.layer.as_ref()
    }

    /// A kernel's text with what is not as the files say. Lines stay where they are.
    ///
    /// # Errors
    ///
    /// A kernel that the layer does not fit: it does not add light where that can be seen.
    pub fn applied(&self, kernel: &Kernel, source: Source) -> Result<Source, ShaderError> {
        let layer = self.layer.as_ref().filter(|_| kernel.integrates);
        if self.sliders.is_empty() && layer.is_none() {
            return Ok(source);
        }
        let mut edits = Edits::new();
        let mut set = String::new();
        for (i, slider) in self.sliders.iter().enumerate() {
            let Some(start) = source.start_of(&slider.file) else {
                continue;
            };
            let Range { start: from, end } = slider.declaration;
            edits.push((
                start + from..start + end,
                format!("var<private> {}: {};", slider.name, slider.ty),
            ));
            set += &format!(" {} = {};", slider.name, value_of(slider.kind, i));
        }
        let texts = functions(&source.text);
        let find = |name: &str| texts.iter().find(|text: &&FunctionText| text.name == name);
        if let Some(entry) = find(kernel.entry_point).filter(|_| !set.is_empty()) {
            let start = entry.body.start + 1;
            edits.push((start..start, set));
        }
        if let Some(layer) = layer {
            let added = find(kernel.entry_point).and_then(|entry| added_light(&source.text, &entry.body));
            let added = added.ok_or_else(|| {
                let start = source.start_of(&layer.file).unwrap_or(0);
                let span = naga::Span::from(start + layer.at.start..start + layer.at.end);
                let message = format!(
                    "`{}` cannot be shown: `{}` must add each sample's light, and its weight, in one place by `{ADDED} ...;`",
                    layer.name, kernel.entry_point
                );
                ShaderError::at(&source, Some(span), message)
            })?;
            edits.push((added.start..added.start, format!("{HELD}(")));
            edits.push((added.end..added.end, ")".to_string()));
        }
        edits.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
        let mut source = edits
            .into_iter()
            .fold(source.clone(), |source, (range, new)| source.replaced(range, &new));
        if !self.sliders.is_empty() {
            let count = self.sliders.len();
            let declared = format!("@group(0) @binding({BINDING}) var<uniform> {VALUES}: array<vec4u, {count}>;");
            source.append("(the sliders' values)", &declared);
        }
        if let Some(layer) = layer {
            source.append("(the layer)", &in_place_of_light(layer));
        }
        Ok(source)
    }
}

/// The expression of a constant's value.
fn value_of(kind: Kind, i: usize) -> String {
    let at = format!("{VALUES}[{i}]");
    match kind {
        Kind::F32 => format!("bitcast<f32>({at}.x)"),
        Kind::I32 => format!("bitcast<i32>({at}.x)"),
        Kind::U32 => format!("{at}.x"),
        Kind::Bool => format!("{at}.x != 0u"),
        Kind::Color => format!("bitcast<vec3f>({at}.xyz)"),
    }
}

/// The expression of the light that a function's body adds, if it does so in one place.
fn added_light(text: &str, body: &Range<usize>) -> Option<Range<usize>> {
    let plain = without_comments(text);
    let mut places = plain[body.clone()].match_indices(ADDED);
    let (at, _) = places
        .next()
        .filter(|(at, _)| plain[body.start..body.start + at].ends_with(char::is_whitespace))?;
    let start = body.start + at + ADDED.len();
    let end = start + plain[start..body.end].find(';')?;
    places.next().is_none().then_some(start..end)
}

/// Returns the expression that replaces the radiance of a sample: the final value of the layer, with the weight of
/// the sample.
fn in_place_of_light(layer: &Layer) -> String {
    let Layer { name, ty, numbers, .. } = layer;
    let color = match numbers {
        1 => "vec3f(held)",
        2 => "vec3f(held, 0.0)",
        3 => "held",
        _ => "held.xyz",
    };
    format!(
        "fn {HELD}(light: vec4f) -> vec4f {{ let held = {name}; {name} = {ty}(); \
         return vec4f({color} * light.w, light.w); }}"
    )
}

/// Replacements of parts of a text.
pub type Edits = Vec<(Range<usize>, String)>;

/// Shaders with edits of constants' numbers.
pub fn with_edits(shaders: &Shaders, edits: &dyn Fn(&Slider, &str) -> Edits) -> Shaders {
    shaders.changed(|file, text| {
        let marks = Marks::of_file(file, text);
        let edits: Edits = marks.sliders.iter().flat_map(|slider| edits(slider, text)).collect();
        (!edits.is_empty()).then(|| edited(text, edits))
    })
}

/// Shaders with the numbers of these constants left out: what they have in common, whatever the values.
pub fn without_values(shaders: &Shaders, live: &dyn Fn(&Slider) -> bool) -> Shaders {
    let emptied = |slider: &Slider| {
        slider
            .literals()
            .iter()
            .map(|place| (place.clone(), String::new()))
            .collect()
    };
    with_edits(shaders, &|slider, _| {
        if live(slider) { emptied(slider) } else { Vec::new() }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PHONG: Integrator = Integrator::Phong;

    fn shaders(more: &str) -> Shaders {
        let text = Shaders::built_in().text("phong.wgsl").to_string();
        Shaders::built_in().with("phong.wgsl", text + more)
    }

    fn live(more: &str) -> Vec<String> {
        let live = Live::of(&shaders(more), false, PHONG, None);
        live.sliders.iter().map(|slider| slider.name.clone()).collect()
    }

    #[test]
    fn what_is_needed_to_compile_is_not_read_from_a_buffer() {
        let free = "const free: f32 = 0.5; // slider 0..1\nfn half_of(x: f32) -> f32 { return x * free; }\n";
        assert_eq!(live(free), ["free"]);
        let over = free.replace("const", "override");
        assert_eq!(live(&over), ["free"]);
        for bound in [
            "const size: u32 = 3u; // slider 1..9\nvar<private> many: array<f32, size>;\n",
            "const part: f32 = 0.5; // slider 0..1\nconst whole: f32 = part * 2.0;\n",
            "const which: u32 = 1u; // slider 0..9\nfn chosen(x: u32) -> u32 { switch x { case which: { return 1u; } default: { return 2u; } } }\n",
        ] {
            assert_eq!(live(&(free.to_string() + bound)), ["free"], "{bound}");
            assert_eq!(live(bound), [""; 0]);
        }
    }

    #[test]
    fn a_kernel_without_marks_is_as_it_was() {
        let source = Shaders::built_in().compose(&RENDER, PHONG, None);
        let live = Live::of(&Shaders::built_in(), false, PHONG, None);
        assert_eq!(live.applied(&RENDER, source.clone()).unwrap(), source);
    }

    #[test]
    fn a_layer_stands_for_light_and_lines_stay_where_they_are() {
        let own = shaders(
            "var<private> seen: vec2f; // layer\nconst a: vec3f = vec3f(1.0); // color\nfn marked() { seen = a.xy; }\n",
        );
        let marks = Marks::of(&own);
        let live = Live::of(&own, false, PHONG, marks.layers.first().cloned());
        let before = own.compose(&RENDER, PHONG, None);
        let after = live.applied(&RENDER, before.clone()).unwrap();
        check(&after).unwrap_or_else(|error| panic!("{error}"));
        assert!(after.text.lines().count() <= before.text.lines().count() + 2);
        let line = |source: &Source, what: &str| source.text.lines().position(|line| line.contains(what));
        for what in ["fn marked()", "fn render(", "fn advance("] {
            assert!(line(&before, what).is_some());
            assert_eq!(line(&after, what), line(&before, what), "{what}");
        }
        // The kernel that asks no integrator has the slider alone.
        let hits = live
            .applied(&FIRST_HITS, own.compose(&FIRST_HITS, PHONG, None))
            .unwrap();
        assert!(!hits.text.contains(HELD) && hits.text.contains(VALUES));
        for (old, new) in [
            ("sum += path_value(path);", "sum = sum + path_value(path);"),
            (
                "sum += path_value(path);",
                "sum += path_value(path); sum += vec4f(1.0);",
            ),
        ] {
            let at = before.text.find(old).unwrap();
            let other = before.replaced(at..at + old.len(), new);
            let error = live.applied(&RENDER, other).unwrap_err();
            assert!(error.place.starts_with("phong.wgsl:"), "{error}");
            assert!(error.message.contains("`seen` cannot be shown"), "{error}");
        }
    }

    #[test]
    fn shaders_that_differ_in_values_alone_are_known() {
        let [a, b, c] =
            ["0.5", "0.25", "0.5 "].map(|value| shaders(&format!("const a: f32 = {value}; // slider 0..1\n")));
        let all = |shaders: &Shaders| without_values(shaders, &|_| true);
        assert_eq!(all(&a), all(&b));
        assert_ne!(all(&a), all(&c));
        assert_ne!(without_values(&a, &|_| false), without_values(&b, &|_| false));
    }
}
