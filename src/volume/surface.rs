//! Closed triangle surfaces of label volumes, in the world.

use super::surface_field::mask_field;
use super::surface_nets::surface_nets;
use super::{Volume, surface_query::Index};
use crate::geometry::{Point, Rigid, Vector};
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// How a surface is made from a mask. First the mask is coarsened, then smoothed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceParameters {
    /// Edge of the blocks of voxels that are averaged to one before meshing, in voxels; 1 keeps
    /// the grid. A factor of 2 gives about a quarter of the triangles.
    pub coarsening: usize,
    /// Standard deviation of the Gaussian that smooths the mask, in (coarsened) voxels. Zero keeps
    /// the steps of the voxels. A sheet thinner than about 1.35 times this vanishes, and a ball of
    /// radius r loses sigma^2 / r of it.
    pub smoothing_voxels: f64,
}

impl Default for SurfaceParameters {
    /// Full resolution; the smallest smoothing that makes normals of flat and round surfaces
    /// usable while plates of one voxel survive. Values ours.
    fn default() -> Self {
        Self {
            coarsening: 1,
            smoothing_voxels: 0.7,
        }
    }
}

impl SurfaceParameters {
    /// (field, what is wrong and what is expected) for every value out of range.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(1..=8).contains(&self.coarsening) {
            let text = format!(
                "is {}; expected a whole number from 1 to 8",
                self.coarsening
            );
            problems.push(("coarsening".to_owned(), text));
        }
        if !(0.0..=5.0).contains(&self.smoothing_voxels) {
            let text = format!("is {}; expected 0 to 5 voxels", self.smoothing_voxels);
            problems.push(("smoothing_voxels".to_owned(), text));
        }
        problems
    }
}

/// A triangle surface with its search tree. Triangles run anticlockwise as seen from outside.
#[derive(Clone)]
pub struct Surface {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    /// One unit vector per vertex.
    normals: Vec<Vector>,
    /// One vertex of each connected piece.
    pieces: Vec<u32>,
    /// Built at the first query: many surfaces are only moved or measured.
    index: OnceLock<Index>,
    /// One per vertex, at the first question.
    areas: OnceLock<Vec<f64>>,
}

impl std::fmt::Debug for Surface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Surface({} vertices, {} triangles)",
            self.vertices.len(),
            self.triangles.len()
        )
    }
}

impl Surface {
    /// The surface of the voxels for which `inside` is true, in the world of the volume. It is
    /// closed, also where the mask reaches the border of the grid, and lies between the centres of
    /// voxels inside and outside. Without such voxels the surface is empty.
    pub fn from_mask<T: Copy>(
        volume: &Volume<T>,
        inside: impl Fn(T) -> bool,
        parameters: &SurfaceParameters,
    ) -> Self {
        match mask_field(volume, inside, parameters) {
            Some(field) => Self::from_field(&field, 0.5),
            None => Self::new(Vec::new(), Vec::new()),
        }
    }

    /// The surface between the voxels of `field` of at least `level` (inside) and those below. It
    /// is open where the inside reaches the border of the grid.
    pub fn from_field(field: &Volume<f32>, level: f32) -> Self {
        let (vertices, triangles) = surface_nets(field, level);
        Self::new(vertices, triangles)
    }

    /// A surface of given vertices (world, mm) and triangles, anticlockwise from outside.
    ///
    /// # Panics
    /// When a triangle names a vertex that is not there.
    pub fn new(vertices: Vec<Point>, triangles: Vec<[u32; 3]>) -> Self {
        let normals = vertex_normals(&vertices, &triangles);
        let pieces = one_vertex_per_piece(vertices.len(), &triangles);
        Self {
            vertices,
            triangles,
            normals,
            pieces,
            index: OnceLock::new(),
            areas: OnceLock::new(),
        }
    }

    /// The search tree of the triangles.
    pub(super) fn index(&self) -> &Index {
        self.index
            .get_or_init(|| Index::new(&self.vertices, &self.triangles))
    }

