//! Validation of lights.

use glam::DVec3;

use super::super::limits::{CONES, LENGTHS};
use super::super::{Light, LightDescription, SpotLightDescription};
use super::shape::rectangle;
use super::{At, Checked, Problem, between, check, color, number, point, show, unit};

pub(in super::super) fn light(description: &LightDescription) -> Checked<Light> {
    Ok(match description {
        LightDescription::Spot(light) => return spot(light),
        LightDescription::Rectangle(light) => Light::Rectangle {
            rectangle: rectangle(light.center, light.size, light.normal, light.tangent)?,
            color: color(light.color).at("color")?,
            visible: light.visible,
        },
        LightDescription::Point(light) => Light::Point {
            position: point(light.position).at("position")?,
            color: color(light.color).at("color")?,
        },
        LightDescription::Directional(light) => Light::Directional {
            direction: unit(light.direction).at("direction")?,
            color: color(light.color).at("color")?,
        },
    })
}

fn spot(light: &SpotLightDescription) -> Checked<Light> {
    let position = point(light.position).at("position")?;
    let direction = direction(light, position)?;
    let cone = between(light.cone_angle, CONES).at("cone_angle")?;
    let inner = light.inner_angle;
    check((0.0..=cone).contains(&inner), || {
        let [inner, cone] = [inner, cone].map(number);
        format!("{inner} must be from 0 to cone_angle, {cone}")
    })
    .at("inner_angle")?;
    Ok(Light::Spot {
        position,
        direction,
        color: color(light.color).at("color")?,
        cone: cone.to_radians(),
        inner: inner.to_radians(),
    })
}

/// Returns the direction of a spot light, from `direction` or `look_at`.
fn direction(light: &SpotLightDescription, position: DVec3) -> Checked<DVec3> {
    match (light.direction, light.look_at) {
        (Some(direction), None) => unit(direction).at("direction"),
        (None, Some(target)) => {
            let axis = point(target).at("look_at")? - position;
            check(axis.length() >= LENGTHS.0, || {
                let (target, min) = (show(target), number(LENGTHS.0));
                format!("{target} must be at least {min} away from the light")
            })
            .at("look_at")?;
            Ok(axis.normalize())
        }
        (Some(_), Some(_)) => Err(Problem::new("cannot be combined with look_at; remove one")).at("direction"),
        (None, None) => Err(Problem::predicate("is missing; set direction or look_at")).at("direction"),
    }
}

#[cfg(test)]
mod tests;
