//! The seam between strategies and pixels.

use crate::geometry::Rigid;

/// Gives the similarity costs of candidate poses, over all views. A strategy sees no pixels; CPU
/// and GPU stand behind this one trait.
///
/// A scorer is made for one stage: its views (fixed images and `camera_from_world` of each), the
/// objects that move, and the static objects at fixed poses, which it projects once.
pub trait Scorer {
    /// Number of moving objects, so of poses a candidate has.
    fn moving_objects(&self) -> usize;

    /// Writes the similarity cost of each candidate, lower is better, mean over views (or the sum,
    /// as configured).
    ///
    /// `world_from_volume` holds, candidate after candidate, one pose for each moving object.
    ///
    /// # Panics
    /// When `world_from_volume.len() != costs.len() * self.moving_objects()`.
    fn similarities(&mut self, world_from_volume: &[Rigid], costs: &mut [f64]);
}
