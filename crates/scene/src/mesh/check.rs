//! Checks the rules for meshes that are created in code.

use std::fmt::Display;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{MAX_COLOR, MAX_COORDINATE, MOST, Mesh};

/// Maximum deviation of the length of a unit vector from 1.
const UNIT_TOLERANCE: f32 = 1e-3;

/// Returns the first violation as the error: field, value and rule.
pub(super) fn check(mesh: &Mesh) -> Result<(), String> {
    let vertices = mesh.positions.len();
    if mesh.triangles.is_empty() {
        return Err("triangles: must not be empty".to_owned());
    }
    for (list, count) in [("positions", vertices), ("triangles", mesh.triangles.len())] {
        if count > MOST {
            return Err(format!("{list}: {count} elements; the maximum is {MOST}"));
        }
    }
    if !mesh.center.is_finite() || mesh.center.abs().max_element() > MAX_COORDINATE {
        return Err(format!(
            "center: {} must be finite, and at most {MAX_COORDINATE:e} from 0",
            mesh.center
        ));
    }
    groups(mesh)?;
    each("triangles", &mesh.triangles, |triangle| {
        let bad = triangle.iter().find(|vertex| **vertex as usize >= vertices)?;
        Some(format!("vertex {bad} does not exist; positions has {vertices}"))
    })?;
    each("positions", &mesh.positions, |position| {
        let farthest = (position.as_dvec3() + mesh.center).abs().max_element();
        let is_good = position.is_finite() && farthest <= MAX_COORDINATE;
        (!is_good).then(|| {
            let limit = format!("{MAX_COORDINATE:e}");
            format!("{position} must be finite, and with center from -{limit} to {limit}")
        })
    })?;
    let is_unit = |v: Vec3| (v.length() - 1.0).abs() <= UNIT_TOLERANCE;
    of_vertices("normals", &mesh.normals, vertices, |normal| {
        rule(is_unit(*normal), normal, "must be a unit vector")
    })?;
    of_vertices("uvs", &mesh.uvs, vertices, |uv| {
        rule(uv.is_finite(), uv, "must be finite")
    })?;
    for (i, uvs) in mesh.more_uvs.iter().enumerate() {
        of_vertices(&format!("more_uvs[{i}]"), uvs, vertices, |uv| {
            rule(uv.is_finite(), uv, "must be finite")
        })?;
    }
    let brightest = Vec4::new(MAX_COLOR, MAX_COLOR, MAX_COLOR, 1.0);
    of_vertices("colors", &mesh.colors, vertices, |color| {
        let is_good = color.cmpge(Vec4::ZERO).all() && color.cmple(brightest).all();
        rule(is_good, color, "must be from 0 to 1e6, and its opacity from 0 to 1")
    })?;
    of_vertices("tangents", &mesh.tangents, vertices, |tangent| {
        let is_good = *tangent == Vec4::ZERO || is_unit(tangent.truncate()) && tangent.w.abs() == 1.0;
        rule(is_good, tangent, "must be a unit vector with 1 or -1, or zeros")
    })
}

fn groups(mesh: &Mesh) -> Result<(), String> {
    let (count, triangles, given) = (mesh.groups.len(), mesh.triangles.len(), mesh.group_of.len());
    if count == 0 {
        return Err("groups: must not be empty".to_owned());
    }
    if given != triangles && (given > 0 || count > 1) {
        return Err(format!(
            "group_of: {given} elements; must have one for each of {triangles} triangles, or none if there is one group"
        ));
    }
    each("group_of", &mesh.group_of, |group| {
        let is_good = (*group as usize) < count;
        (!is_good).then(|| format!("group {group} does not exist; groups has {count}"))
    })
}

/// Checks a list that must be empty or have one element per vertex.
fn of_vertices<T: Sync>(
    name: &str,
    list: &[T],
    vertices: usize,
    rule: impl Fn(&T) -> Option<String> + Sync,
) -> Result<(), String> {
    if !list.is_empty() && list.len() != vertices {
        return Err(format!(
            "{name}: {} elements; must have one for each of {vertices} positions, or none",
            list.len()
        ));
    }
    each(name, list, rule)
}

/// Checks all elements; the error is about the first invalid element.
fn each<T: Sync>(name: &str, list: &[T], rule: impl Fn(&T) -> Option<String> + Sync) -> Result<(), String> {
    let broken = |(i, element): (usize, &T)| rule(element).map(|message| format!("{name}[{i}]: {message}"));
    match list.par_iter().enumerate().find_map_first(broken) {
        Some(message) => Err(message),
        None => Ok(()),
    }
}

fn rule(is_good: bool, value: &impl Display, rule: &str) -> Option<String> {
    (!is_good).then(|| format!("{value} {rule}"))
}
