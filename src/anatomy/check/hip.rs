//! Do landmarks lie on bone, the head's centre in the head, the rim around it?

use super::{Bones, Check};
use crate::anatomy::detect::{Head, Local, femoral_head};
use crate::anatomy::{Hip, Label, Landmark, Side, Specimen, lce_angle};
use crate::geometry::{Point, Rigid, Vector};
use crate::volume::Surface;
use std::sync::Arc;

/// Landmarks on the pelvis' surface.
const ON_BONE: [Landmark; 7] = [
    Landmark::Asis,
    Landmark::Aiis,
    Landmark::Sps,
    Landmark::Ips,
    Landmark::Mof,
    Landmark::Iof,
    Landmark::Gsn,
];

/// A rim's point is on bone within this distance (mm); over the notch it is not.
const RIM_ON_BONE_MM: f64 = 3.0;

/// The checks of one hip, and its femoral head's radius (mm; not a number where there is none).
pub(super) fn checks(specimen: &Arc<Specimen>, bones: &Bones, side: Side) -> (Vec<Check>, f64) {
    let voxel = specimen.labels.grid.spacing.into_iter().fold(0.0, f64::max);
    // A landmark placed on the bone itself is up to a voxel's diagonal from the label's surface.
    let near = voxel.max(1.0) * 2.0;
    let mut checks = Vec::new();
    for landmark in ON_BONE {
        if let Some(point) = specimen.landmarks.get(landmark, side) {
            checks.push(Check::number(
                format!("{side} {} from bone", landmark.name()),
                distance(&bones.pelvis, &point),
                "mm",
                (0.0, near),
                (0.0, 10.0),
            )
            .advise(
                "a landmark off the bone tilts the APP or starts registration elsewhere; is it in LPS mm of \
                 this CT, and on this side? Else pick it anew",
            ));
        }
    }
    // Without the landmarks of the frame there is nothing more to look at.
    let Ok(hip) = Hip::new(specimen.clone(), side) else {
        return (checks, f64::NAN);
    };
    let found = head(&hip, &bones.femurs[side.index()]);
    match &found {
        Ok(head) => checks.extend(head_checks(&hip, head)),
        Err(reason) => checks.push(Check::holds(
            format!("{side} femoral head"),
            false,
            reason.clone(),
            "a sphere fits it",
        )
        .advise("the hip's centre, about which everything turns, is not known; is the femur's label whole?")),
    }
    let radius = found.as_ref().map_or(f64::NAN, |head| head.radius_mm);
    checks.extend(rim_checks(&hip, &bones.pelvis, radius));
    checks.push(touching(specimen, side));
    let highest = bones
        .pelvis
        .vertices()
        .iter()
        .map(|p| hip.app_from_volume * p)
        .filter(|p| p.coords.dot(&hip.lateral()) > -20.0)
        .map(|p| p.y)
        .fold(f64::MIN, f64::max);
    let what = format!("{side} ilium above the head's centre");
    checks.push(
        Check::number(what, highest, "mm", (110.0, 220.0), (75.0, 260.0)).advise(
            "the ilium cut lies about 50 mm above the head, wires enter at the crest: with less bone there is \
             no room for them; use a scan that reaches above the crest",
        ),
    );
    let femur = &bones.femurs[side.index()];
    let lowest = femur
        .vertices()
        .iter()
        .map(|p| (hip.app_from_volume * p).y)
        .fold(f64::MAX, f64::min);
    let what = format!("{side} femur below the head's centre");
    checks.push(Check::number(
        what,
        -lowest,
        "mm",
        (130.0, 500.0),
        (50.0, 500.0),
    )
    .advise(
        "the femur's shaft is missing from the lower part of the images, and its rotation is found from \
         what is left; use a scan that reaches 150 mm below the heads",
    ));
    (checks, radius)
}

