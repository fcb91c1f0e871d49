//! The similarity of one view, recomputed only where moving objects can change it.

use super::comparison::Comparison;
use super::drr::add_line_integrals;
use super::similarity::FixedView;
use crate::geometry::Rigid;
use crate::image::{Image, PixelRect};
use crate::simd::SimdLevel;
use crate::xray::BoneVolume;
use std::sync::Arc;

/// One view of a scorer: what the static objects give is computed once, and every candidate
/// changes and restores only the pixels near its moving objects.
#[derive(Clone, Debug)]
pub(super) struct ViewCost {
    fixed: Arc<FixedView>,
    camera_from_world: Rigid,
    background: Background,
    /// The current projection; the background's outside `drawn`.
    projection: Vec<f32>,
    drawn: PixelRect,
    /// Its gradients are the background's outside `derived`.
    comparison: Comparison,
    derived: PixelRect,
}

/// The static objects' projection and all that follows from it.
#[derive(Clone, Debug)]
struct Background {
    projection: Vec<f32>,
    gradients: [Vec<f32>; 2],
    /// Sum of all patch costs.
    total: f64,
    /// Sums of patch costs over rectangles from the first centre, with one more row and column of
    /// zeros before the first.
    cost_area: Vec<f64>,
}

impl ViewCost {
    /// Projects the static objects (with `world_from_volume` each) and compares them.
    pub fn new(
        fixed: Arc<FixedView>,
        camera_from_world: Rigid,
        statics: &[(Arc<BoneVolume>, Rigid)],
        step_mm: f64,
        level: SimdLevel,
    ) -> Self {
        let camera = *fixed.camera();
        let whole = PixelRect::of_image(camera.width, camera.height);
        let mut projection = vec![0.0; camera.width * camera.height];
        for (bone, world_from_volume) in statics {
            let camera_from_volume = camera_from_world * world_from_volume;
            add_line_integrals(bone, &camera, &camera_from_volume, step_mm, &mut projection);
        }
        let mut comparison = Comparison::new(&fixed, level);
        comparison.derive(&projection, whole);
        let centers = comparison.all_centers();
        let mut costs = vec![0.0; centers.width() * centers.height()];
        let total = comparison.sum_of_costs(&fixed, centers, Some(&mut costs));
        Self {
            camera_from_world,
            background: Background {
                projection: projection.clone(),
                gradients: comparison.gradients.clone(),
                total,
                cost_area: area_sums(&costs, centers.width()),
            },
            projection,
            drawn: PixelRect::EMPTY,
            comparison,
            derived: PixelRect::EMPTY,
            fixed,
        }
    }

    /// The similarity with the moving objects at the given poses, lower is better.
    pub fn similarity(
        &mut self,
        moving: &[Arc<BoneVolume>],
        world_from_volume: &[Rigid],
        step_mm: f64,
    ) -> f64 {
        self.restore_background();
        let camera = self.fixed.camera();
        for (bone, world_from_volume) in moving.iter().zip(world_from_volume) {
            let camera_from_volume = self.camera_from_world * world_from_volume;
            let touched = add_line_integrals(
                bone,
                camera,
                &camera_from_volume,
                step_mm,
                &mut self.projection,
            );
            self.drawn = self.drawn.union(&touched);
        }
        let whole = PixelRect::of_image(camera.width, camera.height);
        self.derived = self.drawn.grown(self.comparison.gradient_reach(), &whole);
        self.comparison.derive(&self.projection, self.derived);

        let all = self.comparison.all_centers();
        let centers = self
            .derived
            .grown(self.fixed.radius, &whole)
            .intersection(&all);
        // Exact sums: the untouched patches' costs plus the touched ones' are, bit for bit, the
        // sum over all patches.
        let untouched = self.background.total - self.background.cost_of(centers, all);
        let touched = self.comparison.sum_of_costs(&self.fixed, centers, None);
        (untouched + touched) / self.fixed.costs()
    }

    /// The current projection: that of the candidate compared last.
    pub fn projection(&self) -> Image<f32> {
        let camera = self.fixed.camera();
        Image::new(camera.width, camera.height, self.projection.clone())
    }

    fn restore_background(&mut self) {
        let width = self.fixed.camera().width;
        copy_part(
            &self.background.projection,
            &mut self.projection,
            width,
            self.drawn,
        );
        for (from, to) in self
            .background
            .gradients
            .iter()
            .zip(&mut self.comparison.gradients)
        {
            copy_part(from, to, width, self.derived);
        }
        self.drawn = PixelRect::EMPTY;
        self.derived = PixelRect::EMPTY;
    }
}

impl Background {
    /// The sum of the costs of the patches around `centers`, which lie in `all`.
    fn cost_of(&self, centers: PixelRect, all: PixelRect) -> f64 {
        if centers.is_empty() {
            return 0.0;
        }
        let before =
            |x: usize, y: usize| self.cost_area[(y - all.y0) * (all.width() + 1) + x - all.x0];
        before(centers.x1, centers.y1)
            - before(centers.x0, centers.y1)
            - before(centers.x1, centers.y0)
            + before(centers.x0, centers.y0)
    }
}

/// Sums over all rectangles that begin at the first value.
fn area_sums(values: &[f64], width: usize) -> Vec<f64> {
    let height = values.len() / width;
    let mut area = vec![0.0; (width + 1) * (height + 1)];
    for y in 0..height {
        let mut row = 0.0;
        for x in 0..width {
            row += values[y * width + x];
            area[(y + 1) * (width + 1) + x + 1] = area[y * (width + 1) + x + 1] + row;
        }
    }
    area
}

fn copy_part(from: &[f32], to: &mut [f32], width: usize, part: PixelRect) {
    for y in part.y0..part.y1 {
        let row = y * width + part.x0..y * width + part.x1;
        to[row.clone()].copy_from_slice(&from[row]);
    }
}
