//! From Hounsfield units to linear attenuation.

use serde::{Deserialize, Serialize};

/// The linear map from Hounsfield units to attenuation, cut off at zero: for fluoroscopy and for
/// DRRs alike (DESIGN section 3, "attenuation"; facts 2.4).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AttenuationParameters {
    /// Hounsfield units at and below which nothing attenuates. Default -130, as the authors'
    /// simulated fluoroscopy; -1000 is what their code has for DRRs.
    pub hu_lower: f32,
    /// Attenuation per mm of one Hounsfield unit above `hu_lower`. Default 2.68275e-5, about a
    /// thousandth of the difference of water and air per mm.
    pub slope_per_mm_hu: f32,
}

impl Default for AttenuationParameters {
    fn default() -> Self {
        Self {
            hu_lower: -130.0,
            slope_per_mm_hu: 2.68275e-5,
        }
    }
}

impl AttenuationParameters {
    /// Linear attenuation per mm of a material of `hu` Hounsfield units:
    /// `max(0, (hu - hu_lower) * slope)`.
    #[inline]
    pub fn mu(&self, hu: f32) -> f32 {
        ((hu - self.hu_lower) * self.slope_per_mm_hu).max(0.0)
    }

    /// Field names with what is wrong and what is expected, for values out of range.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(-1100.0..=500.0).contains(&self.hu_lower) {
            problems.push((
                "hu_lower".into(),
                format!("is {}; expected -1100 to 500 HU", self.hu_lower),
            ));
        }
        if !(self.slope_per_mm_hu > 0.0 && self.slope_per_mm_hu <= 1e-3) {
            problems.push((
                "slope_per_mm_hu".into(),
                format!(
                    "is {}; expected above 0 and at most 0.001 per mm and HU",
                    self.slope_per_mm_hu
                ),
            ));
        }
        problems
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn water_and_air_attenuate_as_published() {
        let p = AttenuationParameters::default();
        assert_eq!(p.mu(-130.0), 0.0);
        assert_eq!(p.mu(-1000.0), 0.0);
        assert!((f64::from(p.mu(870.0)) - 2.68275e-2).abs() < 1e-8);
        assert!(p.problems().is_empty());
    }

    #[test]
    fn values_out_of_range_are_named() {
        let p = AttenuationParameters {
            hu_lower: f32::NAN,
            slope_per_mm_hu: 0.0,
        };
        let fields: Vec<_> = p.problems().into_iter().map(|(field, _)| field).collect();
        assert_eq!(fields, ["hu_lower", "slope_per_mm_hu"]);
    }
}