/// The heads of one person are of one size.
pub(super) fn radii([left, right]: [f64; 2]) -> Check {
    let what = "femoral heads' radii, left and right";
    let mut check = Check::number(what, (left - right).abs(), "mm", (0.0, 1.5), (0.0, 4.0));
    check.found = format!("{left:.1} and {right:.1} mm");
    check.expected = "at most 1.5 mm apart".into();
    check.advise(
        "one head's label is swollen, worn or holds something of the socket: its centre, about which the hip \
         turns, may be off; look at both in the slices",
    )
}

/// The sphere of the femur's label. Landmarks give its directions only, so it is a witness of its
/// own for the head's centre.
fn head(hip: &Hip, femur: &Surface) -> Result<Head, String> {
    let rows = hip.app_from_volume.rotation.inverse();
    let local = Local {
        origin: Point::origin(),
        axes: [rows * hip.lateral(), rows * Vector::y(), rows * Vector::z()],
    };
    femoral_head(femur, hip.side, &local).map_err(|error| error.to_string())
}

fn head_checks(hip: &Hip, head: &Head) -> Vec<Check> {
    let side = hip.side;
    let label = hip.specimen.labels.nearest(&hip.head());
    let own = label == Some(Label::femur(side).value());
    vec![
        Check::holds(
            format!("{side} femoral head's centre"),
            own,
            format!("in label {}", label.unwrap_or(0)),
            format!("in label {} ({side} femur)", Label::femur(side).value()),
        )
        .advise("left and right are swapped in labels or landmarks, or they are of different worlds; check both"),
        Check::number(
            format!("{side} femoral head's radius"),
            head.radius_mm,
            "mm",
            (19.0, 30.0),
            (14.0, 36.0),
        )
        .advise("no adult's head is so small or large: is the CT's voxel size right, and the label a femur?"),
        Check::number(
            format!("{side} femoral head's residual from the sphere"),
            head.rms_mm,
            "mm",
            (0.0, 1.0),
            (0.0, 2.0),
        )
        .advise(
            "a head that is no sphere turns about no point: collisions and LCE angles depend on it; does the \
             label hold the whole head and nothing of the socket?",
        ),
        Check::number(
            format!("{side} femoral head's centre from the sphere's"),
            (head.center - hip.head()).norm(),
            "mm",
            (0.0, 2.0),
            (0.0, 5.0),
        )
        .advise(
            "movements turn about the given centre: the femur then grinds into the socket; give the sphere's \
             centre, or leave it out to have it found",
        ),
    ]
}

