//! Tests of the BVH builder: node invariants for random, degenerate and extreme boxes.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::Vec3;

use super::binary::{Binary, Inner};
use super::{Aabb, BUILD_MAX_DEPTH, DecodedOnce, MAX_LEAF_SIZE, Node, Tree, build};
use crate::cases;

/// Numbers from 0 to 1.
struct Random(u64);

impl Random {
    fn number(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 16_777_216.0
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.number(), self.number(), self.number())
    }
}

fn box_around(middle: Vec3, extent: Vec3) -> Aabb {
    Aabb {
        low: middle - extent,
        high: middle + extent,
    }
}

fn random_boxes(count: usize) -> Vec<Aabb> {
    let mut random = Random(1);
    (0..count)
        .map(|_| box_around(random.point(), random.point() * 0.02))
        .collect()
}

fn decoded(base: f32, q: u8, exponent: u8) -> f32 {
    base + q as f32 * f32::from_bits((exponent as u32) << 23)
}

/// Asserts invariants and returns the number of levels.
fn check(tree: &Tree, boxes: &[Aabb], max_leaf_size: u32) -> u32 {
    let mut nodes = vec![0; tree.nodes.len()];
    let mut items = vec![0; boxes.len()];
    let mut levels = 0;
    // Index, level, boxes of all ancestors.
    let mut pending: Vec<(u32, u32, Vec<Aabb>)> = vec![(0, 1, Vec::new())];
    while let Some((number, level, ancestors)) = pending.pop() {
        levels = levels.max(level);
        nodes[number as usize] += 1;
        let node = &tree.nodes[number as usize];
        for c in 0..8 {
            let [low, high] = [node.low, node.high]
                .map(|q| Vec3::from_array([0, 1, 2].map(|a| decoded(node.base[a], q[a][c], node.exponents[a]))));
            assert_eq!((low, high), (node.low(c), node.high(c)));
            let mut ancestors = ancestors.clone();
            ancestors.push(Aabb { low, high });
            let range = node.items(c);
            if let Some(child) = node.child(c) {
                assert_eq!(node.leaves[c], 0);
                pending.push((child, level + 1, ancestors.clone()));
            } else if range.is_empty() {
                assert_eq!(node.leaves[c], 0);
                assert_eq!((node.low.map(|q| q[c]), node.high.map(|q| q[c])), ([255; 3], [0; 3]));
            }
            assert!(range.len() <= max_leaf_size as usize);
            for item in &tree.order[range] {
                items[*item as usize] += 1;
                let bounds = &boxes[*item as usize];
                for Aabb { low, high } in &ancestors {
                    assert!(low.cmple(bounds.low.max(Vec3::MIN)).all(), "{low} {bounds:?}");
                    assert!(high.cmpge(bounds.high.min(Vec3::MAX)).all(), "{high} {bounds:?}");
                }
            }
        }
    }
    assert!(nodes.iter().all(|count| *count == 1));
    assert!(items.iter().all(|count| *count == 1));
    assert_eq!(tree.order.len(), boxes.len());
    assert!(levels <= BUILD_MAX_DEPTH);
    levels
}

fn check_builds(boxes: &[Aabb]) -> u32 {
    let levels =
        [1, 2, 3, MAX_LEAF_SIZE].map(|max_leaf_size| check(&build(boxes, max_leaf_size), boxes, max_leaf_size));
    levels.into_iter().max().unwrap()
}

#[test]
fn few_items_give_valid_bvhs() {
    for count in [0, 1, 2, 3, 4, 5, 7, 8, 9, 10, 17] {
        check_builds(&random_boxes(count));
    }
    let tree = build(&[], 4);
    assert_eq!(
        (tree.nodes.len(), tree.nodes[0].inner, tree.nodes[0].leaves),
        (1, 0, [0; 8])
    );
    let tree = build(&random_boxes(1), 4);
    assert_eq!((tree.nodes.len(), tree.nodes[0].inner, &*tree.order), (1, 0, &[0][..]));
}

#[test]
fn many_items_give_valid_shallow_bvhs() {
    let boxes = random_boxes(cases(100_000));
    assert!(check_builds(&boxes) <= 9);
}

