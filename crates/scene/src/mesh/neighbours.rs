//! What lies around each point of a mesh, whatever the number of vertices there: vertices of one position may differ in
//! normal and texture coordinates, and are one point.

use std::hash::BuildHasher;

use glam::Vec3;
use hashbrown::{DefaultHashBuilder, HashTable};
use rayon::prelude::*;

/// The points of a mesh and the triangles around each.
pub(super) struct Neighbours {
    /// Each vertex's point.
    pub points: Vec<u32>,
    /// Where in `around` each point's triangles begin, and the end.
    starts: Vec<u32>,
    around: Vec<u32>,
}

impl Neighbours {
    /// Positions must have no negative zeros.
    pub fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Neighbours {
        let (points, count) = points(positions);
        // A counting sort of all corners by their points: triangles keep their order.
        let mut starts = vec![0u32; count + 1];
        for vertex in triangles.iter().flatten() {
            starts[points[*vertex as usize] as usize] += 1;
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut around = vec![0; sum as usize];
        for (i, triangle) in triangles.iter().enumerate().rev() {
            for vertex in triangle {
                let start = &mut starts[points[*vertex as usize] as usize];
                *start -= 1;
                around[*start as usize] = i as u32;
            }
        }
        Neighbours { points, starts, around }
    }

    /// How many points there are.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The triangles around a point, in their order.
    pub fn around(&self, point: usize) -> &[u32] {
        &self.around[self.starts[point] as usize..self.starts[point + 1] as usize]
    }

    /// Finds edges that the triangles do not make a surface around, and triangles that are there again. For each triangle
    /// there is a group, or all are of one.
    pub fn edges(&self, triangles: &[[u32; 3]], group_of: &[u32]) -> Edges {
        (0..self.count())
            .into_par_iter()
            .with_min_len(1024)
            .fold(
                || (Edges::default(), Vec::new()),
                |(mut edges, mut others), point| {
                    let (mut crowded, mut turned) = self.odd(triangles, point, &[], &mut others);
                    // Triangles that are there again are odd at each of their edges, and are told for themselves.
                    if crowded + turned > 0 {
                        let repeated = self.repeated(triangles, group_of, point);
                        if !repeated.is_empty() {
                            (crowded, turned) = self.odd(triangles, point, &repeated, &mut others);
                            // Each triangle is told of at its lowest point.
                            let lowest = |triangle: &u32| self.points_of(triangles, *triangle).iter().min().copied();
                            edges
                                .repeated
                                .extend(repeated.iter().filter(|t| lowest(t) == Some(point as u32)));
                        }
                    }
                    edges.crowded += crowded;
                    edges.turned += turned;
                    (edges, others)
                },
            )
            .map(|(edges, _)| edges)
            .reduce(Edges::default, |mut a, b| {
                a.crowded += b.crowded;
                a.turned += b.turned;
                a.repeated.extend(b.repeated);
                a
            })
    }

    /// The numbers of crowded and of turned edges whose lower point this is, without some triangles, which are in order.
    #[inline]
    fn odd(
        &self,
        triangles: &[[u32; 3]],
        point: usize,
        without: &[u32],
        others: &mut Vec<(u32, bool)>,
    ) -> (usize, usize) {
        others.clear();
        for triangle in self.around(point) {
            if !without.is_empty() && without.binary_search(triangle).is_ok() {
                continue;
            }
            let corners = self.points_of(triangles, *triangle);
            for k in 0..3 {
                let (from, to) = (corners[k], corners[(k + 1) % 3]);
                if from as usize == point && to as usize > point {
                    others.push((to, true));
                } else if to as usize == point && from as usize > point {
                    others.push((from, false));
                }
            }
        }
        others.sort_unstable();
        let edges = others.chunk_by(|a, b| a.0 == b.0);
        edges.fold((0, 0), |(crowded, turned), edge| match edge {
            [a, b] if a.1 == b.1 => (crowded, turned + 1),
            [_, _, _, ..] => (crowded + 1, turned),
            _ => (crowded, turned),
        })
    }

    /// The triangles around a point, in their order, that have the points of another one with a lower number, in the same
    /// direction, and are of its group.
    fn repeated(&self, triangles: &[[u32; 3]], group_of: &[u32], point: usize) -> Vec<u32> {
        let mut all: Vec<_> = (self.around(point).iter())
            .map(|triangle| {
                let [a, b, c] = self.points_of(triangles, *triangle);
                let others = match point as u32 {
                    p if p == a => [b, c],
                    p if p == b => [c, a],
                    _ => [a, b],
                };
                let group = group_of.get(*triangle as usize).copied().unwrap_or(0);
                (others, group, *triangle)
            })
            .collect();
        all.sort_unstable();
        let pairs = all.windows(2);
        let pairs = pairs.filter(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1));
        let mut repeated: Vec<u32> = pairs.map(|pair| pair[1].2).collect();
        repeated.sort_unstable();
        repeated
    }

