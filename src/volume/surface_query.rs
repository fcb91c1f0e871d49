//! Rays, closest points, containment and intersection of surfaces.
//!
//! A bounding volume hierarchy (parry3d, single precision, boxes widened by more than its
//! rounding) finds the candidates; every decision is made on the triangles in double precision.

use super::Surface;
use crate::geometry::{Point, Ray, Rigid, Vector};
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector as Vector32;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhNode};

/// How far boxes are widened, in mm: well above the rounding of coordinates below 10 m to `f32`.
const WIDENING_MM: f64 = 2e-3;

/// The search tree of a surface's triangles.
#[derive(Clone)]
pub(super) struct Index {
    tree: Bvh,
}

impl Index {
    pub(super) fn new(vertices: &[Point], triangles: &[[u32; 3]]) -> Self {
        let leaves: Vec<Aabb> = triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|v| vertices[v as usize]);
                let low = a.inf(&b).inf(&c) - Vector::repeat(WIDENING_MM);
                let high = a.sup(&b).sup(&c) + Vector::repeat(WIDENING_MM);
                Aabb::new(single(&low), single(&high))
            })
            .collect();
        Self {
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves),
        }
    }
}

fn single(p: &Point) -> Vector32 {
    Vector32::new(p.x as f32, p.y as f32, p.z as f32)
}

fn double(v: Vector32) -> Point {
    Point::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Parameter along the ray (mm where its direction has unit length).
    pub t: f64,
    /// True where the ray enters the enclosed volume.
    pub entering: bool,
    /// Index of the triangle.
    pub triangle: usize,
}

impl Surface {
    /// All intersections of a ray (`t >= 0`) with the surface, by rising `t`. A ray through an
    /// edge or a vertex counts once, so that a closed surface is left as often as it is entered.
    pub fn intersections(&self, ray: &Ray) -> Vec<Hit> {
        let sheared = Sheared::new(ray);
        let crossed = |node: &BvhNode| {
            ray.clip(&double(node.mins()), &double(node.maxs()))
                .is_some_and(|(_, leave)| leave >= 0.0)
        };
        let mut hits: Vec<Hit> = self
            .index()
            .tree
            .leaves(crossed)
            .filter_map(|triangle| {
                let triangle = triangle as usize;
                let (t, entering) = sheared.hit(&self.corners(triangle))?;
                (t >= 0.0).then_some(Hit {
                    t,
                    entering,
                    triangle,
                })
            })
            .collect();
        hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle)));
        hits
    }

    /// True when the point lies inside the (closed) surface.
    pub fn contains(&self, point: &Point) -> bool {
        // Any direction does; this one is along no grid axis and no plane of symmetry.
        let ray = Ray {
            origin: *point,
            direction: Vector::new(0.299, 0.787, 0.541),
        };
        let depth: i32 = self
            .intersections(&ray)
            .iter()
            .map(|hit| if hit.entering { -1 } else { 1 })
            .sum();
        depth > 0
    }

    /// The point of the surface closest to `point`, and its triangle; `None` for an empty surface.
    pub fn closest_point(&self, point: &Point) -> Option<(Point, usize)> {
        let to_box = |node: &BvhNode, _best: f32| {
            let (low, high) = (double(node.mins()), double(node.maxs()));
            let beyond = (low - point).sup(&(point - high)).sup(&Vector::zeros());
            beyond.norm() as f32
        };
        let to_triangle = |triangle: u32, _best: f32| {
            let nearest = closest_on_triangle(point, &self.corners(triangle as usize));
            Some(((nearest - point).norm() as f32, nearest))
        };
        let (triangle, (_, nearest)) =
            self.index().tree.find_best(f32::MAX, to_box, to_triangle)?;
        Some((nearest, triangle as usize))
    }

    /// True when the two surfaces cross. `self_from_other` is the pose of `other` in this
    /// surface's frame. One surface wholly inside the other does not cross it.
    pub fn crosses(&self, other: &Surface, self_from_other: &Rigid) -> bool {
        let rotation = self_from_other.rotation.to_rotation_matrix();
        let spread = rotation.matrix().abs();
        let overlap = |mine: &BvhNode, theirs: &BvhNode| {
            let (low, high) = (double(theirs.mins()), double(theirs.maxs()));
            let center = self_from_other * nalgebra::center(&low, &high);
            let half = spread * ((high - low) / 2.0);
            let (my_low, my_high) = (double(mine.mins()), double(mine.maxs()));
            (0..3).all(|a| center[a] - half[a] <= my_high[a] && my_low[a] <= center[a] + half[a])
        };
        self.index()
            .tree
            .leaf_pairs(&other.index().tree, overlap)
            .any(|(mine, theirs)| {
                let theirs = other.corners(theirs as usize).map(|p| self_from_other * p);
                triangles_cross(&self.corners(mine as usize), &theirs)
            })
    }

    /// True when a piece of `other` lies inside this surface, judged by one vertex of each piece:
    /// right for surfaces that do not cross.
    pub fn contains_piece_of(&self, other: &Surface, self_from_other: &Rigid) -> bool {
        other
            .pieces()
            .any(|p| self.contains(&(self_from_other * p)))
    }
}

