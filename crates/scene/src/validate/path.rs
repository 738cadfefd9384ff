//! Validation and warnings that are specific to the path tracer.

use super::super::{
    AlphaMode, Integrator, Principled, PrincipledDescription, Reflection, RenderDescription, Shadows, TextureKind,
    Value,
};
use super::{Checked, Color, DVec3, Material, Texture, check, cut, number};

/// Maximum number of materials in a warning.
const MAX_NAMES: usize = 8;
/// Tolerance for rounding errors in a sum of two fractions.
const ROUNDING: f64 = 1e-9;

/// Warning about `light_samples`, which the path tracer ignores.
pub(crate) const LIGHT_SAMPLES: &str =
    "render.light_samples: no effect with integrator = \"path\"; increase pixel_samples to reduce noise";

pub(super) fn needs_path(integrator: Integrator) -> Checked<()> {
    check(integrator.follows_paths(), || "needs integrator = \"path\"".to_owned())
}

/// Returns the component-wise maximum of a color or texture; `None` for images.
pub(super) fn max_color(color: &Color, textures: &[Texture]) -> Option<DVec3> {
    match *color {
        Color::Plain(color) => Some(color),
        Color::Texture(i) => match textures[i].kind {
            TextureKind::Constant(color) => Some(color),
            TextureKind::Checker { even, odd } => Some(even.max(odd)),
            TextureKind::Lines { cell, line, .. } => Some(cell.max(line)),
            TextureKind::Image { .. } => None,
        },
    }
}

/// Returns warnings about values that the path tracer ignores or changes.
pub(super) fn notes(
    (render, integrator): (&RenderDescription, Integrator),
    (names, materials): (&[String], &[Material]),
    textures: &[Texture],
) -> Vec<String> {
    if !integrator.follows_paths() {
        return Vec::new();
    }
    let mut notes = Vec::new();
    if render.ambient != DVec3::ZERO {
        notes.push("render.ambient: no effect with integrator = \"path\", which computes indirect light".to_owned());
    }
    if render.shadows == Shadows::Transparent {
        let rule = "no effect with integrator = \"path\", which traces light through glass";
        notes.push(format!("render.shadows: {rule}"));
    }
    if render.light_samples != RenderDescription::default().light_samples {
        notes.push(LIGHT_SAMPLES.to_owned());
    }
    notes.extend(energy_note(names, materials, textures));
    notes.extend(alpha_note(names, materials));
    notes.extend(cutoff_note(names, materials));
    notes
}

/// Returns a warning about Phong materials that do not conserve energy.
fn energy_note(names: &[String], materials: &[Material], textures: &[Texture]) -> Option<String> {
    let reflectance = |material: &Material| {
        let Reflection::Phong { diffuse, specular, .. } = &material.reflection else {
            return None;
        };
        let reflectance = (max_color(diffuse, textures)? + max_color(specular, textures)?).max_element();
        (reflectance > 1.0 + ROUNDING).then_some(reflectance)
    };
    let bright: Vec<(&String, f64)> = (names.iter().zip(materials))
        .filter_map(|(name, material)| Some((name, reflectance(material)?)))
        .collect();
    // Rounded to hundredths, because sums such as 0.7 + 0.4 have many digits.
    let shown = bright.iter().map(|(name, reflectance)| {
        let reflectance = number(((reflectance - ROUNDING) * 100.0).ceil() / 100.0);
        format!("{:?} ({reflectance})", cut(name))
    });
    let list = join_limited(shown)?;
    Some(format!(
        "materials: diffuse + specular are scaled down to 1 with integrator = \"path\", which conserves energy: {list}"
    ))
}

fn alpha_note(names: &[String], materials: &[Material]) -> Option<String> {
    let is_unused = |principled: &Principled| {
        principled.alpha_mode == AlphaMode::Opaque && !matches!(principled.alpha, Value::Plain(1.0))
    };
    let rule = "has no effect without alpha_mode = \"mask\" or \"blend\"";
    Some(format!(
        "materials: alpha {rule}; affected: {}",
        matching_names(names, materials, is_unused)?
    ))
}

fn cutoff_note(names: &[String], materials: &[Material]) -> Option<String> {
    let default = PrincipledDescription::default().alpha_cutoff;
    let is_unused =
        |principled: &Principled| principled.alpha_mode != AlphaMode::Mask && principled.alpha_cutoff != default;
    let rule = "has no effect without alpha_mode = \"mask\"";
    Some(format!(
        "materials: alpha_cutoff {rule}; affected: {}",
        matching_names(names, materials, is_unused)?
    ))
}

/// Returns the names of the `principled` materials that satisfy `predicate`.
fn matching_names(names: &[String], materials: &[Material], predicate: impl Fn(&Principled) -> bool) -> Option<String> {
    let found = (names.iter().zip(materials)).filter(|(_, material)| match &material.reflection {
        Reflection::Principled(principled) => predicate(principled),
        _ => false,
    });
    join_limited(found.map(|(name, _)| format!("{:?}", cut(name))))
}

/// Joins names as `a, b and c`, truncated if there are many; `None` if there are no names.
fn join_limited(mut names: impl Iterator<Item = String>) -> Option<String> {
    let mut shown: Vec<String> = names.by_ref().take(MAX_NAMES).collect();
    match names.count() {
        0 => {}
        more => shown.push(format!("{more} more")),
    }
    let last = shown.pop()?;
    Some(match shown.is_empty() {
        true => last,
        false => format!("{} and {last}", shown.join(", ")),
    })
}

#[cfg(test)]
mod tests;