    fn points_of(&self, triangles: &[[u32; 3]], triangle: u32) -> [u32; 3] {
        triangles[triangle as usize].map(|vertex| self.points[vertex as usize])
    }
}

/// What is odd about edges.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Edges {
    /// The number of those that belong to more than two triangles.
    pub crowded: usize,
    /// The number of those that both of their triangles pass in the same direction.
    pub turned: usize,
    /// The triangles, in no order, that have the points of another one with a lower number, in the same direction, and are
    /// of its group. They are not counted with their edges.
    pub repeated: Vec<u32>,
}

/// A number for each vertex, the same one where positions are, and how many there are.
fn points(positions: &[Vec3]) -> (Vec<u32>, usize) {
    let hasher = DefaultHashBuilder::default();
    let bits = |vertex: usize| {
        let [x, y, z] = positions[vertex].to_array().map(f32::to_bits);
        (x, y, z)
    };
    // The first vertex of each point; its number is in `points`.
    let mut table: HashTable<u32> = HashTable::with_capacity(positions.len());
    let mut points = Vec::with_capacity(positions.len());
    let mut count = 0;
    for vertex in 0..positions.len() {
        let key = bits(vertex);
        let first = *table
            .entry(
                hasher.hash_one(key),
                |first| bits(*first as usize) == key,
                |first| hasher.hash_one(bits(*first as usize)),
            )
            .or_insert(vertex as u32)
            .get() as usize;
        if first == vertex {
            points.push(count);
            count += 1;
        } else {
            points.push(points[first]);
        }
    }
    (points, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Vec<Vec3> {
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]
            .map(|[x, y]| Vec3::new(x, y, 0.0))
            .to_vec()
    }

    #[test]
    fn equal_positions_are_one_point() {
        let triangles = [[0, 1, 2], [4, 2, 3]];
        let neighbours = Neighbours::of(&square(), &triangles);
        assert_eq!(neighbours.points, [0, 1, 2, 3, 0]);
        assert_eq!(neighbours.around(0), [0, 1]);
        assert_eq!(neighbours.around(1), [0]);
        assert_eq!(neighbours.around(3), [1]);
        assert_eq!(neighbours.edges(&triangles, &[]), Edges::default());
    }

    fn odd(triangles: &[[u32; 3]], groups: &[u32]) -> (usize, usize, Vec<u32>) {
        let mut edges = Neighbours::of(&square(), triangles).edges(triangles, groups);
        edges.repeated.sort_unstable();
        (edges.crowded, edges.turned, edges.repeated)
    }

    #[test]
    fn repeated_triangles_are_found() {
        // Vertex 4 is where vertex 0 is.
        let triangles = [[0, 1, 2], [0, 2, 3], [1, 2, 4], [2, 0, 1], [3, 0, 2]];
        assert_eq!(odd(&triangles, &[]), (0, 0, vec![2, 3, 4]));
        // Of another group is another one: three triangles at two edges, three of one group and one more at the third.
        assert_eq!(odd(&triangles, &[0, 1, 1, 0, 1]), (1, 2, vec![3, 4]));
        // And so is one that looks the other way.
        assert_eq!(odd(&[[0, 1, 2], [2, 1, 0], [1, 2, 0]], &[]), (0, 0, vec![2]));
    }

    #[test]
    fn edges_are_counted() {
        assert_eq!(odd(&[[0, 1, 2], [4, 3, 2]], &[]), (0, 1, vec![]));
        assert_eq!(odd(&[[0, 1, 2], [4, 2, 3], [2, 1, 0]], &[]), (1, 0, vec![]));
        assert_eq!(odd(&[[0, 1, 2], [0, 1, 2]], &[0, 1]), (0, 3, vec![]));
    }
}
