//! Kinds of values of scene files: JSON schemas independent of the Rust types. Fields of descriptions refer to kinds,
//! as in `#[schemars(with = "Length")]`, and import this module with `*`. Only the test that generates the schema needs
//! it; `no_kinds.rs` replaces it in other builds.

use std::borrow::Cow;

pub(crate) use schemars::JsonSchema;
use schemars::{Schema, SchemaGenerator};
use serde_json::{Value, json};

use crate::limits::*;
use crate::schema::TITLE_SEPARATOR;
use crate::{MetalIndex, ViewSettings};

const COORDINATES: (f64, f64) = (-MAX_COORDINATE, MAX_COORDINATE);

/// Defines kinds by name, label and schema.
macro_rules! kinds {
    ($($name:ident, $label:literal, $schema:expr;)+) => { $(
        pub(crate) struct $name;

        impl JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                kind($label, $schema)
            }
        }
    )+ };
}

kinds! {
    Point, "a point in scene units, three numbers", list(3, number(COORDINATES));
    Vector, "a direction, three numbers that are not all 0", direction();
    Points3, "three points in scene units", list(3, list(3, number(COORDINATES)));
    Points4, "four points in scene units", list(4, list(3, number(COORDINATES)));
    Length, "a length in scene units", number(LENGTHS);
    Size, "two lengths in scene units", list(2, number(LENGTHS));
    Rgb, "linear red, green and blue", list(3, number(COLORS));
    FractionRgb, "linear red, green and blue", list(3, number(FRACTIONS));
    Fraction, "", number(FRACTIONS);
    Degrees, "in degrees", number(ROTATIONS);
    Angles, "three angles in degrees", list(3, number(ROTATIONS));

    Pixels, "in pixels", integer(1, MAX_COUNT);
    Count, "a whole number", integer(1, MAX_COUNT);
    MaxSamples, "a whole number", integer(MIN_ADAPTIVE_SAMPLES, MAX_COUNT);
    Stops, "in stops", number((-ViewSettings::MAX_STOPS, ViewSettings::MAX_STOPS));
    Depth, "a whole number", integer(0, MAX_DEPTH);
    Seed, "a whole number", integer(0, u32::MAX);
    Clamp, "", number(CLAMPS);
    ShadowEpsilon, "", number(SHADOW_EPSILONS);
    FilterRadius, "in pixels", number(FILTER_RADII);

    FrameNumber, "a frame", number(FRAMES);
    Fov, "in degrees", number(FOVS);
    Aperture, "a length in scene units", number(APERTURES);
    FNumber, "", number(F_NUMBERS);
    Blades, "a whole number", blades();

    Shininess, "", number(SHININESS);
    Ior, "", number(IORS);
    PrincipledIor, "", number(PRINCIPLED_IORS);
    Etas, "for red, green and blue", list(3, number(ETAS));
    Ks, "for red, green and blue", list(3, number(KS));
    Metal, "a metal's name", names(MetalIndex::names());
    Absorption, "for red, green and blue, for each scene unit", list(3, number(ABSORPTIONS));
    Thickness, "in scene units", number(THICKNESSES);
    AttenuationDistance, "in scene units", number(ATTENUATION_DISTANCES);

    UvScale, "two numbers", list(2, scale());
    UvOffset, "two numbers", list(2, number(OFFSETS));
    LineWidth, "above 0 and below 1", open_range(LINE_WIDTHS);
    Anisotropy, "", number(ANISOTROPIES);
    Factors, "four numbers", list(4, number(FACTORS));
    UvSet, "a whole number", integer(0, UV_SETS - 1);
    Strength, "", number(STRENGTHS);

    ConeAngle, "in degrees", number(CONES);
    InnerAngle, "in degrees", number((0.0, CONES.1));
    EnvironmentScale, "", number(ENVIRONMENT_SCALES);
    Elevation, "in degrees", number(ELEVATIONS);
    Turbidity, "", number(TURBIDITIES);
    Seconds, "in seconds", number(TIMES);

    Factor, "", scale();
    Factor3, "three numbers", list(3, scale());
    Matrix, "three rows of four numbers", matrix();
    ListIndex, "a number", integer(0, u32::MAX);
}

