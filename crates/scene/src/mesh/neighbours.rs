//! Mesh adjacency by points. A point consists of all vertices with equal positions, independent of their other
//! attributes.

use std::hash::BuildHasher;

use glam::Vec3;
use hashbrown::{DefaultHashBuilder, HashTable};
use rayon::prelude::*;

pub(super) struct Adjacency {
    /// Index of the point of each vertex.
    pub points: Vec<u32>,
    /// For each point, the start of its triangles in `triangles`.
    starts: Vec<u32>,
    /// The triangles of each point, in ascending order.
    triangles: Vec<u32>,
}

impl Adjacency {
    /// Groups vertices into points. Positions must not contain -0, because their bits are compared.
    pub fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Adjacency {
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
        let mut sorted = vec![0; sum as usize];
        for (i, triangle) in triangles.iter().enumerate().rev() {
            for vertex in triangle {
                let start = &mut starts[points[*vertex as usize] as usize];
                *start -= 1;
                sorted[*start as usize] = i as u32;
            }
        }
        Adjacency {
            points,
            starts,
            triangles: sorted,
        }
    }

    pub fn point_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns the triangles at a point, in ascending order.
    pub fn triangles_at(&self, point: usize) -> &[u32] {
        &self.triangles[self.starts[point] as usize..self.starts[point + 1] as usize]
    }

    /// Finds non-manifold edges, inconsistent winding and duplicate triangles. If `group_of` is empty, all triangles
    /// are in one group.
    pub fn find_irregularities(&self, triangles: &[[u32; 3]], group_of: &[u32]) -> Irregularities {
        (0..self.point_count())
            .into_par_iter()
            .with_min_len(1024)
            .fold(
                || (Irregularities::default(), Vec::new()),
                |(mut irregularities, mut other_ends), point| {
                    let (mut non_manifold, mut inconsistent) =
                        self.irregular_edges(triangles, point, &[], &mut other_ends);
                    // Counted without duplicate triangles, which would make their edges irregular.
                    if non_manifold + inconsistent > 0 {
                        let duplicates = self.duplicates(triangles, group_of, point);
                        if !duplicates.is_empty() {
                            (non_manifold, inconsistent) =
                                self.irregular_edges(triangles, point, &duplicates, &mut other_ends);
                            let lowest_point =
                                |triangle: &u32| self.points_of(triangles, *triangle).iter().min().copied();
                            irregularities
                                .duplicates
                                .extend(duplicates.iter().filter(|t| lowest_point(t) == Some(point as u32)));
                        }
                    }
                    irregularities.non_manifold += non_manifold;
                    irregularities.inconsistent += inconsistent;
                    (irregularities, other_ends)
                },
            )
            .map(|(irregularities, _)| irregularities)
            .reduce(Irregularities::default, |mut a, b| {
                a.non_manifold += b.non_manifold;
                a.inconsistent += b.inconsistent;
                a.duplicates.extend(b.duplicates);
                a
            })
    }

    /// Counts the non-manifold edges and the edges with inconsistent winding whose point with the lower index is
    /// `point`. Skips the triangles in `skipped`, which is sorted. `other_ends` is scratch memory.
    #[inline]
    fn irregular_edges(
        &self,
        triangles: &[[u32; 3]],
        point: usize,
        skipped: &[u32],
        other_ends: &mut Vec<(u32, bool)>,
    ) -> (usize, usize) {
        other_ends.clear();
        for triangle in self.triangles_at(point) {
            if !skipped.is_empty() && skipped.binary_search(triangle).is_ok() {
                continue;
            }
            let corners = self.points_of(triangles, *triangle);
            for k in 0..3 {
                let (start, end) = (corners[k], corners[(k + 1) % 3]);
                if start as usize == point && end as usize > point {
                    other_ends.push((end, true));
                } else if end as usize == point && start as usize > point {
                    other_ends.push((start, false));
                }
            }
        }
        other_ends.sort_unstable();
        let edges = other_ends.chunk_by(|a, b| a.0 == b.0);
        edges.fold((0, 0), |(non_manifold, inconsistent), edge| match edge {
            [a, b] if a.1 == b.1 => (non_manifold, inconsistent + 1),
            [_, _, _, ..] => (non_manifold + 1, inconsistent),
            _ => (non_manifold, inconsistent),
        })
    }

