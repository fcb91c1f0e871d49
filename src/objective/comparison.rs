//! The moving side of the comparison with a fixed image.

use super::lanes::with_lanes;
use super::patch_cost::SumOfCosts;
use super::patch_sums::{PADDING, PatchSums};
use super::similarity::FixedView;
use crate::image::PixelRect;
use crate::image::gradient::SmoothGradient;
use crate::simd::SimdLevel;

/// Gradients of a projection, and all the memory that comparing them takes.
#[derive(Clone, Debug)]
pub struct Comparison {
    level: SimdLevel,
    filter: SmoothGradient,
    sums: PatchSums,
    /// The costs of one row of patches.
    row: Vec<f64>,
    /// Along x, then along y; zeros follow the last pixel.
    pub(super) gradients: [Vec<f32>; 2],
}

impl Comparison {
    /// For projections that are compared with `fixed`.
    pub fn new(fixed: &FixedView, level: SimdLevel) -> Self {
        let (width, height) = (fixed.camera().width, fixed.camera().height);
        Self {
            level,
            filter: SmoothGradient::new(width, height, fixed.kernel.clone()),
            sums: PatchSums::new(width, height, fixed.radius),
            row: vec![0.0; width],
            gradients: std::array::from_fn(|_| vec![0.0; width * height + PADDING]),
        }
    }

    /// The similarity of one whole projection (row-major, of the camera's size) to `fixed`, lower is
    /// better. Allocates nothing.
    ///
    /// # Panics
    /// When the projection has another number of pixels, `self` was made for a fixed view of
    /// another size, or the processor lacks the level.
    pub fn similarity(&mut self, fixed: &FixedView, projection: &[f32]) -> f64 {
        let camera = fixed.camera();
        self.derive(projection, PixelRect::of_image(camera.width, camera.height));
        self.sum_of_costs(fixed, self.all_centers(), None) / fixed.costs()
    }

    /// The pixels that are centres of patches.
    pub(super) fn all_centers(&self) -> PixelRect {
        self.sums.all_centers()
    }

    /// How far a pixel of the projection reaches into the gradients.
    pub(super) fn gradient_reach(&self) -> usize {
        self.filter.reach()
    }

    /// Computes the gradients of the pixels `part` of a whole projection.
    pub(super) fn derive(&mut self, projection: &[f32], part: PixelRect) {
        let pixels = projection.len();
        let [gx, gy] = self.gradients.each_mut().map(|g| &mut g[..pixels]);
        self.filter.apply(self.level, projection, part, gx, gy);
    }

    /// The sum over both directions of the costs of the patches around `centers`; a sum over any
    /// set of patches is exact (`SumOfCosts` says why). Adds each cost to `map`, one value for
    /// each of [`Self::all_centers`], if it is given.
    pub(super) fn sum_of_costs(
        &mut self,
        fixed: &FixedView,
        centers: PixelRect,
        mut map: Option<&mut [f64]>,
    ) -> f64 {
        let mut total = 0.0;
        for (moving, fixed) in self.gradients.iter().zip(&fixed.gradients) {
            let work = SumOfCosts {
                sums: &mut self.sums,
                row: &mut self.row,
                moving,
                fixed,
                centers,
                map: map.as_deref_mut(),
            };
            total += with_lanes(self.level, work);
        }
        total
    }
}
