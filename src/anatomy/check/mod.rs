//! Proofs that a specimen is what it says: sides, frames, landmarks on bone, whole bones, Hounsfield
//! units.
//!
//! [`specimen_problems`](super::specimen_problems) says whether a specimen is well formed; these
//! checks ask its own data whether it is right. They read label map, CT, landmarks and rims against
//! each other: a femoral head's centre, for instance, against a sphere fitted to the femur's label.

mod content;
mod frames;
mod hip;

use super::{Side, Specimen};
use crate::anatomy::Label;
use crate::volume::Surface;
use std::sync::Arc;

/// How a check came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    Fine,
    /// Unusual; look at the pictures.
    Doubtful,
    /// A study on this specimen would give wrong numbers.
    Wrong,
}

impl Verdict {
    /// `ok`, `doubtful` or `WRONG`, as tables print it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fine => "ok",
            Self::Doubtful => "doubtful",
            Self::Wrong => "WRONG",
        }
    }
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    pub what: String,
    pub found: String,
    pub expected: String,
    pub verdict: Verdict,
}

impl Check {
    /// A check of a number: fine within `fine`, doubtful within `bearable`, wrong beyond and if it
    /// is not a number.
    pub fn number(
        what: impl Into<String>,
        value: f64,
        unit: &str,
        fine: (f64, f64),
        bearable: (f64, f64),
    ) -> Self {
        let within = |(low, high): (f64, f64)| (low..=high).contains(&value);
        let verdict = match (within(fine), within(bearable)) {
            (true, _) => Verdict::Fine,
            (false, true) => Verdict::Doubtful,
            (false, false) => Verdict::Wrong,
        };
        let bound = |v: f64| {
            format!("{v:.6}")
                .trim_end_matches('0')
                .trim_end_matches('.')
                .to_owned()
        };
        let expected = match fine {
            (low, high) if low.is_infinite() => format!("at most {}", bound(high)),
            (low, high) if high.is_infinite() => format!("at least {}", bound(low)),
            (low, high) => format!("{} to {}", bound(low), bound(high)),
        };
        let digits = if value.abs() >= 100.0 { 0 } else { 1 };
        Self {
            what: what.into(),
            found: format!("{value:.digits$} {unit}").trim_end().to_owned(),
            expected: format!("{expected} {unit}").trim_end().to_owned(),
            verdict,
        }
    }

    /// A check that either holds or makes the specimen wrong.
    pub fn holds(
        what: impl Into<String>,
        holds: bool,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self {
            what: what.into(),
            found: found.into(),
            expected: expected.into(),
            verdict: if holds { Verdict::Fine } else { Verdict::Wrong },
        }
    }
}

/// Label surfaces that several checks measure to (LPS, mm).
struct Bones {
    pelvis: Surface,
    /// By [`Side::index`].
    femurs: [Surface; 2],
}

/// All checks of a specimen that has no [`specimen_problems`](super::specimen_problems), in the order
/// in which people read them.
pub fn check_specimen(specimen: &Arc<Specimen>) -> Vec<Check> {
    let surface = |label: Label| {
        Surface::from_mask(
            &specimen.labels,
            |v| v == label.value(),
            &Default::default(),
        )
    };
    let bones = Bones {
        pelvis: surface(Label::Pelvis),
        femurs: Side::BOTH.map(|side| surface(Label::femur(side))),
    };
    let mut checks = content::checks(specimen, &bones);
    checks.extend(frames::checks(specimen, &bones));
    for side in Side::BOTH {
        checks.extend(hip::checks(specimen, &bones, side));
    }
    checks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::phantom::{PhantomParameters, phantom};
    use crate::anatomy::{Landmark, Landmarks, mirror};
    use crate::geometry::{Point, Vector};
    use std::sync::LazyLock;

    static BODY: LazyLock<Specimen> = LazyLock::new(|| {
        let parameters = PhantomParameters {
            voxel_mm: 2.0,
            ..Default::default()
        };
        phantom(1, &parameters)
    });

    fn wrong(specimen: &Specimen) -> Vec<String> {
        let wrong = |check: &Check| check.verdict == Verdict::Wrong;
        let checks = check_specimen(&Arc::new(specimen.clone()));
        checks.into_iter().filter(wrong).map(|c| c.what).collect()
    }

    #[test]
    fn a_body_and_its_mirror_image_are_right() {
        assert_eq!(wrong(&BODY), [""; 0]);
        assert_eq!(wrong(&mirror(&BODY)), [""; 0]);
    }

    #[test]
    fn swapped_landmarks_are_seen() {
        let mut body = BODY.clone();
        let mut swapped = Landmarks::default();
        for (landmark, side, point) in BODY.landmarks.iter() {
            swapped.set(landmark, side.opposite(), point);
        }
        body.landmarks = swapped;
        let found = wrong(&body).join("\n");
        for part in [
            "landmarks of the left",
            "left femoral head's centre",
            "APP x",
        ] {
            assert!(found.contains(part), "expected '{part}' in {found}");
        }
    }

    #[test]
    fn swapped_femora_are_seen() {
        let mut body = BODY.clone();
        body.labels = BODY.labels.map(|v| [0, 1, 3, 2][usize::from(v)]);
        let found = wrong(&body).join("\n");
        for part in ["label of the left femur", "left femoral head's centre"] {
            assert!(found.contains(part), "expected '{part}' in {found}");
        }
    }

    #[test]
    fn a_landmark_off_the_bone_and_a_head_off_its_centre_are_seen() {
        let mut body = BODY.clone();
        for (landmark, by) in [(Landmark::Asis, 15.0), (Landmark::Fh, 8.0)] {
            let point = BODY.landmarks.get(landmark, Side::Right).unwrap();
            let moved = point - Vector::y() * by;
            body.landmarks.set(landmark, Side::Right, moved);
        }
        let found = wrong(&body);
        assert_eq!(
            found,
            [
                "right ASIS from bone",
                "right femoral head's centre from the sphere's"
            ]
        );
    }

    #[test]
    fn a_ct_in_other_units_or_elsewhere_is_seen() {
        let mut offset = BODY.clone();
        offset.ct = BODY.ct.map(|hu| hu + 1024);
        assert!(wrong(&offset).join("\n").contains("air"));
        let mut apart = BODY.clone();
        apart.ct.data.rotate_right(40 * BODY.ct.grid.dims[0]);
        assert!(wrong(&apart).join("\n").contains("brighter"));
    }

    #[test]
    fn a_rim_of_the_other_side_is_seen() {
        let mut body = BODY.clone();
        body.rims.swap(0, 1);
        assert!(wrong(&body).join("\n").contains("left rim"));
        let mut flat = BODY.clone();
        flat.rims[1] = flat.rims[1]
            .iter()
            .map(|p| Point::new(p.x, p.y, p.z + 40.0))
            .collect();
        assert!(wrong(&flat).join("\n").contains("right rim"));
    }
}
