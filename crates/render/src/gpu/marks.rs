//! Marks in the comments of shaders: constants that the development mode makes sliders of, and variables that it shows as
//! layers.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::compose::{Shaders, Source};
use super::functions::without_comments;
use crate::error::ShaderError;

/// The longest name of a layer, in bytes.
pub const MAX_NAME_LEN: usize = 48;

/// The annotations in shaders.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// Constants that become sliders.
    pub sliders: Vec<Slider>,
    /// Variables that become layers.
    pub layers: Vec<Layer>,
    /// Marks that say nothing that can be followed.
    pub mistakes: Vec<ShaderError>,
}

/// A constant with a mark: `const NAME: TYPE = VALUE; // slider LOW..HIGH`.
#[derive(Clone, Debug, PartialEq)]
pub struct Slider {
    /// Its file in the folder of shaders.
    pub file: String,
    /// Its name.
    pub name: String,
    /// Its line, counted from 1.
    pub line: usize,
    /// The kind of the constant.
    pub kind: Kind,
    /// The least value, for numbers.
    pub min: f64,
    /// The largest.
    pub max: f64,
    /// The interval between values, if it is given.
    pub step: Option<f64>,
    /// The value in the file.
    pub value: Value,
    /// The whole declaration in the file, from its keyword to its semicolon.
    pub(super) declaration: Range<usize>,
    /// Its type as it is written.
    pub(super) ty: String,
    /// Its numbers in the file: one, or the three of a colour.
    literals: Vec<Range<usize>>,
}

/// The kind of a slider's constant.
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
    /// `vec3f`
    Color,
}

/// The value of a slider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A switch.
    Bool(bool),
    /// A number; one of 32 bits has its place here.
    Number(f64),
    /// Red, green and blue.
    Color([f64; 3]),
}

/// A variable with a mark: `var<private> NAME: TYPE; // layer`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layer {
    /// Its file in the folder of shaders.
    pub file: String,
    /// Its name.
    pub name: String,
    /// Its type as it is written.
    pub(super) ty: String,
    /// Number of components.
    pub numbers: usize,
    /// Its name in the file.
    pub(super) at: Range<usize>,
}

impl Slider {
    /// Returns a value rounded to the type and clamped to the range; `None` if it is of another kind.
    pub fn rounded(&self, value: Value) -> Option<Value> {
        let within = |x: f64| x.clamp(self.min, self.max);
        match (self.kind, value) {
            (Kind::Bool, Value::Bool(_)) => Some(value),
            (Kind::F32, Value::Number(x)) if x.is_finite() => Some(Value::Number(f64::from(within(x) as f32))),
            (Kind::I32 | Kind::U32, Value::Number(x)) if x.is_finite() => Some(Value::Number(within(x).round())),
            (Kind::Color, Value::Color(c)) if c.iter().all(|x| x.is_finite()) => Some(Value::Color(
                c.map(|x| f64::from(x.max(0.0).min(f64::from(f32::MAX)) as f32)),
            )),
            _ => None,
        }
    }

    /// Checks a requested value, and returns it as the constant stores it.
    ///
    /// # Errors
    ///
    /// The rule that it breaks.
    pub fn checked(&self, value: Value) -> Result<Value, String> {
        let rounded = self.rounded(value).ok_or("cannot have a value of this kind")?;
        let plain = |x: f64| format!("{x:?}").trim_end_matches(".0").to_owned();
        let is_whole = matches!(self.kind, Kind::I32 | Kind::U32);
        match (value, rounded) {
            (Value::Number(x), _) if is_whole && x.fract() != 0.0 => {
                Err(format!("{} must be a whole number", plain(x)))
            }
            // A requested value has fewer digits than the ends of the range.
            (Value::Number(x), Value::Number(y))
                if (x - y).abs() > 1e-6 * y.abs().max(f64::from(f32::MIN_POSITIVE)) =>
            {
                let (min, max) = (self.short(self.min), self.short(self.max));
                Err(format!("{} must be from {min} to {max}", plain(x)))
            }
            (Value::Color(c), _) if c.iter().any(|x| *x < 0.0) => Err(format!("{c:?} must not be negative")),
            _ => Ok(rounded),
        }
    }