#[test]
fn invalid_bvhs_are_detected() {
    let boxes = random_boxes(100);
    let tree = build(&boxes, 4);
    let is_rejected = |change: &dyn Fn(&mut Tree)| {
        let mut tree = tree.clone();
        change(&mut tree);
        std::panic::catch_unwind(|| check(&tree, &boxes, 4)).is_err()
    };
    assert!(!is_rejected(&|_| ()));
    assert!(is_rejected(&|tree| tree.order[3] = tree.order[4]));
    assert!(is_rejected(&|tree| tree.nodes[1].leaves.swap(0, 7)));
    let slot = (0..8).find(|c| tree.nodes[0].child(*c).is_some()).unwrap();
    assert!(is_rejected(&|tree| tree.nodes[0].low[1][slot] += 1));
    assert!(is_rejected(&|tree| tree.nodes[0].high[2][slot] -= 1));
    assert!(is_rejected(&|tree| tree.nodes[0].exponents[0] -= 1));
    assert!(is_rejected(&|tree| tree.nodes[0].base[0] += 1e-3));
}

#[test]
fn the_bvh_does_not_depend_on_the_number_of_threads() {
    for boxes in [
        random_boxes(cases(200_000)),
        vec![box_around(Vec3::ONE, Vec3::ONE); cases(100_000)],
    ] {
        let [one, two, five] = [1, 2, 5].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let tree = pool.install(|| build(&boxes, 4));
            (bytemuck::cast_slice::<Node, u8>(&tree.nodes).to_vec(), tree.order)
        });
        assert!(one == two && two == five);
    }
}

#[test]
fn grid_origins_contain_no_negative_zeros() {
    let boxes: Vec<Aabb> = (0..100_000)
        .map(|i| {
            let zero = if i % 3 == 0 { 0.0 } else { -0.0 };
            Aabb {
                low: Vec3::new(zero, (i % 317) as f32, zero),
                high: Vec3::new(1.0, (i % 317) as f32 + 1.0, zero),
            }
        })
        .collect();
    let tree = build(&boxes, 4);
    check(&tree, &boxes, 4);
    assert!(
        tree.nodes
            .iter()
            .all(|node| node.base.iter().all(|x| x.to_bits() != (-0.0f32).to_bits()))
    );
}

#[test]
fn equal_boxes_give_valid_shallow_bvhs() {
    for extent in [0.0, 1.0, 1e30] {
        assert!(check_builds(&vec![box_around(Vec3::splat(0.3), Vec3::splat(extent)); 3000]) <= 12);
    }
    let boxes = vec![box_around(Vec3::NEG_ONE, Vec3::ONE); cases(1_000_000)];
    check(&build(&boxes, 4), &boxes, 4);
}

#[test]
fn boxes_in_geometric_progression_give_valid_bvhs() {
    for axis in [Vec3::X, Vec3::new(1.0, 0.0, 1.0), Vec3::ONE] {
        // Equal, touching, nested and degenerate boxes, down to denormal numbers.
        let distance = |i: i32| 2f32.powi(-i);
        let boxes = |extent: f32, offset: f32| -> Vec<Aabb> {
            (-120..150)
                .map(|i| box_around(axis * distance(i), Vec3::splat(extent) + axis * (offset * distance(i))))
                .collect()
        };
        for (extent, offset) in [(0.0, 0.0), (0.0, 0.25), (0.0, 1.0), (1e-30, 0.0), (1.0, 0.0)] {
            check_builds(&boxes(extent, offset));
            let repeated: Vec<Aabb> = (0..cases(50)).flat_map(|_| boxes(extent, offset)).collect();
            check_builds(&repeated);
        }
    }
    // With slow growth, a binary tree of unlimited depth would degenerate into a chain.
    let boxes: Vec<Aabb> = (0..2000)
        .map(|i| box_around(Vec3::X * 1.05f32.powi(-i), Vec3::splat(1e-25)))
        .collect();
    check_builds(&boxes);
}

fn binary_levels(inner: &[Inner]) -> u32 {
    inner.split_first().map_or(0, |(node, below)| {
        let (first, second) = below.split_at(node.first_size as usize - 1);
        1 + binary_levels(first).max(binary_levels(second))
    })
}

