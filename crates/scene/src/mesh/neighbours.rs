//! Mesh adjacency by points. A point consists of all vertices with equal positions, independent of their other
//! attributes.

use std::hash::BuildHasher;

use glam::Vec3;
use hashbrown::{DefaultHashBuilder, HashTable};
use rayon::prelude::*;

pub(super) struct Neighbours {
    /// Point of each vertex.
    pub points: Vec<u32>,
    /// Ranges of the points in `around`.
    starts: Vec<u32>,
    around: Vec<u32>,
}

impl Neighbours {
    /// Groups vertices into points. Positions must not contain -0.
    pub fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Neighbours {
        let (points, count) = points(positions);
        // Stable counting sort of corners by point.
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

    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns the triangles at a point, in ascending order.
    pub fn around(&self, point: usize) -> &[u32] {
        &self.around[self.starts[point] as usize..self.starts[point + 1] as usize]
    }

    /// Finds non-manifold edges, inconsistent winding and duplicate triangles. If `group_of` is empty, all triangles
    /// are in one group.
    pub fn edges(&self, triangles: &[[u32; 3]], group_of: &[u32]) -> Edges {
        (0..self.count())
            .into_par_iter()
            .with_min_len(1024)
            .fold(
                || (Edges::default(), Vec::new()),
                |(mut edges, mut others), point| {
                    let (mut crowded, mut turned) = self.odd(triangles, point, &[], &mut others);
                    // Edges are counted without duplicate triangles, which would make edges irregular.
                    if crowded + turned > 0 {
                        let repeated = self.repeated(triangles, group_of, point);
                        if !repeated.is_empty() {
                            (crowded, turned) = self.odd(triangles, point, &repeated, &mut others);
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

    /// Counts crowded and turned edges whose point with the lower index is `point`. Ignores the triangles of a sorted
    /// list.
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

    /// Returns the triangles at a point that have the same points, winding and group as an earlier triangle.
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

/// Irregular edges and duplicate triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Edges {
    /// Edges of more than two triangles.
    pub crowded: usize,
    /// Edges that have the same direction in both triangles.
    pub turned: usize,
    /// Triangles with the same points, winding and group as an earlier triangle. Unsorted; ignored when counting edges.
    pub repeated: Vec<u32>,
}

/// Returns the point of each vertex, and the number of points.
fn points(positions: &[Vec3]) -> (Vec<u32>, usize) {
    let hasher = DefaultHashBuilder::default();
    let bits = |vertex: usize| {
        let [x, y, z] = positions[vertex].to_array().map(f32::to_bits);
        (x, y, z)
    };
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
        // Vertex 4 has the position of vertex 0.
        let triangles = [[0, 1, 2], [0, 2, 3], [1, 2, 4], [2, 0, 1], [3, 0, 2]];
        assert_eq!(odd(&triangles, &[]), (0, 0, vec![2, 3, 4]));
        // Triangles in different groups are not duplicates: two edges with three triangles, and one with four.
        assert_eq!(odd(&triangles, &[0, 1, 1, 0, 1]), (1, 2, vec![3, 4]));
        // Triangles with opposite winding are not duplicates.
        assert_eq!(odd(&[[0, 1, 2], [2, 1, 0], [1, 2, 0]], &[]), (0, 0, vec![2]));
    }

    #[test]
    fn edges_are_counted() {
        assert_eq!(odd(&[[0, 1, 2], [4, 3, 2]], &[]), (0, 1, vec![]));
        assert_eq!(odd(&[[0, 1, 2], [4, 2, 3], [2, 1, 0]], &[]), (1, 0, vec![]));
        assert_eq!(odd(&[[0, 1, 2], [0, 1, 2]], &[0, 1]), (0, 3, vec![]));
    }
}