    /// A value's bits, as a kernel reads it.
    pub fn bits(&self, value: Value) -> [u32; 4] {
        match (self.kind, value) {
            (Kind::I32, Value::Number(x)) => [x as i32 as u32, 0, 0, 0],
            (Kind::U32, Value::Number(x)) => [x as u32, 0, 0, 0],
            (_, Value::Number(x)) => [(x as f32).to_bits(), 0, 0, 0],
            (_, Value::Bool(on)) => [u32::from(on), 0, 0, 0],
            (_, Value::Color([r, g, b])) => {
                let [r, g, b] = [r, g, b].map(|x| (x as f32).to_bits());
                [r, g, b, 0]
            }
        }
    }

    /// Returns a 32-bit number with the fewest digits that identify it.
    pub fn short(&self, x: f64) -> f64 {
        match self.kind {
            Kind::I32 | Kind::U32 => x,
            _ => format!("{}", x as f32).parse().unwrap_or(x),
        }
    }

    /// The edits of its file's text that give it a value: its numbers alone are touched.
    pub fn edits(&self, text: &str, value: Value) -> Vec<(Range<usize>, String)> {
        let number = |range: &Range<usize>, x: f64| {
            let old = text.get(range.clone()).unwrap_or_default();
            let suffix = old.trim_start_matches(|c: char| !matches!(c, 'f' | 'i' | 'u'));
            (range.clone(), self.written(x) + suffix)
        };
        match (value, self.literals.as_slice()) {
            (Value::Bool(on), [place]) => vec![(place.clone(), on.to_string())],
            (Value::Number(x), [place]) => vec![number(place, x)],
            (Value::Color(c), [place]) if c[0] == c[1] && c[1] == c[2] => vec![number(place, c[0])],
            (Value::Color(c), [place]) => {
                vec![(place.clone(), c.map(|x| self.written(x)).join(", "))]
            }
            (Value::Color(c), places) => places.iter().zip(c).map(|(place, x)| number(place, x)).collect(),
            _ => Vec::new(),
        }
    }

    /// Formats a number for WGSL.
    fn written(&self, x: f64) -> String {
        match self.kind {
            Kind::I32 | Kind::U32 => format!("{x:.0}"),
            _ => format!("{:?}", x as f32),
        }
    }

    /// The places of its numbers in its file.
    pub(super) fn literals(&self) -> &[Range<usize>] {
        &self.literals
    }
}

impl Marks {
    /// Returns the annotations of all files.
    pub fn of(shaders: &Shaders) -> Marks {
        let mut marks = Marks::default();
        for (file, text) in shaders.files() {
            marks.read(file, text);
        }
        marks
    }

    /// Returns the annotations of a file.
    pub fn of_file(file: &str, text: &str) -> Marks {
        let mut marks = Marks::default();
        marks.read(file, text);
        marks
    }

    fn read(&mut self, file: &str, text: &str) {
        // Most files have none, and are not looked at closely.
        if !["slider", "switch", "color", "layer"]
            .iter()
            .any(|word| text.contains(word))
        {
            return;
        }
        let plain = without_comments(text);
        let mut start = 0;
        for (number, line) in text.split_inclusive('\n').enumerate() {
            let here = start..start + line.len();
            start = here.end;
            let code = plain[here.clone()].trim_end();
            // The code's comment: the first thing behind it.
            let Some(comment) = line[code.len()..].trim().strip_prefix("//") else {
                continue;
            };
            if code.trim().is_empty() {
                continue;
            }
            let at = here.start + (code.len() - code.trim_start().len());
            let line = Line {
                file,
                number: number + 1,
                code: code.trim(),
                at,
            };
            let told = match comment
                .trim()
                .split_once(char::is_whitespace)
                .unwrap_or((comment.trim(), ""))
            {
                ("slider", range) => line.slider(Some(range.trim())).map(|slider| self.sliders.push(slider)),
                ("switch" | "color", "") => line.slider(None).map(|slider| self.sliders.push(slider)),
                ("layer", "") => line.layer().map(|layer| self.layers.push(layer)),
                _ => continue,
            };
            if let Err(message) = told {
                let mut source = Source::default();
                source.append(file, text);
                let span = naga::Span::from(at..at + line.code.len());
                self.mistakes.push(ShaderError::at(&source, Some(span), message));
            }
        }
    }
}

