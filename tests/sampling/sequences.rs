//! Sample sequences: published values, stratification, discrepancy, independence.

use glam::{UVec2, Vec2};
use wgray_trace::cpu::sampling::{sample_key, sample_square};
use wgray_trace::cpu::sequence::{halton_sample, radical_inverse_3, shuffled_index, sobol_reversed, sobol_sample};
use wgray_trace::records::{GRID, HALTON, JITTERED, RANDOM, ROTATED_GRID, SOBOL};

/// The first 32 points of the two-dimensional Sobol' sequence, multiplied by 32. Source: scipy 1.17.1,
/// `qmc.Sobol(2, scramble=False)`, with the direction numbers of Joe and Kuo (2008).
const SOBOL_POINTS: [[u32; 2]; 32] = [
    [0, 0],
    [16, 16],
    [24, 8],
    [8, 24],
    [12, 12],
    [28, 28],
    [20, 4],
    [4, 20],
    [6, 10],
    [22, 26],
    [30, 2],
    [14, 18],
    [10, 6],
    [26, 22],
    [18, 14],
    [2, 30],
    [3, 15],
    [19, 31],
    [27, 7],
    [11, 23],
    [15, 3],
    [31, 19],
    [23, 11],
    [7, 27],
    [5, 5],
    [21, 21],
    [29, 13],
    [13, 29],
    [9, 9],
    [25, 25],
    [17, 1],
    [1, 17],
];

/// Returns the Sobol' index of scipy's point `i`; scipy generates points in Gray code order.
fn gray(i: u32) -> u32 {
    i ^ (i >> 1)
}

/// Radical inverses in base 3, multiplied by 3^15. Source: scipy 1.17.1, `qmc.Halton(2, scramble=False)`.
const HALTON_3: [u32; 12] = [
    0, 4782969, 9565938, 1594323, 6377292, 11160261, 3188646, 7971615, 12754584, 531441, 5314410, 10097379,
];

fn keys(count: u32) -> impl Iterator<Item = UVec2> {
    (0..count).map(|i| sample_key(UVec2::new(i % 13, i / 13), 3, i % 5))
}

fn to_24_bits(x: f32) -> u32 {
    (x * (1 << 24) as f32) as u32
}

#[test]
fn sequences_match_published_values() {
    for i in 0..32 {
        let j = gray(i);
        let point = [j.reverse_bits() >> 27, sobol_reversed(j).reverse_bits() >> 27];
        assert_eq!(point, SOBOL_POINTS[i as usize], "Sobol' point {j}");
    }
    for (i, expected) in (0..).zip(HALTON_3) {
        assert_eq!(radical_inverse_3(i), expected, "{i} in base 3");
    }
    assert_eq!(
        radical_inverse_3(u32::MAX) % 3,
        radical_inverse_3(u32::MAX % 14_348_907) % 3
    );
}

#[test]
fn the_second_sobol_coordinate_is_the_product_with_pascals_matrix() {
    // Direction numbers of the polynomial x + 1: v_1 = 1/2, v_k = v_(k-1) XOR v_(k-1) / 2.
    for i in (0..1 << 16).map(|i: u32| i.wrapping_mul(0x9e37_79b9)) {
        let mut direction = 1u32 << 31;
        let mut y = 0;
        for k in 0..32 {
            y ^= if (i >> k) & 1 == 1 { direction } else { 0 };
            direction ^= direction >> 1;
        }
        assert_eq!(sobol_reversed(i).reverse_bits(), y, "{i}");
    }
}

/// Returns true if 2^m points are a (0, m, 2)-net in base 2: each elementary interval contains one point.
fn is_net(points: &[Vec2]) -> bool {
    let m = points.len().ilog2();
    (0..=m).all(|column_bits| {
        let mut occupied = vec![false; points.len()];
        for p in points {
            let (column, row) = (
                to_24_bits(p.x) >> (24 - column_bits),
                to_24_bits(p.y) >> (24 - (m - column_bits)),
            );
            occupied[((column << (m - column_bits)) | row) as usize] = true;
        }
        occupied.into_iter().all(|occupied| occupied)
    })
}

#[test]
fn scrambled_sobol_points_are_nets() {
    for key in keys(40) {
        for m in 0..=8 {
            for run in [0, 1, 5, 1000] {
                let points: Vec<Vec2> = (run << m..(run + 1) << m).map(|i| sobol_sample(i, key)).collect();
                assert!(is_net(&points), "run {run} of 2^{m} points, key {key}");
            }
        }
    }
    // Negative controls: other patterns, an unaligned run, a moved point.
    for key in keys(5) {
        for pattern in [RANDOM, HALTON] {
            let points: Vec<Vec2> = (0..64).map(|i| sample_square(pattern, 64, i, 0, key)).collect();
            assert!(!is_net(&points));
        }
        let points: Vec<Vec2> = (32..96).map(|i| sobol_sample(i, key)).collect();
        assert!(!is_net(&points));
        let mut points: Vec<Vec2> = (0..64).map(|i| sobol_sample(i, key)).collect();
        points[0] = points[1];
        assert!(!is_net(&points));
    }
}

