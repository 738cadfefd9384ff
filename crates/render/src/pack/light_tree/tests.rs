//! Tests of the light tree against integrals and exhaustive searches, in f64.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3, Vec4};

use super::*;
use crate::cases;
use wgray_trace::cpu::light_tree::{light_child, light_importances, light_shares};

/// A linear congruential generator, 0 to 1.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let p = self.point();
            if (1e-3..=1.0).contains(&p.length()) {
                return p.normalize();
            }
        }
    }

    fn cone(&mut self) -> Cone {
        let spread = match (self.unit() * 4.0) as u32 {
            0 => 0.0,
            1 => self.unit() * 0.3,
            2 => self.unit() * PI,
            _ => return Cone::ALL,
        };
        Cone {
            axis: self.direction(),
            spread,
            edge: if self.unit() < 0.5 {
                FRAC_PI_2
            } else {
                self.unit() * FRAC_PI_2
            },
            two_sided: self.unit() < 0.3,
        }
    }

    fn emitter(&mut self, i: u32, two_sided: bool) -> TreeEmitter {
        let (center, normal) = (self.point() * 5.0, self.direction());
        let half = if self.unit() < 0.2 { 0.0 } else { 0.3 * self.unit() };
        let cone = match half == 0.0 {
            true => Cone::ALL,
            false => Cone::flat(normal, two_sided),
        };
        TreeEmitter {
            low: center - half,
            high: center + half,
            cone,
            intensity: (self.unit() * 20.0 - 15.0).exp(),
            density: 1.0,
            instance: 0,
            index: i,
        }
    }
}

/// Returns true if a cone contains a normal or, for a two-sided cone, the opposite of the normal.
fn contains(cone: &Cone, normal: DVec3) -> bool {
    let angle = cone.axis.angle_between(normal);
    let angle = if cone.two_sided { angle.min(PI - angle) } else { angle };
    angle <= cone.spread + 1e-7
}

#[test]
fn the_union_of_two_cones_contains_both() {
    let mut random = Random(1);
    let mut narrower = 0;
    for _ in 0..4000 {
        let (a, b) = (random.cone(), random.cone());
        let union = a.with(&b);
        assert!(union.edge >= a.edge.max(b.edge) && (union.axis.length() - 1.0).abs() < 1e-9);
        assert!(union.two_sided == (a.two_sided || b.two_sided));
        narrower += u32::from(union.spread < PI);
        for cone in [a, b] {
            for _ in 0..8 {
                // Half of the normals are on the rim.
                let side = cone.axis.any_orthonormal_vector();
                let tilt_axis = DQuat::from_axis_angle(cone.axis, random.unit() * 2.0 * PI) * side;
                let angle = cone.spread * if random.unit() < 0.5 { 1.0 } else { random.unit() };
                let normal = DQuat::from_axis_angle(tilt_axis, angle) * cone.axis;
                assert!(
                    contains(&union, normal),
                    "{a:?} {b:?}: {union:?} does not contain {normal}"
                );
            }
        }
    }
    assert!(
        narrower > 400,
        "too few unions are narrower than the sphere: {narrower}"
    );
}

#[test]
fn the_orientation_measure_matches_quadrature() {
    // Equation 1 integrates over the sphere: 1 inside the spread, then the cosine up to the edge.
    for (spread, edge) in [
        (0.0, FRAC_PI_2),
        (0.5, FRAC_PI_2),
        (1.2, 0.7),
        (PI, FRAC_PI_2),
        (2.5, FRAC_PI_2),
        (0.0, 0.2),
    ] {
        let steps = 200_000;
        let sum: f64 = (0..steps)
            .map(|i| {
                let angle = PI * (f64::from(i) + 0.5) / f64::from(steps);
                let weight = match angle {
                    angle if angle <= spread => 1.0,
                    angle if angle <= spread + edge => (angle - spread).cos(),
                    _ => 0.0,
                };
                2.0 * PI * angle.sin() * weight * PI / f64::from(steps)
            })
            .sum();
        let cone = Cone {
            axis: DVec3::X,
            spread,
            edge,
            two_sided: false,
        };
        assert!(
            (cone.measure() - sum).abs() < 1e-4,
            "{spread}, {edge}: {} for {sum}",
            cone.measure()
        );
    }
}

fn children(node: &LightNode) -> impl Iterator<Item = (usize, u32)> {
    (0..WIDTH)
        .filter(|i| node.intensity[*i] > 0.0)
        .map(|i| (i, node.children[i]))
}

fn probabilities(nodes: &[LightNode], count: usize, p: Vec3, n: Vec3) -> Vec<f64> {
    let mut found = vec![0.0; count];
    let mut pending = vec![(0_usize, 1.0)];
    while let Some((number, probability)) = pending.pop() {
        let node = &nodes[number];
        let shares = light_shares(light_importances(node, p, n));
        for (i, child_index) in children(node) {
            let probability = probability * f64::from(shares[i]);
            match child_index {
                NO_INDEX => found[node.index[i] as usize] = probability,
                child_index => pending.push((child_index as usize, probability)),
            }
        }
    }
    found
}

