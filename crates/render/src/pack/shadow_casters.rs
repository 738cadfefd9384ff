//! Selection of primitives that can cast shadows. A flat primitive, such as a wall of a room, casts no shadow if all
//! shapes and lights are on one side.

use glam::DVec3;

use super::{MAX_LINEAR_PRIMITIVES, Primitive};
use wgray_scene::{Geometry, Light, Reflection, Scene, Shadows};
use wgray_trace::cpu::primitive::is_solid;

/// Maximum distance at which a point counts as on a plane, relative to the coordinates, because the record of the plane
/// is rounded.
const TOLERANCE: f64 = 1e-6;

/// Returns a flag for each primitive outside of the BVH: false if it cannot occlude any light. This holds for a flat
/// primitive if all shapes and lights are on one side of its plane, for glass without shadows, and, with `phong`, for
/// the rectangle of an area light. With more than [`MAX_LINEAR_PRIMITIVES`] primitives or an environment map, the
/// planes are not tested.
pub fn shadow_caster_flags(scene: &Scene, primitives: &[Primitive]) -> Vec<bool> {
    let is_tested = primitives.len() <= MAX_LINEAR_PRIMITIVES && !has_environment_map(scene);
    let casts =
        |p: &Primitive| material_casts_shadow(scene, p) && (!is_tested || is_solid(p.kind) || has_both_sides(scene, p));
    primitives.iter().map(casts).collect()
}

/// Returns true if a primitive's material casts shadows.
pub fn material_casts_shadow(scene: &Scene, primitive: &Primitive) -> bool {
    match scene.shapes.get(primitive.shape as usize) {
        Some(shape) => casts_shadow(scene, shape.material),
        // The primitive of an area light. With `path`, it occludes light from behind.
        None => scene.render.integrator.needs_emitters(),
    }
}

pub fn casts_shadow(scene: &Scene, material: usize) -> bool {
    let is_glass = matches!(scene.materials[material].reflection, Reflection::Glass { .. });
    scene.render.shadows == Shadows::Opaque || !is_glass
}

/// Returns true for an environment map. Environment maps light both sides of every plane.
fn has_environment_map(scene: &Scene) -> bool {
    scene
        .environment
        .as_ref()
        .is_some_and(|environment| environment.image.is_some())
}

/// Returns true if shapes or lights lie on both sides of a flat primitive's plane.
fn has_both_sides(scene: &Scene, primitive: &Primitive) -> bool {
    let normal = primitive.z.as_dvec3().normalize();
    let center = primitive.anchor.as_dvec3();
    let (mut below, mut above) = (false, false);
    let mut add_height = |height: f64, size: f64| {
        below |= height < -TOLERANCE * size;
        above |= height > TOLERANCE * size;
        below && above
    };
    let mut add_point = |p: DVec3| add_height((p - center).dot(normal), p.abs().max(center.abs()).max_element());
    let found_by_lights = scene.lights.iter().any(|light| match light {
        Light::Rectangle { rectangle, .. } => rectangle.corners().into_iter().any(&mut add_point),
        Light::Point { position, .. } | Light::Spot { position, .. } => add_point(*position),
        Light::Directional { .. } => false,
    });
    let found_by_shapes = found_by_lights
        || scene.shapes.iter().any(|shape| {
            let mut found = false;
            shape.geometry.each_extreme(normal, |p| found |= add_point(p));
            found
        });
    // Directional lights and planes extend to infinity, so only their directions are tested.
    let found_by_directions = found_by_shapes
        || scene.lights.iter().any(|light| match light {
            Light::Directional { direction, .. } => add_height(-direction.dot(normal), 1.0),
            _ => false,
        });
    found_by_directions
        || scene.shapes.iter().any(|shape| match shape.geometry {
            Geometry::Plane { tangent, bitangent, .. } => [tangent, bitangent, -tangent, -bitangent]
                .into_iter()
                .any(|direction| add_height(direction.dot(normal), 1.0)),
            _ => false,
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pack::pack_shapes;
    use wgray_scene::Description;

    /// Returns a flag for each primitive: true if it can cast a shadow.
    fn casters(shapes: &str) -> Vec<bool> {
        let text = format!(
            "image = {{ width = 4, height = 4 }}\ncamera = {{ position = [0, -9, 1], look_at = [0, 0, 0], fov = 45 }}\n\
             materials.m = {{ type = 'phong', color = [1, 1, 1] }}\n{shapes}"
        );
        let scene = Description::parse(&text, "s.toml").unwrap().validate().unwrap();
        shadow_caster_flags(&scene, &pack_shapes(&scene))
    }

    const FLOOR: &str = "[[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [1, 2, 3]\nnormal = [0.6, 0, 0.8]\n";

    fn ball(height: f64) -> String {
        let center = [1.0 + 0.6 * height, 2.0, 3.0 + 0.8 * height];
        format!("[[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = {center:?}\nradius = 1\n")
    }

    fn light(kind: &str, key: &str, value: [f64; 3]) -> String {
        format!("[[lights]]\ntype = '{kind}'\n{key} = {value:?}\ncolor = [1, 1, 1]\n")
    }

    #[test]
    fn a_floor_below_all_geometry_and_lights_casts_no_shadow() {
        assert_eq!(casters(FLOOR), [false]);
        assert_eq!(casters(&(ball(1.0) + FLOOR)), [true, false]);
        let above =
            light("point", "position", [7.0, 2.0, 11.0]) + &light("directional", "direction", [-0.6, 0.0, -0.8]);
        assert_eq!(casters(&(above + &ball(2.0) + FLOOR)), [true, false]);
    }

    #[test]
    fn a_floor_with_geometry_or_lights_below_casts_a_shadow() {
        assert_eq!(
            casters(&(ball(0.99) + FLOOR)),
            [true, true],
            "a sphere partly below the floor"
        );
        let below = light("point", "position", [0.0, 2.0, 2.0]);
        assert_eq!(casters(&(below + &ball(2.0) + FLOOR)), [true, true]);
        let upwards = light("directional", "direction", [0.6, 0.0, 0.8]);
        assert_eq!(casters(&(upwards + &ball(2.0) + FLOOR)), [true, true]);
        let slope = FLOOR.replace("0.8", "-0.8");
        assert_eq!(casters(&(slope + FLOOR)), [true, true], "two intersecting planes");
    }

    #[test]
    fn the_walls_of_a_room_cast_no_shadows() {
        let walls: String = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
            .map(|normal| {
                let center = normal.map(|x| -2 * x);
                format!(
                    "[[shapes]]\ntype = 'rectangle'\nmaterial = 'm'\ncenter = {center:?}\nnormal = {normal:?}\nsize = [4, 4]\n"
                )
            })
            .concat();
        let inside = "[[shapes]]\ntype = 'triangle'\nmaterial = 'm'\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n";
        assert_eq!(casters(&walls), [false; 6]);
        assert_eq!(
            casters(&(walls + inside)),
            [false, false, false, false, false, false, true]
        );
    }
}
