//! Conversion of numbers and vectors between the records of several paths and SIMD lanes.

use fearless_simd::f32x8;
use fearless_simd::prelude::*;
use glam::Vec3;

use super::super::bits::bits_of;
use super::super::lanes::Lanes3;

/// Number of paths or rays processed at a time.
pub const LANES: usize = 8;

/// One number per path.
pub type Row = [f32; LANES];
/// One vector per path, stored as rows of x, y and z.
pub type Rows3 = [Row; 3];
/// One number per lane.
pub type F<S> = f32x8<S>;
/// One vector per lane.
pub type V<S> = Lanes3<f32x8<S>>;

/// Stores `v` as the vector of a lane.
#[inline(always)]
pub fn set3(rows: &mut Rows3, lane: usize, v: Vec3) {
    rows[0][lane] = v.x;
    rows[1][lane] = v.y;
    rows[2][lane] = v.z;
}

/// Returns the vector of a lane.
#[inline(always)]
pub fn get3(rows: &Rows3, lane: usize) -> Vec3 {
    Vec3::new(rows[0][lane], rows[1][lane], rows[2][lane])
}

#[inline(always)]
pub fn load3<S: Simd>(simd: S, rows: &Rows3) -> V<S> {
    Lanes3 {
        x: f32x8::simd_from(simd, rows[0]),
        y: f32x8::simd_from(simd, rows[1]),
        z: f32x8::simd_from(simd, rows[2]),
    }
}

#[inline(always)]
pub fn store3<S: Simd>(v: V<S>) -> Rows3 {
    [v.x.into(), v.y.into(), v.z.into()]
}

/// Returns `v` in all lanes.
#[inline(always)]
pub fn splat3<S: Simd>(simd: S, v: Vec3) -> V<S> {
    let [x, y, z] = v.to_array();
    Lanes3 {
        x: SimdBase::splat(simd, x),
        y: SimdBase::splat(simd, y),
        z: SimdBase::splat(simd, z),
    }
}

/// Returns the numbers of the lanes of a mask.
#[inline(always)]
pub fn lanes_of(mask: u64) -> impl Iterator<Item = usize> {
    bits_of(mask as u32)
}

/// Returns the mask of the first `count` lanes.
#[inline(always)]
pub fn lane_mask(count: usize) -> u64 {
    (1 << count) - 1
}