#[test]
fn parallel_and_serial_builds_give_the_same_nodes() {
    let mut random = Random(5);
    for count in [0, 1, 2, 5, 16, 17, 300, cases(5000) as u32] {
        let emitters: Vec<TreeEmitter> = (0..count).map(|i| random.emitter(i, i % 3 == 0)).collect();
        let serial = build_with(&emitters, usize::MAX);
        for parallel in [1, 40, MIN_PARALLEL_EMITTERS] {
            let nodes = build_with(&emitters, parallel);
            assert!(
                bytemuck::cast_slice::<_, u32>(&nodes) == bytemuck::cast_slice::<_, u32>(&serial),
                "{count}, {parallel}"
            );
        }
        let changed = build_with(&emitters[..emitters.len().saturating_sub(1)], 1);
        assert!(count == 0 || bytemuck::cast_slice::<_, u32>(&changed) != bytemuck::cast_slice::<_, u32>(&serial));
    }
}

#[test]
fn probabilities_sum_to_one_and_are_positive_for_visible_emitters() {
    let mut random = Random(2);
    for (count, two_sided) in [(1, false), (2, false), (17, true), (300, false), (300, true)] {
        let emitters: Vec<TreeEmitter> = (0..count).map(|i| random.emitter(i, two_sided)).collect();
        let nodes = build(&emitters);
        assert_eq!(
            nodes
                .iter()
                .flat_map(children)
                .filter(|(_, child_index)| *child_index == NO_INDEX)
                .count(),
            emitters.len()
        );
        let mut dark = 0;
        for _ in 0..200 {
            let p = random.point() * 6.0;
            let n = if random.unit() < 0.3 {
                DVec3::ZERO
            } else {
                random.direction()
            };
            let found = probabilities(&nodes, emitters.len(), p.as_vec3(), n.as_vec3());
            let sum: f64 = found.iter().sum();
            assert!((sum - 1.0).abs() < 1e-5, "{sum}");
            for emitter in &emitters {
                // An emitter is visible if one of nine points on it faces p and lies above the surface.
                let (center, half) = (0.5 * (emitter.low + emitter.high), 0.5 * (emitter.high - emitter.low).x);
                let u = emitter.cone.axis.any_orthonormal_vector();
                let v = emitter.cone.axis.cross(u);
                let is_visible = (0..9).any(|k| {
                    let point = center + (u * f64::from(k % 3 - 1) + v * f64::from(k / 3 - 1)) * half / 2.0;
                    let to_point = (point - p).normalize();
                    let faces =
                        emitter.cone.spread > 3.0 || -to_point.dot(emitter.cone.axis) > 0.0 || emitter.cone.two_sided;
                    faces && (n == DVec3::ZERO || to_point.dot(n) > 0.0)
                });
                let probability = found[emitter.index as usize];
                assert!(!is_visible || probability > 0.0, "{emitter:?} from {p}, {n}");
                dark += u32::from(probability == 0.0);
            }
        }
        assert!(count < 3 || dark > 100, "only {dark} emitters have probability 0");
    }
}

#[test]
fn nodes_link_to_parents_and_bound_children() {
    let mut random = Random(3);
    let emitters: Vec<TreeEmitter> = (0..1000).map(|i| random.emitter(i, false)).collect();
    let nodes = build(&emitters);
    assert_eq!(nodes[0].parent.x, NO_INDEX);
    assert!(nodes.len() < 500, "too many nodes: {}", nodes.len());
    let center = |node: &LightNode, i: usize| Vec3::new(node.x[i], node.y[i], node.z[i]);
    let (mut visited, mut leaves) = (0, 0);
    let mut pending = vec![0_u32];
    while let Some(number) = pending.pop() {
        visited += 1;
        let node = &nodes[number as usize];
        for (i, child_index) in children(node) {
            if child_index == NO_INDEX {
                leaves += 1;
                continue;
            }
            let child = &nodes[child_index as usize];
            assert_eq!(child.parent.x, 4 * number + i as u32);
            let mut sum = 0.0;
            for (j, _) in children(child) {
                // The spheres surround boxes, so a child's sphere may exceed the parent's sphere, but the center of the
                // child's sphere does not.
                assert!((center(node, i) - center(child, j)).length() <= node.radius[i] * 1.0001);
                sum += child.intensity[j];
            }
            assert!((sum - node.intensity[i]).abs() <= 1e-5 * node.intensity[i]);
            pending.push(child_index);
        }
    }
    assert_eq!((visited, leaves), (nodes.len(), emitters.len()));
}

/// Averages the positive part of evenly spread heights.
fn mean_above(middle: f64, radius: f64) -> f64 {
    let steps = 2000;
    let heights = (0..steps).map(|i| middle + radius * (2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0));
    heights.map(|height| height.max(0.0)).sum::<f64>() / f64::from(steps)
}

