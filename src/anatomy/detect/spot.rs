//! A place found by rule, and how well the rule pins it down.

use crate::geometry::Point;

/// Bone that comes to within this of a criterion's extreme might as well have been taken (mm): a
/// voxel of a good CT, and more than the noise of its surface.
pub(super) const FLAT_MM: f64 = 1.0;

/// A place found by rule.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub point: Point,
    /// Root mean square distance to the places that meet the rule to within [`FLAT_MM`].
    pub flat_mm: f64,
}

impl Spot {
    /// The best place among all that meet the rule to within [`FLAT_MM`].
    pub fn among<'a>(point: Point, as_good: impl Iterator<Item = &'a Point>) -> Self {
        let flat_mm = rms(as_good.map(|p| (p - point).norm_squared()));
        Self { point, flat_mm }
    }
}

/// The root of the mean of squares; 0 of none.
pub(super) fn rms(squares: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for square in squares {
        sum += square;
        count += 1;
    }
    (sum / count.max(1) as f64).sqrt()
}