/// A line of a file that has a mark.
struct Line<'a> {
    file: &'a str,
    /// Counted from 1.
    number: usize,
    code: &'a str,
    /// The offset of the code in the file.
    at: usize,
}

/// The parts of `KEYWORD NAME: TYPE = VALUE;`, with the value's place in the line's code.
struct Declared<'a> {
    keyword: &'a str,
    name: &'a str,
    ty: &'a str,
    value: Option<(usize, &'a str)>,
}

fn declared(code: &str) -> Option<Declared<'_>> {
    let body = code.strip_suffix(';').filter(|body| !body.contains([';', '{', '}']))?;
    let (head, value) = match body.split_once('=') {
        Some((head, value)) => {
            let place = head.len() + 1 + (value.len() - value.trim_start().len());
            (head, Some((place, value.trim())))
        }
        None => (body, None),
    };
    let (before, ty) = head.split_once(':').unwrap_or((head, ""));
    let (keyword, name) = before.trim().rsplit_once(|c: char| c.is_whitespace() || c == '>')?;
    let keyword_end = before.trim().len() - name.len();
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    (!name.is_empty() && name.chars().all(is_name)).then_some(Declared {
        keyword: if keyword.contains('<') {
            before.trim()[..keyword_end].trim()
        } else {
            keyword.trim()
        },
        name,
        ty: ty.trim(),
        value,
    })
}

/// A type without the blanks in it.
fn packed_type(ty: &str) -> String {
    ty.chars().filter(|c| !c.is_whitespace()).collect()
}

impl Line<'_> {
    /// The slider that is meant. `range` is what follows the word `slider`.
    fn slider(&self, range: Option<&str>) -> Result<Slider, String> {
        const RULE: &str = "a slider must be a line `const NAME: TYPE = VALUE; // slider LOW..HIGH`, of f32, i32 or u32; \
            `// slider` of a bool; or `// color` of a vec3f";
        let declared = declared(self.code).filter(|it| matches!(it.keyword, "const" | "override"));
        let Some(Declared { name, ty, value, .. }) = declared else {
            return Err(RULE.to_string());
        };
        let Some((place, written)) = value.filter(|_| !ty.is_empty()) else {
            return Err(format!("`{name}` must have a type and a value: {RULE}"));
        };
        let kind = match packed_type(ty).as_str() {
            "f32" => Kind::F32,
            "i32" => Kind::I32,
            "u32" => Kind::U32,
            "bool" => Kind::Bool,
            "vec3f" | "vec3<f32>" => Kind::Color,
            _ => return Err(format!("`{name}` is of type `{ty}`: {RULE}")),
        };
        let place = self.at + place;
        let whole = || std::iter::once(place..place + written.len()).collect();
        let wrong = || format!("`{name}`: `{written}` must be a number literal, true or false: {RULE}");
        let (value, literals) = match kind {
            Kind::Bool => {
                let on = written.parse().map_err(|_| wrong())?;
                (Value::Bool(on), whole())
            }
            Kind::Color => color(written, place).ok_or_else(wrong)?,
            _ => {
                let x = number(written, kind).ok_or_else(wrong)?;
                (Value::Number(x), whole())
            }
        };
        let [mut min, mut max, mut step] = [0.0, 1.0, f64::NAN];
        match (kind, range) {
            (Kind::Bool, None | Some("")) | (Kind::Color, None) => {}
            (Kind::Bool | Kind::Color, _) => return Err(format!("`{name}` has no range: {RULE}")),
            (_, None) => return Err(format!("`{name}` is neither a color nor a switch: {RULE}")),
            (_, Some(limits)) => {
                let rule = || {
                    let whole = if kind == Kind::F32 { "" } else { " whole" };
                    format!(
                        "`{name}`: `slider {limits}` must be `slider LOW..HIGH` or `slider LOW..HIGH step STEP`, with{whole} \
                         numbers, LOW below HIGH, and STEP above 0"
                    )
                };
                let (range, stepped) = limits.split_once("step").unwrap_or((limits, ""));
                let (low, high) = range.split_once("..").ok_or_else(rule)?;
                let limit = |text: &str| number(text.trim(), kind).ok_or_else(rule);
                (min, max) = (limit(low)?, limit(high)?);
                if limits.contains("step") {
                    step = limit(stepped)?;
                }
                if !(min < max) || step <= 0.0 {
                    return Err(rule());
                }
                if let Value::Number(x) = value
                    && !(min..=max).contains(&x)
                {
                    return Err(format!(
                        "`{name}`: {written} must be from {min} to {max}, as its slider says"
                    ));
                }
            }
        }
        Ok(Slider {
            file: self.file.to_string(),
            name: name.to_string(),
            line: self.number,
            kind,
            min,
            max,
            step: Some(step).filter(|step| !step.is_nan()),
            value,
            declaration: self.at..self.at + self.code.len(),
            ty: ty.to_string(),
            literals,
        })
    }

    fn layer(&self) -> Result<Layer, String> {
        const RULE: &str = "a layer must be a line `var<private> NAME: TYPE; // layer`, of f32, vec2f, vec3f or vec4f";
        let declared = declared(self.code).filter(|it| packed_type(it.keyword) == "var<private>");
        let Some(Declared { name, ty, value, .. }) = declared else {
            return Err(RULE.to_string());
        };
        if value.is_some() {
            return Err(format!(
                "`{name}` is set to 0 before each sample and must not have an initial value: {RULE}"
            ));
        }
        if name.len() > MAX_NAME_LEN {
            return Err(format!(
                "`{name}`: a layer's name must have {MAX_NAME_LEN} bytes at most"
            ));
        }
        let numbers = match packed_type(ty).as_str() {
            "f32" => 1,
            "vec2f" | "vec2<f32>" => 2,
            "vec3f" | "vec3<f32>" => 3,
            "vec4f" | "vec4<f32>" => 4,
            _ => return Err(format!("`{name}` is of type `{ty}`: {RULE}")),
        };
        let at = self.at + self.code.find(name).unwrap_or(0);
        Ok(Layer {
            file: self.file.to_string(),
            name: name.to_string(),
            ty: ty.to_string(),
            numbers,
            at: at..at + name.len(),
        })
    }
}

