//! The columns of a registration's row.
//!
//! *Result* columns are a pure function of configuration, seed and key; *measurement* columns
//! (times, attempt) are not (DESIGN section 4.1). Angles are degrees, lengths mm. Errors and
//! movements are those of the hip's APP: LR = x, IS = y, AP = z.

use std::collections::HashMap;
use std::sync::LazyLock;

/// What a column holds. Every column but the key may be empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    Text,
    Integer,
    Number,
    Flag,
}

/// What a column is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Part of the row's key: never empty.
    Key,
    /// Promised to be equal in every run of the study.
    Result,
    /// How it went this time.
    Measurement,
}

/// One column.
#[derive(Clone, Debug)]
pub struct Column {
    pub name: String,
    pub kind: Kind,
    pub role: Role,
    /// What it means, with unit and frame.
    pub doc: String,
}

/// `status` of a registration that came to an end.
pub const COMPLETE: &str = "complete";
/// `status` of a registration that could not be made; `phase` and `message` say why.
pub const FAILED: &str = "failed";
/// `status` of a registration that is set aside because it, or its case's simulation, ended its process
/// twice, the second time in a process that did nothing else.
pub const CRASHED: &str = "crashed";

/// Stages of the strategies, in the order in which they run: prefixes of the stage columns.
pub const STAGES: [&str; 15] = [
    "view1_cmaes",
    "view1_bobyqa",
    "view2_search",
    "view2_cmaes",
    "view2_bobyqa",
    "view3_search",
    "view3_cmaes",
    "view3_bobyqa",
    "multi_pelvis_cmaes",
    "multi_femur_cmaes",
    "multi_fragment_cmaes",
    "multi_pelvis_bobyqa",
    "multi_femur_bobyqa",
    "multi_fragment_bobyqa",
    "multi_all_bobyqa",
];

/// Every column, in the order of the table.
#[derive(Debug)]
pub struct Schema {
    pub columns: Vec<Column>,
    places: HashMap<String, usize>,
}

/// The one schema of this version.
pub static SCHEMA: LazyLock<Schema> = LazyLock::new(Schema::new);

