//! Top-down construction of a binary BVH by the surface area heuristic (SAH), for the wide BVH.
//!
//! Splits are found by binning (Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", RT 2007), and in
//! small nodes by a sweep along each axis.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4, Vec4Swizzles as _};
use rayon::prelude::*;

use super::Aabb;
use super::wide::{SLOTS, costs};

/// Minimum number of items of a node that several threads split.
const MIN_PARALLEL_ITEMS: usize = 1 << 16;
/// Items per task of a parallel loop.
const CHUNK: usize = 1 << 14;
/// Minimum number of items of a node whose parts are built in parallel.
const MIN_JOIN_ITEMS: usize = 1 << 11;
/// Maximum number of items of a node that is split by a sweep along each axis.
const MAX_SMALL_ITEMS: usize = 8;
/// Number of bins per axis, a power of two.
const BINS: usize = 16;

/// A box and its index. The index is stored as the bits of `low.w`, which no arithmetic uses; `high.w` is 1.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct BuildItem {
    low: Vec4,
    high: Vec4,
}

impl BuildItem {
    fn new(index: usize, bounds: &Aabb) -> BuildItem {
        let is_valid = bounds.low.cmple(bounds.high).all(); // false if any bound is NaN
        let Aabb { low, high } = if is_valid {
            *bounds
        } else {
            Aabb {
                low: Vec3::ZERO,
                high: Vec3::ZERO,
            }
        };
        // Adding 0 turns -0 into 0: otherwise a minimum's bits would depend on the order of operands.
        let finite = |v: Vec3| v.clamp(Vec3::MIN, Vec3::MAX) + Vec3::ZERO;
        BuildItem {
            low: finite(low).extend(f32::from_bits(index as u32)),
            high: finite(high).extend(1.0),
        }
    }

    pub fn index(&self) -> u32 {
        self.low.w.to_bits()
    }

    pub fn bounds(&self) -> Aabb {
        Aabb {
            low: self.low.xyz(),
            high: self.high.xyz(),
        }
    }

    /// Returns twice the centroid.
    fn middle(&self) -> Vec4 {
        self.low + self.high
    }
}

/// An inner node, of at least two items.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct Inner {
    pub low: Vec3,
    pub high: Vec3,
    /// Number of items in the first part.
    pub first_size: u32,
    /// SAH cost in a wide BVH if the items may occupy up to 1, 2, .. 7 slots of the parent.
    pub costs: [f32; SLOTS - 1],
}

/// A binary BVH in depth-first order. A node of n items owns n - 1 consecutive inner nodes: itself, then the inner
/// nodes of each part.
pub struct Binary {
    pub items: Vec<BuildItem>,
    pub inner: Vec<Inner>,
}

impl Binary {
    /// Builds at most `levels` levels of inner nodes, for at most 2^`levels` boxes.
    pub fn build(boxes: &[Aabb], levels: u32, max_leaf_size: usize) -> Binary {
        let items = boxes.par_iter().enumerate().with_min_len(CHUNK);
        let mut items: Vec<BuildItem> = items.map(|(i, bounds)| BuildItem::new(i, bounds)).collect();
        let mut inner = bytemuck::zeroed_vec(boxes.len().saturating_sub(1));
        build(&mut items, &mut inner, levels, max_leaf_size);
        Binary { items, inner }
    }
}

fn build(items: &mut [BuildItem], inner: &mut [Inner], levels: u32, max_leaf_size: usize) {
    let Some((node, below)) = inner.split_first_mut() else {
        return;
    };
    let count = items.len();
    let bounds = Bounds::of(items);
    let first_size = split(items, &bounds, levels);
    let parts = items.split_at_mut(first_size);
    let inner = below.split_at_mut(first_size - 1);
    let mut build_first = || build(parts.0, inner.0, levels - 1, max_leaf_size);
    let mut build_second = || build(parts.1, inner.1, levels - 1, max_leaf_size);
    if count >= MIN_JOIN_ITEMS {
        rayon::join(build_first, build_second);
    } else {
        build_first();
        build_second();
    }
    let sides = [(&*parts.0, &*inner.0), (&*parts.1, &*inner.1)].map(|(items, inner)| costs_of(items, inner));
    let Aabb { low, high } = bounds.aabb();
    *node = Inner {
        low,
        high,
        first_size: first_size as u32,
        costs: costs(area(bounds.low, bounds.high), count, max_leaf_size, &sides),
    };
}

