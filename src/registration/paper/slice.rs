//! The strategy `paper_slice`: the paper's search with a faster projector.

use super::parameters::PaperParameters;
use super::pipeline::Paper;
use crate::registration::observation::Observation;
use crate::registration::outcome::Outcome;
use crate::registration::strategy::{RegistrationError, Strategy};
use crate::xray::ProjectorParameters;
use serde::{Deserialize, Serialize};

/// Everything that the strategy `paper_slice` may be told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PaperSliceParameters {
    /// Pitch of the lattice that slices are resampled to, in pixels of the reduced image: 0.25 to 2.
    /// Smaller is sharper and, by its square, slower. Default 1.
    pub pitch_px: f64,
    /// The search. `step_mm` is the ray caster's and has no effect.
    pub paper: PaperParameters,
}

impl Default for PaperSliceParameters {
    fn default() -> Self {
        Self {
            pitch_px: 1.0,
            paper: PaperParameters::default(),
        }
    }
}

impl PaperSliceParameters {
    /// What is out of range, as (field, problem).
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(0.25..=2.0).contains(&self.pitch_px) {
            let problem = format!("{} lies outside 0.25 to 2", self.pitch_px);
            problems.push(("pitch_px".to_owned(), problem));
        }
        let paper = self.paper.problems().into_iter();
        problems.extend(paper.map(|(field, problem)| (format!("paper.{field}"), problem)));
        problems
    }
}

/// The paper's registration (`Paper`) with DRRs by slice resampling
/// ([`crate::xray::SliceResampling`]) in place of cast rays.
#[derive(Clone, Debug, Default)]
pub struct PaperSlice {
    pub parameters: PaperSliceParameters,
}

impl Strategy for PaperSlice {
    fn name(&self) -> &'static str {
        "paper_slice"
    }

    fn register(&self, observation: &Observation) -> Result<Outcome, RegistrationError> {
        let pitch_px = self.parameters.pitch_px;
        Paper {
            parameters: self.parameters.paper.clone(),
        }
        .register_by(ProjectorParameters::Slice { pitch_px }, observation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_values_are_named_with_their_place() {
        let mut p = PaperSliceParameters::default();
        assert_eq!(p.problems(), []);
        p.pitch_px = 0.0;
        p.paper.orbit_step_deg = -1.0;
        let fields: Vec<String> = p.problems().into_iter().map(|(field, _)| field).collect();
        assert_eq!(fields, ["pitch_px", "paper.orbit_step_deg"]);
    }
}