    /// Returns the triangles at a point that have the same points, winding and group as an earlier triangle.
    fn duplicates(&self, triangles: &[[u32; 3]], group_of: &[u32], point: usize) -> Vec<u32> {
        let mut keyed: Vec<_> = (self.triangles_at(point).iter())
            .map(|triangle| {
                let [a, b, c] = self.points_of(triangles, *triangle);
                let other_points = match point as u32 {
                    p if p == a => [b, c],
                    p if p == b => [c, a],
                    _ => [a, b],
                };
                let group = group_of.get(*triangle as usize).copied().unwrap_or(0);
                (other_points, group, *triangle)
            })
            .collect();
        keyed.sort_unstable();
        let pairs = keyed.windows(2);
        let pairs = pairs.filter(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1));
        let mut duplicates: Vec<u32> = pairs.map(|pair| pair[1].2).collect();
        duplicates.sort_unstable();
        duplicates
    }

    fn points_of(&self, triangles: &[[u32; 3]], triangle: u32) -> [u32; 3] {
        triangles[triangle as usize].map(|vertex| self.points[vertex as usize])
    }
}

/// Irregular edges and duplicate triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Irregularities {
    /// Number of edges with more than two triangles.
    pub non_manifold: usize,
    /// Number of edges that both of their triangles traverse in the same direction: the winding is inconsistent.
    pub inconsistent: usize,
    /// Triangles with the same points, winding and group as an earlier triangle, unsorted. The numbers of edges ignore
    /// these triangles.
    pub duplicates: Vec<u32>,
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
        let adjacency = Adjacency::of(&square(), &triangles);
        assert_eq!(adjacency.points, [0, 1, 2, 3, 0]);
        assert_eq!(adjacency.triangles_at(0), [0, 1]);
        assert_eq!(adjacency.triangles_at(1), [0]);
        assert_eq!(adjacency.triangles_at(3), [1]);
        assert_eq!(
            adjacency.find_irregularities(&triangles, &[]),
            Irregularities::default()
        );
    }

    fn irregularities(triangles: &[[u32; 3]], groups: &[u32]) -> (usize, usize, Vec<u32>) {
        let mut irregularities = Adjacency::of(&square(), triangles).find_irregularities(triangles, groups);
        irregularities.duplicates.sort_unstable();
        (
            irregularities.non_manifold,
            irregularities.inconsistent,
            irregularities.duplicates,
        )
    }

    #[test]
    fn duplicate_triangles_are_found() {
        // Vertex 4 has the position of vertex 0.
        let triangles = [[0, 1, 2], [0, 2, 3], [1, 2, 4], [2, 0, 1], [3, 0, 2]];
        assert_eq!(irregularities(&triangles, &[]), (0, 0, vec![2, 3, 4]));
        // Triangles 0 and 2 are not duplicates, because their groups differ. Two of their edges have inconsistent
        // winding; the third edge, which triangle 1 shares, is not manifold.
        assert_eq!(irregularities(&triangles, &[0, 1, 1, 0, 1]), (1, 2, vec![3, 4]));
        // Triangles with opposite winding are not duplicates.
        assert_eq!(irregularities(&[[0, 1, 2], [2, 1, 0], [1, 2, 0]], &[]), (0, 0, vec![2]));
    }

    #[test]
    fn irregular_edges_are_counted() {
        assert_eq!(irregularities(&[[0, 1, 2], [4, 3, 2]], &[]), (0, 1, vec![]));
        assert_eq!(irregularities(&[[0, 1, 2], [4, 2, 3], [2, 1, 0]], &[]), (1, 0, vec![]));
        assert_eq!(irregularities(&[[0, 1, 2], [0, 1, 2]], &[0, 1]), (0, 3, vec![]));
    }
}