    /// Positions in the surface's frame (the world for a mask's surface), mm.
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// Indices of vertices, anticlockwise as seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The outward unit normal of each vertex: the area-weighted mean of its triangles'.
    pub fn normals(&self) -> &[Vector] {
        &self.normals
    }

    /// One vertex of each connected piece.
    pub fn pieces(&self) -> impl Iterator<Item = Point> + '_ {
        self.pieces.iter().map(|&v| self.vertices[v as usize])
    }

    /// True for a surface without triangles.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The corners of one triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Point; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// The outward unit normal of a triangle; zero for one without area.
    pub fn triangle_normal(&self, triangle: usize) -> Vector {
        area_vector(&self.corners(triangle))
            .try_normalize(1e-12)
            .unwrap_or_default()
    }

    /// The outward unit normal at a point of a triangle, interpolated between its vertices.
    pub fn normal_at(&self, point: &Point, triangle: usize) -> Vector {
        let [a, b, c] = self.corners(triangle);
        let whole = area_vector(&[a, b, c]);
        let total = whole.norm_squared();
        if total <= 1e-24 {
            return self.normals[self.triangles[triangle][0] as usize];
        }
        let weight = |p: &Point, q: &Point| area_vector(&[*point, *p, *q]).dot(&whole) / total;
        let weights = [weight(&b, &c), weight(&c, &a), weight(&a, &b)];
        let mut normal = Vector::zeros();
        for (vertex, w) in self.triangles[triangle].iter().zip(weights) {
            normal += self.normals[*vertex as usize] * w;
        }
        normal
            .try_normalize(1e-12)
            .unwrap_or_else(|| self.triangle_normal(triangle))
    }

    /// Area in mm^2.
    pub fn area(&self) -> f64 {
        let half = |t: usize| area_vector(&self.corners(t)).norm() / 2.0;
        (0..self.triangles.len()).map(half).sum()
    }

    /// The part of the area that each vertex stands for (mm^2): a third of its triangles'.
    pub fn vertex_areas(&self) -> &[f64] {
        self.areas.get_or_init(|| {
            let mut areas = vec![0.0; self.vertices.len()];
            for (t, triangle) in self.triangles.iter().enumerate() {
                let third = area_vector(&self.corners(t)).norm() / 6.0;
                for &v in triangle {
                    areas[v as usize] += third;
                }
            }
            areas
        })
    }

    /// Enclosed volume in mm^3, by the divergence theorem; positive for outward triangles.
    pub fn volume(&self) -> f64 {
        let Some(&start) = self.vertices.first() else {
            return 0.0;
        };
        let six = |t: usize| {
            let [a, b, c] = self.corners(t).map(|p| p - start);
            a.dot(&b.cross(&c))
        };
        (0..self.triangles.len()).map(six).sum::<f64>() / 6.0
    }

    /// The centre of the enclosed volume, or `None` where there is none.
    pub fn centroid(&self) -> Option<Point> {
        let start = *self.vertices.first()?;
        let (mut total, mut moment) = (0.0, Vector::zeros());
        for t in 0..self.triangles.len() {
            let [a, b, c] = self.corners(t).map(|p| p - start);
            let six = a.dot(&b.cross(&c));
            total += six;
            moment += (a + b + c) * (six / 4.0);
        }
        (total.abs() > 1e-12).then(|| start + moment / total)
    }

    /// True when the surface has no border: each edge is run through as often in one direction as
    /// in the other.
    pub fn is_closed(&self) -> bool {
        let mut edges: Vec<(u32, u32, i32)> = Vec::with_capacity(3 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let direction = if from < to { 1 } else { -1 };
                edges.push((from.min(to), from.max(to), direction));
            }
        }
        edges.sort_unstable();
        edges
            .chunk_by(|p, q| (p.0, p.1) == (q.0, q.1))
            .all(|edge| edge.iter().map(|e| e.2).sum::<i32>() == 0)
    }

    /// The same surface in another frame: `target_from_source` maps this one's to it.
    pub fn transformed(&self, target_from_source: &Rigid) -> Self {
        let vertices = self.vertices.iter().map(|p| target_from_source * p);
        Self::new(vertices.collect(), self.triangles.clone())
    }

    /// Every vertex moved by `distance_mm` along its outward normal (inward where negative): a
    /// parallel surface as long as the distance stays below the radii of curvature.
    pub fn offset(&self, distance_mm: f64) -> Self {
        let vertices = self.vertices.iter().zip(&self.normals);
        let vertices = vertices.map(|(p, n)| p + n * distance_mm).collect();
        Self::new(vertices, self.triangles.clone())
    }
}

