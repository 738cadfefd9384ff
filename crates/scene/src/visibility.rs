//! Warnings about scenes in which nothing can be visible.

use glam::DVec3;

use super::{Bounds, Camera, Color, Geometry, Light, Projection, Reflection, Scene, Shape};

impl Scene {
    /// Returns warnings if the scene certainly has no light, or no geometry in view. Other scenes may still render
    /// black, for example because no light reaches the visible surfaces.
    pub fn visibility_warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if !self.has_geometry_in_view() && !self.shows_environment_only() {
            warnings.push(match self.shapes.is_empty() {
                true => "the scene has no shapes; the image shows only the background".to_owned(),
                false => "no shape is in view of the camera; the image shows only the background \
                          (check camera.position and camera.look_at)"
                    .to_owned(),
            });
        }
        if !self.shapes.is_empty() && !self.has_light() {
            warnings.push("the scene has no light, emission or environment; every surface renders black".to_owned());
        }
        let is_dark = self.render.integrator.follows_paths() && self.render.max_depth == 0;
        if is_dark && !self.shapes.is_empty() && self.has_light() && !self.has_emission() {
            warnings.push(
                "render.max_depth is 0, so only emitters are visible, and no shape emits light; 1 adds direct light"
                    .to_owned(),
            );
        }
        warnings
    }

    fn has_emission(&self) -> bool {
        let mut materials = self.shapes.iter().flat_map(materials).map(|i| &self.materials[i]);
        materials.any(|material| !is_black(&material.emission))
    }

    /// Returns true if any light can arrive at a surface or leave a surface.
    fn has_light(&self) -> bool {
        let color = |light: &Light| match light {
            Light::Rectangle { color, .. }
            | Light::Point { color, .. }
            | Light::Directional { color, .. }
            | Light::Spot { color, .. } => *color,
        };
        if self.lights.iter().any(|light| color(light) != DVec3::ZERO) || self.render.background != DVec3::ZERO {
            return true;
        }
        if !self.render.integrator.follows_paths() {
            let is_ambient = |reflection: &Reflection| match reflection {
                Reflection::Phong { ambient, .. } => !is_black(ambient),
                _ => false,
            };
            let mut materials = self.shapes.iter().flat_map(materials).map(|i| &self.materials[i]);
            return self.render.ambient != DVec3::ZERO && materials.any(|material| is_ambient(&material.reflection));
        }
        let environment = self.environment.as_ref();
        let is_lit = environment.is_some_and(|environment| {
            let has_light_map = environment.image.as_ref().is_some_and(|image| image.scale != 0.0);
            has_light_map || environment.color != DVec3::ZERO
        });
        is_lit || self.has_emission()
    }

    /// Returns true if the scene consists only of an environment map, which may be intentional.
    fn shows_environment_only(&self) -> bool {
        let environment = self.environment.as_ref();
        self.shapes.is_empty() && environment.is_some_and(|environment| environment.image.is_some())
    }

    /// Returns false only if the camera certainly sees no shape and no area light.
    fn has_geometry_in_view(&self) -> bool {
        let is_visible = |shape: &&Shape| materials(shape).any(|i| self.materials[i].visible);
        let mut shapes = self.shapes.iter().filter(is_visible).peekable();
        let mut area_lights = (self.lights.iter())
            .filter_map(|light| match light {
                Light::Rectangle {
                    rectangle,
                    visible: true,
                    ..
                } => Geometry::Rectangle(*rectangle).bounds(),
                _ => None,
            })
            .peekable();
        let Some(frustum) = Frustum::of(self).filter(|_| self.camera_path.is_none()) else {
            return shapes.peek().is_some() || area_lights.peek().is_some();
        };
        area_lights.any(|bounds| frustum.may_see(bounds))
            || shapes.any(|shape| match shape.geometry.bounds() {
                Some(bounds) => frustum.may_see(bounds),
                None => matches!(shape.geometry, Geometry::Plane { .. }), // infinite
            })
    }
}

fn materials(shape: &Shape) -> impl Iterator<Item = usize> {
    let groups = match &shape.geometry {
        Geometry::Mesh { materials, .. } => materials.as_slice(),
        _ => std::slice::from_ref(&shape.material),
    };
    groups.iter().copied()
}

fn is_black(color: &Color) -> bool {
    *color == Color::Plain(DVec3::ZERO)
}

/// The points `p` with `normal . (p - position) + offset >= 0`, where `position` is the position of the [`Frustum`].
struct HalfSpace {
    normal: DVec3,
    offset: f64,
}

/// Half-spaces whose intersection contains everything that a camera sees.
struct Frustum {
    position: DVec3,
    sides: [HalfSpace; 5],
}

impl Frustum {
    /// Returns the camera's frustum; `None` for a panorama.
    fn of(scene: &Scene) -> Option<Frustum> {
        let Camera {
            position,
            right,
            up,
            forward,
            projection,
            lens,
            ..
        } = scene.camera;
        let (width, height) = (f64::from(scene.width), f64::from(scene.height));
        // The filter reaches beyond the image by its radius; one more pixel covers rounding errors.
        let margin = 2.0 * (scene.render.filter.radius + 1.0);
        let extents = |half: f64| (half * (width + margin) / height, half * (height + margin) / height);
        // At depth d, a ray through a lens with radius r and focus distance f is at most r (1 + d / f) from the central
        // ray.
        let (radius, spread) = lens.map_or((0.0, 0.0), |lens| (lens.radius, lens.radius / lens.focus));
        let ((x, y), is_perspective) = match projection {
            Projection::Perspective { fov } => (extents((fov / 2.0).tan()), true),
            Projection::Orthographic { height } => (extents(height / 2.0), false),
            Projection::Panorama => return None,
        };
        let side = |direction: DVec3, extent: f64| match is_perspective {
            true => HalfSpace {
                normal: forward * (extent + spread) + direction,
                offset: radius,
            },
            false => HalfSpace {
                normal: direction,
                offset: extent,
            },
        };
        let front = HalfSpace {
            normal: forward,
            offset: 0.0,
        };
        Some(Frustum {
            position,
            sides: [front, side(right, x), side(-right, x), side(up, y), side(-up, y)],
        })
    }

    /// Returns false only if the box is outside a half-space.
    fn may_see(&self, (low, high): Bounds) -> bool {
        let corners = [low - self.position, high - self.position];
        let tolerance = 1e-6 * (corners[0].abs() + corners[1].abs()).element_sum();
        self.sides.iter().all(|side| {
            let terms = side.normal.to_array().into_iter().enumerate();
            let farthest: f64 = terms.map(|(i, n)| (n * corners[0][i]).max(n * corners[1][i])).sum();
            farthest + side.offset >= -tolerance
        })
    }
}

#[cfg(test)]
mod tests;