#[test]
fn importance_matches_the_formula_with_angles() {
    let mut random = Random(4);
    let (mut compared, mut dark) = (0, 0);
    for i in 0..20_000 {
        let emitter = TreeEmitter {
            cone: random.cone(),
            intensity: 1.0,
            ..random.emitter(i, false)
        };
        let node = build(&[emitter])[0];
        let (p, n) = (random.point() * 6.0, random.direction());
        let to_center = 0.5 * (emitter.low + emitter.high) - p;
        let (distance, radius) = (to_center.length(), 0.5 * (emitter.high - emitter.low).length());
        let angular_radius = if distance <= radius {
            PI
        } else {
            (radius / distance).asin()
        };
        let from_axis = emitter.cone.axis.angle_between(-to_center);
        let from_axis = if emitter.cone.two_sided {
            from_axis.min(PI - from_axis)
        } else {
            from_axis
        };
        let leaving = (from_axis - emitter.cone.spread).max(0.0);
        let facing = n.angle_between(to_center);
        let squared_distance = distance * distance + 0.1 * radius * radius;
        let height = |angle: f64| mean_above(distance * angle.cos(), radius).max(0.03 * radius);
        let value = height(leaving) * height(facing) / (squared_distance * squared_distance);
        let found = light_importances(&node, p.as_vec3(), n.as_vec3());
        assert_eq!(
            (found.y, found.z, found.w),
            (0.0, 0.0, 0.0),
            "only the first child exists"
        );
        let found = f64::from(found.x);
        if leaving - angular_radius < emitter.cone.edge && facing - angular_radius < FRAC_PI_2 {
            compared += 1;
            assert!(
                (found - value).abs() < 2e-3 * value.max(1e-3),
                "{found} for {value}: {emitter:?} {p} {n}"
            );
        } else if found == 0.0 {
            dark += 1;
        }
    }
    assert!(
        compared > 3_000 && dark > 3_000,
        "{compared} emitters with light at the point, {dark} without"
    );
}

#[test]
fn children_are_selected_in_proportion_to_importance() {
    let mut random = Random(5);
    for _ in 0..2_000 {
        let importances = Vec4::from_array([(); 4].map(|()| match (random.unit() * 4.0) as u32 {
            0 => 0.0,
            1 => 1e-36,
            _ => (random.unit() * 60.0 - 30.0).exp() as f32,
        }));
        let shares = light_shares(importances);
        let sum: f64 = importances.to_array().iter().map(|x| f64::from(*x)).sum();
        assert!((shares.element_sum() - 1.0).abs() < 1e-6, "{importances}: {shares}");
        if sum == 0.0 {
            assert_eq!(shares, Vec4::X);
            continue;
        }
        for i in 0..WIDTH {
            let share = f64::from(importances[i]) / sum;
            // At most three shares are raised to the minimum of 2^-12.
            assert!(
                (f64::from(shares[i]) - share).abs() < 4.0 / 4096.0,
                "{importances}: {shares}"
            );
            assert_eq!(shares[i] > 0.0, importances[i] > 0.0);
            assert!(shares[i] == 0.0 || shares[i] > 0.999 / 4096.0);
        }
        let mut counts = [0_u32; WIDTH];
        let steps = 4096_u16;
        for k in 0..steps {
            counts[light_child(shares, f32::from(k) / f32::from(steps)) as usize] += 1;
        }
        for i in 0..WIDTH {
            let expected = f64::from(shares[i]) * f64::from(steps);
            assert!((f64::from(counts[i]) - expected).abs() <= 2.0, "{shares}: {counts:?}");
            assert!(shares[i] > 0.0 || counts[i] == 0);
        }
        // The largest random number.
        let last = light_child(shares, 1.0 - f32::EPSILON / 2.0) as usize;
        assert!(shares[last] > 0.0, "{shares}: {last}");
    }
}

#[test]
fn coincident_and_exponential_emitters_give_shallow_trees() {
    let emitter_at = |i: u32, p: DVec3, intensity: f64| TreeEmitter {
        low: p,
        high: p,
        cone: Cone::ALL,
        intensity,
        density: 1.0,
        instance: 0,
        index: i,
    };
    let depth = |emitters: &[TreeEmitter]| {
        let nodes = build(emitters);
        let levels = |mut i: usize| {
            let mut levels = 0;
            while nodes[i].parent.x != NO_INDEX {
                i = nodes[i].parent.x as usize / 4;
                levels += 1;
            }
            levels
        };
        (0..nodes.len()).map(levels).max().unwrap()
    };
    let count = 20_000;
    let coincident: Vec<TreeEmitter> = (0..count).map(|i| emitter_at(i, DVec3::ONE, 1.0)).collect();
    assert!(depth(&coincident) <= 8, "{}", depth(&coincident));
    let row: Vec<TreeEmitter> = (0..count)
        .map(|i| emitter_at(i, DVec3::X * f64::from(i), 1.0))
        .collect();
    assert!(depth(&row) <= 12, "{}", depth(&row));
    // The distances and intensities form geometric progressions: without a depth limit, each split would separate a
    // single emitter.
    let geometric: Vec<TreeEmitter> = (0..300)
        .map(|i| emitter_at(i, DVec3::X * 0.5_f64.powi(i as i32), 0.001_f64.powi(i as i32 % 90)))
        .collect();
    assert!(depth(&geometric) <= 48 + 9, "{}", depth(&geometric));
    assert!(build(&[]).is_empty());
}