fn costs_of(items: &[BuildItem], inner: &[Inner]) -> [f32; SLOTS - 1] {
    match inner.first() {
        Some(node) => node.costs,
        None => [super::wide::leaf_cost(area(items[0].low, items[0].high), 1); SLOTS - 1],
    }
}

#[derive(Clone, Copy)]
struct Bounds {
    low: Vec4,
    high: Vec4,
    low_middle: Vec4,
    high_middle: Vec4,
}

impl Bounds {
    const EMPTY: Bounds = Bounds {
        low: Vec4::INFINITY,
        high: Vec4::NEG_INFINITY,
        low_middle: Vec4::INFINITY,
        high_middle: Vec4::NEG_INFINITY,
    };

    fn of_chunk(items: &[BuildItem]) -> Bounds {
        items.iter().fold(Bounds::EMPTY, |bounds, item| Bounds {
            low: bounds.low.min(item.low),
            high: bounds.high.max(item.high),
            low_middle: bounds.low_middle.min(item.middle()),
            high_middle: bounds.high_middle.max(item.middle()),
        })
    }

    fn of(items: &[BuildItem]) -> Bounds {
        if items.len() < MIN_PARALLEL_ITEMS {
            return Bounds::of_chunk(items);
        }
        items.par_chunks(CHUNK).map(Bounds::of_chunk).reduce(
            || Bounds::EMPTY,
            |a, b| Bounds {
                low: a.low.min(b.low),
                high: a.high.max(b.high),
                low_middle: a.low_middle.min(b.low_middle),
                high_middle: a.high_middle.max(b.high_middle),
            },
        )
    }

    fn aabb(&self) -> Aabb {
        Aabb {
            low: self.low.xyz(),
            high: self.high.xyz(),
        }
    }
}

/// Added to the area of every box, so that the number of nodes matters even if all boxes have zero area.
const MIN_AREA: f32 = 1e-30;

/// Returns half the surface area, clamped to finite costs.
pub fn area(low: Vec4, high: Vec4) -> f32 {
    let size = (high - low).min(Vec4::splat(1e15));
    size.x * size.y + size.y * size.z + size.z * size.x + MIN_AREA
}

/// Partitions the items into two nonempty parts; returns the size of the first part.
fn split(items: &mut [BuildItem], bounds: &Bounds, levels: u32) -> usize {
    let count = items.len();
    if count == 2 {
        return 1;
    }
    let min_levels = usize::BITS - (count - 1).leading_zeros(); // levels of a balanced tree
    let first_size = match () {
        _ if levels <= min_levels || area(bounds.low, bounds.high) < 2.0 * MIN_AREA => None,
        _ if count <= MAX_SMALL_ITEMS => split_small(items),
        _ => split_by_bins(items, bounds),
    };
    first_size.unwrap_or_else(|| split_in_half(items, bounds))
}

fn split_in_half(items: &mut [BuildItem], bounds: &Bounds) -> usize {
    let half = items.len() / 2;
    let extent = (bounds.high_middle - bounds.low_middle).xyz();
    if extent.max_element() > 0.0 {
        let axis = extent.max_position();
        let key = |item: &BuildItem| (item.middle()[axis], item.index());
        items.select_nth_unstable_by(half, |a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
        });
    }
    half
}

