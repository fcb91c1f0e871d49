//! Is the CT in Hounsfield units, and are the bones whole?

use super::{Bones, Check, Verdict};
use crate::anatomy::{Label, Side, Specimen};
use crate::volume::Volume;
use crate::volume::components::components;
use crate::volume::distance::squared_distance;

/// Labels in the order of the tables.
const LABELS: [(Label, &str); 3] = [
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
        ),
        Check::number(
            "largest edge of a voxel",
            largest,
            "mm",
            (0.0, 1.5),
            (0.0, 4.0),
        ),
    ];
    checks.push(air(specimen));
    let around = mean_around(specimen);
    for (label, name) in LABELS {
        let mean = mean_inside(specimen, label);
        checks.push(Check::number(
            format!("{name} brighter than what surrounds it by"),
            mean - around,
            "HU",
            (150.0, 1500.0),
            (80.0, 2500.0),
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
        ));
        checks.push(pieces(specimen, label, name));
        checks.push(borders(specimen, label, name));
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

/// A femur is one piece; the pelvis is one to three, as its joints are open or not.
fn pieces(specimen: &Specimen, label: Label, name: &str) -> Check {
    let labels = &specimen.labels;
    let (min, max) = labels
        .bounds(|l| l == label.value())
        .expect("every label is there");
    let mask: Volume<bool> = labels.cropped(min, max).map(|l| l == label.value());
    let found = components(&mask);
    let mut sizes = found.sizes.clone();
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    let main = if label == Label::Pelvis { 3 } else { 1 };
    let total: usize = sizes.iter().sum();
    let scattered = total - sizes.iter().take(main).sum::<usize>();
    let what = match main {
        1 => format!("{name} outside its largest piece"),
        n => format!("{name} outside its {n} largest pieces"),
    };
    let percent = 100.0 * scattered as f64 / total.max(1) as f64;
    Check::number(what, percent, "%", (0.0, 0.5), (0.0, 10.0))
}

/// A bone that reaches the CT's border was cut off there. Femora may leave it towards the feet.
fn borders(specimen: &Specimen, label: Label, name: &str) -> Check {
    let labels = &specimen.labels;
    let grid = &labels.grid;
    let (min, max) = labels
        .bounds(|l| l == label.value())
        .expect("every label is there");
    let mut touched = Vec::new();
    for axis in 0..3 {
        // The world direction in which the index grows, as one of the six of the body.
        let direction = grid.direction.column(axis);
        let main = direction.iamax();
        let names = [["right", "left"], ["front", "back"], ["feet", "head"]][main];
        let upward = direction[main] > 0.0;
        for (reached, high) in [
            (min[axis] == 0, false),
            (max[axis] + 1 == grid.dims[axis], true),
        ] {
            let side = names[usize::from(high == upward)];
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
    }
}
