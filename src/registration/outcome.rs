//! What a registration gives back.

use crate::geometry::Rigid;
use crate::surgery::CutPlanes;

/// One stage of a strategy.
#[derive(Clone, Debug, PartialEq)]
pub struct StageRecord {
    /// Column prefix: `view1_cmaes`, `multi_fragment_bobyqa`, ...
    pub stage: &'static str,
    /// Cost at the stage's result.
    pub cost: f64,
    /// Similarity evaluations (candidates, all views of one candidate together).
    pub evaluations: u64,
    /// True when a generation or evaluation cap ended the stage.
    pub capped: bool,
    /// Wall time; a measurement, not a result.
    pub seconds: f64,
}

/// How the fragment's shape was obtained.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeOutcome {
    /// It was given.
    Given,
    /// It was estimated; `cuts` are those used, and a message says which cut fell back to the
    /// nominal one and why, if one did.
    Estimated {
        cuts: Box<CutPlanes>,
        ilium_fallback: Option<String>,
        pubis_fallback: Option<String>,
        seconds: f64,
    },
}

/// Estimated poses, and how they came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// View 1 after the single-landmark initialization.
    pub initial_camera_from_pelvis: Rigid,
    /// The three views after their single-view registrations.
    pub single_view_camera_from_pelvis: [Rigid; 3],
    /// Orbital angles of views 2 and 3 relative to view 1 that the exhaustive search chose (rad).
    pub orbital_angles: [f64; 2],
    /// Poses after all multi-view stages, in view 1's camera.
    pub camera_from_pelvis: Rigid,
    pub camera_from_femur: Rigid,
    pub camera_from_fragment: Rigid,
    /// The fragment's movement in the APP (DESIGN section 3, movement).
    pub fragment_movement: Rigid,
    pub shape: ShapeOutcome,
    pub stages: Vec<StageRecord>,
}
