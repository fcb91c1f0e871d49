//! What is assigned to surfaces, which carry shape only.

use serde::{Deserialize, Serialize};

/// How a specimen is made from bone surfaces. Hounsfield values follow the 32 slices of the
/// Visible Human Male through both hips (`docs/specimens.md` compares them).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfacesParameters {
    /// Edge of a voxel (mm).
    pub voxel_mm: f64,
    /// The CT ends this far below the femoral heads, towards the feet (mm).
    pub below_heads_mm: f64,
    /// Soft tissue above the highest bone (mm).
    pub above_bones_mm: f64,
    /// Air around the body (mm).
    pub air_mm: f64,
    /// Seed of the texture; its stream's key is the specimen's name.
    pub seed: u64,
    /// Cortical bone (HU).
    pub cortical_hu: f64,
    /// Median thickness of the cortical shell of hip bones and proximal femora (mm); the sacrum
    /// has two thirds of it.
    pub cortical_mm: f64,
    /// Standard deviation of the logarithm of the shell's thickness from place to place.
    pub cortical_spread: f64,
    /// Mean of the trabecular bone inside hip bones (HU); femoral heads and the bone over the
    /// joint are denser, the sacrum and the femoral necks less dense.
    pub trabecular_hu: f64,
    /// Standard deviation of the trabecular texture (HU).
    pub trabecular_texture_hu: f64,
    /// Cortex of the femoral shaft (HU) and its thickness (mm).
    pub shaft_hu: f64,
    pub shaft_mm: f64,
    /// Marrow in the shaft (HU).
    pub marrow_hu: f64,
    /// The CT at the given surfaces (HU): the threshold they were segmented at.
    pub surface_hu: f64,
    /// Blur of the scanner, one standard deviation (mm).
    pub blur_mm: f64,
    /// Noise of the scanner, one standard deviation (HU).
    pub noise_hu: f64,
    /// Muscle, fat and the pelvic organs (HU).
    pub muscle_hu: f64,
    pub fat_hu: f64,
    pub organ_hu: f64,
    /// Mean thickness of the fat under the skin (mm).
    pub fat_mm: f64,
    /// Soft tissue beside the greater trochanters, in front of the pelvis and behind it (mm).
    pub lateral_tissue_mm: f64,
    pub anterior_tissue_mm: f64,
    pub posterior_tissue_mm: f64,
}

impl Default for SurfacesParameters {
    fn default() -> Self {
        Self {
            voxel_mm: 1.0,
            below_heads_mm: 150.0,
            above_bones_mm: 20.0,
            air_mm: 10.0,
            seed: 1,
            cortical_hu: 1150.0,
            cortical_mm: 1.4,
            cortical_spread: 0.4,
            trabecular_hu: 175.0,
            trabecular_texture_hu: 130.0,
            shaft_hu: 1400.0,
            shaft_mm: 6.0,
            marrow_hu: -20.0,
            surface_hu: 200.0,
            blur_mm: 0.8,
            noise_hu: 15.0,
            muscle_hu: 45.0,
            fat_hu: -115.0,
            organ_hu: 25.0,
            fat_mm: 20.0,
            lateral_tissue_mm: 45.0,
            anterior_tissue_mm: 40.0,
            posterior_tissue_mm: 45.0,
        }
    }
}

impl SurfacesParameters {
    /// (field, what is wrong and what is expected) for every value out of range.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        let mut check = |field: &str, value: f64, low: f64, high: f64| {
            if !(low..=high).contains(&value) {
                let text = format!("is {value}; expected {low} to {high}");
                problems.push((field.to_owned(), text));
            }
        };
        check("voxel_mm", self.voxel_mm, 0.4, 3.0);
        check("below_heads_mm", self.below_heads_mm, 60.0, 300.0);
        check("above_bones_mm", self.above_bones_mm, 2.0, 200.0);
        check("air_mm", self.air_mm, 2.0, 200.0);
        check("cortical_hu", self.cortical_hu, 500.0, 3000.0);
        check("cortical_mm", self.cortical_mm, 0.2, 5.0);
        check("cortical_spread", self.cortical_spread, 0.0, 1.0);
        check("trabecular_hu", self.trabecular_hu, 0.0, 800.0);
        check(
            "trabecular_texture_hu",
            self.trabecular_texture_hu,
            0.0,
            300.0,
        );
        check("shaft_hu", self.shaft_hu, 500.0, 3000.0);
        check("shaft_mm", self.shaft_mm, 1.0, 12.0);
        check("marrow_hu", self.marrow_hu, -150.0, 300.0);
        check("surface_hu", self.surface_hu, 100.0, 400.0);
        check("blur_mm", self.blur_mm, 0.1, 3.0);
        check("noise_hu", self.noise_hu, 0.0, 100.0);
        check("muscle_hu", self.muscle_hu, 0.0, 99.0);
        check("fat_hu", self.fat_hu, -200.0, -20.0);
        check("organ_hu", self.organ_hu, -50.0, 99.0);
        check("fat_mm", self.fat_mm, 2.0, 100.0);
        check("lateral_tissue_mm", self.lateral_tissue_mm, 15.0, 200.0);
        check("anterior_tissue_mm", self.anterior_tissue_mm, 15.0, 200.0);
        check("posterior_tissue_mm", self.posterior_tissue_mm, 15.0, 200.0);
        problems
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_sound_and_bad_values_are_named() {
        assert_eq!(SurfacesParameters::default().problems(), vec![]);
        let bad = SurfacesParameters {
            voxel_mm: f64::NAN,
            fat_hu: 10.0,
            ..Default::default()
        };
        let fields: Vec<String> = bad.problems().into_iter().map(|p| p.0).collect();
        assert_eq!(fields, ["voxel_mm", "fat_hu"]);
    }
}
