//! Order of primitives: first those outside of the BVH, by kind and by whether they can cast a shadow.

use super::shadow_casters::{material_casts_shadow, shadow_caster_flags};
use super::{MAX_LINEAR_PRIMITIVES, PLANE, Primitive};
use wgray_scene::Scene;

/// Primitives in order. The flag is false if a primitive is known to cast no shadow.
pub struct SortedPrimitives {
    all: Vec<(Primitive, bool)>,
    /// Number of primitives outside of the BVH.
    linear_count: usize,
}

impl SortedPrimitives {
    /// Sorts primitives. More than [`MAX_LINEAR_PRIMITIVES`] bounded primitives are in the BVH.
    pub fn of(scene: &Scene, primitives: Vec<Primitive>) -> SortedPrimitives {
        let bounded = primitives.iter().filter(|primitive| primitive.kind != PLANE).count();
        let is_in_bvh = |primitive: &Primitive| bounded > MAX_LINEAR_PRIMITIVES && primitive.kind != PLANE;
        let (in_bvh, linear): (Vec<Primitive>, Vec<Primitive>) = primitives.into_iter().partition(is_in_bvh);
        let casts = shadow_caster_flags(scene, &linear);
        let mut all: Vec<(Primitive, bool)> = linear.into_iter().zip(casts).collect();
        let linear_count = all.len();
        all.extend(
            in_bvh
                .into_iter()
                .map(|primitive| (primitive, material_casts_shadow(scene, &primitive))),
        );
        all[..linear_count].sort_by_key(|(primitive, casts)| (primitive.kind, !casts));
        all[linear_count..].sort_by_key(|(primitive, casts)| (primitive.kind, !casts));
        SortedPrimitives { all, linear_count }
    }

    pub fn all(&self) -> &[(Primitive, bool)] {
        &self.all
    }

    pub fn linear(&self) -> &[(Primitive, bool)] {
        &self.all[..self.linear_count]
    }

    /// Returns the primitives in the BVH, with indices, and flags that are true if a primitive can cast a shadow.
    pub fn in_bvh(&self) -> Vec<(u32, &Primitive, bool)> {
        let indices = self.linear_count as u32..;
        let in_bvh = indices.zip(&self.all[self.linear_count..]);
        in_bvh.map(|(i, (primitive, casts))| (i, primitive, *casts)).collect()
    }

    pub fn into_primitives(self) -> Vec<Primitive> {
        self.all.into_iter().map(|(primitive, _)| primitive).collect()
    }
}
