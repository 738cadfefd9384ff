//! A shadow ray with the radiance that it carries, traced after the shading of a path's hit.

use glam::{UVec2, Vec2, Vec3};

use super::surface::Surface;

/// A segment from a surface towards a light sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowRay {
    /// Start of the segment.
    pub origin: Vec3,
    /// Direction of the segment, which ends at `origin + t_max * to_light`.
    pub to_light: Vec3,
    pub t_max: f32,
    /// Primitives at the start that do not occlude, as in [`Surface`].
    pub exclude_front: UVec2,
    pub exclude_back: UVec2,
    /// Primitive at the end that does not occlude.
    pub target_prim: u32,
    /// Radiance added to the path if the segment is not occluded.
    pub contribution: Vec3,
    /// Number of bounces of the path that the contribution arrives along, as in `add_radiance`.
    pub bounces: u32,
}

impl ShadowRay {
    /// Returns a surface at the start of the segment. Only the fields that occlusion queries read are set.
    #[inline(always)]
    pub fn surface(&self) -> Surface {
        Surface {
            position: Vec3::ZERO,
            normal: Vec3::ZERO,
            smooth_normal: Vec3::ZERO,
            shading_normal: Vec3::ZERO,
            wo: Vec3::ZERO,
            ray_origin: self.origin,
            terminator_offset: Vec3::ZERO,
            side: 0.0,
            exclude_front: self.exclude_front,
            exclude_back: self.exclude_back,
            uv: Vec2::ZERO,
            du: Vec3::ZERO,
            dv: Vec3::ZERO,
        }
    }
}
