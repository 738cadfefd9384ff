//! Which primitives can cast a shadow at all: a flat one with the whole scene on one side of its plane cannot, as no
//! segment from a surface to a light crosses it. The walls of a room are such.

use std::cell::LazyCell;

use glam::DVec3;

use super::extent_tree::{Extent, ExtentTree};
use super::{ELLIPSOID, Primitive};
use wgray_scene::{Geometry, Integrator, Light, Parallelogram, Reflection, Scene, Shadows};

/// How far beyond a plane a point counts as on it, relative to the coordinates: the rounding of its record.
const TOLERANCE: f64 = 1e-6;
/// Nodes that are looked at for one side of one primitive. A primitive that needs more counts as one that can cast a
/// shadow, which costs time alone: so the work stays in proportion to the scene's size, whatever its form.
const MOST_NODES: u32 = 1024;

/// For each primitive, whether it can hide a point of a surface from a light.
pub fn can_cast_shadow(scene: &Scene, primitives: &[Primitive]) -> Vec<bool> {
    let things = LazyCell::new(|| Things::of(scene)); // where nothing is flat nothing asks
    let blocking = primitives.iter().map(|p| match scene.shapes.get(p.shape as usize) {
        Some(shape) => casts_shadow(scene, shape.material) && (p.kind == ELLIPSOID || things.blocks(p, MOST_NODES)),
        // A light: under the path tracer it hides what is behind it.
        None => scene.render.integrator == Integrator::Path && things.blocks(p, MOST_NODES),
    });
    blocking.collect()
}

pub fn casts_shadow(scene: &Scene, material: usize) -> bool {
    let is_glass = matches!(scene.materials[material].reflection, Reflection::Glass { .. });
    scene.render.shadows == Shadows::Opaque || !is_glass
}

/// All that a plane may have on its sides.
struct Things<'a> {
    scene: &'a Scene,
    /// Of the shapes, an infinite one's point among them, and then the lights that have a place.
    places: ExtentTree,
    /// Of the shapes and lights that are infinitely far away, by the same numbers.
    directions: ExtentTree,
    /// Whether light comes from all directions: everything is then on both sides of what it may light.
    all_around: bool,
}

impl<'a> Things<'a> {
    fn of(scene: &'a Scene) -> Things<'a> {
        let shapes = scene.shapes.len();
        let is_infinite = |i: usize| match scene.shapes.get(i) {
            Some(shape) => matches!(shape.geometry, Geometry::Plane { .. }),
            None => matches!(scene.lights[i - shapes], Light::Directional { .. }),
        };
        let is_light_far_away = |i: usize| i >= shapes && is_infinite(i);
        let all = || 0..shapes + scene.lights.len();
        let places = all().filter(|i| !is_light_far_away(*i)).collect();
        let directions = all().filter(|i| is_infinite(*i)).collect();
        Things {
            scene,
            places: ExtentTree::new(places, &Places(scene)),
            directions: ExtentTree::new(directions, &Directions(scene)),
            all_around: scene
                .environment
                .as_ref()
                .is_some_and(|environment| environment.image.is_some()),
        }
    }

    fn blocks(&self, primitive: &Primitive, most_nodes: u32) -> bool {
        if self.all_around {
            return true;
        }
        let mut range = Range {
            normal: primitive.z.as_dvec3().normalize(),
            center: primitive.anchor.as_dvec3(),
            below: false,
            above: false,
        };
        self.on_side(&mut range, 1.0, most_nodes) && self.on_side(&mut range, -1.0, most_nodes)
    }

    /// Whether there is anything above the plane, for `side` 1, or below it, for -1.
    fn on_side(&self, range: &mut Range, side: f64, most_nodes: u32) -> bool {
        let scene = self.scene;
        let normal = range.normal * side;
        let center = range.center;
        let near = center.abs().max_element();
        let mut budget = most_nodes;
        let found = |range: &Range| if side > 0.0 { range.above } else { range.below };
        if found(range) {
            return true; // seen while the other side was looked at
        }
        // Distances are computed to within a few units of the last place of what goes into them.
        let rounding = |size: f64| 1e-14 * size;
        let directions = self.directions.any(
            normal,
            &mut budget,
            |highest, size, _| highest + rounding(size) > TOLERANCE,
            |i| {
                range.infinite(scene, i);
                found(range)
            },
        );
        let places = directions || {
            self.places.any(
                normal,
                &mut budget,
                |highest, size, nearest| {
                    let height = highest - center.dot(normal) + rounding(size + near);
                    height > TOLERANCE * near.max(nearest)
                },
                |i| {
                    range.finite(scene, i);
                    found(range)
                },
            )
        };
        places || budget == 0
    }
}

struct Places<'a>(&'a Scene);