#[test]
fn the_depth_is_limited() {
    // Each box is twice as large as the next box.
    let boxes: Vec<Aabb> = (0..240)
        .map(|i| box_around(Vec3::splat(2f32.powi(120 - i)), Vec3::splat(2f32.powi(120 - i))))
        .collect();
    let levels = |levels| binary_levels(&Binary::build(&boxes, levels, 4).inner);
    assert!(levels(200) > BUILD_MAX_DEPTH, "only {} levels", levels(200));
    assert_eq!(levels(BUILD_MAX_DEPTH), BUILD_MAX_DEPTH);
    assert_eq!(levels(8), 8);
    check_builds(&boxes);
    let many: Vec<Aabb> = (0..cases(1000)).flat_map(|_| boxes.iter().copied()).collect();
    assert_eq!(binary_levels(&Binary::build(&many, 18, 4).inner), 18);
    check(&build(&many, 1), &many, 1);
}

#[test]
fn huge_tiny_and_infinite_boxes_give_valid_bvhs() {
    let mut random = Random(7);
    for scale in [1e-45, 1e-40, 1e-38, 1e-20, 1e9, 1e18, 1e25, 1e37, f32::MAX] {
        let boxes: Vec<Aabb> = (0..500)
            .map(|_| box_around((random.point() - 0.5) * scale, random.point() * (0.1 * scale)))
            .collect();
        check_builds(&boxes);
    }
    // Small boxes far from the origin: grid steps below the float spacing.
    for offset in [1e3, 1e6, 1e9, -1e9] {
        let boxes: Vec<Aabb> = (0..500)
            .map(|_| box_around(random.point() + offset, random.point() * 1e-3))
            .collect();
        check_builds(&boxes);
    }
    // Planes and half-spaces among small boxes.
    let mut boxes = random_boxes(1000);
    for i in 0..10 {
        let center = Vec3::splat(0.1 * i as f32);
        boxes.push(box_around(center, Vec3::new(1e9, 1e9, 0.0)));
        boxes.push(box_around(center, Vec3::new(f32::INFINITY, f32::INFINITY, 0.0)));
        boxes.push(box_around(center, Vec3::INFINITY));
        boxes.push(box_around(center, Vec3::new(0.0, f32::MAX, 0.0)));
    }
    check_builds(&boxes);
    check_builds(&[box_around(Vec3::ZERO, Vec3::INFINITY)]);
}

#[test]
fn empty_and_nan_boxes_are_replaced_by_the_origin() {
    let mut boxes = random_boxes(100);
    boxes.push(Aabb::EMPTY);
    boxes.push(box_around(Vec3::NAN, Vec3::ONE));
    boxes.push(box_around(Vec3::ONE, -Vec3::X));
    let tree = build(&boxes, 4);
    let mut order = tree.order.clone();
    order.sort_unstable();
    assert!(order.into_iter().eq(0..103));
    assert!(
        tree.nodes
            .iter()
            .all(|node| (0..8).all(|c| !node.low(c).is_nan() && !node.high(c).is_nan()))
    );
    boxes[100..].fill(box_around(Vec3::ZERO, Vec3::ZERO));
    assert_eq!(build(&boxes, 4), tree);
    check(&tree, &boxes, 4);
}

#[test]
fn children_are_in_the_slots_of_their_octants() {
    let corners = (0..8).map(|c| Vec3::new((c & 1) as f32, (c >> 1 & 1) as f32, (c >> 2) as f32));
    let boxes: Vec<Aabb> = corners
        .rev()
        .map(|corner| box_around(corner, Vec3::splat(0.1)))
        .collect();
    let tree = build(&boxes, 1);
    let items: Vec<u32> = (0..8).map(|c| tree.order[tree.nodes[0].items(c)][0]).collect();
    assert_eq!(items, [7, 6, 5, 4, 3, 2, 1, 0]);
}

/// A thread that decodes a BVH may run another task that decodes the same BVH, while rayon waits for a part. With a lock,
/// this test would not end.
#[test]
fn a_task_may_decode_a_bvh_during_its_decoding() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (decoded, calls) = (DecodedOnce::default(), AtomicU32::new(0));
    let decode = || {
        rayon::yield_now(); // runs the other task
        calls.fetch_add(1, Ordering::Relaxed)
    };
    pool.scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|_| decoded.init(decode));
        }
    });
    decoded.init(|| unreachable!());
    assert_eq!((calls.into_inner(), decoded.get()), (2, Some(&0)));
}