fn rim_checks(hip: &Hip, pelvis: &Surface, head_mm: f64) -> Vec<Check> {
    let side = hip.side;
    let rim = hip.rim_in_app();
    let lps = hip.specimen.rim(side);
    let on_bone = |p: &&Point| distance(pelvis, p) <= RIM_ON_BONE_MM;
    let share = 100.0 * lps.iter().filter(on_bone).count() as f64 / lps.len().max(1) as f64;
    let (middle, normal, rms) = plane(&rim, &hip.lateral());
    let lateral = normal.dot(&hip.lateral());
    let opening = lateral.clamp(-1.0, 1.0).acos().to_degrees();
    let depth = normal.dot(&middle.coords);
    let sideways = (middle.coords - normal * depth).norm();
    let radius = rim.iter().map(|p| (p - middle).norm()).sum::<f64>() / rim.len().max(1) as f64;
    let lce = lce_angle(&rim, side, &Rigid::identity(), &Point::origin())
        .map_or(f64::NAN, f64::to_degrees);
    let name = |what: &str| format!("{side} rim{what}");
    let advice = "cuts keep their distance from the rim, and the LCE angle is read from it: both follow a wrong rim; \
                  trace it anew, or leave it out to have it found";
    let over = radius / head_mm;
    let what = name("'s mean radius over the head's");
    let mut proportion = Check::number(what, over, "", (0.95, 1.35), (0.8, 1.6));
    proportion.found = format!("{over:.2}");
    let checks = vec![
        Check::number(name(" on bone"), share, "%", (70.0, 100.0), (40.0, 100.0)),
        Check::number(
            name("'s mean radius"),
            radius,
            "mm",
            (20.0, 38.0),
            (15.0, 45.0),
        ),
        proportion,
        Check::number(
            name("'s distance from its plane (RMS)"),
            rms,
            "mm",
            (0.0, 5.0),
            (0.0, 10.0),
        ),
        Check::number(
            name("'s middle beside the head's centre"),
            sideways,
            "mm",
            (0.0, 8.0),
            (0.0, 15.0),
        ),
        Check::number(
            name("'s plane lateral of the head's centre"),
            depth,
            "mm",
            (-15.0, 15.0),
            (-25.0, 25.0),
        ),
        Check::number(
            name("'s opening from straight lateral"),
            opening,
            "deg",
            (15.0, 70.0),
            (0.0, 80.0),
        ),
    ];
    let lce = Check::number(
        format!("{side} LCE angle"),
        lce,
        "deg",
        (10.0, 50.0),
        (-20.0, 70.0),
    )
    .advise(
        "a hip that is covered so little or so much is not what the operation was described for, and its \
         movements collide earlier or later; or the rim's lateral edge is wrong: look at it in the pictures",
    );
    let checks = checks.into_iter().map(|check| check.advise(advice));
    checks.chain([lce]).collect()
}

/// Middle, unit normal (on the side of `lateral`) and RMS distance of the best plane.
fn plane(points: &[Point], lateral: &Vector) -> (Point, Vector, f64) {
    let n = points.len().max(1) as f64;
    let middle = Point::from(points.iter().map(|p| p.coords).sum::<Vector>() / n);
    let mut scatter = nalgebra::Matrix3::zeros();
    for p in points {
        let arm = p - middle;
        scatter += arm * arm.transpose() / n;
    }
    let eigen = scatter.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let normal: Vector = eigen.eigenvectors.column(least).into();
    let normal = if normal.dot(lateral) < 0.0 {
        -normal
    } else {
        normal
    };
    (middle, normal, eigen.eigenvalues[least].max(0.0).sqrt())
}

/// Faces between voxels of the femur and of the pelvis. A joint has cartilage between them; where
/// labels touch, movements of the femur collide at once.
fn touching(specimen: &Specimen, side: Side) -> Check {
    let labels = &specimen.labels;
    let grid = &labels.grid;
    let [ni, nj, nk] = grid.dims;
    let (a, b) = (Label::Pelvis.value(), Label::femur(side).value());
    let between = |p: usize, q: usize| {
        let (p, q) = (labels.data[p], labels.data[q]);
        (p == a && q == b) || (p == b && q == a)
    };
    let [dx, dy, dz] = grid.spacing;
    let mut mm2 = 0.0;
    for k in 0..nk {
        for j in 0..nj {
            for i in 0..ni {
                let here = grid.offset(i, j, k);
                let steps = [
                    (i + 1 < ni, 1, dy * dz),
                    (j + 1 < nj, ni, dx * dz),
                    (k + 1 < nk, ni * nj, dx * dy),
                ];
                for (inside, step, area) in steps {
                    if inside && between(here, here + step) {
                        mm2 += area;
                    }
                }
            }
        }
    }
    let what = format!("{side} femur touching the pelvis over");
    // Single voxels of bones that were segmented apart may touch.
    Check::number(what, mm2, "mm2", (0.0, 20.0), (0.0, 1000.0)).advise(
        "where labels touch, movements of femur and fragment collide at once and are drawn again: only small \
         ones are left; open the joint space in the label map",
    )
}

fn distance(surface: &Surface, point: &Point) -> f64 {
    match surface.closest_point(point) {
        Some((closest, _)) => (closest - point).norm(),
        None => f64::NAN,
    }
}
