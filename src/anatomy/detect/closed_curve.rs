//! Closed polylines: equal steps and smoothing.

use nalgebra::SVector;

/// `count` points at equal arc lengths along the closed polyline through `points`, from its first.
pub(super) fn resampled<const D: usize>(
    points: &[SVector<f64, D>],
    count: usize,
) -> Vec<SVector<f64, D>> {
    let n = points.len();
    let mut reach = vec![0.0];
    for i in 0..n {
        reach.push(reach[i] + (points[(i + 1) % n] - points[i]).norm());
    }
    let step = reach[n] / count as f64;
    let mut segment = 0;
    (0..count)
        .map(|i| {
            let s = i as f64 * step;
            while segment + 1 < n && reach[segment + 1] <= s {
                segment += 1;
            }
            let length = reach[segment + 1] - reach[segment];
            let t = if length > 0.0 {
                (s - reach[segment]) / length
            } else {
                0.0
            };
            points[segment].lerp(&points[(segment + 1) % n], t)
        })
        .collect()
}

/// Length of the closed polyline.
pub(super) fn length<const D: usize>(points: &[SVector<f64, D>]) -> f64 {
    let n = points.len();
    (0..n)
        .map(|i| (points[(i + 1) % n] - points[i]).norm())
        .sum()
}

/// Values on a ring smoothed by a Gaussian with a standard deviation in steps.
pub(super) fn smoothed<const D: usize>(
    values: &[SVector<f64, D>],
    sigma_steps: f64,
) -> Vec<SVector<f64, D>> {
    let n = values.len() as isize;
    let radius = (4.0 * sigma_steps).ceil() as isize;
    let weights: Vec<f64> = (-radius..=radius)
        .map(|k| (-0.5 * (k as f64 / sigma_steps).powi(2)).exp())
        .collect();
    let total: f64 = weights.iter().sum();
    (0..n)
        .map(|i| {
            let sum: SVector<f64, D> = (-radius..=radius)
                .zip(&weights)
                .map(|(k, w)| values[(i + k).rem_euclid(n) as usize] * *w)
                .sum();
            sum / total
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    #[test]
    fn a_square_is_walked_in_equal_steps() {
        let square =
            [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)].map(|(x, y)| Vector2::new(x, y));
        assert_eq!(length(&square), 16.0);
        let points = resampled(&square, 32);
        assert_eq!(points[3], Vector2::new(1.5, 0.0));
        assert_eq!(points[31], Vector2::new(0.0, 0.5));
    }

    #[test]
    fn smoothing_keeps_a_constant_and_damps_a_wave_as_a_gaussian_does() {
        let wave = |i: usize| (std::f64::consts::TAU * 5.0 * i as f64 / 100.0).cos();
        let values: Vec<Vector2<f64>> = (0..100).map(|i| Vector2::new(7.0, wave(i))).collect();
        let smooth = smoothed(&values, 3.0);
        let k = std::f64::consts::TAU * 5.0 / 100.0;
        let damping = (-0.5 * (k * 3.0_f64).powi(2)).exp();
        for (i, v) in smooth.iter().enumerate() {
            assert!((v.x - 7.0).abs() < 1e-12);
            assert!((v.y - damping * wave(i)).abs() < 1e-3);
        }
    }
}
