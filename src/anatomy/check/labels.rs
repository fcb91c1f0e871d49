//! Are the labels whole, without holes, islands and leaks?

use super::Check;
use super::content::LABELS;
use crate::anatomy::{Label, Specimen};
use crate::volume::Volume;
use crate::volume::components::components;
use crate::volume::distance::squared_distance;

/// The shell in which bone beside a label is looked for begins beyond the blur of the label's own edge
/// and ends before the next bone (mm).
const SHELL_MM: (f64, f64) = (2.0, 4.0);

/// What is at least so bright beside a label is bone that the label lacks (HU): brighter than muscle,
/// contrast-filled vessels apart.
const BONE_HU: i16 = 300;

/// The smallest bone of the pelvis is more than this part of its label.
const BONE_SHARE: usize = 10;

/// The spine goes on above the sacrum and is not labelled, femora end where the label does: this much of
/// a label's height at its open end is not looked at.
const OPEN_END: f64 = 0.12;

pub(super) fn checks(specimen: &Specimen) -> Vec<Check> {
    let mut checks = Vec::new();
    for (label, name) in LABELS {
        let mask = mask(specimen, label);
        checks.push(islands(&mask, label, name));
        checks.push(holes(&mask, name));
        checks.push(leak(specimen, label, name));
    }
    checks
}

/// One label's voxels, with a border of one voxel where the grid has it.
fn mask(specimen: &Specimen, label: Label) -> Volume<bool> {
    let labels = &specimen.labels;
    let (min, max) = labels
        .bounds(|l| l == label.value())
        .expect("every label is there");
    let dims = labels.grid.dims;
    let low = min.map(|v| v.saturating_sub(1));
    let high = std::array::from_fn(|a| (max[a] + 1).min(dims[a] - 1));
    labels.cropped(low, high).map(|l| l == label.value())
}

fn cm3(voxels: usize, mask: &Volume<bool>) -> f64 {
    voxels as f64 * mask.grid.spacing.iter().product::<f64>() / 1000.0
}

/// A femur is one piece; the pelvis is one to three, as its joints are open or not.
fn islands(mask: &Volume<bool>, label: Label, name: &str) -> Check {
    let mut sizes = components(mask).sizes;
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    let main = if label == Label::Pelvis { 3 } else { 1 };
    let total: usize = sizes.iter().sum();
    let bones = sizes
        .iter()
        .take(main)
        .take_while(|size| **size * BONE_SHARE >= total);
    let scattered = total - bones.sum::<usize>();
    let what = match main {
        1 => format!("{name} outside its largest piece"),
        n => format!("{name} outside its {n} largest pieces"),
    };
    Check::number(what, cm3(scattered, mask), "cm3", (0.0, 0.2), (0.0, 20.0)).advise(
        "islands are drawn in DRRs as bone and stop the fragment's movement where they lie; keep the \
         largest pieces of the label",
    )
}

/// Background that its label encloses.
fn holes(mask: &Volume<bool>, name: &str) -> Check {
    let outside = components(&mask.map(|inside| !inside));
    let [ni, nj, nk] = mask.grid.dims;
    let mut open = vec![false; outside.sizes.len() + 1];
    for (offset, &number) in outside.labels.data.iter().enumerate() {
        let [i, j, k] = mask.grid.voxel(offset);
        if i == 0 || j == 0 || k == 0 || i + 1 == ni || j + 1 == nj || k + 1 == nk {
            open[number as usize] = true;
        }
    }
    let enclosed: usize = outside
        .sizes
        .iter()
        .zip(&open[1..])
        .filter(|(_, open)| !**open)
        .map(|(size, _)| size)
        .sum();
    let what = format!("holes inside the {name}");
    Check::number(what, cm3(enclosed, mask), "cm3", (0.0, 0.1), (0.0, 10.0)).advise(
        "a hole is missing from DRRs, though not from the fluoroscopy they are compared with; fill the \
         label's holes, the marrow belongs to the bone",
    )
}

/// Share of a label's surroundings that is as bright as bone: the label is too small there.
fn leak(specimen: &Specimen, label: Label, name: &str) -> Check {
    let labels = &specimen.labels;
    let grid = &labels.grid;
    let largest = grid.spacing.into_iter().fold(0.0, f64::max);
    let (low, high) = (SHELL_MM.0.max(1.5 * largest), SHELL_MM.1.max(3.0 * largest));
    let (min, max) = labels
        .bounds(|l| l == label.value())
        .expect("every label is there");
    let reach = |a: usize| (high / grid.spacing[a]).ceil() as usize + 1;
    let first = std::array::from_fn(|a| min[a].saturating_sub(reach(a)));
    let last = std::array::from_fn(|a| (max[a] + reach(a)).min(grid.dims[a] - 1));
    let (near, ct) = (
        labels.cropped(first, last),
        specimen.ct.cropped(first, last),
    );
    let from_own = squared_distance(&near.map(|l| l == label.value()));
    let from_other = squared_distance(&near.map(|l| l != 0 && l != label.value()));
    // The end that is open: the pelvis' upper, a femur's lower.
    let z = |voxel| grid.center(voxel).z;
    let (a, b) = (z(min), z(max));
    let (bottom, top) = (a.min(b), a.max(b));
    let (bottom, top) = match label {
        Label::Pelvis => (f64::MIN, top - OPEN_END * (top - bottom)),
        _ => (bottom + OPEN_END * (top - bottom), f64::MAX),
    };
    let (mut bright, mut shell) = (0usize, 0usize);
    for offset in 0..near.grid.len() {
        let own = f64::from(from_own.data[offset]);
        let beside_another = f64::from(from_other.data[offset]) <= high * high;
        if !(low * low..=high * high).contains(&own) || beside_another {
            continue;
        }
        let z = near.grid.center(near.grid.voxel(offset)).z;
        if (bottom..=top).contains(&z) {
            shell += 1;
            bright += usize::from(ct.data[offset] >= BONE_HU);
        }
    }
    let percent = 100.0 * bright as f64 / shell.max(1) as f64;
    let what = format!("bone beside the {name}'s label");
    Check::number(what, percent, "%", (0.0, 1.0), (0.0, 30.0)).advise(
        "what the label lacks is missing from DRRs and from collisions, and stays behind when the bone \
         moves; complete the label, or look whether it is shifted",
    )
}