impl Schema {
    /// The place of a column.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.places.get(name).copied()
    }

    fn new() -> Self {
        let mut schema = Self {
            columns: Vec::new(),
            places: HashMap::new(),
        };
        schema.keys();
        schema.truths();
        schema.estimates();
        schema.errors();
        schema.stages();
        schema.measurements();
        schema
    }

    fn add(&mut self, name: impl Into<String>, kind: Kind, role: Role, doc: impl Into<String>) {
        let (name, doc) = (name.into(), doc.into());
        let before = self.places.insert(name.clone(), self.columns.len());
        assert!(before.is_none(), "column {name} is there twice");
        self.columns.push(Column {
            name,
            kind,
            role,
            doc,
        });
    }

    fn result(&mut self, name: impl Into<String>, kind: Kind, doc: impl Into<String>) {
        self.add(name, kind, Role::Result, doc);
    }

    fn numbers(&mut self, columns: &[(&str, &str)]) {
        for (name, doc) in columns {
            self.result(*name, Kind::Number, *doc);
        }
    }

    /// Three rotations and three translations in the APP.
    fn pose(&mut self, prefix: &str, what: &str) {
        for (axis, of) in AXES {
            let doc = format!("{what}: angle about the {of} axis of R = Rx Ry Rz (deg)");
            self.result(format!("{prefix}rotation_{axis}_deg"), Kind::Number, doc);
        }
        for (axis, of) in AXES {
            let doc = format!("{what}: translation along the {of} axis (mm)");
            self.result(format!("{prefix}translation_{axis}_mm"), Kind::Number, doc);
        }
    }

    fn keys(&mut self) {
        for (name, kind, doc) in [
            ("specimen", Kind::Text, "Name of the specimen"),
            ("side", Kind::Text, "left or right"),
            ("fragment", Kind::Integer, "Number of the fragment, from 0"),
            ("movement", Kind::Integer, "Number of the movement, from 0"),
            (
                "initialization",
                Kind::Integer,
                "Number of the initialization, from 0",
            ),
            (
                "scenario",
                Kind::Text,
                "Which fragment shape the registration was given",
            ),
            (
                "strategy",
                Kind::Text,
                "Name of the strategy in the configuration",
            ),
        ] {
            self.add(name, kind, Role::Key, doc);
        }
        for (name, kind, doc) in [
            ("status", Kind::Text, "complete, failed or crashed"),
            ("phase", Kind::Text, "Where a registration failed"),
            ("message", Kind::Text, "Why it failed"),
            (
                "specimen_kind",
                Kind::Text,
                "Where the anatomy comes from: phantom, surfaces, ...",
            ),
            (
                "assigned_density",
                Kind::Flag,
                "True when Hounsfield values were assigned by rule, not measured",
            ),
        ] {
            self.result(name, kind, doc);
        }
    }

    fn truths(&mut self) {
        self.numbers(&[
            (
                "true_rotation_deg",
                "True movement of the fragment: total rotation (deg)",
            ),
            (
                "true_translation_mm",
                "True movement of the fragment: translation (mm)",
            ),
        ]);
        self.pose("true_", "True movement of the fragment in the APP");
        self.pose("true_femur_", "True movement of the femur in the APP");
        self.numbers(&[
            (
                "preoperative_lce_deg",
                "LCE angle before the movement (deg)",
            ),
            ("true_lce_deg", "LCE angle after the true movement (deg)"),
            (
                "true_orbital_angle_2_deg",
                "Orbital angle of view 2 against view 1, without its perturbation (deg)",
            ),
            (
                "true_orbital_angle_3_deg",
                "Orbital angle of view 3 against view 1, without its perturbation (deg)",
            ),
            (
                "pick_point_offset_mm",
                "Distance of the 3D pick from the landmark (mm)",
            ),
            (
                "pick_pixel_offset_px",
                "Distance of the 2D pick from the landmark's image, in pixels of the full image",
            ),
        ]);
        self.result(
            "fragment_rejections",
            Kind::Integer,
            "Random cuts that gave no plausible fragment before this one",
        );
        self.result(
            "movement_rejections",
            Kind::Integer,
            "Movements that collided before this one",
        );
        self.result(
            "overlap_voxels",
            Kind::Integer,
            "Voxels where moved bone fell on bone that stays: the collision tolerance lets few through",
        );
    }

    fn estimates(&mut self) {
        self.pose(
            "estimated_",
            "Estimated movement of the fragment in the APP",
        );
        self.numbers(&[
            (
                "estimated_lce_deg",
                "LCE angle after the estimated movement (deg)",
            ),
            (
                "estimated_orbital_angle_2_deg",
                "Orbital angle that the search chose for view 2 (deg)",
            ),
            (
                "estimated_orbital_angle_3_deg",
                "Orbital angle that the search chose for view 3 (deg)",
            ),
        ]);
    }

    fn errors(&mut self) {
        self.numbers(&[
            (
                "rotation_error_deg",
                "Total angle of estimated x inverse(true) of the fragment's movement (deg)",
            ),
            (
                "translation_error_mm",
                "Translation norm of estimated x inverse(true) (mm)",
            ),
            (
                "lce_error_deg",
                "Estimated less true LCE angle (deg), signed",
            ),
        ]);
        for (axis, of) in AXES {
            let doc = format!("Angle of the error about the {of} axis (deg), signed");
            self.result(format!("rotation_error_{axis}_deg"), Kind::Number, doc);
        }
        for (axis, of) in AXES {
            let doc = format!("Component of the error along the {of} axis (mm), signed");
            self.result(format!("translation_error_{axis}_mm"), Kind::Number, doc);
        }
        for (phase, when) in [
            ("initialization", "after the initialization"),
            ("single_view", "after its single-view registration"),
            ("multi_view", "after the multi-view registration"),
        ] {
            let doc = |unit: &str| {
                format!(
                    "Offset of the pelvis from the truth in view 1, in the APP, {when} ({unit})"
                )
            };
            self.result(
                format!("pelvis_{phase}_rotation_deg"),
                Kind::Number,
                doc("deg"),
            );
            self.result(
                format!("pelvis_{phase}_translation_mm"),
                Kind::Number,
                doc("mm"),
            );
        }
        for cut in ["ilium", "pubis"] {
            let doc = format!(
                "Why the nominal {cut} cut was used instead of an estimate; empty otherwise"
            );
            self.result(format!("{cut}_fallback"), Kind::Text, doc);
            let doc = format!("Angle between the used and the true {cut} plane (deg)");
            self.result(format!("{cut}_angle_error_deg"), Kind::Number, doc);
            let doc = format!(
                "Distance of the true {cut} plane from the used plane, at the foot of the perpendicular from the femoral head to the true plane (mm), positive when the used plane lies outward"
            );
            self.result(format!("{cut}_offset_error_mm"), Kind::Number, doc);
        }
    }

    fn stages(&mut self) {
        for stage in STAGES {
            let doc = "Cost at the stage's result";
            self.result(format!("{stage}_cost"), Kind::Number, doc);
            let doc = "Candidates whose similarity the stage evaluated";
            self.result(format!("{stage}_evaluations"), Kind::Integer, doc);
            let doc = "True when a cap on generations or evaluations ended the stage";
            self.result(format!("{stage}_capped"), Kind::Flag, doc);
        }
    }

    fn measurements(&mut self) {
        for stage in STAGES {
            let doc = "Wall time of the stage (s)";
            self.add(
                format!("{stage}_seconds"),
                Kind::Number,
                Role::Measurement,
                doc,
            );
        }
        for (name, kind, doc) in [
            (
                "shape_seconds",
                Kind::Number,
                "Wall time of the shape estimation (s)",
            ),
            (
                "registration_seconds",
                Kind::Number,
                "Wall time of the whole registration (s)",
            ),
            (
                "simulation_seconds",
                Kind::Number,
                "Wall time of the case's simulation (s)",
            ),
            ("attempt", Kind::Integer, "The attempt that wrote the row"),
        ] {
            self.add(name, kind, Role::Measurement, doc);
        }
    }
}

/// Suffix and description of the APP's axes.
const AXES: [(&str, &str); 3] = [
    ("lr", "left-right"),
    ("is", "inferior-superior"),
    ("ap", "anterior-posterior"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_documented() {
        assert!(SCHEMA.columns.iter().all(|c| !c.doc.is_empty()));
        assert_eq!(SCHEMA.place("specimen"), Some(0));
        assert_eq!(SCHEMA.place("nobody"), None);
        for (place, column) in SCHEMA.columns.iter().enumerate() {
            assert_eq!(SCHEMA.place(&column.name), Some(place));
        }
    }

    /// Times are the only thing that may differ between two runs, so no result is named like one.
    #[test]
    fn seconds_are_measurements() {
        for column in &SCHEMA.columns {
            let time = column.name.ends_with("_seconds");
            assert!(!time || column.role == Role::Measurement, "{}", column.name);
        }
    }
}
