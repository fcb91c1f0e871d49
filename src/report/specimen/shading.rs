//! Surfaces drawn without perspective, lit from the viewer.

use super::painting::Painting;
use crate::geometry::{Pixel, Point, Vector};
use crate::report::picture::Colour;
use crate::volume::Surface;

/// A view without perspective: pixel positions of points, and how near they are.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// The point in the picture's middle.
    pub middle: Point,
    /// Unit directions of columns and against rows.
    pub right: Vector,
    pub up: Vector,
    pub pixel_mm: f64,
    /// Pixels of the square picture's edge.
    pub size: usize,
}

impl View {
    /// The unit direction to the viewer.
    pub fn toward(&self) -> Vector {
        self.right.cross(&self.up)
    }

    /// Where a point is drawn.
    pub fn pixel(&self, point: &Point) -> Pixel {
        let arm = point - self.middle;
        let half = (self.size as f64 - 1.0) / 2.0;
        Pixel::new(
            half + arm.dot(&self.right) / self.pixel_mm,
            half - arm.dot(&self.up) / self.pixel_mm,
        )
    }

    /// The point of the plane through the middle that is drawn at a pixel.
    pub fn point(&self, x: f64, y: f64) -> Point {
        let half = (self.size as f64 - 1.0) / 2.0;
        self.middle
            + self.right * ((x - half) * self.pixel_mm)
            + self.up * ((half - y) * self.pixel_mm)
    }
}

/// A picture of surfaces that hide each other.
pub(super) struct Scene {
    view: View,
    painting: Painting,
    /// Nearness of what each pixel shows (mm).
    near: Vec<f64>,
}

impl Scene {
    pub fn new(view: View) -> Self {
        Self {
            painting: Painting::new(view.size, view.size),
            near: vec![f64::NEG_INFINITY; view.size * view.size],
            view,
        }
    }

    /// Draws a surface, each triangle's pixels shaded by the normal between its vertices.
    pub fn add(&mut self, surface: &Surface, colour: Colour) {
        let toward = self.view.toward();
        let placed: Vec<(Pixel, f64, f64)> = surface
            .vertices()
            .iter()
            .zip(surface.normals())
            .map(|(p, n)| {
                let near = (p - self.view.middle).dot(&toward);
                (self.view.pixel(p), near, n.dot(&toward))
            })
            .collect();
        for triangle in surface.triangles() {
            self.triangle(triangle.map(|v| placed[v as usize]), colour);
        }
    }

    fn triangle(&mut self, corners: [(Pixel, f64, f64); 3], colour: Colour) {
        let [a, b, c] = corners.map(|corner| corner.0);
        let area = cross(&a, &b, &c);
        if area.abs() < 1e-12 {
            return;
        }
        let size = self.view.size as f64;
        let range = |values: [f64; 3]| {
            let low = values.into_iter().fold(f64::MAX, f64::min).ceil().max(0.0);
            let high = values
                .into_iter()
                .fold(f64::MIN, f64::max)
                .floor()
                .min(size - 1.0);
            (low as usize, high)
        };
        let (x0, x1) = range([a.x, b.x, c.x]);
        let (y0, y1) = range([a.y, b.y, c.y]);
        for y in (y0..).take_while(|y| *y as f64 <= y1) {
            for x in (x0..).take_while(|x| *x as f64 <= x1) {
                let at = Pixel::new(x as f64, y as f64);
                let weights =
                    [cross(&at, &b, &c), cross(&at, &c, &a), cross(&at, &a, &b)].map(|w| w / area);
                if weights.iter().any(|w| *w < -1e-9) {
                    continue;
                }
                let mix = |value: fn(&(Pixel, f64, f64)) -> f64| -> f64 {
                    corners.iter().zip(weights).map(|(c, w)| w * value(c)).sum()
                };
                let near = mix(|corner| corner.1);
                let place = y * self.view.size + x;
                if near > self.near[place] {
                    self.near[place] = near;
                    let light = 0.2 + 0.8 * mix(|corner| corner.2).clamp(0.0, 1.0);
                    self.painting
                        .set(x, y, colour.map(|v| (f64::from(v) * light) as u8));
                }
            }
        }
    }

    /// The picture so far.
    pub fn painting(self) -> Painting {
        self.painting
    }
}

/// Twice the signed area of a triangle.
fn cross(a: &Pixel, b: &Pixel, c: &Pixel) -> f64 {
    (b - a).perp(&(c - a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Grid, Volume};

    #[test]
    fn the_nearer_ball_hides_the_other_and_lies_where_it_should() {
        let grid = Grid::axis_aligned([60; 3], 1.0, Point::new(-30.0, -30.0, -30.0));
        let ball = |middle: Point| {
            let data = (0..grid.len())
                .map(|o| (grid.center(grid.voxel(o)) - middle).norm() < 8.0)
                .collect();
            Surface::from_mask(&Volume::new(grid.clone(), data), |v| v, &Default::default())
        };
        let mut scene = Scene::new(View {
            middle: Point::origin(),
            right: Vector::x(),
            up: Vector::y(),
            pixel_mm: 1.0,
            size: 61,
        });
        scene.add(&ball(Point::new(0.0, 0.0, 15.0)), [200, 0, 0]);
        scene.add(&ball(Point::new(4.0, 10.0, -15.0)), [0, 200, 0]);
        let painting = scene.painting();
        // The middle of the near ball is lit fully; the far one shows above and to the right.
        assert!(painting.at(30, 30)[0] > 190 && painting.at(30, 30)[1] == 0);
        assert!(
            painting.at(30, 24)[0] > 0,
            "the near ball hides the far one"
        );
        assert!(painting.at(34, 15)[1] > 150);
        assert_eq!(painting.at(5, 5), [0; 3]);
    }
}
