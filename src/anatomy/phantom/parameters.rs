//! What a user may set of the phantom population.

use serde::{Deserialize, Serialize};

/// Parameters of the phantom population. Everything else about a body is drawn at random from
/// ranges that were read off real pelves (docs/phantom.md).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PhantomParameters {
    /// Edge of the cubic voxels in mm, 0.5 to 4. Default 1. At 2 mm and more the joint space is
    /// about one voxel wide.
    pub voxel_mm: f64,
    /// Seed of the population: another seed gives other bodies for the same numbers.
    pub seed: u64,
    /// Smallest and largest joint space between femoral head and acetabulum in mm, drawn once a
    /// body. Default 2.6 and 3.8; between 2 and 6.
    pub joint_space_mm: [f64; 2],
    /// Smallest and largest lateral centre-edge angle in degrees, drawn for each hip. Default 26
    /// and 38; between 0 and 50, so that dysplastic hips can be asked for.
    pub center_edge_deg: [f64; 2],
    /// Standard deviation in degrees of the pelvic tilt about the left-right axis. Default 6.
    pub tilt_sd_deg: f64,
    /// Standard deviation in degrees of the rotations of the pelvis on the table about the two
    /// other axes. Default 2.
    pub table_rotation_sd_deg: f64,
    /// How much left and right differ: 0 gives a symmetric skeleton, 1 (default) what people have.
    pub asymmetry: f64,
    /// Standard deviation of the CT's noise in HU. Default 17.
    pub noise_hu: f64,
}

impl Default for PhantomParameters {
    fn default() -> Self {
        Self {
            voxel_mm: 1.0,
            seed: 1,
            joint_space_mm: [2.6, 3.8],
            center_edge_deg: [26.0, 38.0],
            tilt_sd_deg: 6.0,
            table_rotation_sd_deg: 2.0,
            asymmetry: 1.0,
            noise_hu: 17.0,
        }
    }
}

impl PhantomParameters {
    /// (field, what is wrong and what is expected) for each value out of its range.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut found = Vec::new();
        let mut number = |field: &str, value: f64, low: f64, high: f64| {
            if !(low..=high).contains(&value) {
                found.push((
                    field.to_owned(),
                    format!("is {value}; expected {low} to {high}"),
                ));
            }
        };
        number("voxel_mm", self.voxel_mm, 0.5, 4.0);
        for value in self.joint_space_mm {
            number("joint_space_mm", value, 2.0, 6.0);
        }
        for value in self.center_edge_deg {
            number("center_edge_deg", value, 0.0, 50.0);
        }
        number("tilt_sd_deg", self.tilt_sd_deg, 0.0, 15.0);
        number(
            "table_rotation_sd_deg",
            self.table_rotation_sd_deg,
            0.0,
            10.0,
        );
        number("asymmetry", self.asymmetry, 0.0, 2.0);
        number("noise_hu", self.noise_hu, 0.0, 100.0);
        for (field, range) in [
            ("joint_space_mm", self.joint_space_mm),
            ("center_edge_deg", self.center_edge_deg),
        ] {
            if range[0] > range[1] {
                found.push((
                    field.to_owned(),
                    format!(
                        "is [{}, {}]; expected the smaller first",
                        range[0], range[1]
                    ),
                ));
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_fine_and_nonsense_is_named() {
        assert!(PhantomParameters::default().problems().is_empty());
        let bad = PhantomParameters {
            voxel_mm: 0.1,
            joint_space_mm: [4.0, 3.0],
            noise_hu: f64::NAN,
            ..Default::default()
        };
        let fields: Vec<_> = bad.problems().into_iter().map(|(f, _)| f).collect();
        assert_eq!(fields, ["voxel_mm", "noise_hu", "joint_space_mm"]);
    }
}