impl Extent for Places<'_> {
    fn extent(&self, i: usize, direction: DVec3) -> (f64, f64) {
        let mut extent = Interval::new();
        each_place(self.0, i, direction, |p| extent.add(p.dot(direction)));
        (extent.low, extent.high)
    }

    fn normal(&self, i: usize) -> DVec3 {
        match self.0.shapes.get(i).map(|shape| &shape.geometry) {
            Some(Geometry::Rectangle(shape) | Geometry::Disk(shape)) => shape.u.cross(shape.v),
            Some(Geometry::Triangles(triangles)) => match triangles.first() {
                Some([v0, v1, v2]) => (v1 - v0).cross(v2 - v0),
                None => DVec3::ZERO,
            },
            _ => DVec3::ZERO,
        }
    }
}

struct Directions<'a>(&'a Scene);

impl Extent for Directions<'_> {
    fn extent(&self, i: usize, direction: DVec3) -> (f64, f64) {
        let mut extent = Interval::new();
        each_direction(self.0, i, |d| extent.add(d.dot(direction)));
        (extent.low, extent.high)
    }

    fn normal(&self, i: usize) -> DVec3 {
        match self.0.shapes.get(i).map(|shape| &shape.geometry) {
            Some(Geometry::Plane { tangent, bitangent, .. }) => tangent.cross(*bitangent),
            _ => DVec3::ZERO,
        }
    }
}

/// The points of a shape, or of a light, that lie farthest along a direction and against it.
fn each_place(scene: &Scene, i: usize, normal: DVec3, mut point: impl FnMut(DVec3)) {
    let mut parallelogram = |p: &Parallelogram| {
        for (a, b) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            point(p.center + p.u * a + p.v * b);
        }
    };
    match scene.shapes.get(i).map(|shape| &shape.geometry) {
        Some(Geometry::Rectangle(rectangle)) => parallelogram(rectangle),
        Some(Geometry::Disk(disk)) => {
            let (a, b) = (disk.u.dot(normal), disk.v.dot(normal));
            let half = (a * a + b * b).sqrt();
            point(disk.center + normal * half);
            point(disk.center - normal * half);
        }
        Some(Geometry::Ellipsoid { center, axes }) => {
            let half = axes
                .map(|axis| axis.dot(normal))
                .iter()
                .map(|h| h * h)
                .sum::<f64>()
                .sqrt();
            point(center + normal * half);
            point(center - normal * half);
        }
        Some(Geometry::Triangles(triangles)) => triangles.iter().flatten().for_each(|v| point(*v)),
        Some(Geometry::Mesh { mesh, to_world, .. }) => {
            mesh.corners()
                .for_each(|corner| point(to_world.transform_point3(corner)));
        }
        Some(Geometry::Plane { point: p, .. }) => point(*p),
        None => match &scene.lights[i - scene.shapes.len()] {
            Light::Rectangle { rectangle, .. } => parallelogram(rectangle),
            Light::Point { position, .. } | Light::Spot { position, .. } => point(*position),
            Light::Directional { .. } => {}
        },
    }
}

/// The directions of a shape's or a light's points that are infinitely far away.
fn each_direction(scene: &Scene, i: usize, mut direction: impl FnMut(DVec3)) {
    match scene.shapes.get(i).map(|shape| &shape.geometry) {
        Some(Geometry::Plane { tangent, bitangent, .. }) => {
            for d in [*tangent, *bitangent] {
                direction(d);
                direction(-d);
            }
        }
        Some(_) => {}
        None => {
            if let Light::Directional { direction: d, .. } = &scene.lights[i - scene.shapes.len()] {
                direction(-*d);
            }
        }
    }
}

struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    fn new() -> Interval {
        Interval {
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        }
    }

    fn add(&mut self, x: f64) {
        self.low = self.low.min(x);
        self.high = self.high.max(x);
    }
}

/// On which sides of a plane things were seen.
struct Range {
    normal: DVec3,
    center: DVec3,
    below: bool,
    above: bool,
}

impl Range {
    fn finite(&mut self, scene: &Scene, i: usize) {
        each_place(scene, i, self.normal, |p| {
            let size = p.abs().max(self.center.abs()).max_element();
            self.height((p - self.center).dot(self.normal), size);
        });
    }

    fn infinite(&mut self, scene: &Scene, i: usize) {
        each_direction(scene, i, |d| self.height(d.dot(self.normal), 1.0));
    }

