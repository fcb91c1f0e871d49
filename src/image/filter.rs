//! Gaussian smoothing and Sobel derivatives. Beyond the border every filter sees the nearest
//! pixel of the image ("replicate", SciPy's mode "nearest").

use super::Image;
use crate::simd::{SimdLevel, for_simd_level};

/// The taps of a symmetric, normalized, sampled Gaussian.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianKernel {
    /// The tap at the centre, then those at distance 1, 2, ... px.
    half: Vec<f32>,
}

impl GaussianKernel {
    /// `width` taps (odd) of standard deviation `sigma_px`.
    ///
    /// # Panics
    /// When `width` is even or `sigma_px` is not positive.
    pub fn with_width(width: usize, sigma_px: f64) -> Self {
        assert!(width % 2 == 1, "a kernel of {width} taps has no centre");
        assert!(sigma_px > 0.0, "a Gaussian of sigma {sigma_px} has no taps");
        let taps: Vec<f64> = (0..=width / 2)
            .map(|i| (-0.5 * (i as f64 / sigma_px).powi(2)).exp())
            .collect();
        let sum = taps[0] + 2.0 * taps[1..].iter().sum::<f64>();
        Self {
            half: taps.iter().map(|tap| (tap / sum) as f32).collect(),
        }
    }

    /// Standard deviation `sigma_px`, cut off beyond four of them.
    ///
    /// # Panics
    /// When `sigma_px` is not positive.
    pub fn with_sigma(sigma_px: f64) -> Self {
        Self::with_width(2 * (4.0 * sigma_px + 0.5).floor() as usize + 1, sigma_px)
    }

    /// Number of taps on each side of the centre.
    pub fn radius(&self) -> usize {
        self.half.len() - 1
    }

    /// The tap at the centre, then those at distance 1, 2, ..., `radius` px.
    pub fn half(&self) -> &[f32] {
        &self.half
    }
}

/// The image smoothed along its columns, then along its rows.
pub fn gaussian(image: &Image<f32>, kernel: &GaussianKernel) -> Image<f32> {
    gaussian_at(SimdLevel::current(), image, kernel)
}

for_simd_level! {
    fn gaussian_at(image: &Image<f32>, kernel: &GaussianKernel) -> Image<f32> = gaussian_loops;
}

#[inline(always)]
fn gaussian_loops(image: &Image<f32>, kernel: &GaussianKernel) -> Image<f32> {
    let (width, radius) = (image.width, kernel.radius());
    let mut smooth = Image::filled(width, image.height, 0.0);
    let mut padded = vec![0.0; width + 2 * radius];
    for (y, out) in smooth.data.chunks_exact_mut(width).enumerate() {
        let middle = &mut padded[radius..radius + width];
        smooth_column_wise(image, kernel, y, middle);
        replicate_ends(&mut padded, radius);
        for (o, &center) in out.iter_mut().zip(&padded[radius..]) {
            *o = kernel.half[0] * center;
        }
        for (distance, &tap) in kernel.half.iter().enumerate().skip(1) {
            let (left, right) = (&padded[radius - distance..], &padded[radius + distance..]);
            for ((o, &l), &r) in out.iter_mut().zip(left).zip(right) {
                *o += tap * (l + r);
            }
        }
    }
    smooth
}

/// Row `y` of the image smoothed along its columns only.
#[inline(always)]
pub(crate) fn smooth_column_wise(
    image: &Image<f32>,
    kernel: &GaussianKernel,
    y: usize,
    out: &mut [f32],
) {
    for (o, &center) in out.iter_mut().zip(image.row(y)) {
        *o = kernel.half[0] * center;
    }
    for (distance, &tap) in kernel.half.iter().enumerate().skip(1) {
        let above = image.row(y.saturating_sub(distance));
        let below = image.row((y + distance).min(image.height - 1));
        for ((o, &a), &b) in out.iter_mut().zip(above).zip(below) {
            *o += tap * (a + b);
        }
    }
}

/// Copies the outermost of the values between two margins of `radius` values into the margins.
pub(crate) fn replicate_ends(padded: &mut [f32], radius: usize) {
    let last = padded.len() - 1 - radius;
    let (first_value, last_value) = (padded[radius], padded[last]);
    padded[..radius].fill(first_value);
    padded[last + 1..].fill(last_value);
}

/// The 3 x 3 Sobel derivative along columns (x): weights 1, 2, 1, not normalized, positive where
/// values grow to the right.
pub fn sobel_x(image: &Image<f32>) -> Image<f32> {
    sobel(image, |p| {
        (p[0][2] - p[0][0]) + 2.0 * (p[1][2] - p[1][0]) + (p[2][2] - p[2][0])
    })
}

/// The 3 x 3 Sobel derivative along rows (y), positive where values grow downwards.
pub fn sobel_y(image: &Image<f32>) -> Image<f32> {
    sobel(image, |p| {
        (p[2][0] - p[0][0]) + 2.0 * (p[2][1] - p[0][1]) + (p[2][2] - p[0][2])
    })
}