/// A ray in the coordinates in which it is the axis (0, 0, 1): the watertight test of Woop,
/// Benthin and Wald (2013, JCGT 2(1)), with a tie rule for rays through edges and vertices.
struct Sheared {
    origin: Point,
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Sheared {
    fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let z = d.iamax();
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        Self {
            origin: ray.origin,
            axes: [x, y, z],
            shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]],
        }
    }

    /// The parameter along the ray's line and whether it enters there.
    fn hit(&self, corners: &[Point; 3]) -> Option<(f64, bool)> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = p - self.origin;
            [
                p[x] - self.shear[0] * p[z],
                p[y] - self.shear[1] * p[z],
                self.shear[2] * p[z],
            ]
        });
        let (u, u_side) = edge(&b, &c);
        let (v, v_side) = edge(&c, &a);
        let (w, w_side) = edge(&a, &b);
        if u_side != v_side || v_side != w_side {
            return None;
        }
        let total = u + v + w;
        if total == 0.0 {
            return None;
        }
        let t = (u * a[2] + v * b[2] + w * c[2]) / total;
        Some((t, !u_side))
    }
}

/// The edge function of p -> q at the ray, and on which side of the edge the ray passes. Running
/// the edge the other way negates both exactly; a ray on the edge is pushed to one side by a rule
/// that depends on the edge alone, so that of all triangles around it each sheet is hit once.
fn edge(p: &[f64; 3], q: &[f64; 3]) -> (f64, bool) {
    let value = p[0] * q[1] - p[1] * q[0];
    let side = if value == 0.0 {
        (q[1] - p[1], p[0] - q[0]) > (0.0, 0.0)
    } else {
        value > 0.0
    };
    (value, side)
}

/// The point of a triangle closest to `p`, by the region of the plane that `p` projects to
/// (Ericson 2005, section 5.1.5).
pub(crate) fn closest_on_triangle(p: &Point, [a, b, c]: &[Point; 3]) -> Point {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(&(p - a)), ac.dot(&(p - a)));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let (d3, d4) = (ab.dot(&(p - b)), ac.dot(&(p - b)));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let (d5, d6) = (ab.dot(&(p - c)), ac.dot(&(p - c)));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    a + (ab * vb + ac * vc) / (va + vb + vc)
}

/// True when an edge of one triangle passes through the other. Triangles in one plane do not
/// count: in closed surfaces their neighbours then cross.
fn triangles_cross(first: &[Point; 3], second: &[Point; 3]) -> bool {
    let sides = |plane: &[Point; 3], points: &[Point; 3]| {
        let normal = (plane[1] - plane[0]).cross(&(plane[2] - plane[0]));
        points.map(|p| normal.dot(&(p - plane[0])))
    };
    let apart = |s: &[f64; 3]| s.iter().all(|&v| v > 0.0) || s.iter().all(|&v| v < 0.0);
    let of_second = sides(first, second);
    if apart(&of_second) {
        return false;
    }
    let of_first = sides(second, first);
    if apart(&of_first) {
        return false;
    }
    (0..3).any(|i| {
        let j = (i + 1) % 3;
        (of_second[i] > 0.0) != (of_second[j] > 0.0)
            && line_passes_through(&second[i], &second[j], first)
            || (of_first[i] > 0.0) != (of_first[j] > 0.0)
                && line_passes_through(&first[i], &first[j], second)
    })
}

