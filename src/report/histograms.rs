//! Histograms as the paper draws them: joint ones of rotation and translation, and those of the
//! LCE error.

use super::canvas::{Area, Figure};
use super::errors_table::{SCENARIOS, absolute, scenario_title};
use super::offsets_table::one_row_a_case;
use super::rows::Rows;
use plotters::prelude::*;

/// One panel of a joint histogram.
#[derive(Clone, Debug)]
pub struct JointPanel {
    pub title: String,
    /// Rotations (deg) and translations (mm), pairwise.
    pub rotations_deg: Vec<f64>,
    pub translations_mm: Vec<f64>,
}

/// Joint histograms side by side, each normalized to its own number of values.
#[derive(Clone, Debug)]
pub struct JointHistograms {
    pub name: String,
    pub panels: Vec<JointPanel>,
    /// Upper ends of the axes; values beyond are counted in the last bin.
    pub rotation_limit_deg: f64,
    pub translation_limit_mm: f64,
    /// Number of bins along each axis.
    pub bins: usize,
}

impl JointHistograms {
    /// The joint rotation/translation errors of the four scenarios (the paper's figure of
    /// fragment errors).
    pub fn errors(rows: &Rows) -> Self {
        let panel = |scenario: &str| {
            let own = rows.with("scenario", scenario);
            JointPanel {
                title: format!("{} (n = {})", scenario_title(scenario), own.len()),
                rotations_deg: absolute(&own, "rotation_error_deg"),
                translations_mm: absolute(&own, "translation_error_mm"),
            }
        };
        Self {
            name: "errors_joint".into(),
            panels: SCENARIOS.map(panel).to_vec(),
            rotation_limit_deg: 8.0,
            translation_limit_mm: 8.0,
            bins: 32,
        }
    }

    /// The sampled movements (figure S of the paper's supplement), one a case.
    pub fn movements(rows: &Rows) -> Self {
        let cases = one_row_a_case(rows);
        Self {
            name: "movements_joint".into(),
            panels: vec![JointPanel {
                title: format!("Sampled movements (n = {})", cases.len()),
                rotations_deg: absolute(&cases, "true_rotation_deg"),
                translations_mm: absolute(&cases, "true_translation_mm"),
            }],
            rotation_limit_deg: 36.0,
            translation_limit_mm: 12.0,
            bins: 36,
        }
    }

    fn shares(&self, panel: &JointPanel) -> Vec<f64> {
        let bin = |value: f64, limit: f64| {
            ((value / limit * self.bins as f64) as usize).min(self.bins - 1)
        };
        let mut shares = vec![0.0; self.bins * self.bins];
        for (r, t) in panel.rotations_deg.iter().zip(&panel.translations_mm) {
            let (x, y) = (
                bin(*r, self.rotation_limit_deg),
                bin(*t, self.translation_limit_mm),
            );
            shares[y * self.bins + x] += 1.0 / panel.rotations_deg.len() as f64;
        }
        shares
    }
}

impl Figure for JointHistograms {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn size(&self) -> (u32, u32) {
        match self.panels.len() {
            1 => (520, 480),
            n => (900, 420 * n.div_ceil(2) as u32),
        }
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<'_, B>) -> Result<(), String> {
        let columns = self.panels.len().min(2);
        let areas = area.split_evenly((self.panels.len().div_ceil(columns), columns));
        let shares: Vec<Vec<f64>> = self.panels.iter().map(|p| self.shares(p)).collect();
        let top = shares.iter().flatten().copied().fold(1e-12, f64::max);
        for ((panel, shares), area) in self.panels.iter().zip(&shares).zip(areas) {
            self.draw_panel(panel, shares, top, &area)
                .map_err(|e| e.to_string())?;
        }
        Ok(())
    }
}

impl JointHistograms {
    fn draw_panel<B: DrawingBackend>(
        &self,
        panel: &JointPanel,
        shares: &[f64],
        top: f64,
        area: &Area<'_, B>,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let mut chart = ChartBuilder::on(area)
            .caption(&panel.title, ("sans-serif", 15))
            .margin(8)
            .x_label_area_size(38)
            .y_label_area_size(46)
            .build_cartesian_2d(0.0..self.rotation_limit_deg, 0.0..self.translation_limit_mm)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_desc("rotation (deg), more in the last bin")
            .y_desc("translation (mm), more in the last bin")
            .label_style(("sans-serif", 12))
            .draw()?;
        let step = (
            self.rotation_limit_deg / self.bins as f64,
            self.translation_limit_mm / self.bins as f64,
        );
        let filled = (shares.iter().enumerate()).filter(|(_, share)| **share > 0.0);
        chart.draw_series(filled.map(|(i, share)| {
            let (x, y) = ((i % self.bins) as f64, (i / self.bins) as f64);
            let corners = [
                (x * step.0, y * step.1),
                ((x + 1.0) * step.0, (y + 1.0) * step.1),
            ];
            Rectangle::new(corners, shade((share / top).sqrt()).filled())
        }))?;
        Ok(())
    }
}

/// Light to dark blue for 0 to 1.
fn shade(value: f64) -> RGBColor {
    let mix = |from: f64, to: f64| (from + (to - from) * value.clamp(0.0, 1.0)) as u8;
    RGBColor(mix(222.0, 8.0), mix(235.0, 48.0), mix(247.0, 107.0))
}

