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

    /// Counts edges that the triangles do not make a surface around.
    pub fn edges(&self, triangles: &[[u32; 3]]) -> Edges {
        (0..self.count())
            .into_par_iter()
            .with_min_len(1024)
            .fold(
                || (Edges::default(), Vec::new()),
                |(edges, mut others), point| {
                    others.clear();
                    for triangle in self.around(point) {
                        let corners = triangles[*triangle as usize].map(|vertex| self.points[vertex as usize]);
                        for k in 0..3 {
                            let (from, to) = (corners[k] as usize, corners[(k + 1) % 3] as usize);
                            // Each edge is counted at its lower point.
                            if from == point && to > point {
                                others.push((to, true));
                            } else if to == point && from > point {
                                others.push((from, false));
                            }
                        }
                    }
                    others.sort_unstable();
                    let edges = others
                        .chunk_by(|a, b| a.0 == b.0)
                        .fold(edges, |edges, edge| match edge {
                            [a, b] if a.1 == b.1 => Edges {
                                turned: edges.turned + 1,
                                ..edges
                            },
                            [_, _, _, ..] => Edges {
                                crowded: edges.crowded + 1,
                                ..edges
                            },
                            _ => edges,
                        });
                    (edges, others)
                },
            )
            .map(|(edges, _)| edges)
            .reduce(Edges::default, |a, b| Edges {
                crowded: a.crowded + b.crowded,
                turned: a.turned + b.turned,
            })
    }
}

/// Numbers of edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Edges {
    /// They belong to more than two triangles.
    pub crowded: usize,
    /// Both of their triangles pass them in the same direction.
    pub turned: usize,
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
        assert_eq!(neighbours.edges(&triangles), Edges::default());
    }

    #[test]
    fn edges_are_counted() {
        let edges = |triangles: &[[u32; 3]]| Neighbours::of(&square(), triangles).edges(triangles);
        assert_eq!(edges(&[[0, 1, 2], [4, 3, 2]]), Edges { crowded: 0, turned: 1 });
        assert_eq!(edges(&[[0, 1, 2], [4, 2, 3], [2, 0, 1]]).crowded, 1);
        assert_eq!(edges(&[[0, 1, 2], [0, 1, 2]]), Edges { crowded: 0, turned: 3 });
    }
}