/// Parses a WGSL number of a type; `None` for anything else.
fn number(written: &str, kind: Kind) -> Option<f64> {
    let digits = written.strip_prefix('-').unwrap_or(written);
    if !digits.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
        return None; // names that Rust knows, such as "inf"
    }
    match kind {
        Kind::I32 => written
            .strip_suffix('i')
            .unwrap_or(written)
            .parse::<i32>()
            .ok()
            .map(f64::from),
        Kind::U32 => written
            .strip_suffix('u')
            .unwrap_or(written)
            .parse::<u32>()
            .ok()
            .map(f64::from),
        _ => {
            let x = match written.strip_suffix('f') {
                Some(single) => single.parse::<f32>().ok()?,
                None => written.parse::<f64>().ok()? as f32,
            };
            x.is_finite().then_some(f64::from(x))
        }
    }
}

/// The numbers of `vec3f(r, g, b)` or `vec3f(all)`, and where they are.
fn color(written: &str, place: usize) -> Option<(Value, Vec<Range<usize>>)> {
    let open = written.find('(')?;
    if !matches!(packed_type(&written[..open]).as_str(), "vec3f" | "vec3<f32>") {
        return None;
    }
    let inside = written[open + 1..].strip_suffix(')')?;
    let mut at = place + open + 1;
    let (mut numbers, mut literals) = (Vec::new(), Vec::new());
    for part in inside.split(',') {
        let start = at + (part.len() - part.trim_start().len());
        numbers.push(number(part.trim(), Kind::F32).filter(|x| *x >= 0.0)?);
        literals.push(start..start + part.trim().len());
        at += part.len() + 1;
    }
    match numbers.as_slice() {
        [all] => Some((Value::Color([*all; 3]), literals)),
        [r, g, b] => Some((Value::Color([*r, *g, *b]), literals)),
        _ => None,
    }
}

