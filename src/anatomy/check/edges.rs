//! Do the labels' edges lie on the CT's?

use super::{Bones, Check};
use crate::anatomy::Specimen;
use crate::geometry::{Point, Vector};
use crate::volume::cubic::cubic;
use crate::volume::{Surface, Volume};
use nalgebra::{Matrix4, Vector4};

/// Places on the labels' surfaces that are looked at, at most.
const PLACES: usize = 20_000;

/// The CT is looked at this far to either side of a surface (voxels).
const REACH: f64 = 4.0;

/// Step along a surface's normal (voxels).
const STEP: f64 = 0.25;

/// The CT falls by this much at least over a step of half a voxel where bone ends (HU).
const FALL_HU: f32 = 40.0;

/// Rounds of the fit; the farthest tenth is left out of each.
const ROUNDS: usize = 5;

/// A place of a label's surface, and how far outside it (mm) the CT's own edge lies.
struct Edge {
    normal: Vector,
    outside_mm: f64,
}

/// A label map that is shifted against its CT lies off the bones' edges in one direction, one that is
/// too thick or thin off all of them alike: the least squares of `edge = shift . normal + thickness`
/// tell both.
pub(super) fn checks(specimen: &Specimen, bones: &Bones) -> Vec<Check> {
    let voxel = specimen.ct.grid.spacing.into_iter().fold(0.0, f64::max);
    let mut edges = Vec::new();
    for surface in [&bones.pelvis, &bones.femurs[0], &bones.femurs[1]] {
        edges.extend(of_surface(&specimen.ct, surface, voxel));
    }
    let (shift, thin) = fit(edges).unwrap_or((Vector::repeat(f64::NAN), f64::NAN));
    let size = shift.norm();
    let mut shifted = Check::number(
        "labels beside the CT's edges of bone",
        size,
        "mm",
        (0.0, 0.3 * voxel),
        (0.0, voxel),
    );
    shifted.found = format!(
        "{size:.2} mm ({:.2}, {:.2}, {:.2})",
        -shift.x, -shift.y, -shift.z
    );
    let mut thick = Check::number(
        "labels' surface outside the CT's edges of bone",
        -thin,
        "mm",
        (-0.8 * voxel, 0.8 * voxel),
        (-2.0 * voxel, 2.0 * voxel),
    );
    thick.found = format!("{:.2} mm", -thin);
    if !size.is_finite() {
        let advice = "the CT has no edges of bone where the label map has them: is it in Hounsfield units, \
                      and are both of the same body?";
        return [shifted, thick]
            .map(|mut check| {
                check.found = "no edges of bone".into();
                check.advise(advice)
            })
            .into();
    }
    vec![
        shifted.advise(
            "bone leaves its label on one side and takes soft tissue along on the other: poses are off by the \
             shift; half a voxel is a file whose origin is a corner where the other's is a centre, mend the \
             label map's origin",
        ),
        thick.advise(
            "labels that are too thick close the joint space and collide early, those that are too thin lose \
             the cortex from DRRs; segment at half the height of the bone's edge, without dilation",
        ),
    ]
}

fn of_surface(ct: &Volume<i16>, surface: &Surface, voxel: f64) -> Vec<Edge> {
    let every = surface.vertices().len().div_ceil(PLACES / 3).max(1);
    let places = surface.vertices().iter().zip(surface.normals());
    places
        .step_by(every)
        .filter_map(|(point, normal)| {
            let outside_mm = edge(ct, point, normal, voxel)?;
            Some(Edge {
                normal: *normal,
                outside_mm,
            })
        })
        .collect()
}

/// Where along a normal the CT falls most steeply.
fn edge(ct: &Volume<i16>, point: &Point, normal: &Vector, voxel: f64) -> Option<f64> {
    let steps = (2.0 * REACH / STEP) as usize;
    let at = |n: usize| (n as f64 * STEP - REACH) * voxel;
    let values: Vec<f32> = (0..=steps)
        .map(|n| cubic(ct, &ct.grid.index(&(point + normal * at(n)))))
        .collect();
    let fall = |n: usize| values[n - 1] - values[n + 1];
    let steepest = (2..steps - 1).max_by(|a, b| fall(*a).total_cmp(&fall(*b)))?;
    if fall(steepest) < FALL_HU {
        return None;
    }
    // The vertex of the parabola through the three falls.
    let (before, here, after) = (fall(steepest - 1), fall(steepest), fall(steepest + 1));
    let bend = before - 2.0 * here + after;
    let offset = match bend < 0.0 {
        true => 0.5 * f64::from((before - after) / bend),
        false => 0.0,
    };
    Some(at(steepest) + offset.clamp(-1.0, 1.0) * STEP * voxel)
}

/// The shift of the CT's edges (mm) and how far outside the labels they lie (mm).
fn fit(mut edges: Vec<Edge>) -> Option<(Vector, f64)> {
    let mut solution = Vector4::zeros();
    for round in 0..ROUNDS {
        if edges.len() < 100 {
            return None;
        }
        let row = |e: &Edge| e.normal.push(1.0);
        if round > 0 {
            let far = |e: &Edge| (row(e).dot(&solution) - e.outside_mm).abs();
            edges.sort_by(|a, b| far(a).total_cmp(&far(b)));
            edges.truncate(edges.len() * 9 / 10);
        }
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for edge in &edges {
            let row = row(edge);
            normal += row * row.transpose();
            right += row * edge.outside_mm;
        }
        solution = normal.cholesky()?.solve(&right);
    }
    Some((solution.xyz(), solution.w))
}