/// Histograms of the signed LCE error of the four scenarios.
#[derive(Clone, Debug)]
pub struct LceHistograms {
    /// Title and signed errors (deg) of each panel.
    panels: Vec<(String, Vec<f64>)>,
}

/// The LCE histograms span +- this; errors beyond are counted in the outer bins.
const LCE_LIMIT_DEG: f64 = 6.0;
const LCE_BINS: usize = 48;

impl LceHistograms {
    /// The signed LCE errors of the four scenarios.
    pub fn of(rows: &Rows) -> Self {
        let panel = |scenario: &str| {
            let own = rows.with("scenario", scenario);
            let title = format!("{} (n = {})", scenario_title(scenario), own.len());
            (title, own.numbers("lce_error_deg").to_vec())
        };
        Self {
            panels: SCENARIOS.map(panel).to_vec(),
        }
    }

    fn shares(values: &[f64]) -> Vec<f64> {
        let mut shares = vec![0.0; LCE_BINS];
        for value in values {
            let position = (value + LCE_LIMIT_DEG) / (2.0 * LCE_LIMIT_DEG) * LCE_BINS as f64;
            let bin = (position.max(0.0) as usize).min(LCE_BINS - 1);
            shares[bin] += 1.0 / values.len() as f64;
        }
        shares
    }
}

impl Figure for LceHistograms {
    fn name(&self) -> String {
        "lce_errors".into()
    }

    fn size(&self) -> (u32, u32) {
        (900, 640)
    }

    fn draw<B: DrawingBackend>(&self, area: &Area<'_, B>) -> Result<(), String> {
        let shares: Vec<Vec<f64>> = self.panels.iter().map(|(_, v)| Self::shares(v)).collect();
        let top = shares.iter().flatten().copied().fold(1e-12, f64::max) * 1.1;
        for (((title, _), shares), area) in
            (self.panels.iter().zip(&shares)).zip(area.split_evenly((2, 2)))
        {
            draw_lce_panel(title, shares, top, &area).map_err(|e| e.to_string())?;
        }
        Ok(())
    }
}

fn draw_lce_panel<B: DrawingBackend>(
    title: &str,
    shares: &[f64],
    top: f64,
    area: &Area<'_, B>,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 15))
        .margin(8)
        .x_label_area_size(36)
        .y_label_area_size(48)
        .build_cartesian_2d(-LCE_LIMIT_DEG..LCE_LIMIT_DEG, 0.0..top)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc("LCE error (deg), more in the outer bins")
        .y_desc("share")
        .label_style(("sans-serif", 12))
        .draw()?;
    let step = 2.0 * LCE_LIMIT_DEG / LCE_BINS as f64;
    chart.draw_series(shares.iter().enumerate().map(|(i, share)| {
        let x = -LCE_LIMIT_DEG + i as f64 * step;
        Rectangle::new([(x, 0.0), (x + step, *share)], shade(0.7).filled())
    }))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn rows() -> Rows {
        let n = 400;
        let spread = |i: usize, k: f64| ((i as f64 * k).fract() - 0.3) * 6.0;
        let text = |f: &dyn Fn(usize) -> String| (0..n).map(f).collect::<Vec<_>>();
        let numbers = |f: &dyn Fn(usize) -> f64| (0..n).map(f).collect::<Vec<_>>();
        Rows::of(
            BTreeMap::from([
                ("scenario".into(), text(&|i| SCENARIOS[i % 4].to_string())),
                ("specimen".into(), text(&|_| "phantom-1".to_string())),
                ("side".into(), text(&|_| "left".to_string())),
            ]),
            BTreeMap::from([
                ("fragment".into(), numbers(&|i| (i / 40) as f64)),
                ("movement".into(), numbers(&|i| (i / 4) as f64)),
                (
                    "rotation_error_deg".into(),
                    numbers(&|i| spread(i, 0.618).abs()),
                ),
                (
                    "translation_error_mm".into(),
                    numbers(&|i| spread(i, 0.414).abs()),
                ),
                ("lce_error_deg".into(), numbers(&|i| spread(i, 0.732))),
                (
                    "true_rotation_deg".into(),
                    numbers(&|i| 10.0 + spread(i, 0.3)),
                ),
                (
                    "true_translation_mm".into(),
                    numbers(&|i| 5.0 + spread(i, 0.9)),
                ),
            ]),
        )
    }

    #[test]
    fn shares_add_up_and_figures_are_written() {
        let errors = JointHistograms::errors(&rows());
        for panel in &errors.panels {
            assert!((errors.shares(panel).iter().sum::<f64>() - 1.0).abs() < 1e-9);
        }
        let folder = tempfile::tempdir().unwrap();
        super::super::canvas::write(&errors, folder.path()).unwrap();
        super::super::canvas::write(&JointHistograms::movements(&rows()), folder.path()).unwrap();
        super::super::canvas::write(&LceHistograms::of(&rows()), folder.path()).unwrap();
        for name in ["errors_joint", "movements_joint", "lce_errors"] {
            let svg = std::fs::read_to_string(folder.path().join(format!("{name}.svg"))).unwrap();
            assert!(svg.contains("deg"), "{name} has its axis named");
            assert!(folder.path().join(format!("{name}.png")).exists());
        }
    }
}
