//! Rays in a form for box tests.

use super::Line;

/// A ray with precomputed values for tests against boxes.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    /// For each axis, the side of boxes that the ray enters: 0 for the lower side, 1 for the upper side.
    pub(super) near_side_index: [usize; 3],
    /// The ray's origin, shifted to pad the boxes: for tests of near sides, and of far sides.
    pub(super) origins: [[f32; 3]; 2],
    pub(super) inverse: [f32; 3],
}

impl BoxRay {
    /// Creates a ray from its origin, shifted to pad the boxes for tests of lower and of upper sides, and the
    /// reciprocals of the direction's components.
    #[inline(always)]
    pub fn new(low_origin: [f32; 3], high_origin: [f32; 3], inverse: [f32; 3]) -> BoxRay {
        let mut near_side_index = [0; 3];
        let mut origins = [low_origin, high_origin];
        for k in 0..3 {
            if inverse[k] < 0.0 {
                near_side_index[k] = 1;
                (origins[0][k], origins[1][k]) = (high_origin[k], low_origin[k]);
            }
        }
        BoxRay {
            near_side_index,
            origins,
            inverse,
        }
    }

    /// Returns the octant of the direction: bit k is set if component k is negative.
    #[inline(always)]
    pub fn octant(&self) -> usize {
        let [x, y, z] = self.near_side_index;
        x | y << 1 | z << 2
    }

    #[inline(always)]
    pub fn of(line: &Line) -> BoxRay {
        let mut values = [[0.0; 3]; 3];
        for (i, axis) in line.axes.into_iter().enumerate() {
            values[0][axis] = line.o_low[i];
            values[1][axis] = line.o_high[i];
            values[2][axis] = line.inverse[i];
        }
        let [low_origin, high_origin, inverse] = values;
        BoxRay::new(low_origin, high_origin, inverse)
    }
}
