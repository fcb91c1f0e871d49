//! The moving side of the comparison with a fixed image.

use super::patch_cost::sum_of_costs;
use super::patch_sums::PatchSums;
use super::similarity::FixedView;
use crate::image::PixelRect;
use crate::image::gradient::SmoothGradient;
use crate::simd::SimdLevel;

/// Gradients of a projection, and all the memory that comparing them takes.
#[derive(Clone, Debug)]
pub(super) struct Comparison {
    level: SimdLevel,
    filter: SmoothGradient,
    sums: PatchSums,
    /// The costs of one row of patches.
    row: Vec<f64>,
    /// Along x, then along y.
    pub gradients: [Vec<f32>; 2],
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
            gradients: std::array::from_fn(|_| vec![0.0; width * height]),
        }
    }

    /// The pixels that are centres of patches.
    pub fn all_centers(&self) -> PixelRect {
        self.sums.all_centers()
    }

    /// How far a pixel of the projection reaches into the gradients.
    pub fn gradient_reach(&self) -> usize {
        self.filter.reach()
    }

    /// Computes the gradients of the pixels `part` of a whole projection.
    pub fn derive(&mut self, projection: &[f32], part: PixelRect) {
        let [gx, gy] = &mut self.gradients;
        self.filter.apply(self.level, projection, part, gx, gy);
    }

    /// The sum over both directions of the costs of the patches around `centers`; a sum over any
    /// set of patches is exact (`sum_of_costs` says why). Adds each cost to `map`, one value for
    /// each of [`Self::all_centers`], if it is given.
    pub fn sum_of_costs(
        &mut self,
        fixed: &FixedView,
        centers: PixelRect,
        mut map: Option<&mut [f64]>,
    ) -> f64 {
        let mut total = 0.0;
        for (moving, fixed) in self.gradients.iter().zip(&fixed.gradients) {
            total += sum_of_costs(
                self.level,
                &mut self.sums,
                &mut self.row,
                moving,
                fixed,
                centers,
                map.as_deref_mut(),
            );
        }
        total
    }
}
