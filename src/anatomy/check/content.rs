//! Is the CT in Hounsfield units, and do labels lie on its bones?

use super::{Bones, Check};
use crate::anatomy::{Label, Side, Specimen};
use crate::volume::distance::squared_distance;

/// Labels in the order of the tables.
pub(super) const LABELS: [(Label, &str); 3] = [
    (Label::Pelvis, "pelvis"),
    (Label::FemurLeft, "left femur"),
    (Label::FemurRight, "right femur"),
];

/// What surrounds bone is looked at between these distances from it (mm): beyond the blur of its
/// edge.
const AROUND_MM: (f32, f32) = (3.0, 6.0);

pub(super) fn checks(specimen: &Specimen, bones: &Bones) -> Vec<Check> {
    let grid = &specimen.ct.grid;
    let [i, j, k] = grid.dims;
    let largest = grid.spacing.into_iter().fold(0.0, f64::max);
    let mut checks = vec![
        Check::holds(
            "CT and label map",
            grid == &specimen.labels.grid,
            format!("{i} x {j} x {k} voxels"),
            "one grid",
        )
        .advise("labels name other places of the CT; resample them to the CT with nearest neighbours"),
        Check::number(
            "largest edge of a voxel",
            largest,
            "mm",
            (0.0, 1.5),
            (0.0, 4.0),
        )
        .advise(
            "DRRs and cuts are as coarse as the voxels, and the joint space closes from 2 mm on; use a \
             thinner reconstruction of the same scan",
        ),
    ];
    checks.push(air(specimen));
    checks.push(dense(specimen));
    let around = mean_around(specimen);
    for (label, name) in LABELS {
        let mean = mean_inside(specimen, label);
        checks.push(Check::number(
            format!("{name} brighter than what surrounds it by"),
            mean - around,
            "HU",
            (150.0, 1500.0),
            (80.0, 2500.0),
        )
        .advise(
            "labels and CT are not of one place, or the CT is not in HU: DRRs of a label show soft tissue; \
             check both files' origin and axes and the CT's rescale slope",
        ));
        let (mean_fine, mean_bearable) = ((100.0, 1000.0), (20.0, 1300.0));
        let what = format!("{name}'s mean density");
        checks.push(Check::number(what, mean, "HU", mean_fine, mean_bearable).advise(
            "line integrals of bone, and so contrast and noise of every image, scale with it; check the \
             CT's rescale slope and intercept, and that the label is bone",
        ));
    }
    for (label, name) in LABELS {
        let surface = match label {
            Label::Pelvis => &bones.pelvis,
            Label::FemurLeft => &bones.femurs[Side::Left.index()],
            _ => &bones.femurs[Side::Right.index()],
        };
        let (fine, bearable) = match label {
            Label::Pelvis => ((500.0, 2000.0), (200.0, 3000.0)),
            _ => ((100.0, 600.0), (60.0, 1000.0)),
        };
        let cm3 = surface.volume() / 1000.0;
        checks.push(Check::number(
            format!("{name}'s volume"),
            cm3,
            "cm3",
            fine,
            bearable,
        )
        .advise(
            "a bone of unusual size is often one that is cut off, or two under one label; look at the \
             label map beside the CT",
        ));
    }
    checks
}

/// Air is -1000 HU, and there is air around every body.
fn air(specimen: &Specimen) -> Check {
    let mut values = specimen.ct.data.clone();
    let (_, low, _) = values.select_nth_unstable(specimen.ct.data.len() / 1000);
    let what = "air (the darkest thousandth of the CT)";
    Check::number(
        what,
        f64::from(*low),
        "HU",
        (-1100.0, -850.0),
        (-2000.0, -500.0),
    )
    .advise(
        "every attenuation is off by the difference: fluoroscopy has the wrong contrast; check the CT's \
         rescale intercept (values stored from 0 lie 1024 too high)",
    )
}

/// Cortical bone reaches 1000 HU and more in every CT of 1 mm.
fn dense(specimen: &Specimen) -> Check {
    let pairs = specimen.labels.data.iter().zip(&specimen.ct.data);
    let mut bone: Vec<i16> = pairs.filter(|(l, _)| **l != 0).map(|(_, v)| *v).collect();
    let hundredth = bone.len() / 100;
    let dense = match bone.len() {
        0 => f64::NAN,
        n => f64::from(*bone.select_nth_unstable(n - 1 - hundredth).1),
    };
    let what = "dense bone (the labels' brightest hundredth)";
    Check::number(what, dense, "HU", (700.0, 2200.0), (400.0, 3071.0)).advise(
        "a CT that is clipped, scaled or smoothed gives bone the wrong contrast; export it anew with its \
         whole range, with a bone kernel if there is one",
    )
}

fn mean_inside(specimen: &Specimen, label: Label) -> f64 {
    let pairs = specimen.labels.data.iter().zip(&specimen.ct.data);
    mean(
        pairs
            .filter(|(l, _)| **l == label.value())
            .map(|(_, hu)| *hu),
    )
}

/// Mean of what lies beside the labels. The spine's bone is unlabelled and hardly weighs.
fn mean_around(specimen: &Specimen) -> f64 {
    let from_bone = squared_distance(&specimen.labels.map(|l| l != 0));
    let (low, high) = AROUND_MM;
    let beside = |d: &f32| (low * low..=high * high).contains(d);
    let pairs = from_bone.data.iter().zip(&specimen.ct.data);
    mean(pairs.filter(|(d, _)| beside(d)).map(|(_, hu)| *hu))
}

fn mean(values: impl Iterator<Item = i16>) -> f64 {
    let (mut sum, mut count) = (0i64, 0i64);
    for value in values {
        sum += i64::from(value);
        count += 1;
    }
    sum as f64 / count.max(1) as f64
}
