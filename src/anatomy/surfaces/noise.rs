//! Smooth random fields.

use crate::geometry::Point;
use crate::random::Stream;
use rand::RngExt;
use rand_distr::StandardNormal;

/// A stationary Gaussian random field of mean 0 and variance 1, whose correlation falls as a
/// Gaussian of standard deviation sqrt(2) times its `sigma_mm`.
pub(super) struct GaussianField {
    origin: Point,
    spacing_mm: f64,
    dims: [usize; 3],
    values: Vec<f32>,
}

/// Nodes beyond the box on each side, in standard deviations, so that its border is not special.
const REACH: f64 = 3.0;

impl GaussianField {
    /// A field over the box from `low` to `high` (world, mm): white noise at nodes half a standard
    /// deviation apart (`finest_mm` at least), smoothed along each axis.
    pub fn new(
        stream: &mut Stream,
        low: &Point,
        high: &Point,
        sigma_mm: f64,
        finest_mm: f64,
    ) -> Self {
        let spacing_mm = (sigma_mm / 2.0).max(finest_mm);
        let sigma = sigma_mm / spacing_mm;
        let radius = (REACH * sigma).ceil() as usize;
        let inner: [usize; 3] =
            std::array::from_fn(|a| ((high[a] - low[a]) / spacing_mm).ceil() as usize + 2);
        let mut dims = inner.map(|n| n + 2 * radius);
        let mut values: Vec<f32> = (0..dims.iter().product::<usize>())
            .map(|_| stream.sample::<f32, _>(StandardNormal))
            .collect();
        let mut weights: Vec<f32> = (0..=2 * radius)
            .map(|n| (-0.5 * ((n as f64 - radius as f64) / sigma).powi(2)).exp() as f32)
            .collect();
        // Independent values of variance 1 keep it when the squared weights sum to 1.
        let energy: f32 = weights.iter().map(|w| w * w).sum::<f32>().sqrt();
        weights.iter_mut().for_each(|w| *w /= energy);
        for axis in 0..3 {
            (values, dims) = smoothed_and_cropped(&values, dims, axis, &weights);
        }
        Self {
            origin: *low,
            spacing_mm,
            dims,
            values,
        }
    }

    /// The field at a world point, trilinear between nodes; the nearest node's cell beyond the box.
    pub fn at(&self, point: &Point) -> f32 {
        let mut cell = [0usize; 3];
        let mut part = [0.0f32; 3];
        for axis in 0..3 {
            let index = (point[axis] - self.origin[axis]) / self.spacing_mm;
            let index = index.clamp(0.0, (self.dims[axis] - 1) as f64 - 1e-6);
            cell[axis] = index as usize;
            part[axis] = (index - cell[axis] as f64) as f32;
        }
        let row = self.dims[0];
        let base = (cell[2] * self.dims[1] + cell[1]) * row + cell[0];
        let along = |at: usize| {
            let (a, b) = (self.values[at], self.values[at + 1]);
            a + (b - a) * part[0]
        };
        let plane = |at: usize| {
            let (a, b) = (along(at), along(at + row));
            a + (b - a) * part[1]
        };
        let (a, b) = (plane(base), plane(base + row * self.dims[1]));
        a + (b - a) * part[2]
    }
}

/// The weighted sums along one axis where all weights have a value.
fn smoothed_and_cropped(
    values: &[f32],
    dims: [usize; 3],
    axis: usize,
    weights: &[f32],
) -> (Vec<f32>, [usize; 3]) {
    let stride = dims[..axis].iter().product::<usize>();
    let mut next = dims;
    next[axis] = dims[axis] + 1 - weights.len();
    let outer = dims[axis + 1..].iter().product::<usize>();
    let mut result = Vec::with_capacity(next.iter().product());
    for block in 0..outer {
        for n in 0..next[axis] {
            let base = (block * dims[axis] + n) * stride;
            for inner in 0..stride {
                let mut sum = 0.0;
                for (w, weight) in weights.iter().enumerate() {
                    sum += weight * values[base + w * stride + inner];
                }
                result.push(sum);
            }
        }
    }
    (result, next)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    #[test]
    fn the_field_has_unit_variance_and_its_correlation() {
        let mut s = stream(3, Purpose::AssignedDensity, "noise test");
        let (low, high) = (Point::new(-5.0, 3.0, 10.0), Point::new(75.0, 83.0, 90.0));
        let field = GaussianField::new(&mut s, &low, &high, 2.0, 1.0);
        let (mut sum, mut square, mut lagged, mut n) = (0.0, 0.0, 0.0, 0.0);
        for k in 0..70 {
            for j in 0..70 {
                for i in 0..70 {
                    let p = low + crate::geometry::Vector::new(i.into(), j.into(), k.into());
                    let v = f64::from(field.at(&p));
                    let w = f64::from(field.at(&(p + crate::geometry::Vector::x() * 4.0)));
                    sum += v;
                    square += v * v;
                    lagged += v * w;
                    n += 1.0;
                }
            }
        }
        assert!((sum / n).abs() < 0.06, "mean {}", sum / n);
        assert!((square / n - 1.0).abs() < 0.06, "variance {}", square / n);
        let expected = (-(4.0_f64 / 2.0).powi(2) / 4.0).exp();
        assert!(
            (lagged / square - expected).abs() < 0.05,
            "{}",
            lagged / square
        );
    }
}