#[test]
fn light_samples_continue_the_sequence_of_the_previous_pixel_sample() {
    for key in keys(5) {
        for pattern in [SOBOL, HALTON] {
            let single: Vec<Vec2> = (0..64).map(|i| sample_square(pattern, 64, i, 0, key)).collect();
            let groups: Vec<Vec2> = (0..64)
                .map(|i| sample_square(pattern, 16, i % 16, i / 16, key))
                .collect();
            assert_eq!(single, groups);
        }
    }
}

#[test]
fn shuffling_maps_aligned_runs_to_aligned_runs() {
    for key in keys(20) {
        for m in 0..12u32 {
            let mut run: Vec<u32> = (3 << m..4 << m).map(|i| shuffled_index(i, key.x)).collect();
            run.sort_unstable();
            let first = run[0];
            assert_eq!(first % (1 << m), 0);
            assert!(run.iter().zip(first..).all(|(found, expected)| *found == expected));
        }
    }
    let shuffled: Vec<u32> = keys(20).map(|key| shuffled_index(0, key.x)).collect();
    assert!(
        shuffled
            .iter()
            .all(|i| shuffled.iter().filter(|j| i == *j).count() == 1)
    );
}

#[test]
fn aligned_runs_of_halton_points_have_one_point_in_each_interval() {
    for key in keys(20) {
        for digits in 1..=5u32 {
            let count = 3u32.pow(digits);
            // `shuffled_index` maps an aligned run of 256 indices to an aligned run, in another order. The test uses
            // the first 3^digits indices of that run.
            let mut run: Vec<u32> = (512..768).map(|i| shuffled_index(i, key.x ^ key.y)).collect();
            run.sort_unstable();
            let mut intervals: Vec<u32> = (run[..count as usize].iter())
                .map(|i| radical_inverse_3(*i) / 3u32.pow(15 - digits))
                .collect();
            intervals.sort_unstable();
            assert!(intervals.into_iter().eq(0..count), "{digits} digits");
        }
        for i in 0..1000 {
            let p = halton_sample(i * 4_294_967, key);
            assert!((0.0..1.0).contains(&p.x) & (0.0..1.0).contains(&p.y));
        }
    }
    // The largest 15-digit value stays below 1.
    let largest = std::hint::black_box(14_348_906f32);
    assert!(largest * 6.969_171_6e-8 < 1.0);
}

/// Returns the star discrepancy: the maximum of |fraction of points in the box - a b| over the boxes [0, a) x [0, b)
/// and [0, a] x [0, b], where a and b are coordinates of points or 1.
fn star_discrepancy(points: &[Vec2]) -> f64 {
    let n = points.len() as f64;
    let mut by_x: Vec<Vec2> = points.to_vec();
    by_x.sort_by(|p, q| p.x.total_cmp(&q.x));
    let coordinates = |values: Vec<f32>| {
        let mut coordinates: Vec<f64> = values.into_iter().map(f64::from).collect();
        coordinates.push(1.0);
        coordinates.sort_by(f64::total_cmp);
        coordinates.dedup();
        coordinates
    };
    let ys = coordinates(points.iter().map(|p| p.y).collect());
    // Numbers of points by y, among those with x < a and with x <= a.
    let (mut open, mut closed) = (vec![0.0; ys.len()], vec![0.0; ys.len()]);
    let count_while = |counts: &mut [f64], first: &mut usize, keep: &dyn Fn(f64) -> bool| {
        while let Some(p) = by_x.get(*first).filter(|p| keep(f64::from(p.x))) {
            counts[ys.partition_point(|y| *y < f64::from(p.y))] += 1.0;
            *first += 1;
        }
    };
    let (mut first_open, mut first_closed) = (0, 0);
    let mut max_deviation = 0.0f64;
    for a in coordinates(points.iter().map(|p| p.x).collect()) {
        count_while(&mut open, &mut first_open, &|x| x < a);
        count_while(&mut closed, &mut first_closed, &|x| x <= a);
        let (mut below, mut covered) = (0.0, 0.0);
        for (j, b) in ys.iter().enumerate() {
            covered += closed[j];
            max_deviation = max_deviation.max(a * b - below / n).max(covered / n - a * b);
            below += open[j];
        }
    }
    max_deviation
}

fn discrepancies(pattern: u32, side: u32, count: u32) -> Vec<f64> {
    let points = |key| {
        (0..count)
            .map(|i| sample_square(pattern, side, i, 0, key))
            .collect::<Vec<Vec2>>()
    };
    keys(8).map(|key| star_discrepancy(&points(key))).collect()
}

