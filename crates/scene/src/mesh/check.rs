//! Checks the rules for meshes that are created in code.

use std::fmt::Display;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{MAX_COLOR, MAX_COORDINATE, MAX_ELEMENTS, Mesh};

/// Maximum deviation of the length of a unit vector from 1.
const UNIT_TOLERANCE: f32 = 1e-3;

/// Checks all rules. The error is the first violation: field, value and rule.
pub(super) fn check(mesh: &Mesh) -> Result<(), String> {
    let vertices = mesh.positions.len();
    if mesh.triangles.is_empty() {
        return Err("triangles: must not be empty".to_owned());
    }
    for (list, count) in [("positions", vertices), ("triangles", mesh.triangles.len())] {
        if count > MAX_ELEMENTS {
            return Err(format!("{list}: {count} elements; the maximum is {MAX_ELEMENTS}"));
        }
    }
    if !mesh.center.is_finite() || mesh.center.abs().max_element() > MAX_COORDINATE {
        return Err(format!(
            "center: {} must be from -{MAX_COORDINATE:e} to {MAX_COORDINATE:e}",
            mesh.center
        ));
    }
    check_groups(mesh)?;
    check_all("triangles", &mesh.triangles, |triangle| {
        let invalid = triangle.iter().find(|vertex| **vertex as usize >= vertices)?;
        Some(format!(
            "vertex {invalid} does not exist; number of positions: {vertices}"
        ))
    })?;
    check_all("positions", &mesh.positions, |position| {
        let max_coordinate = (position.as_dvec3() + mesh.center).abs().max_element();
        let is_valid = position.is_finite() && max_coordinate <= MAX_COORDINATE;
        (!is_valid).then(|| {
            let limit = format!("{MAX_COORDINATE:e}");
            format!("{position} plus center must be from -{limit} to {limit}")
        })
    })?;
    let is_unit = |v: Vec3| (v.length() - 1.0).abs() <= UNIT_TOLERANCE;
    check_vertex_list("normals", &mesh.normals, vertices, |normal| {
        violation(is_unit(*normal), normal, "must be a unit vector")
    })?;
    check_vertex_list("uvs", &mesh.uvs, vertices, |uv| {
        violation(uv.is_finite(), uv, "must be finite")
    })?;
    for (i, uvs) in mesh.more_uvs.iter().enumerate() {
        check_vertex_list(&format!("more_uvs[{i}]"), uvs, vertices, |uv| {
            violation(uv.is_finite(), uv, "must be finite")
        })?;
    }
    let max_color = Vec4::new(MAX_COLOR, MAX_COLOR, MAX_COLOR, 1.0);
    check_vertex_list("colors", &mesh.colors, vertices, |color| {
        let is_valid = color.cmpge(Vec4::ZERO).all() && color.cmple(max_color).all();
        violation(is_valid, color, "must be from 0 to 1e6, and the opacity from 0 to 1")
    })?;
    check_vertex_list("tangents", &mesh.tangents, vertices, |tangent| {
        let is_valid = *tangent == Vec4::ZERO || is_unit(tangent.truncate()) && tangent.w.abs() == 1.0;
        violation(is_valid, tangent, "must be a unit vector with w = 1 or w = -1, or zero")
    })
}

fn check_groups(mesh: &Mesh) -> Result<(), String> {
    let (count, triangles, group_of_len) = (mesh.groups.len(), mesh.triangles.len(), mesh.group_of.len());
    if count == 0 {
        return Err("groups: must not be empty".to_owned());
    }
    if group_of_len != triangles && (group_of_len > 0 || count > 1) {
        return Err(format!(
            "group_of: the length {group_of_len} must be {triangles}, the number of triangles, or 0 if there is one group"
        ));
    }
    check_all("group_of", &mesh.group_of, |group| {
        let is_valid = (*group as usize) < count;
        (!is_valid).then(|| format!("group {group} does not exist; number of groups: {count}"))
    })
}

/// Checks a list that must be empty or have one element per vertex.
fn check_vertex_list<T: Sync>(
    name: &str,
    list: &[T],
    vertices: usize,
    rule: impl Fn(&T) -> Option<String> + Sync,
) -> Result<(), String> {
    if !list.is_empty() && list.len() != vertices {
        return Err(format!(
            "{name}: the length {} must be {vertices}, the number of positions, or 0",
            list.len()
        ));
    }
    check_all(name, list, rule)
}

/// Checks all elements. The error describes the first invalid element.
fn check_all<T: Sync>(name: &str, list: &[T], rule: impl Fn(&T) -> Option<String> + Sync) -> Result<(), String> {
    let violation_at = |(i, element): (usize, &T)| rule(element).map(|message| format!("{name}[{i}]: {message}"));
    match list.par_iter().enumerate().find_map_first(violation_at) {
        Some(message) => Err(message),
        None => Ok(()),
    }
}

fn violation(is_valid: bool, value: &impl Display, rule: &str) -> Option<String> {
    (!is_valid).then(|| format!("{value} {rule}"))
}
