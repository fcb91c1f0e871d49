//! A closed box as a surface, for tests.

use crate::geometry::Point;

/// Vertices and outward triangles of the box between two corners.
pub fn block(low: &Point, high: &Point) -> (Vec<Point>, Vec<[u32; 3]>) {
    let corner = |n: usize| {
        let pick = |axis: usize| [low, high][n >> axis & 1][axis];
        Point::new(pick(0), pick(1), pick(2))
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    ((0..8).map(corner).collect(), triangles.collect())
}