fn sobel(image: &Image<f32>, stencil: impl Fn([[f32; 3]; 3]) -> f32) -> Image<f32> {
    let mut out = Image::filled(image.width, image.height, 0.0);
    for y in 0..image.height {
        let rows = [y.saturating_sub(1), y, (y + 1).min(image.height - 1)].map(|j| image.row(j));
        for x in 0..image.width {
            let columns = [x.saturating_sub(1), x, (x + 1).min(image.width - 1)];
            out.data[y * image.width + x] = stencil(rows.map(|row| columns.map(|i| row[i])));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 5 columns, 4 rows: (13 x + 7 y + x y (x + 2 y)) mod 23.
    fn pattern() -> Image<f32> {
        let value = |x: usize, y: usize| ((13 * x + 7 * y + x * y * (x + 2 * y)) % 23) as f32;
        Image::new(5, 4, (0..20).map(|i| value(i % 5, i / 5)).collect())
    }

    fn assert_close(got: &Image<f32>, expected: &[f64], tolerance: f64) {
        assert_eq!(got.data.len(), expected.len());
        for (i, (&g, &e)) in got.data.iter().zip(expected).enumerate() {
            assert!((f64::from(g) - e).abs() < tolerance, "{i}: {g} {e}");
        }
    }

    // SciPy 1.17.1, with y, x = numpy.mgrid[0:4, 0:5] and a = the pattern:
    // scipy.ndimage.gaussian_filter(a, 1.1, radius=2, mode="nearest"),
    // scipy.ndimage.gaussian_filter(a, 2.0, mode="nearest"), and
    // scipy.ndimage.sobel(a, axis, mode="nearest") for the axes 1 (x) and 0 (y).
    const SCIPY_GAUSSIAN: [f64; 20] = [
        4.8155286, 7.4467179, 9.7003808, 10.7804106, 10.0575911, 7.9908243, 9.1782377, 10.6605253,
        11.4076997, 11.4683653, 12.2948688, 11.0271973, 10.1917523, 10.0039252, 10.9123861,
        15.4201762, 11.4719687, 8.2008520, 7.4010103, 8.8975403,
    ];
    const SCIPY_GAUSSIAN_WIDE: [f64; 20] = [
        6.9662154, 7.9008741, 8.7107944, 9.1990484, 9.3270626, 8.9544193, 9.1811608, 9.4233367,
        9.6338182, 9.7760210, 11.0585174, 10.3975379, 9.8941548, 9.6950833, 9.7786520, 12.8351755,
        11.2846322, 10.0149749, 9.3671638, 9.3382071,
    ];
    const SCIPY_SOBEL_X: [f64; 20] = [
        32.0000000,
        20.0000000,
        24.0000000,
        5.0000000,
        -31.0000000,
        -1.0000000,
        29.0000000,
        22.0000000,
        -8.0000000,
        0.0000000,
        -19.0000000,
        1.0000000,
        -13.0000000,
        -4.0000000,
        29.0000000,
        -36.0000000,
        -50.0000000,
        -29.0000000,
        15.0000000,
        30.0000000,
    ];
    const SCIPY_SOBEL_Y: [f64; 20] = [
        8.0000000,
        -4.0000000,
        16.0000000,
        21.0000000,
        23.0000000,
        43.0000000,
        31.0000000,
        18.0000000,
        -2.0000000,
        14.0000000,
        51.0000000,
        17.0000000,
        -33.0000000,
        -44.0000000,
        -27.0000000,
        16.0000000,
        -18.0000000,
        -35.0000000,
        -21.0000000,
        -18.0000000,
    ];

    #[test]
    fn gaussian_agrees_with_scipy() {
        let smooth = gaussian(&pattern(), &GaussianKernel::with_width(5, 1.1));
        assert_close(&smooth, &SCIPY_GAUSSIAN, 1e-5);
    }

    #[test]
    fn wide_gaussian_agrees_with_scipy() {
        let smooth = gaussian(&pattern(), &GaussianKernel::with_sigma(2.0));
        assert_close(&smooth, &SCIPY_GAUSSIAN_WIDE, 1e-5);
    }

    #[test]
    fn sobel_agrees_with_scipy() {
        assert_close(&sobel_x(&pattern()), &SCIPY_SOBEL_X, 1e-9);
        assert_close(&sobel_y(&pattern()), &SCIPY_SOBEL_Y, 1e-9);
    }

    #[test]
    fn a_ramp_has_its_slope_times_eight() {
        let ramp = Image::new(
            9,
            8,
            (0..72)
                .map(|i| 2.0 * (i % 9) as f32 - 3.0 * (i / 9) as f32)
                .collect(),
        );
        let (gx, gy) = (sobel_x(&ramp), sobel_y(&ramp));
        assert_eq!((gx.at(4, 4), gy.at(4, 4)), (16.0, -24.0));
        // At the border the replicated pixel halves the difference.
        assert_eq!((gx.at(0, 4), gy.at(4, 7)), (8.0, -12.0));
    }

    #[test]
    fn a_gaussian_keeps_a_constant_and_the_sum_of_a_point() {
        let kernel = GaussianKernel::with_sigma(1.5);
        assert_eq!(kernel.radius(), 6);
        let flat = gaussian(&Image::filled(20, 15, 3.0), &kernel);
        assert!(flat.data.iter().all(|v| (v - 3.0).abs() < 1e-6));
        let mut point = Image::filled(21, 21, 0.0);
        point.data[10 * 21 + 10] = 1.0;
        let spread = gaussian(&point, &kernel);
        assert!((spread.data.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        let second: f32 = (0..21)
            .map(|x| (x as f32 - 10.0).powi(2) * spread.row(10)[x])
            .sum();
        let first: f32 = spread.row(10).iter().sum();
        // The cut at four standard deviations takes 0.1 % of the variance.
        assert!((second / first - 2.25).abs() < 0.01);
    }
}
