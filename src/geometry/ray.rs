//! Rays and their intersection with boxes.

use super::{Point, Vector};

/// The half line `origin + t * direction`, `t >= 0`. `direction` need not have unit length.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Point,
    pub direction: Vector,
}

impl Ray {
    /// The point at parameter `t` (mm where `direction` has unit length).
    pub fn at(&self, t: f64) -> Point {
        self.origin + self.direction * t
    }

    /// The parameters at which the infinite line enters and leaves the box, or `None` if it
    /// misses it. Negative parameters lie behind the origin.
    pub fn clip(&self, min: &Point, max: &Point) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let (o, d) = (self.origin[axis], self.direction[axis]);
            if d == 0.0 {
                if o < min[axis] || o > max[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((min[axis] - o) / d, (max[axis] - o) / d);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some((enter, leave))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_an_oblique_line_and_refuses_a_miss() {
        let ray = Ray {
            origin: Point::new(-2.0, 0.5, 0.5),
            direction: Vector::new(1.0, 0.0, 0.0),
        };
        let (min, max) = (Point::origin(), Point::new(1.0, 1.0, 1.0));
        assert_eq!(ray.clip(&min, &max), Some((2.0, 3.0)));
        let miss = Ray {
            origin: Point::new(-2.0, 1.5, 0.5),
            ..ray
        };
        assert_eq!(miss.clip(&min, &max), None);
    }
}
