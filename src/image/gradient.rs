//! Gradients of the smoothed image, for a part of an image at a time.

use super::filter::GaussianKernel;
use super::{Image, PixelRect};
use crate::simd::{SimdLevel, for_simd_level};

/// Largest radius of the Gaussian that [`SmoothGradient`] takes.
pub const MAX_RADIUS: usize = 4;

/// Gaussian smoothing followed by Sobel derivatives, row after row, so that no smoothed image is
/// stored. Its result at a pixel is that of [`super::filter`] bit for bit, whatever part of the
/// image is asked for.
#[derive(Clone, Debug)]
pub struct SmoothGradient {
    width: usize,
    height: usize,
    kernel: GaussianKernel,
    /// One row smoothed along columns, with a margin of the kernel's radius on both sides.
    column_wise: Vec<f32>,
    /// Three consecutive smoothed rows (row j at j mod 3) with a margin of one pixel.
    smooth: [Vec<f32>; 3],
}

impl SmoothGradient {
    /// For images of `width` x `height` pixels.
    ///
    /// # Panics
    /// When the kernel's radius is above [`MAX_RADIUS`].
    pub fn new(width: usize, height: usize, kernel: GaussianKernel) -> Self {
        let radius = kernel.radius();
        assert!(radius <= MAX_RADIUS, "a Gaussian of radius {radius} px");
        Self {
            width,
            height,
            kernel,
            column_wise: vec![0.0; width + 2 * radius],
            smooth: std::array::from_fn(|_| vec![0.0; width + 2]),
        }
    }

    /// How far a pixel's value reaches into the gradients, in pixels.
    pub fn reach(&self) -> usize {
        self.kernel.radius() + 1
    }

    /// Writes the derivatives along x and y into the pixels `part` of `gx` and `gy`. All three
    /// slices are whole row-major images.
    ///
    /// # Panics
    /// When a slice is not of the image's size or the processor lacks `level`.
    pub fn apply(
        &mut self,
        level: SimdLevel,
        image: &[f32],
        part: PixelRect,
        gx: &mut [f32],
        gy: &mut [f32],
    ) {
        let size = self.width * self.height;
        assert!(image.len() == size && gx.len() == size && gy.len() == size);
        let part = part.intersection(&PixelRect::of_image(self.width, self.height));
        if part.is_empty() {
            return;
        }
        match self.kernel.radius() {
            0 => gradient_rows::<0>(level, self, image, part, gx, gy),
            1 => gradient_rows::<1>(level, self, image, part, gx, gy),
            2 => gradient_rows::<2>(level, self, image, part, gx, gy),
            3 => gradient_rows::<3>(level, self, image, part, gx, gy),
            MAX_RADIUS => gradient_rows::<4>(level, self, image, part, gx, gy),
            radius => unreachable!("`new` refuses a Gaussian of radius {radius} px"),
        }
    }

    /// Both derivatives of a whole image.
    pub fn of_image(
        level: SimdLevel,
        image: &Image<f32>,
        kernel: GaussianKernel,
    ) -> [Image<f32>; 2] {
        let (width, height) = (image.width, image.height);
        let mut gx = Image::filled(width, height, 0.0);
        let mut gy = gx.clone();
        Self::new(width, height, kernel).apply(
            level,
            &image.data,
            PixelRect::of_image(width, height),
            &mut gx.data,
            &mut gy.data,
        );
        [gx, gy]
    }

    /// Smooths the columns of row `j` that the gradients of `part` need.
    #[inline(always)]
    fn smooth_row<const RADIUS: usize>(&mut self, image: &[f32], part: PixelRect, j: usize) {
        let (width, height) = (self.width, self.height);
        let (x0, x1) = (part.x0.saturating_sub(1), (part.x1 + 1).min(width));
        let (wide0, wide1) = (x0.saturating_sub(RADIUS), (x1 + RADIUS).min(width));
        let mut taps = [0.0; MAX_RADIUS + 1];
        taps[..=RADIUS].copy_from_slice(self.kernel.half());

        let row = |y: usize| &image[y * width + wide0..y * width + wide1];
        let center = row(j);
        let above: [&[f32]; MAX_RADIUS + 1] = std::array::from_fn(|t| row(j.saturating_sub(t)));
        let below: [&[f32]; MAX_RADIUS + 1] = std::array::from_fn(|t| row((j + t).min(height - 1)));
        let out = &mut self.column_wise[RADIUS + wide0..RADIUS + wide1];
        for (i, o) in out.iter_mut().enumerate() {
            let mut sum = taps[0] * center[i];
            for t in 1..=RADIUS {
                sum += taps[t] * (above[t][i] + below[t][i]);
            }
            *o = sum;
        }
        if wide0 == 0 {
            let first = self.column_wise[RADIUS];
            self.column_wise[..RADIUS].fill(first);
        }
        if wide1 == width {
            let last = self.column_wise[RADIUS + width - 1];
            self.column_wise[RADIUS + width..].fill(last);
        }

        let count = x1 - x0;
        let shifted: [&[f32]; 2 * MAX_RADIUS + 1] = std::array::from_fn(|t| {
            let start = x0 + t.min(2 * RADIUS);
            &self.column_wise[start..start + count]
        });
        let smooth = &mut self.smooth[j % 3];
        for (i, o) in smooth[1 + x0..1 + x1].iter_mut().enumerate() {
            let mut sum = taps[0] * shifted[RADIUS][i];
            for t in 1..=RADIUS {
                sum += taps[t] * (shifted[RADIUS - t][i] + shifted[RADIUS + t][i]);
            }
            *o = sum;
        }
        if x0 == 0 {
            smooth[0] = smooth[1];
        }
        if x1 == width {
            smooth[width + 1] = smooth[width];
        }
    }
}