#[test]
fn star_discrepancies_are_within_their_bounds() {
    let max = |values: Vec<f64>| values.into_iter().fold(0.0, f64::max);
    let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
    let n = 32.0;
    // Cell centers: 1/n - 1/(4 n^2), attained by the box without the last column and row.
    let grid = star_discrepancy(
        &(0..1024)
            .map(|i| sample_square(GRID, 32, i, 0, UVec2::ZERO))
            .collect::<Vec<_>>(),
    );
    assert!((grid - (1.0 / n - 0.25 / (n * n))).abs() < 1e-6, "{grid}");
    // One point per cell: each of the 2n - 1 cells on the boundary of a box contributes at most one point.
    assert!(max(discrepancies(JITTERED, 32, 1024)) <= (2.0 * n - 1.0) / (n * n));
    // A (0, m, 2)-net in base 2: (m + 1) / 2^m (Niederreiter, "Random Number Generation and Quasi-Monte Carlo Methods",
    // 1992, theorem 4.6).
    let bound = 11.0 / 1024.0;
    let sobol = max(discrepancies(SOBOL, 1024, 1024));
    assert!(sobol <= bound, "{sobol}");
    // Independent points: about 1/sqrt(N).
    let random = mean(discrepancies(RANDOM, 32, 1024));
    assert!(random > bound && (0.7..1.6).contains(&(random * n)), "{random}");
    let halton = mean(discrepancies(HALTON, 1024, 1024));
    assert!(halton < 0.4 * random, "{halton}");
}

#[test]
fn a_rotated_grid_has_more_columns_than_the_grid() {
    let columns = |pattern, side: u32| {
        let mut xs: Vec<f32> = (0..side * side)
            .map(|i| sample_square(pattern, side, i, 0, UVec2::ZERO).x)
            .collect();
        xs.sort_by(f32::total_cmp);
        xs.dedup_by(|a, b| (*a - *b).abs() < 1e-5);
        xs.len()
    };
    assert_eq!((columns(GRID, 4), columns(ROTATED_GRID, 4)), (4, 10));
    assert_eq!((columns(GRID, 2), columns(ROTATED_GRID, 2)), (2, 4));
    // The points are rotated, and wrapped by an integer number of pixels.
    let (c, s) = (2.0 / 5f64.sqrt(), 1.0 / 5f64.sqrt());
    for side in [1, 2, 4, 7, 16] {
        for i in 0..side * side {
            let p = sample_square(ROTATED_GRID, side, i, 0, UVec2::ZERO).as_dvec2() - 0.5;
            assert!(p.x.abs() <= 0.5 && p.y.abs() <= 0.5);
            let q = sample_square(GRID, side, i, 0, UVec2::ZERO).as_dvec2() - 0.5;
            let difference = glam::DVec2::new(c * q.x - s * q.y, s * q.x + c * q.y) - p;
            assert!(
                (difference - difference.round()).length() < 1e-6,
                "{side}, {i}: {difference}"
            );
        }
    }
}

/// Returns the deviation of the chi-square of 8 x 8 cells from its mean, in standard deviations.
fn dependence(pairs: impl Iterator<Item = (f32, f32)>) -> f64 {
    let mut cells = [0.0; 64];
    for (a, b) in pairs {
        cells[(8.0 * a) as usize * 8 + (8.0 * b) as usize] += 1.0;
    }
    let expected = cells.iter().sum::<f64>() / 64.0;
    let chi_square: f64 = cells.iter().map(|n| (n - expected) * (n - expected) / expected).sum();
    (chi_square - 63.0) / (2.0f64 * 63.0).sqrt()
}

#[test]
fn samples_of_pixels_and_lights_are_independent() {
    for pattern in [RANDOM, HALTON, SOBOL] {
        let sample_at = |pixel: u32, purpose, sample: u32| {
            let key = sample_key(UVec2::new(pixel % 64, pixel / 64), 1, purpose);
            sample_square(pattern, 16, sample % 16, sample / 16, key)
        };
        // Pairs of coordinates over pixels and over samples, and pairs of adjacent pixels.
        let pixels = dependence((0..4096).map(|i| (sample_at(i, 0, 5).x, sample_at(i, 1, 5).x)));
        let samples = dependence((0..4096).map(|i| (sample_at(7, 0, i).x, sample_at(7, 1, i).x)));
        let crossed = dependence((0..4096).map(|i| (sample_at(7, 0, i).y, sample_at(7, 2, i).x)));
        let neighbors = dependence((0..4096).map(|i| (sample_at(i, 0, 3).x, sample_at(i + 1, 0, 3).x)));
        for (pair, found) in [pixels, samples, crossed, neighbors].into_iter().enumerate() {
            assert!(found < 6.0, "pattern {pattern}, pairs {pair}: {found}");
        }
    }
    // Negative control: two scrambles of the same sequence in the same order are dependent.
    let same_order_points = |purpose| {
        let key = sample_key(UVec2::ZERO, 1, purpose);
        move |i: u32| i.reverse_bits().wrapping_add(key.x) as f32 / 4_294_967_296.0 * 0.999_999
    };
    let (a, b) = (same_order_points(0), same_order_points(1));
    assert!(dependence((0..4096).map(|i| (a(i), b(i)))) > 100.0);
}
