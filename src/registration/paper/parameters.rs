//! Parameters of the strategy `paper`: Tables S-2 to S-4 and what the paper leaves open.

use crate::objective::Views;
use crate::shape_estimation::RansacParameters;
use serde::{Deserialize, Serialize};

/// One kind of single-view registration of the pelvis; axes are the camera's (x and y in the
/// image plane, z depth), angles and translations in the order x, y, z.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SingleViewParameters {
    /// CMA-ES population (Table S-2).
    pub population: usize,
    /// CMA-ES initial standard deviations (Table S-2).
    pub sd_rotation_deg: [f64; 3],
    pub sd_translation_mm: [f64; 3],
    /// Standard deviations of the zero-mean normal priors (Table S-3).
    pub prior_rotation_deg: [f64; 3],
    pub prior_translation_mm: [f64; 3],
    /// Half widths of BOBYQA's box (Table S-4).
    pub box_rotation_deg: [f64; 3],
    pub box_translation_mm: [f64; 3],
}

/// One object of the multi-view registration; axes are the APP's. Every value holds for all three
/// rotations or all three translations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiViewParameters {
    /// CMA-ES population (Table S-2).
    pub population: usize,
    /// CMA-ES initial standard deviations (Table S-2).
    pub sd_rotation_deg: f64,
    pub sd_translation_mm: f64,
    /// mu = sigma of the folded normals on the rotation angle and the translation norm (facts 2.9:
    /// the paper shows them in a figure only).
    pub prior_rotation_deg: f64,
    pub prior_translation_mm: f64,
    /// Half widths of BOBYQA's box when this object moves alone (Table S-4, sequential).
    pub box_rotation_deg: f64,
    pub box_translation_mm: f64,
    /// Half widths of BOBYQA's box when all objects move (Table S-4, simultaneous).
    pub joint_box_rotation_deg: f64,
    pub joint_box_translation_mm: f64,
}

/// Everything that the strategy `paper` may be told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PaperParameters {
    /// Pixels cut off each side of an image before anything else (facts 2.3; the crop is the
    /// library's, not the paper's).
    pub crop_px: usize,
    /// Reduction of the image at the first and the second resolution level.
    pub coarse_reduction: usize,
    pub fine_reduction: usize,
    /// Diameter of the similarity's patches in the full-size image.
    pub patch_diameter_px: usize,
    /// Step of the ray caster.
    pub step_mm: f64,
    /// Whether the views' similarities are averaged or added (equation 1 writes a sum; the weights
    /// 0.9 and 0.1 balance a mean, facts 2.1).
    pub views: Views,
    /// Weight of the similarity in CMA-ES stages; the regularization has the rest.
    pub similarity_weight: f64,
    /// Where the initialization puts the landmark on its ray, as a share of the source-to-detector
    /// distance.
    pub landmark_depth: f64,
    /// The orbital search covers this angle to both sides of the first view ...
    pub orbit_range_deg: f64,
    /// ... in steps of this.
    pub orbit_step_deg: f64,
    /// CMA-ES stops when recent costs agree to this.
    pub cmaes_tolerance: f64,
    /// Cap on the evaluations of one CMA-ES stage (the library's 900 (N + 3)^2 for N = 6).
    pub cmaes_max_evaluations: usize,
    /// BOBYQA's relative tolerance in single-view stages.
    pub single_view_tolerance: f64,
    /// BOBYQA's relative tolerance in multi-view stages.
    pub multi_view_tolerance: f64,
    /// Cap on the evaluations of one BOBYQA stage (ours; far above what a stage takes).
    pub bobyqa_max_evaluations: usize,
    /// How planes are fitted to annotated cut lines.
    pub ransac: RansacParameters,
    /// First view, started from the landmark.
    pub landmark_view: SingleViewParameters,
    /// Second and third view, started from the orbital search.
    pub orbital_view: SingleViewParameters,
    pub pelvis: MultiViewParameters,
    pub femur: MultiViewParameters,
    pub fragment: MultiViewParameters,
}

impl Default for PaperParameters {
    fn default() -> Self {
        let femur = MultiViewParameters {
            population: 100,
            sd_rotation_deg: 17.2,
            sd_translation_mm: 5.0,
            prior_rotation_deg: 45.0,
            prior_translation_mm: 10.0,
            box_rotation_deg: 10.0,
            box_translation_mm: 30.0,
            joint_box_rotation_deg: 2.5,
            joint_box_translation_mm: 10.0,
        };
        Self {
            crop_px: 50,
            coarse_reduction: 8,
            fine_reduction: 4,
            patch_diameter_px: 83,
            step_mm: 1.0,
            views: Views::Mean,
            similarity_weight: 0.9,
            landmark_depth: 0.85,
            orbit_range_deg: 90.0,
            orbit_step_deg: 1.0,
            cmaes_tolerance: 0.01,
            cmaes_max_evaluations: 72_900,
            single_view_tolerance: 1e-4,
            multi_view_tolerance: 1e-3,
            bobyqa_max_evaluations: 5_000,
            ransac: RansacParameters::default(),
            landmark_view: SingleViewParameters {
                population: 100,
                sd_rotation_deg: [15.0, 15.0, 30.0],
                sd_translation_mm: [50.0, 50.0, 100.0],
                prior_rotation_deg: [10.0; 3],
                prior_translation_mm: [20.0, 20.0, 100.0],
                box_rotation_deg: [7.5, 7.5, 15.0],
                box_translation_mm: [25.0, 25.0, 50.0],
            },
            orbital_view: SingleViewParameters {
                population: 20,
                sd_rotation_deg: [2.5, 2.5, 5.0],
                sd_translation_mm: [2.5; 3],
                prior_rotation_deg: [2.5; 3],
                prior_translation_mm: [2.5, 2.5, 25.0],
                box_rotation_deg: [1.25; 3],
                box_translation_mm: [1.25, 1.25, 12.5],
            },
            pelvis: MultiViewParameters {
                population: 20,
                sd_rotation_deg: 2.3,
                sd_translation_mm: 2.0,
                prior_rotation_deg: 10.0,
                prior_translation_mm: 50.0,
                box_rotation_deg: 2.5,
                box_translation_mm: 5.0,
                joint_box_rotation_deg: 2.5,
                joint_box_translation_mm: 5.0,
            },
            fragment: MultiViewParameters {
                prior_rotation_deg: 25.0,
                ..femur.clone()
            },
            femur,
        }
    }
}