/// A text with edits made in it that do not overlap.
pub fn edited(text: &str, mut edits: Vec<(Range<usize>, String)>) -> String {
    // From the end: what comes before an edit stays where it is.
    edits.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
    let mut text = text.to_string();
    for (range, new) in edits {
        text.replace_range(range, &new);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Marks {
        Marks::of_file("a.wgsl", text)
    }

    #[test]
    fn what_a_slider_cannot_have_is_refused() {
        let text = "const a: f32 = 0.5; // slider 0.3..0.7\nconst n: i32 = -3; // slider -5..5\n\
            const c: vec3f = vec3f(0.5, .25, 1f); // color";
        let [a, n, c] = read(text).sliders.try_into().unwrap();
        for x in [0.3, 0.7, 0.5, f64::from(0.3f32), f64::from(0.7f32)] {
            assert_eq!(a.checked(Value::Number(x)).map(|_| ()), Ok(()), "{x}");
        }
        let told = |slider: &Slider, value: Value| slider.checked(value).unwrap_err();
        assert_eq!(told(&a, Value::Number(0.29999)), "0.29999 must be from 0.3 to 0.7");
        assert_eq!(told(&a, Value::Number(-1e300)), "-1e300 must be from 0.3 to 0.7");
        assert_eq!(n.checked(Value::Number(-5.0)), Ok(Value::Number(-5.0)));
        assert_eq!(told(&n, Value::Number(0.1)), "0.1 must be a whole number");
        assert_eq!(told(&n, Value::Number(6.0)), "6 must be from -5 to 5");
        assert_eq!(told(&n, Value::Bool(true)), "cannot have a value of this kind");
        let color = Value::Color([0.0, 2.0, 1e30]);
        assert!(c.checked(color).is_ok());
        assert!(told(&c, Value::Color([0.0, -1e-9, 0.0])).contains("must not be negative"));
    }

    #[test]
    fn the_projects_own_shaders_have_no_marks() {
        assert_eq!(Marks::of(&Shaders::built_in()), Marks::default());
    }

    #[test]
    fn marked_constants_are_sliders() {
        let text = "const a: f32 = 0.5; // slider 0..1\n\
            override gain: f32 = 1.0;   //slider 0..4 step 0.1\n  const n: i32 = -3; // slider -5..5 step 1\n\
            const m : u32=7u; // slider 0..10\r\nconst on: bool = true; // switch\nconst off: bool = false; // slider\n\
            const c: vec3f = vec3f(0.5, .25, 1f); // color\nconst all: vec3<f32> = vec3<f32>(0.5); // color\n";
        let marks = read(text);
        assert_eq!(marks.mistakes, []);
        let told: Vec<_> = marks
            .sliders
            .iter()
            .map(|s| (s.name.as_str(), s.line, s.min, s.max, s.step))
            .collect();
        assert_eq!(
            told,
            [
                ("a", 1, 0.0, 1.0, None),
                ("gain", 2, 0.0, 4.0, Some(f64::from(0.1f32))),
                ("n", 3, -5.0, 5.0, Some(1.0)),
                ("m", 4, 0.0, 10.0, None),
                ("on", 5, 0.0, 1.0, None),
                ("off", 6, 0.0, 1.0, None),
                ("c", 7, 0.0, 1.0, None),
                ("all", 8, 0.0, 1.0, None),
            ]
        );
        let values: Vec<Value> = marks.sliders.iter().map(|s| s.value).collect();
        assert_eq!(
            values,
            [
                Value::Number(0.5),
                Value::Number(1.0),
                Value::Number(-3.0),
                Value::Number(7.0),
                Value::Bool(true),
                Value::Bool(false),
                Value::Color([0.5, 0.25, 1.0]),
                Value::Color([0.5; 3]),
            ]
        );
        // Written values are read back, and the rest of the text stays.
        let new = [
            Value::Number(0.25),
            Value::Number(f64::from(1e-9f32)),
            Value::Number(4.0),
            Value::Number(0.0),
            Value::Bool(false),
            Value::Bool(true),
            Value::Color([0.0, 0.75, 0.1f32.into()]),
            Value::Color([1.0, 0.0, 2.0]),
        ];
        let edits = marks
            .sliders
            .iter()
            .zip(new)
            .flat_map(|(s, value)| s.edits(text, value))
            .collect();
        let written = edited(text, edits);
        assert_eq!(read(&written).sliders.iter().map(|s| s.value).collect::<Vec<_>>(), new);
        let wanted = "const a: f32 = 0.25; // slider 0..1\n\
            override gain: f32 = 1e-9;   //slider 0..4 step 0.1\n  const n: i32 = 4; // slider -5..5 step 1\n\
            const m : u32=0u; // slider 0..10\r\nconst on: bool = false; // switch\nconst off: bool = true; // slider\n\
            const c: vec3f = vec3f(0.0, 0.75, 0.1f); // color\nconst all: vec3<f32> = vec3<f32>(1.0, 0.0, 2.0); // color\n";
        assert_eq!(written, wanted);
    }

    #[test]
    fn marked_variables_are_layers() {
        let marks = read(
            "var<private> a: vec3f; // layer\n var < private > b: f32; // layer\nvar<private> c: vec4<f32>;// layer",
        );
        assert_eq!(marks.mistakes, []);
        let told: Vec<_> = marks
            .layers
            .iter()
            .map(|layer| (layer.name.as_str(), layer.numbers))
            .collect();
        assert_eq!(told, [("a", 3), ("b", 1), ("c", 4)]);
    }

    #[test]
    fn prose_and_comments_are_no_marks() {
        let text = "// slider 0..1\n/* const a: f32 = 0.5; // slider 0..1 */\nconst b: f32 = 0.5; // sliders 0..1\n\
            var<private> c: f32; // layer of paint\nconst d: f32 = 0.5; // a slider 0..1\n// const e: f32 = 1.0; // slider 0..1\n\
            let x = y; // color of the thing\n";
        assert_eq!(read(text), Marks::default());
    }

    #[test]
    fn a_mark_that_cannot_be_followed_is_told_with_its_place() {
        for (line, wanted) in [
            ("let a = 1.0; // slider 0..1", "must be a line"),
            ("const a = 1.0; // slider 0..1", "must have a type"),
            ("override a: f32; // slider 0..1", "must have a type and a value"),
            ("const a: vec2f = vec2f(1.0); // slider 0..1", "`vec2f`"),
            ("const a: f32 = B * 2.0; // slider 0..1", "`B * 2.0` must be a number"),
            ("const a: f32 = inf; // slider 0..1", "`inf` must be a number"),
            ("const a: f32 = 1.0; // slider", "must be `slider LOW..HIGH`"),
            ("const a: f32 = 1.0; // slider 1..0", "LOW below HIGH"),
            ("const a: f32 = 1.0; // slider 0..1 step 0", "STEP above 0"),
            ("const a: f32 = 1.0; // slider 0 1", "must be `slider LOW..HIGH`"),
            ("const a: i32 = 1; // slider 0..1.5", "whole"),
            ("const a: f32 = 2.0; // slider 0..1", "2.0 must be from 0 to 1"),
            ("const a: f32 = 2.0; // color", "neither a color"),
            ("const a: bool = true; // slider 0..1", "no range"),
            ("const a: vec3f = vec3f(-1.0); // color", "must be a number"),
            ("var<private> a: mat3x3f; // layer", "`mat3x3f`"),
            ("var<private> a: f32 = 1.0; // layer", "0 before each sample"),
            ("var<workgroup> a: f32; // layer", "must be a line"),
            ("const a: f32 = 1.0; // layer", "must be a line"),
        ] {
            let marks = read(&format!("// first\n  {line}\n"));
            let [told] = marks.mistakes.as_slice() else {
                panic!("{line}: {marks:?}")
            };
            assert_eq!(told.place, "a.wgsl:2:3", "{line}");
            assert!(told.message.contains(wanted), "{line}: {}", told.message);
            assert_eq!((marks.sliders.len(), marks.layers.len()), (0, 0), "{line}");
        }
    }

    #[test]
    fn values_are_rounded_to_what_the_constant_can_have() {
        let marks = read(
            "const a: f32 = 0.5; // slider 0..1\nconst n: i32 = 1; // slider -4..4\nconst b: bool = true; // slider",
        );
        let [a, n, b] = marks.sliders.as_slice() else {
            panic!("{marks:?}")
        };
        assert_eq!(a.rounded(Value::Number(0.1)), Some(Value::Number(f64::from(0.1f32))));
        assert_eq!(a.rounded(Value::Number(7.0)), Some(Value::Number(1.0)));
        assert_eq!(a.rounded(Value::Number(f64::NAN)), None);
        assert_eq!(n.rounded(Value::Number(-2.6)), Some(Value::Number(-3.0)));
        assert_eq!(n.bits(Value::Number(-3.0)), [-3i32 as u32, 0, 0, 0]);
        assert_eq!(b.rounded(Value::Number(1.0)), None);
        assert_eq!(b.bits(Value::Bool(true)), [1, 0, 0, 0]);
    }
}
