//! The light samples of a block, evaluated in SIMD lanes.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::LazyLock;

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x8};
use glam::{UVec2, Vec2, Vec3};

use super::lanes::{Lanes2, Lanes3, Real, Vector2, Vector3};
use super::light::{LightSegments, segment};
use super::primitive::occludes;
use super::shadow::{SampleBlock, block_sample};
use super::slab::{box_interval, interval_hits, slabs};
use super::traversal::{Directions, MAX_SEGMENTS};
use crate::records::{GRID, ROTATED_GRID, SAMPLE_BLOCK};

/// Best instruction set of this processor.
pub static LEVEL: LazyLock<Level> = LazyLock::new(Level::new);

/// Number of SIMD lanes.
pub const LANES: usize = 8;

/// Number of lanes of the widest vectors with which directions are read.
const WIDEST: usize = 16;

/// Samples on the unit square. Unused lanes repeat the first sample.
#[derive(Clone)]
pub struct Samples {
    count: usize,
    x: [f32; MAX_SEGMENTS],
    y: [f32; MAX_SEGMENTS],
}

/// Number of blocks whose samples a thread keeps. They suffice for the blocks of 512 light samples.
const KEPT_BLOCKS: usize = 16;

/// A block, as far as its samples depend on it, and its samples.
type KeptBlock = (SampleBlock, Rc<Samples>);

thread_local! {
    /// The last samples: several functions evaluate them for the same hit and light. Samples of grids are the same for
    /// all hits.
    static KEPT: RefCell<[Option<KeptBlock>; KEPT_BLOCKS]> = RefCell::default();
}

impl Samples {
    /// Returns the samples of a block.
    pub fn of(block: SampleBlock) -> Rc<Samples> {
        let mut key = block;
        if block.pattern == GRID || block.pattern == ROTATED_GRID {
            (key.group, key.key) = (0, UVec2::ZERO); // without effect
        }
        KEPT.with_borrow_mut(|kept| {
            let kept = &mut kept[(block.first / SAMPLE_BLOCK) as usize % KEPT_BLOCKS];
            match kept {
                Some((kept_key, samples)) if *kept_key == key => Rc::clone(samples),
                _ => Rc::clone(&kept.insert((key, Rc::new(Samples::new(block)))).1),
            }
        })
    }

    fn new(block: SampleBlock) -> Samples {
        let count = block.count as usize;
        let first = block_sample(block, 0);
        let mut samples = Samples {
            count,
            x: [first.x; MAX_SEGMENTS],
            y: [first.y; MAX_SEGMENTS],
        };
        for i in 1..count {
            let sample = block_sample(block, i as u32);
            (samples.x[i], samples.y[i]) = (sample.x, sample.y);
        }
        samples
    }

    /// Writes the vectors to the samples on a light. Returned values would be copied.
    pub fn write_segments(&self, level: Level, segments: LightSegments, directions: &mut Directions) {
        directions.count = self.count;
        dispatch!(level, simd => {
            for i in (0..self.count.next_multiple_of(WIDEST)).step_by(LANES) {
                let row = |row: &[f32; MAX_SEGMENTS]| f32x8::from_slice(simd, &row[i..i + LANES]);
                let to_light: Lanes3<_> = segment(segments, Lanes2 { x: row(&self.x), y: row(&self.y) });
                for (component, row) in [to_light.x, to_light.y, to_light.z].into_iter().zip(&mut directions.components) {
                    component.store_slice(&mut row[i..i + LANES]);
                }
            }
        });
    }
}

/// Returns the directions that begin at index i.
#[inline(always)]
pub fn directions_at<S: Simd>(simd: S, directions: &Directions, i: usize) -> Lanes3<f32x8<S>> {
    let [x, y, z] = &directions.components;
    let [x, y, z] = [x, y, z].map(
        #[inline(always)]
        |row| f32x8::from_slice(simd, &row[i..i + LANES]),
    );
    Vector3::new(x, y, z)
}

/// Returns the mask of the segments from `o` that hit a box, like `interval_hits`.
pub fn box_hits(low: Vec3, high: Vec3, o: Vec3, pad: f32, directions: &Directions, t_max: f32) -> u32 {
    dispatch!(*LEVEL, simd => {
        let mut bits = 0;
        for i in (0..directions.count).step_by(LANES) {
            let d = directions_at(simd, directions, i);
            let slabs = slabs(d.broadcast(o), d, d.x.splat(pad));
            let interval = box_interval(d.broadcast(low), d.broadcast(high), slabs);
            bits |= (interval_hits(interval, d.x.splat(t_max)).to_bitmask() as u32) << i;
        }
        bits & directions.all()
    })
}

/// Returns the mask of the directions in which a primitive occludes the light, like `occludes`. `o` and the directions
/// are in the primitive's local space.
#[inline(never)] // compiled once for all kinds
pub fn occluded_directions(kind: u32, o: Vec3, directions: &Directions, levels: Vec2, t_max: f32) -> u32 {
    dispatch!(*LEVEL, simd => {
        let mut bits = 0;
        for i in (0..directions.count).step_by(LANES) {
            let d = directions_at(simd, directions, i);
            let levels = Vector2::new(d.x.splat(levels.x), d.x.splat(levels.y));
            let is_occluded = occludes(kind, d.broadcast(o), d, levels, d.x.splat(t_max));
            bits |= (is_occluded.to_bitmask() as u32) << i;
        }
        bits & directions.all()
    })
}
