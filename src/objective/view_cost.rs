//! The similarity of one view, recomputed only where moving objects can change it.

use super::comparison::Comparison;
use super::similarity::FixedView;
use crate::geometry::Rigid;
use crate::image::{Image, PixelRect};
use crate::simd::SimdLevel;
use crate::xray::{BoneVolume, Projector};
use std::sync::Arc;

/// One view of a scorer: what the static objects give is computed once, and every candidate
/// changes and restores only the pixels near its moving objects. Candidates are projected as many at
/// a time as the projector likes.
#[derive(Clone, Debug)]
pub(super) struct ViewCost {
    fixed: Arc<FixedView>,
    camera_from_world: Rigid,
    background: Background,
    /// For each moving object the axis that it is projected along, if it is fixed.
    axes: Vec<Option<usize>>,
    /// The current projections, one after the other; the background's outside `drawn` of each.
    projections: Vec<f32>,
    drawn: Vec<PixelRect>,
    /// Its gradients are the background's outside `derived`.
    comparison: Comparison,
    derived: PixelRect,
    /// Memory to work in: one object's poses in this camera, and the pixels that they touch.
    poses: Vec<Rigid>,
    touched: Vec<PixelRect>,
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
    /// Projects the static objects (with `world_from_volume` each) and compares them. The number of
    /// objects that will move is `moving`.
    pub fn new(
        fixed: Arc<FixedView>,
        camera_from_world: Rigid,
        moving: usize,
        statics: &[(Arc<BoneVolume>, Rigid)],
        projector: &mut dyn Projector,
        level: SimdLevel,
    ) -> Self {
        let camera = *fixed.camera();
        let whole = PixelRect::of_image(camera.width, camera.height);
        let mut projection = vec![0.0; camera.width * camera.height];
        for (bone, world_from_volume) in statics {
            let pose = [camera_from_world * world_from_volume];
            let mut touched = [PixelRect::EMPTY];
            projector.project_add(bone, &camera, &pose, None, &mut projection, &mut touched);
        }
        let mut comparison = Comparison::new(&fixed, level);
        comparison.derive(&projection, whole);
        let centers = comparison.all_centers();
        let mut costs = vec![0.0; centers.width() * centers.height()];
        let total = comparison.sum_of_costs(&fixed, centers, Some(&mut costs));
        Self {
            camera_from_world,
            axes: vec![None; moving],
            projections: Vec::new(),
            background: Background {
                projection,
                gradients: comparison.gradients.clone(),
                total,
                cost_area: area_sums(&costs, centers.width()),
            },
            drawn: Vec::new(),
            comparison,
            derived: PixelRect::EMPTY,
            poses: Vec::new(),
            touched: Vec::new(),
            fixed,
        }
    }

    /// Fixes the axes that moving objects are projected along at what suits these poses.
    pub fn fix_axes(
        &mut self,
        moving: &[Arc<BoneVolume>],
        world_from_volume: &[Rigid],
        projector: &dyn Projector,
    ) {
        let camera = self.fixed.camera();
        for ((axis, bone), pose) in self.axes.iter_mut().zip(moving).zip(world_from_volume) {
            *axis = projector.axis(bone, camera, &(self.camera_from_world * pose));
        }
    }

    /// Adds to each cost the similarity of a candidate, which has one pose for each moving object;
    /// lower is better.
    pub fn add_similarities(
        &mut self,
        moving: &[Arc<BoneVolume>],
        world_from_volume: &[Rigid],
        projector: &mut dyn Projector,
        costs: &mut [f64],
    ) {
        let batch = projector.batch().min(costs.len()).max(1);
        self.make_room(batch);
        let poses = world_from_volume.chunks(batch * moving.len());
        for (costs, poses) in costs.chunks_mut(batch).zip(poses) {
            self.project(moving, poses, projector);
            for (number, cost) in costs.iter_mut().enumerate() {
                *cost += self.similarity(number);
            }
        }
    }

    /// Makes room for as many projections, which allocates when there were never as many before.
    fn make_room(&mut self, batch: usize) {
        while self.drawn.len() < batch {
            self.projections
                .extend_from_slice(&self.background.projection);
            self.drawn.push(PixelRect::EMPTY);
            self.touched.push(PixelRect::EMPTY);
        }
    }

    /// Projects as many candidates as there is room for.
    fn project(
        &mut self,
        moving: &[Arc<BoneVolume>],
        world_from_volume: &[Rigid],
        projector: &mut dyn Projector,
    ) {
        let camera = self.fixed.camera();
        let pixels = camera.width * camera.height;
        let candidates = world_from_volume.len() / moving.len();
        let images = &mut self.projections[..candidates * pixels];
        for (image, drawn) in images.chunks_exact_mut(pixels).zip(&mut self.drawn) {
            copy_part(&self.background.projection, image, camera.width, *drawn);
            *drawn = PixelRect::EMPTY;
        }
        for (object, bone) in moving.iter().enumerate() {
            let poses = world_from_volume[object..].iter().step_by(moving.len());
            self.poses.clear();
            self.poses
                .extend(poses.map(|pose| self.camera_from_world * pose));
            let touched = &mut self.touched[..candidates];
            let axis = self.axes[object];
            projector.project_add(bone, camera, &self.poses, axis, images, touched);
            for (drawn, touched) in self.drawn.iter_mut().zip(touched) {
                *drawn = drawn.union(touched);
            }
        }
    }

    /// The similarity of one of the current projections.
    fn similarity(&mut self, number: usize) -> f64 {
        let camera = self.fixed.camera();
        let whole = PixelRect::of_image(camera.width, camera.height);
        let gradients = self.background.gradients.iter();
        for (from, to) in gradients.zip(&mut self.comparison.gradients) {
            copy_part(from, to, camera.width, self.derived);
        }
        let reach = self.comparison.gradient_reach();
        self.derived = self.drawn[number].grown(reach, &whole);
        let pixels = camera.width * camera.height;
        let projection = &self.projections[number * pixels..][..pixels];
        self.comparison.derive(projection, self.derived);

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

    /// The projection of the first of the candidates compared last.
    pub fn projection(&self) -> Image<f32> {
        let camera = self.fixed.camera();
        let pixels = camera.width * camera.height;
        Image::new(
            camera.width,
            camera.height,
            self.projections[..pixels].to_vec(),
        )
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