/// True when the line p q passes through the triangle.
fn line_passes_through(p: &Point, q: &Point, [a, b, c]: &[Point; 3]) -> bool {
    let d = q - p;
    let side = |from: &Point, to: &Point| d.dot(&(from - p).cross(&(to - p)));
    let (u, v, w) = (side(a, b), side(b, c), side(c, a));
    (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};
    use crate::volume::{Grid, SurfaceParameters, Volume};
    use rand::RngExt;

    fn ball(center: Point, radius: f64) -> Surface {
        let grid = Grid::axis_aligned([64; 3], 1.0, center - Vector::repeat(31.7));
        let data = (0..grid.len())
            .map(|o| (grid.center(grid.voxel(o)) - center).norm() <= radius)
            .collect();
        let mask = Volume::new(grid, data);
        Surface::from_mask(&mask, |v| v, &SurfaceParameters::default())
    }

    /// An octahedron with its corners on the axes: rays along axes meet corners and edges exactly.
    fn octahedron() -> Surface {
        let p = |x: i32, y: i32, z: i32| Point::new(x.into(), y.into(), z.into());
        let vertices = vec![
            p(1, 0, 0),
            p(-1, 0, 0),
            p(0, 1, 0),
            p(0, -1, 0),
            p(0, 0, 1),
            p(0, 0, -1),
        ];
        let triangles = vec![
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        Surface::new(vertices, triangles)
    }

    #[test]
    fn a_ray_through_a_ball_enters_and_leaves_where_a_sphere_says() {
        let (center, radius) = (Point::new(200.0, -30.0, 900.0), 25.0);
        let surface = ball(center, radius);
        let mut stream = stream(3, Purpose::PhantomShape, "ray test");
        let (mut met, mut squares) = (0, 0.0);
        for _ in 0..500 {
            let mut draw = || Vector::from_fn(|_, _| stream.random_range(-40.0..40.0));
            let origin = center + draw().normalize() * 80.0;
            let direction = (center + draw() * 0.5 - origin).normalize();
            let hits = surface.intersections(&Ray { origin, direction });
            let toward = direction.dot(&(center - origin));
            let miss2 = (center - origin).norm_squared() - toward * toward;
            let half = (radius * radius - miss2).sqrt();
            if miss2 < (radius - 1.0).powi(2) {
                met += 1;
                assert_eq!(hits.len(), 2, "{hits:?}");
                assert!(hits[0].entering && !hits[1].entering);
                // A grazing ray turns a radial error (voxels: below 0.45 mm) into a longer one.
                let errors = [hits[0].t - (toward - half), hits[1].t - (toward + half)];
                let radial = errors.map(|e| e * half / radius);
                assert!(radial.iter().all(|e| e.abs() < 0.45), "{errors:?}");
                squares += radial[0].powi(2) + radial[1].powi(2);
                let normal = surface.triangle_normal(hits[0].triangle);
                assert!(normal.dot(&direction) < 0.0);
            } else if miss2 > (radius + 1.0).powi(2) {
                assert!(hits.is_empty());
            }
        }
        assert!(met > 100, "{met}");
        let rms = (squares / f64::from(2 * met)).sqrt();
        assert!(rms < 0.12, "{rms}");
    }

    #[test]
    fn rays_through_corners_and_edges_count_once() {
        let surface = octahedron();
        assert!(surface.is_closed() && surface.volume() > 0.0);
        // Through two opposite corners, through two opposite edges, and off both.
        let through = [
            (Point::new(-5.0, 0.0, 0.0), Vector::x()),
            (Point::new(0.0, 5.0, 0.0), -Vector::y()),
            (Point::new(0.0, 0.0, -5.0), Vector::z() * 2.0),
            (Point::new(-5.0, -5.0, 0.0), Vector::new(1.0, 1.0, 0.0)),
            (Point::new(0.0, 0.25, -5.0), Vector::z()),
            (Point::new(0.3, 0.2, -5.0), Vector::z()),
        ];
        for (origin, direction) in through {
            let hits = surface.intersections(&Ray { origin, direction });
            assert_eq!(hits.len(), 2, "from {origin} along {direction}: {hits:?}");
            assert!(hits[0].entering && !hits[1].entering);
        }
        // Along the silhouette, through corners: as often in as out.
        for (origin, direction) in [
            (Point::new(1.0, 0.0, -5.0), Vector::z()),
            (Point::new(-5.0, 0.0, 1.0), Vector::x()),
            (Point::new(2.0, -1.0, 0.0), Vector::new(-1.0, 1.0, 0.0)),
        ] {
            let hits = surface.intersections(&Ray { origin, direction });
            let entering = hits.iter().filter(|h| h.entering).count();
            assert_eq!(entering * 2, hits.len(), "from {origin} along {direction}");
        }
    }

    #[test]
    fn hits_behind_the_origin_do_not_count() {
        let ray = Ray {
            origin: Point::origin(),
            direction: Vector::new(0.2, 0.1, 2.0),
        };
        let hits = octahedron().intersections(&ray);
        assert_eq!(hits.len(), 1);
        assert!(!hits[0].entering && hits[0].t > 0.0);
    }

    #[test]
    fn contains_agrees_with_the_sphere() {
        let center = Point::new(1.0, 2.0, 3.0);
        let surface = ball(center, 20.0);
        let mut stream = stream(4, Purpose::PhantomShape, "inside test");
        for _ in 0..500 {
            let p = center + Vector::from_fn(|_, _| stream.random_range(-25.0..25.0));
            let r = (p - center).norm();
            if (r - 20.0).abs() > 0.3 {
                assert_eq!(surface.contains(&p), r < 20.0, "at radius {r}");
            }
        }
    }

    #[test]
    fn the_closest_point_is_that_of_all_triangles() {
        let surface = ball(Point::new(-90.0, 10.0, 400.0), 12.0);
        let mut stream = stream(5, Purpose::PhantomShape, "closest test");
        for _ in 0..50 {
            let p = Point::new(-90.0, 10.0, 400.0)
                + Vector::from_fn(|_, _| stream.random_range(-30.0..30.0));
            let (found, triangle) = surface.closest_point(&p).unwrap();
            let brute = (0..surface.triangles().len())
                .map(|t| (closest_on_triangle(&p, &surface.corners(t)) - p).norm())
                .fold(f64::MAX, f64::min);
            assert!(((found - p).norm() - brute).abs() < 1e-5);
            let own = closest_on_triangle(&p, &surface.corners(triangle));
            assert_eq!(own, found);
        }
    }

    /// The closest point of a triangle against a fine sampling of it.
    #[test]
    fn the_closest_point_of_a_triangle_beats_its_samples() {
        let triangle = [
            Point::new(0.0, 0.0, 0.0),
            Point::new(4.0, 0.5, 0.0),
            Point::new(1.0, 3.0, 1.0),
        ];
        let mut stream = stream(6, Purpose::PhantomShape, "triangle test");
        for _ in 0..300 {
            let p = Point::from(Vector::from_fn(|_, _| stream.random_range(-4.0..6.0)));
            let best = (closest_on_triangle(&p, &triangle) - p).norm();
            let mut sampled = f64::MAX;
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (u, v) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                    let q = triangle[0]
                        + (triangle[1] - triangle[0]) * u
                        + (triangle[2] - triangle[0]) * v;
                    sampled = sampled.min((q - p).norm());
                }
            }
            assert!(best <= sampled + 1e-12 && sampled < best + 0.1);
        }
    }

    #[test]
    fn balls_cross_when_their_distance_lies_between_difference_and_sum_of_radii() {
        let (large, small) = (ball(Point::origin(), 25.0), ball(Point::origin(), 10.0));
        let turn = Vector::new(0.4, -0.3, 0.2);
        let direction = Vector::new(0.6, -0.64, 0.48);
        for (distance, expected) in [
            (0.0, false),
            (14.7, false),
            (15.3, true),
            (25.0, true),
            (34.7, true),
            (35.3, false),
            (90.0, false),
        ] {
            let pose = Rigid::new(direction * distance, turn);
            assert_eq!(large.crosses(&small, &pose), expected, "{distance}");
            assert_eq!(
                small.crosses(&large, &pose.inverse()),
                expected,
                "{distance}"
            );
            if !expected {
                assert_eq!(large.contains_piece_of(&small, &pose), distance < 20.0);
                assert!(!small.contains_piece_of(&large, &pose.inverse()));
            }
        }
    }

    #[test]
    fn an_empty_surface_meets_nothing() {
        let empty = Surface::new(Vec::new(), Vec::new());
        let ball = ball(Point::origin(), 10.0);
        let ray = Ray {
            origin: Point::origin(),
            direction: Vector::x(),
        };
        assert!(empty.intersections(&ray).is_empty());
        assert!(empty.closest_point(&Point::origin()).is_none());
        assert!(!empty.crosses(&ball, &Rigid::identity()));
        assert!(!ball.crosses(&empty, &Rigid::identity()));
    }
}
