//! Does the CT hold what a study needs?

use super::content::LABELS;
use super::{Check, Verdict};
use crate::anatomy::{Label, Specimen};

/// Brighter than this is not air (HU).
const AIR_HU: i16 = -400;

pub(super) fn checks(specimen: &Specimen) -> Vec<Check> {
    let mut checks: Vec<Check> = LABELS
        .into_iter()
        .map(|(label, name)| borders(specimen, label, name))
        .collect();
    checks.push(skin(specimen));
    checks
}

/// The world direction in which an index grows, as one of the six of the body, and its opposite.
fn directions(specimen: &Specimen, axis: usize) -> [&'static str; 2] {
    let direction = specimen.labels.grid.direction.column(axis);
    let main = direction.iamax();
    let [low, high] = [["right", "left"], ["front", "back"], ["feet", "head"]][main];
    match direction[main] > 0.0 {
        true => [low, high],
        false => [high, low],
    }
}

/// A bone that reaches the CT's border was cut off there. Femora may leave it towards the feet.
fn borders(specimen: &Specimen, label: Label, name: &str) -> Check {
    let labels = &specimen.labels;
    let (min, max) = labels
        .bounds(|l| l == label.value())
        .expect("every label is there");
    let mut touched = Vec::new();
    for axis in 0..3 {
        let [low, high] = directions(specimen, axis);
        let reached = [
            (min[axis] == 0, low),
            (max[axis] + 1 == labels.grid.dims[axis], high),
        ];
        for (reached, side) in reached {
            if reached && !(side == "feet" && label != Label::Pelvis) {
                touched.push(side);
            }
        }
    }
    Check {
        what: format!("{name} at the CT's border"),
        found: match touched.is_empty() {
            true => "nowhere".into(),
            false => format!("towards {}", touched.join(", ")),
        },
        expected: match label {
            Label::Pelvis => "nowhere".into(),
            _ => "nowhere but at the feet".into(),
        },
        verdict: match touched.is_empty() {
            true => Verdict::Fine,
            false => Verdict::Doubtful,
        },
        advice: "the missing part lacks in every image, and wires through it find no bone; use a longer \
                 or wider reconstruction of the same scan"
            .into(),
    }
}

/// Share of the CT's four sides that is not air: there the body was cut off.
fn skin(specimen: &Specimen) -> Check {
    let ct = &specimen.ct;
    let [ni, nj, nk] = ct.grid.dims;
    let (mut body, mut border) = (0usize, 0usize);
    for axis in 0..3 {
        if directions(specimen, axis).contains(&"feet") {
            continue;
        }
        for offset in 0..ct.grid.len() {
            let voxel = ct.grid.voxel(offset);
            if voxel[axis] == 0 || voxel[axis] + 1 == [ni, nj, nk][axis] {
                border += 1;
                body += usize::from(ct.data[offset] > AIR_HU);
            }
        }
    }
    let percent = 100.0 * body as f64 / border.max(1) as f64;
    let what = "body at the CT's sides";
    Check::number(what, percent, "%", (0.0, 5.0), (0.0, 100.0)).advise(
        "soft tissue that was cut off attenuates nothing: counts are too high and noise too low beyond the \
         border, bones are not touched; reconstruct with the full field of view if contrast matters",
    )
}