/// Normal times twice the area.
fn area_vector([a, b, c]: &[Point; 3]) -> Vector {
    (b - a).cross(&(c - a))
}

fn vertex_normals(vertices: &[Point], triangles: &[[u32; 3]]) -> Vec<Vector> {
    let mut normals = vec![Vector::zeros(); vertices.len()];
    for triangle in triangles {
        let area = area_vector(&triangle.map(|v| vertices[v as usize]));
        for &v in triangle {
            normals[v as usize] += area;
        }
    }
    for normal in &mut normals {
        *normal = normal.try_normalize(1e-12).unwrap_or_default();
    }
    normals
}

/// The lowest vertex of each connected piece, in rising order.
fn one_vertex_per_piece(vertices: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    let mut parent: Vec<u32> = (0..vertices as u32).collect();
    let mut used = vec![false; vertices];
    for &[a, b, c] in triangles {
        used[a as usize] = true;
        for other in [b, c] {
            used[other as usize] = true;
            let (p, q) = (root(&mut parent, a), root(&mut parent, other));
            parent[p.max(q) as usize] = p.min(q);
        }
    }
    (0..vertices as u32)
        .filter(|&v| used[v as usize] && parent[v as usize] == v)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Grid;
    use std::f64::consts::PI;

    /// A ball on an oblique grid of 1 mm whose voxels are asymmetric about its centre.
    fn ball(center: Point, radius: f64) -> Volume<u8> {
        let rotation = nalgebra::Rotation3::from_euler_angles(0.3, -0.2, 0.5);
        let grid = Grid {
            dims: [60, 64, 62],
            spacing: [1.0; 3],
            origin: center - rotation * Vector::new(29.3, 31.6, 30.1),
            direction: *rotation.matrix(),
        };
        let data = (0..grid.len())
            .map(|o| u8::from((grid.center(grid.voxel(o)) - center).norm() <= radius))
            .collect();
        Volume::new(grid, data)
    }

    #[test]
    fn a_ball_is_centred_and_has_its_volume_and_area() {
        let (center, radius) = (Point::new(-120.4, 33.3, 812.0), 24.0);
        let mask = ball(center, radius);
        // Coarser voxels are smoothed more, which takes sigma^2 / r off the radius.
        for (coarsening, off) in [(1, 0.01), (2, 0.025)] {
            let parameters = SurfaceParameters {
                coarsening,
                ..Default::default()
            };
            let surface = Surface::from_mask(&mask, |v| v == 1, &parameters);
            // The voxels' own centroid lies a few microns off the ball's centre.
            let (mut sum, mut count) = (Vector::zeros(), 0.0);
            for (offset, &v) in mask.data.iter().enumerate() {
                if v == 1 {
                    sum += mask.grid.center(mask.grid.voxel(offset)) - center;
                    count += 1.0;
                }
            }
            let found = surface.centroid().unwrap() - center;
            assert!((found - sum / count).norm() < 0.01, "{found:?}");
            assert!(found.norm() < 0.02, "{found:?}");
            let volume = 4.0 / 3.0 * PI * radius.powi(3);
            assert!((surface.volume() / volume - 1.0).abs() < off);
            let area = 4.0 * PI * radius * radius;
            assert!((surface.area() / area - 1.0).abs() < 2.0 * off);
            assert!(surface.is_closed());
            assert_eq!(surface.pieces().count(), 1);
        }
    }

    #[test]
    fn normals_point_outward_also_on_a_left_handed_grid() {
        let center = Point::new(5.0, -8.0, 2.0);
        let mut mask = ball(center, 20.0);
        for flip in [false, true] {
            if flip {
                let axis = mask.grid.direction.column(0).into_owned();
                mask.grid.origin += axis * (mask.grid.dims[0] as f64 - 1.0);
                mask.grid.direction.set_column(0, &-axis);
                let (grid, data) = (mask.grid.clone(), mask.data.clone());
                for (o, v) in mask.data.iter_mut().enumerate() {
                    let [i, j, k] = grid.voxel(o);
                    *v = data[grid.offset(grid.dims[0] - 1 - i, j, k)];
                }
            }
            let surface = Surface::from_mask(&mask, |v| v == 1, &SurfaceParameters::default());
            assert!(surface.volume() > 0.0);
            let mut sum = 0.0;
            for (p, n) in surface.vertices().iter().zip(surface.normals()) {
                let cosine = n.dot(&(p - center).normalize());
                assert!(cosine > 0.9, "flip {flip}: cosine {cosine} at {p}");
                sum += cosine;
            }
            assert!(sum / surface.normals().len() as f64 > 0.994);
        }
    }

    #[test]
    fn a_box_without_smoothing_lies_half_a_voxel_outside_its_centres() {
        let grid = Grid::axis_aligned([4, 5, 6], 2.0, Point::new(10.0, 20.0, 30.0));
        // The whole grid is inside: the surface must close beyond its border.
        let mask = Volume::filled(grid, 1u8);
        let parameters = SurfaceParameters {
            smoothing_voxels: 0.0,
            ..Default::default()
        };
        let surface = Surface::from_mask(&mask, |v| v == 1, &parameters);
        assert!(surface.is_closed());
        let x = surface.vertices().iter().map(|p| p.x);
        let (low, high) = (
            x.clone().fold(f64::MAX, f64::min),
            x.fold(f64::MIN, f64::max),
        );
        assert!((low - 9.0).abs() < 1e-6 && (high - 17.0).abs() < 1e-6);
    }

    #[test]
    fn random_voxels_give_a_closed_surface() {
        use crate::random::{Purpose, stream};
        use rand::RngExt;
        let mut stream = stream(7, Purpose::PhantomShape, "surface test");
        let grid = Grid::axis_aligned([12, 11, 10], 1.0, Point::origin());
        for _ in 0..20 {
            let data = (0..grid.len())
                .map(|_| stream.random_range(0..2u8))
                .collect();
            let mask = Volume::new(grid.clone(), data);
            for smoothing_voxels in [0.0, 0.7] {
                let parameters = SurfaceParameters {
                    smoothing_voxels,
                    ..Default::default()
                };
                let surface = Surface::from_mask(&mask, |v| v == 1, &parameters);
                assert!(surface.is_closed() && !surface.is_empty());
            }
        }
    }

    #[test]
    fn an_offset_ball_has_the_other_radius() {
        let center = Point::origin();
        let surface = Surface::from_mask(&ball(center, 20.0), |v| v == 1, &Default::default());
        let smaller = surface.offset(-1.0);
        let radius = |s: &Surface| (s.volume() * 3.0 / (4.0 * PI)).cbrt();
        assert!((radius(&surface) - radius(&smaller) - 1.0).abs() < 0.01);
    }

    #[test]
    fn nothing_has_an_empty_surface() {
        let surface =
            Surface::from_mask(&ball(Point::origin(), 9.0), |v| v == 2, &Default::default());
        assert!(surface.is_empty() && surface.is_closed() && surface.centroid().is_none());
        assert_eq!(surface.volume(), 0.0);
    }
}
