//! Is left left, and do the pelvic plane's axes point where they should?

use super::{Bones, Check};
use crate::anatomy::frame::app_from_volume;
use crate::anatomy::{Landmark, Side, Specimen};
use crate::geometry::{Point, Vector};
use crate::volume::Surface;

pub(super) fn checks(specimen: &Specimen, bones: &Bones) -> Vec<Check> {
    let at = |landmark, side| specimen.landmarks.get(landmark, side);
    let pairs = Landmark::ALL.into_iter().filter_map(|landmark| {
        let apart = at(landmark, Side::Left)?.x - at(landmark, Side::Right)?.x;
        Some((landmark, apart))
    });
    let nearest = pairs.min_by(|a, b| a.1.total_cmp(&b.1));
    let (landmark, apart) = nearest.unwrap_or((Landmark::Asis, f64::NAN));
    let femurs = Side::BOTH.map(|side| center(&bones.femurs[side.index()]));
    let swapped = "every result would carry the other side's name, and cuts would lie outside the patient: \
                   points or labels of RAS read as LPS, or left and right under each other's name; mend the \
                   file, or say its convention to the importer";
    let tilted = "the APP follows from both ASIS and IPS: with one of them wrong, all angles of cuts and movements \
                  are; a patient who lies so is fine, else pick the point anew";
    let mut checks = vec![
        Check::holds(
            "landmarks of the left, from their right partners",
            apart > 0.0,
            format!(
                "{} {apart:.1} mm along LPS x, the others more",
                landmark.name()
            ),
            "all to the patient's left (+x)",
        )
        .advise(swapped),
        Check::number(
            "label of the left femur, from the right one's, along LPS x",
            femurs[0].x - femurs[1].x,
            "mm",
            (120.0, 300.0),
            (60.0, 400.0),
        )
        .advise(swapped),
    ];
    let (Some(left), Some(right), Some(head)) = (
        at(Landmark::Asis, Side::Left),
        at(Landmark::Asis, Side::Right),
        at(Landmark::Fh, Side::Left),
    ) else {
        return checks;
    };
    let what = "both ASIS apart";
    let apart = (left - right).norm();
    checks.push(Check::number(what, apart, "mm", (170.0, 310.0), (120.0, 360.0)).advise(tilted));
    match app_from_volume(&specimen.landmarks, &head) {
        Ok(app) => {
            let matrix = app.rotation.to_rotation_matrix().into_inner();
            checks.extend(axes(&matrix).into_iter().map(|check| check.advise(tilted)));
            let y = |p: &Point| (app * p).y;
            let z = |p: &Point| (app * p).z;
            let pelvis = center(&bones.pelvis);
            let femora = nalgebra::center(&femurs[0], &femurs[1]);
            let what = "pelvis above the femora along APP y";
            let above = y(&pelvis) - y(&femora);
            checks.push(
                Check::number(what, above, "mm", (50.0, 250.0), (10.0, 400.0)).advise(tilted),
            );
            let what = "both ASIS in front of the pelvis' middle along APP z";
            let front = z(&nalgebra::center(&left, &right)) - z(&pelvis);
            checks
                .push(Check::number(what, front, "mm", (20.0, 120.0), (5.0, 200.0)).advise(tilted));
        }
        Err(error) => checks.push(
            Check::holds("anterior pelvic plane", false, error.to_string(), "a frame")
                .advise(tilted),
        ),
    }
    checks
}

/// Rows of `app_from_volume`'s rotation are the APP's axes in the world.
fn axes(matrix: &nalgebra::Matrix3<f64>) -> Vec<Check> {
    let residual = (matrix * matrix.transpose() - nalgebra::Matrix3::identity()).amax();
    let handed = matrix.determinant();
    let mut checks = vec![Check::holds(
        "APP axes orthonormal and right-handed",
        residual < 1e-9 && (handed - 1.0).abs() < 1e-9,
        format!("residual {residual:.0e}, determinant {handed:.6}"),
        "residual below 1e-9, determinant 1",
    )];
    for (row, (name, world, limit)) in [
        (
            "APP x from the patient's left (+x of LPS)",
            Vector::x(),
            15.0,
        ),
        ("APP y from superior (+z of LPS)", Vector::z(), 35.0),
        ("APP z from anterior (-y of LPS)", -Vector::y(), 35.0),
    ]
    .into_iter()
    .enumerate()
    {
        let cosine = matrix.row(row).transpose().dot(&world);
        let angle = cosine.clamp(-1.0, 1.0).acos().to_degrees();
        checks.push(Check::number(name, angle, "deg", (0.0, limit), (0.0, 60.0)));
    }
    checks
}

fn center(surface: &Surface) -> Point {
    surface.centroid().unwrap_or_else(Point::origin)
}