for_simd_level! {
    fn gradient_rows<const RADIUS: usize>(
        filter: &mut SmoothGradient,
        image: &[f32],
        part: PixelRect,
        gx: &mut [f32],
        gy: &mut [f32],
    ) = gradient_row_loops;
}

#[inline(always)]
fn gradient_row_loops<const RADIUS: usize>(
    filter: &mut SmoothGradient,
    image: &[f32],
    part: PixelRect,
    gx: &mut [f32],
    gy: &mut [f32],
) {
    let (width, last) = (filter.width, filter.height - 1);
    let first = part.y0.saturating_sub(1);
    for j in first..=part.y0 {
        filter.smooth_row::<RADIUS>(image, part, j);
    }
    for y in part.y0..part.y1 {
        if y < last {
            filter.smooth_row::<RADIUS>(image, part, y + 1);
        }
        let count = part.width();
        let [a, b, c] = [y.saturating_sub(1), y, (y + 1).min(last)]
            .map(|j| &filter.smooth[j % 3][part.x0..part.x0 + count + 2]);
        let out_x = &mut gx[y * width + part.x0..][..count];
        let out_y = &mut gy[y * width + part.x0..][..count];
        for i in 0..count {
            out_x[i] = (a[i + 2] - a[i]) + 2.0 * (b[i + 2] - b[i]) + (c[i + 2] - c[i]);
            out_y[i] = (c[i] - a[i]) + 2.0 * (c[i + 1] - a[i + 1]) + (c[i + 2] - a[i + 2]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::filter::{gaussian, sobel_x, sobel_y};
    use super::*;
    use proptest::prelude::*;

    fn rough_image(width: usize, height: usize) -> Image<f32> {
        let value = |i: usize| ((i as u32).wrapping_mul(2_654_435_761) >> 8) as f32 * 1e-6;
        Image::new(width, height, (0..width * height).map(value).collect())
    }

    #[test]
    fn equals_the_single_filters_at_every_level_and_width() {
        let image = rough_image(37, 23);
        for width in [1, 3, 5, 7, 9] {
            let kernel = GaussianKernel::with_width(width, 1.1);
            let smooth = gaussian(&image, &kernel);
            let expected = [sobel_x(&smooth), sobel_y(&smooth)];
            for level in SimdLevel::available() {
                let got = SmoothGradient::of_image(level, &image, kernel.clone());
                assert_eq!(got, expected, "{level:?}, {width} taps");
            }
        }
    }

    proptest! {
        #[test]
        fn a_part_equals_the_whole(
            (x0, x1) in (0usize..31, 0usize..31),
            (y0, y1) in (0usize..19, 0usize..19),
        ) {
            let image = rough_image(30, 18);
            let kernel = GaussianKernel::with_width(5, 1.1);
            let level = SimdLevel::current();
            let whole = SmoothGradient::of_image(level, &image, kernel.clone());
            let part = PixelRect { x0: x0.min(x1), y0: y0.min(y1), x1: x0.max(x1), y1: y0.max(y1) };
            let mut got = [vec![f32::NAN; 540], vec![f32::NAN; 540]];
            let [gx, gy] = &mut got;
            SmoothGradient::new(30, 18, kernel).apply(level, &image.data, part, gx, gy);
            for i in 0..540 {
                let (x, y) = (i % 30, i / 30);
                let inside = part.x0 <= x && x < part.x1 && part.y0 <= y && y < part.y1;
                for axis in 0..2 {
                    prop_assert_eq!(inside, !got[axis][i].is_nan());
                    prop_assert!(!inside || got[axis][i] == whole[axis].data[i]);
                }
            }
        }
    }

    #[test]
    fn the_smallest_images_work() {
        for (width, height) in [(1, 1), (1, 5), (2, 2), (4, 1)] {
            let image = rough_image(width, height);
            let kernel = GaussianKernel::with_width(5, 1.1);
            let smooth = gaussian(&image, &kernel);
            let got = SmoothGradient::of_image(SimdLevel::Portable, &image, kernel);
            assert_eq!(got, [sobel_x(&smooth), sobel_y(&smooth)]);
        }
    }
}