/// Returns the split of lowest SAH cost, among splits of the items sorted by centroid along each axis.
fn split_small(items: &mut [BuildItem]) -> Option<usize> {
    let count = items.len();
    let mut best: Option<(f32, usize, [BuildItem; MAX_SMALL_ITEMS])> = None;
    for axis in 0..3 {
        let mut sorted = [items[0]; MAX_SMALL_ITEMS];
        sorted[..count].copy_from_slice(items);
        for i in 1..count {
            let mut j = i;
            while j > 0 && sorted[j - 1].middle()[axis] > sorted[j].middle()[axis] {
                sorted.swap(j - 1, j);
                j -= 1;
            }
        }
        let mut first_costs = [0.0; MAX_SMALL_ITEMS];
        let (mut low, mut high) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        for i in 1..count {
            low = low.min(sorted[i - 1].low);
            high = high.max(sorted[i - 1].high);
            first_costs[i] = area(low, high) * i as f32;
        }
        (low, high) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
        for i in (1..count).rev() {
            low = low.min(sorted[i].low);
            high = high.max(sorted[i].high);
            let cost = first_costs[i] + area(low, high) * (count - i) as f32;
            if best.as_ref().map_or(cost < f32::INFINITY, |best| cost < best.0) {
                best = Some((cost, i, sorted));
            }
        }
    }
    let (_, first_size, sorted) = best?;
    items.copy_from_slice(&sorted[..count]);
    Some(first_size)
}

#[derive(Clone, Copy)]
struct Bin {
    low: Vec4,
    high: Vec4,
    count: u32,
}

type Bins = [[Bin; BINS]; 3];

const EMPTY_BINS: Bins = [[Bin {
    low: Vec4::INFINITY,
    high: Vec4::NEG_INFINITY,
    count: 0,
}; BINS]; 3];

/// Returns the split of lowest SAH cost between bins, or `None` if all items share a bin.
fn split_by_bins(items: &mut [BuildItem], bounds: &Bounds) -> Option<usize> {
    let low = bounds.low_middle;
    let bins_per_unit = (BINS - 1) as f32 / (bounds.high_middle - low);
    // Adding 2^23 rounds to an integer, which is then in the low bits of the mantissa.
    let bins_of = |item: &BuildItem| {
        let position = (item.middle() - low) * bins_per_unit + 8_388_608.0;
        [position.x, position.y, position.z].map(|x| x.to_bits() as usize % BINS)
    };
    let bin_items = |items: &[BuildItem]| {
        let mut bins = EMPTY_BINS;
        for item in items {
            for (bins, i) in bins.iter_mut().zip(bins_of(item)) {
                let bin = &mut bins[i];
                bin.low = bin.low.min(item.low);
                bin.high = bin.high.max(item.high);
                bin.count += 1;
            }
        }
        bins
    };
    let bins = if items.len() < MIN_PARALLEL_ITEMS {
        bin_items(items)
    } else {
        items.par_chunks(CHUNK).map(bin_items).reduce(|| EMPTY_BINS, merge_bins)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for (axis, bins) in bins.iter().enumerate() {
        let mut first_sides = [(0.0, 0); BINS]; // cost and number of items
        let (mut low, mut high, mut count) = (Vec4::INFINITY, Vec4::NEG_INFINITY, 0);
        for i in 1..BINS {
            low = low.min(bins[i - 1].low);
            high = high.max(bins[i - 1].high);
            count += bins[i - 1].count;
            first_sides[i] = (area(low, high) * count as f32, count);
        }
        (low, high, count) = (Vec4::INFINITY, Vec4::NEG_INFINITY, 0);
        for i in (1..BINS).rev() {
            low = low.min(bins[i].low);
            high = high.max(bins[i].high);
            count += bins[i].count;
            let cost = first_sides[i].0 + area(low, high) * count as f32;
            if count > 0 && first_sides[i].1 > 0 && cost < best.map_or(f32::INFINITY, |best| best.0) {
                best = Some((cost, axis, i));
            }
        }
    }
    let (_, axis, end) = best?;
    Some(partition(items, |item| bins_of(item)[axis] < end))
}

fn merge_bins(mut a: Bins, b: Bins) -> Bins {
    for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
        a.low = a.low.min(b.low);
        a.high = a.high.max(b.high);
        a.count += b.count;
    }
    a
}

/// Moves items that satisfy the predicate to the front; returns their number.
fn partition(items: &mut [BuildItem], is_first: impl Fn(&BuildItem) -> bool) -> usize {
    let mut end = 0;
    for i in 0..items.len() {
        // Without a branch, because half of the branches would be mispredicted.
        let belongs_to_front = is_first(&items[i]);
        items.swap(end, i);
        end += usize::from(belongs_to_front);
    }
    end
}
