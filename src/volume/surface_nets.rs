//! Surface nets: one vertex in each cell of eight voxels that the surface crosses, one quadrilateral
//! around each pair of neighbouring voxels of which one is inside (Gibson 1998,
//! doi:10.1007/BFb0056277). The mesh is closed by construction and needs no table of cases.

use super::Volume;
use crate::geometry::Point;

/// No vertex in this cell.
const NONE: u32 = u32::MAX;

/// Vertices (world, mm) and triangles, anticlockwise from outside, of the surface between voxels
/// of at least `level` (inside) and those below.
pub(super) fn surface_nets(field: &Volume<f32>, level: f32) -> (Vec<Point>, Vec<[u32; 3]>) {
    let dims = field.grid.dims;
    let mut mesh = Mesh {
        vertices: Vec::new(),
        triangles: Vec::new(),
        flipped: field.grid.direction.determinant() < 0.0,
    };
    if dims.iter().any(|&n| n < 2) {
        return (mesh.vertices, mesh.triangles);
    }
    let cells = [dims[0] - 1, dims[1] - 1];
    let cell = |i: usize, j: usize| j * cells[0] + i;
    // The vertices of the cells of the slab below (k - 1) and of the current one (k).
    let mut below = vec![NONE; cells[0] * cells[1]];
    let mut here = below.clone();
    for k in 0..dims[2] - 1 {
        std::mem::swap(&mut below, &mut here);
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                here[cell(i, j)] = mesh.cell_vertex(field, level, [i, j, k]);
            }
        }
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                let inside = field.at(i, j, k) >= level;
                // Edges on the grid's border have no four cells around them.
                let crosses = |i, j, k| (field.at(i, j, k) >= level) != inside;
                if j > 0 && k > 0 && crosses(i + 1, j, k) {
                    let around = [
                        below[cell(i, j - 1)],
                        below[cell(i, j)],
                        here[cell(i, j)],
                        here[cell(i, j - 1)],
                    ];
                    mesh.quad(around, inside);
                }
                if i > 0 && k > 0 && crosses(i, j + 1, k) {
                    let around = [
                        below[cell(i - 1, j)],
                        here[cell(i - 1, j)],
                        here[cell(i, j)],
                        below[cell(i, j)],
                    ];
                    mesh.quad(around, inside);
                }
                if i > 0 && j > 0 && crosses(i, j, k + 1) {
                    let around = [
                        here[cell(i - 1, j - 1)],
                        here[cell(i, j - 1)],
                        here[cell(i, j)],
                        here[cell(i - 1, j)],
                    ];
                    mesh.quad(around, inside);
                }
            }
        }
    }
    (mesh.vertices, mesh.triangles)
}

/// The twelve edges of a cell: the corner they start from and their axis.
const EDGES: [([usize; 3], usize); 12] = [
    ([0, 0, 0], 0),
    ([0, 1, 0], 0),
    ([0, 0, 1], 0),
    ([0, 1, 1], 0),
    ([0, 0, 0], 1),
    ([1, 0, 0], 1),
    ([0, 0, 1], 1),
    ([1, 0, 1], 1),
    ([0, 0, 0], 2),
    ([1, 0, 0], 2),
    ([0, 1, 0], 2),
    ([1, 1, 0], 2),
];

struct Mesh {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    /// The grid's axes are left-handed, so that orders turn around in the world.
    flipped: bool,
}

impl Mesh {
    /// Adds the vertex of a cell: the mean of the level's crossings with the cell's edges.
    fn cell_vertex(&mut self, field: &Volume<f32>, level: f32, [i, j, k]: [usize; 3]) -> u32 {
        let corner = |[a, b, c]: [usize; 3]| field.at(i + a, j + b, k + c);
        let first = corner([0, 0, 0]) >= level;
        let alike = (1..8).all(|c| (corner([c & 1, c >> 1 & 1, c >> 2]) >= level) == first);
        if alike {
            return NONE;
        }
        let (mut sum, mut count) = ([0.0f64; 3], 0.0);
        for (start, axis) in EDGES {
            let mut end = start;
            end[axis] = 1;
            let (f0, f1) = (corner(start), corner(end));
            if (f0 >= level) != (f1 >= level) {
                let t = f64::from(level - f0) / f64::from(f1 - f0);
                for a in 0..3 {
                    sum[a] += start[a] as f64;
                }
                sum[axis] += t;
                count += 1.0;
            }
        }
        let [x, y, z] = sum.map(|s| s / count);
        let vertex = self.vertices.len() as u32;
        let point = field.grid.point(i as f64 + x, j as f64 + y, k as f64 + z);
        self.vertices.push(point);
        vertex
    }

    /// Adds the quadrilateral of four cells that run anticlockwise as seen from the end of the
    /// pair of voxels, the start of which is inside or not; split along its shorter diagonal.
    fn quad(&mut self, around: [u32; 4], start_is_inside: bool) {
        let [a, b, c, d] = around;
        let diagonal =
            |p: u32, q: u32| (self.vertices[p as usize] - self.vertices[q as usize]).norm_squared();
        let halves = if diagonal(a, c) <= diagonal(b, d) {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        };
        for [p, q, r] in halves {
            let outward = start_is_inside != self.flipped;
            self.triangles
                .push(if outward { [p, q, r] } else { [p, r, q] });
        }
    }
}