/// The names of [`ViewTransform`](crate::ViewTransform), with their descriptions.
#[derive(JsonSchema)]
#[schemars(inline)]
#[expect(dead_code, reason = "only the schema of the type is used")]
pub(crate) enum ViewTransformName {
    /// Clamps to 0 ... 1, then applies gamma 1/2.2.
    #[schemars(rename = "gamma22")]
    Gamma22,
    /// Clamps to 0 ... 1, then applies the sRGB curve.
    #[schemars(rename = "srgb")]
    Srgb,
    /// AgX without a look: desaturates bright colors gradually, like film.
    #[schemars(rename = "agx")]
    Agx,
    /// Khronos PBR Neutral: keeps colors up to a brightness, and compresses brighter colors.
    #[schemars(rename = "khronos-pbr-neutral")]
    KhronosPbrNeutral,
}

/// A plain color with components from 0 to 1, or a texture.
pub(crate) struct FractionColor;

impl JsonSchema for FractionColor {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "FractionColor".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = generator.subschema_for::<crate::ColorDescription>();
        let rgb = generator.subschema_for::<FractionRgb>().to_value();
        if let Some(Value::Array(alternatives)) = schema.get_mut("anyOf")
            && let Some(plain) = alternatives.first_mut()
        {
            *plain = rgb;
        }
        copy_plain_title(&mut schema);
        schema
    }
}

/// Sets the title of a key that accepts a plain value or a texture: the label of the plain value, followed by ", or a
/// texture", and the range of the plain value.
pub(crate) fn copy_plain_title(schema: &mut Schema) {
    let plain = schema
        .get("anyOf")
        .and_then(|alternatives| alternatives.get(0)?.get("title"));
    if let Some(title) = plain.and_then(Value::as_str) {
        let title = title.replacen(TITLE_SEPARATOR, &format!(", or a texture{TITLE_SEPARATOR}"), 1);
        schema.insert("title".to_owned(), Value::String(title));
    }
}

/// Adds a title with the label and the range of the numbers to a schema.
fn kind(label: &str, schema: Value) -> Schema {
    let mut schema: Schema = schema.try_into().unwrap_or_default();
    let mut inner = schema.as_value();
    while let Some(items) = inner.get("items") {
        inner = items;
    }
    let range = range(inner);
    let title = match range {
        Some(range) => format!("{label}{TITLE_SEPARATOR}{range}"),
        None => label.to_owned(),
    };
    schema.insert("title".to_owned(), Value::String(title));
    schema
}

/// Returns the range of a schema, such as `1e-9 to 1e9`; several ranges are joined by "or".
fn range(schema: &Value) -> Option<String> {
    if let Some(alternatives) = schema.get("anyOf").and_then(Value::as_array) {
        let ranges: Option<Vec<String>> = alternatives.iter().map(range).collect();
        return Some(ranges?.join(" or "));
    }
    if let Some(constant) = schema.get("const") {
        return Some(constant.to_string());
    }
    let [low, high] = ["minimum", "maximum"].map(|keyword| schema.get(keyword).and_then(Value::as_f64));
    Some(format!("{} to {}", short_number(low?), short_number(high?)))
}

fn short_number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e6).contains(&x.abs()) || x == f64::from(u32::MAX) {
        x.to_string()
    } else {
        format!("{x:e}")
    }
}

fn number((low, high): (f64, f64)) -> Value {
    json!({ "type": "number", "minimum": low, "maximum": high })
}

fn open_range((low, high): (f64, f64)) -> Value {
    json!({ "type": "number", "exclusiveMinimum": low, "exclusiveMaximum": high })
}

fn integer(low: u32, high: u32) -> Value {
    json!({ "type": "integer", "minimum": low, "maximum": high })
}

fn list(count: usize, items: Value) -> Value {
    json!({ "type": "array", "items": items, "minItems": count, "maxItems": count })
}

fn direction() -> Value {
    let mut schema = list(3, number(COORDINATES));
    schema["contains"] = json!({ "not": { "const": 0 } });
    schema
}

fn names(names: impl Iterator<Item = &'static str>) -> Value {
    json!({ "type": "string", "enum": names.collect::<Vec<_>>() })
}

fn blades() -> Value {
    let (low, high) = BLADES;
    json!({ "type": "integer", "anyOf": [{ "const": 0 }, { "minimum": low, "maximum": high }] })
}

fn scale() -> Value {
    let (low, high) = SCALES;
    json!({ "type": "number", "anyOf": [{ "minimum": low, "maximum": high }, { "minimum": -high, "maximum": -low }] })
}

/// A matrix of three rows and an optional fourth row.
fn matrix() -> Value {
    let mut schema = list(3, list(4, number(COORDINATES)));
    schema["maxItems"] = json!(4);
    schema
}