/// Collects what is wrong with a set of parameters.
struct Problems(Vec<(String, String)>);

impl Problems {
    fn positive(&mut self, field: &str, value: f64) {
        if !(value > 0.0 && value.is_finite()) {
            self.add(field, format!("{value} is not a positive number"));
        }
    }

    fn all_positive(&mut self, field: &str, values: &[f64; 3]) {
        for (value, axis) in values.iter().zip(["x", "y", "z"]) {
            self.positive(&format!("{field}[{axis}]"), *value);
        }
    }

    fn population(&mut self, field: &str, value: usize) {
        if !(4..=10_000).contains(&value) {
            self.add(field, format!("{value} lies outside 4 to 10000"));
        }
    }

    fn add(&mut self, field: &str, problem: String) {
        self.0.push((field.to_string(), problem));
    }
}

impl PaperParameters {
    /// What is out of range, as (field, problem).
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut p = Problems(Vec::new());
        for (field, value) in [
            ("step_mm", self.step_mm),
            ("orbit_range_deg", self.orbit_range_deg),
            ("orbit_step_deg", self.orbit_step_deg),
            ("cmaes_tolerance", self.cmaes_tolerance),
            ("single_view_tolerance", self.single_view_tolerance),
            ("multi_view_tolerance", self.multi_view_tolerance),
        ] {
            p.positive(field, value);
        }
        for (field, value) in [
            ("similarity_weight", self.similarity_weight),
            ("landmark_depth", self.landmark_depth),
        ] {
            if !(value > 0.0 && value <= 1.0) {
                p.add(field, format!("{value} lies outside (0, 1]"));
            }
        }
        for (field, value) in [
            ("coarse_reduction", self.coarse_reduction),
            ("fine_reduction", self.fine_reduction),
        ] {
            if !(1..=64).contains(&value) {
                p.add(field, format!("{value} lies outside 1 to 64"));
            }
        }
        if self.patch_diameter_px < 3 {
            p.add(
                "patch_diameter_px",
                format!("{} is below 3 pixels", self.patch_diameter_px),
            );
        }
        for (field, value) in [
            ("cmaes_max_evaluations", self.cmaes_max_evaluations),
            ("bobyqa_max_evaluations", self.bobyqa_max_evaluations),
        ] {
            if value == 0 {
                p.add(field, "0 evaluations leave nothing to do".into());
            }
        }
        for (field, problem) in self.ransac.problems() {
            p.add(&format!("ransac.{field}"), problem);
        }
        for (name, view) in [
            ("landmark_view", &self.landmark_view),
            ("orbital_view", &self.orbital_view),
        ] {
            p.population(&format!("{name}.population"), view.population);
            for (field, values) in [
                ("sd_rotation_deg", &view.sd_rotation_deg),
                ("sd_translation_mm", &view.sd_translation_mm),
                ("prior_rotation_deg", &view.prior_rotation_deg),
                ("prior_translation_mm", &view.prior_translation_mm),
                ("box_rotation_deg", &view.box_rotation_deg),
                ("box_translation_mm", &view.box_translation_mm),
            ] {
                p.all_positive(&format!("{name}.{field}"), values);
            }
        }
        for (name, object) in [
            ("pelvis", &self.pelvis),
            ("femur", &self.femur),
            ("fragment", &self.fragment),
        ] {
            p.population(&format!("{name}.population"), object.population);
            for (field, value) in [
                ("sd_rotation_deg", object.sd_rotation_deg),
                ("sd_translation_mm", object.sd_translation_mm),
                ("prior_rotation_deg", object.prior_rotation_deg),
                ("prior_translation_mm", object.prior_translation_mm),
                ("box_rotation_deg", object.box_rotation_deg),
                ("box_translation_mm", object.box_translation_mm),
                ("joint_box_rotation_deg", object.joint_box_rotation_deg),
                ("joint_box_translation_mm", object.joint_box_translation_mm),
            ] {
                p.positive(&format!("{name}.{field}"), value);
            }
        }
        p.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_values_are_in_range() {
        assert_eq!(PaperParameters::default().problems(), []);
    }

    #[test]
    fn every_wrong_value_is_named() {
        let mut p = PaperParameters {
            step_mm: 0.0,
            ..PaperParameters::default()
        };
        p.femur.population = 1;
        p.landmark_view.box_rotation_deg[2] = f64::NAN;
        let fields: Vec<String> = p.problems().into_iter().map(|(field, _)| field).collect();
        let expected = [
            "step_mm",
            "landmark_view.box_rotation_deg[z]",
            "femur.population",
        ];
        assert_eq!(fields, expected);
    }
}