    fn height(&mut self, height: f64, size: f64) {
        self.below |= height < -TOLERANCE * size;
        self.above |= height > TOLERANCE * size;
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;
    use crate::pack::pack_shapes;
    use wgray_scene::Description;

    const START: &str = "\
image = { width = 4, height = 4 }
camera = { position = [0, -9, 1], look_at = [0, 0, 0], fov = 45 }
materials.m = { type = 'phong', color = [1, 1, 1] }
";

    fn scene(shapes: &str) -> Scene {
        let text = format!("{START}{shapes}");
        Description::parse(&text, "s.toml").unwrap().validate().unwrap()
    }

    /// All primitives against all things.
    fn by_all(scene: &Scene) -> Vec<bool> {
        let blocks = |p: &Primitive| {
            let mut range = Range {
                normal: p.z.as_dvec3().normalize(),
                center: p.anchor.as_dvec3(),
                below: p.kind == ELLIPSOID,
                above: p.kind == ELLIPSOID,
            };
            for i in 0..scene.shapes.len() + scene.lights.len() {
                range.finite(scene, i);
                range.infinite(scene, i);
            }
            range.below && range.above
        };
        pack_shapes(scene).iter().map(blocks).collect()
    }

    fn triangle(out: &mut String, vertices: [DVec3; 3]) {
        let [a, b, c] = vertices.map(|v| format!("{:?}", v.to_array()));
        let _ = writeln!(
            out,
            "[[shapes]]\ntype = 'triangle'\nmaterial = 'm'\nvertices = [{a}, {b}, {c}]"
        );
    }

    /// A sheet of 2 n^2 triangles over the square from -1 to 1.
    fn sheet(n: u32, place: impl Fn(f64, f64) -> DVec3) -> String {
        let mut out = String::new();
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
            let at = |i: u32, j: u32| {
                let [x, y] = [i, j].map(|i| 2.0 * f64::from(i) / f64::from(n) - 1.0);
                place(x, y)
            };
            triangle(&mut out, [at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangle(&mut out, [at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
        out
    }

    fn turned(x: f64, y: f64, z: f64) -> DVec3 {
        glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0) * DVec3::new(x, y, z) + DVec3::new(3.0, -7.0, 20.0)
    }

    /// Scenes in which many primitives have all on one side, of about n primitives each.
    fn scenes(n: u32) -> Vec<(&'static str, Scene)> {
        let side = (n / 2).isqrt();
        let wall_side = (n / 12).isqrt();
        let room: String = (0..6)
            .map(|wall| {
                sheet(wall_side, |x, y| {
                    let z = if wall % 2 == 0 { -1.0 } else { 1.0 };
                    let [x, y, z] = [[x, y, z], [y, z, x], [z, x, y]][wall / 2];
                    turned(x, y, z)
                })
            })
            .collect();
        let lone = "[[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [3, -7, 20]\nradius = 0.5\n";
        let ball = sheet(side, |x, y| {
            let (sin, cos) = (0.98 * x * std::f64::consts::PI).sin_cos();
            let (z, r) = (0.98 * y * 1.5).sin_cos();
            turned(cos * r, sin * r, z)
        });
        let mut random = 1u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(random >> 8) / f64::from(1 << 23) - 1.0
        };
        let mut soup = String::new();
        let mut planes = String::new();
        let mut lights = String::new();
        for i in 0..n {
            let [a, b, c] = [(); 3].map(|()| DVec3::new(next(), next(), next()) * 3.0);
            triangle(&mut soup, [a, a + 0.1 * b, a + 0.1 * c]);
            let point = [next(), next(), next()];
            let _ = writeln!(
                planes,
                "[[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = {point:?}\nnormal = [0.3, 0.2, 1]\ntangent = [1, 0, 0]"
            );
            let kind = ["point", "directional"][i as usize % 2];
            let key = ["position", "direction"][i as usize % 2];
            let at = [0.3 * next(), 0.3 * next(), -1.0 - next().abs()];
            let _ = writeln!(lights, "[[lights]]\ntype = '{kind}'\n{key} = {at:?}\ncolor = [1, 1, 1]");
        }
        let floor = sheet(side, |x, y| DVec3::new(x, y, 0.0));
        let slope = sheet(side, |x, y| turned(x, y, 0.0));
        vec![
            ("a floor", scene(&floor)),
            (
                "a floor under lights that shine upwards",
                scene(&(floor.clone() + &lights)),
            ),
            ("a slope", scene(&slope)),
            ("a turned room", scene(&room)),
            ("a turned room with a ball", scene(&(room + lone))),
            ("a convex mesh", scene(&ball)),
            ("triangles everywhere", scene(&soup)),
            ("parallel planes", scene(&planes)),
            ("a slope and planes", scene(&(slope + &planes))),
        ]
    }

    #[test]
    fn a_tree_gives_the_answers_of_all_against_all() {
        let mut counts = [0, 0];
        for (name, scene) in scenes(600) {
            let blocking = can_cast_shadow(&scene, &pack_shapes(&scene));
            assert!(blocking == by_all(&scene), "{name}");
            blocking.iter().for_each(|b| counts[usize::from(*b)] += 1);
        }
        assert!(counts[0] > 1000 && counts[1] > 1000, "{counts:?}");
    }

    #[test]
    fn few_nodes_are_looked_at_in_scenes_of_thousands_of_primitives() {
        for (name, scene) in scenes(6000) {
            let things = Things::of(&scene);
            let primitives = pack_shapes(&scene);
            let dear = |p: &&Primitive| things.blocks(p, 300) != things.blocks(p, u32::MAX);
            // One in a hundred may need more: at edges, where a node holds parts of two walls.
            let count = primitives.iter().filter(dear).count();
            assert!(
                100 * count <= primitives.len(),
                "{name}: {count} of {}",
                primitives.len()
            );
        }
    }

    #[test]
    fn without_a_budget_everything_may_cast_a_shadow() {
        for (_, scene) in scenes(20) {
            let things = Things::of(&scene);
            assert!(pack_shapes(&scene).iter().all(|p| things.blocks(p, 1)));
        }
    }
}
