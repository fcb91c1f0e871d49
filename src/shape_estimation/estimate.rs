//! The ilium and pubis cuts from annotations on registered views.

use super::annotation::CutAnnotation;
use super::plane_fit::{RansacParameters, ransac_plane};
use super::reconstruct::{RegisteredView, cut_points, prune};
use crate::anatomy::{Hip, Landmark, Side};
use crate::geometry::{Plane, Point};
use crate::random::Stream;
use crate::surgery::{Cut, CutPlanes};
use crate::volume::Surface;

/// The cuts of the estimated fragment, in the APP. Ischium and posterior are the nominal ones.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimatedCuts {
    pub cuts: CutPlanes,
    /// Why the nominal ilium cut was used instead, if it was.
    pub ilium_fallback: Option<String>,
    /// Why the nominal pubis cut was used instead, if it was.
    pub pubis_fallback: Option<String>,
}

/// What an estimate is made from. Nothing of it is simulated truth: the surface and the nominal
/// cuts are preoperative, the poses come from registrations.
#[derive(Clone, Copy, Debug)]
pub struct ShapeInput<'a> {
    pub hip: &'a Hip,
    /// Surface of the whole, unmoved pelvis in the world of the CT.
    pub pelvis: &'a Surface,
    pub views: &'a [RegisteredView],
    pub annotations: &'a [CutAnnotation],
    /// In the APP.
    pub nominal: &'a CutPlanes,
}

/// Estimates the ilium and then the pubis cut. `plausible` judges whether cuts free a fragment that
/// can be one; a cut that has no fit or fails there stays nominal, and the result says why.
pub fn estimate_cuts(
    input: &ShapeInput<'_>,
    parameters: &RansacParameters,
    stream: &mut Stream,
    plausible: impl Fn(&CutPlanes) -> Result<(), String>,
) -> EstimatedCuts {
    let mut cuts = *input.nominal;
    let mut replace = |cut: Cut| -> Option<String> {
        let candidate = match fit(input, cut, parameters, stream) {
            Ok(plane) => cuts.with(cut, plane),
            Err(reason) => return Some(reason),
        };
        match plausible(&candidate) {
            Ok(()) => {
                cuts = candidate;
                None
            }
            Err(reason) => Some(format!("no plausible fragment: {reason}")),
        }
    };
    let ilium_fallback = replace(Cut::Ilium);
    let pubis_fallback = replace(Cut::Pubis);
    EstimatedCuts {
        cuts,
        ilium_fallback,
        pubis_fallback,
    }
}

/// The fitted plane in the APP, its normal out of the fragment.
fn fit(
    input: &ShapeInput<'_>,
    cut: Cut,
    parameters: &RansacParameters,
    stream: &mut Stream,
) -> Result<Plane, String> {
    let points = cut_points(input.pelvis, input.views, input.annotations, cut);
    let kept = prune(&points, input.hip, midline_x(input.hip), cut);
    let fitted = ransac_plane(&kept, parameters, stream)
        .map_err(|error| format!("{error} (of {} before pruning)", points.len()))?;
    let plane = fitted.plane.transformed(&input.hip.app_from_volume);
    // The femoral head, the APP's origin, lies inside.
    let outward = match plane.signed_distance(&Point::origin()) > 0.0 {
        true => plane.flipped(),
        false => plane,
    };
    Ok(outward)
}

/// Where the mid-sagittal plane lies along the APP's x axis: between the inferior symphysis points.
fn midline_x(hip: &Hip) -> f64 {
    let symphysis = Side::BOTH
        .into_iter()
        .filter_map(|side| hip.specimen.landmarks.get(Landmark::Ips, side))
        .map(|point| (hip.app_from_volume * point).x);
    // The APP itself needs both points, so a hip always has them.
    symphysis.sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::frame::ap_view_rotation;
    use crate::anatomy::{Landmarks, Source, Specimen};
    use crate::geometry::{Rigid, Vector};
    use crate::random::{Purpose, stream};
    use crate::shape_estimation::Crossing;
    use crate::volume::surface_block::block;
    use crate::volume::{Grid, Volume};
    use crate::xray::Camera;
    use std::sync::Arc;

    /// A hip without voxels, upright at the origin of the world, for tests of geometry.
    fn hip(side: Side) -> Hip {
        let mut landmarks = Landmarks::default();
        for side in Side::BOTH {
            let s = side.lateral_sign();
            landmarks.set(Landmark::Asis, side, Point::new(120.0 * s, -40.0, 80.0));
            landmarks.set(Landmark::Ips, side, Point::new(5.0 * s, -40.0, -40.0));
            landmarks.set(Landmark::Fh, side, Point::new(85.0 * s, 0.0, 0.0));
        }
        let grid = Grid::axis_aligned([1, 1, 1], 1.0, Point::origin());
        let specimen = Specimen {
            name: "test".into(),
            source: Source {
                kind: "test".into(),
                description: String::new(),
                licence: "none".into(),
                sex: "unknown".into(),
                assigned_density: true,
            },
            ct: Volume::filled(grid.clone(), 0),
            labels: Volume::filled(grid, 0),
            landmarks,
            rims: Default::default(),
        };
        Hip::new(Arc::new(specimen), side).unwrap()
    }

    /// A slab of "ilium" above each head, 20 mm deep, and the annotations of a tilted cut through
    /// it as two known views see them.
    fn scene(side: Side) -> (Hip, Surface, Vec<RegisteredView>, Vec<CutAnnotation>, Plane) {
        let hip = hip(side);
        let s = side.lateral_sign();
        let (low, high) = (40.0f64.min(130.0) * s, 130.0 * s);
        let (vertices, triangles) = block(
            &Point::new(low.min(high), -10.0, 20.0),
            &Point::new(low.max(high), 10.0, 110.0),
        );
        let surface = Surface::new(vertices, triangles);
        assert!(surface.volume() > 0.0);
        let truth = Plane::through(
            &(hip.app_from_volume * Point::new(85.0 * s, 0.0, 55.0)),
            &Vector::new(0.25 * s, 1.0, -0.2),
        );
        let in_world = truth.transformed(&hip.app_from_volume.inverse());
        let camera = Camera::cios_fusion();
        let rotation = ap_view_rotation(side) * hip.app_from_volume.rotation;
        let ap = Rigid::from_parts(
            (Vector::new(0.0, 0.0, -816.0) - rotation * hip.head().coords).into(),
            rotation,
        );
        let turn = Rigid::rotation(Vector::new(0.0, 0.25, 0.0));
        let views: Vec<RegisteredView> = [ap, Rigid::translation(200.0, 0.0, -10.0) * turn * ap]
            .into_iter()
            .map(|camera_from_pelvis| RegisteredView {
                camera,
                camera_from_pelvis,
            })
            .collect();
        let mut annotations = Vec::new();
        for (view, registered) in views.iter().enumerate() {
            for i in 0..40 {
                for (y, crossing) in [(-10.0, Crossing::Entry), (10.0, Crossing::Exit)] {
                    let x = s * (45.0 + 2.0 * i as f64);
                    // The height at which the cut meets the slab's front or back face.
                    let z = (in_world.offset_mm - in_world.normal.x * x - in_world.normal.y * y)
                        / in_world.normal.z;
                    let pixel =
                        camera.project(&(registered.camera_from_pelvis * Point::new(x, y, z)));
                    annotations.push(CutAnnotation {
                        view,
                        cut: Cut::Ilium,
                        pixel,
                        crossing,
                    });
                }
            }
        }
        (hip, surface, views, annotations, truth)
    }

    fn nominal() -> CutPlanes {
        let plane = |n: Vector| Plane::through(&Point::from(n * 45.0), &n);
        CutPlanes::new([Vector::y(), -Vector::y(), -Vector::z(), -Vector::x()].map(plane))
    }

    #[test]
    fn exact_annotations_give_back_the_cut_on_both_sides() {
        for side in Side::BOTH {
            let (hip, surface, views, annotations, truth) = scene(side);
            let nominal = nominal();
            let input = ShapeInput {
                hip: &hip,
                pelvis: &surface,
                views: &views,
                annotations: &annotations,
                nominal: &nominal,
            };
            let mut draws = stream(1, Purpose::Ransac, "exact");
            let parameters = RansacParameters::default();
            let estimated = estimate_cuts(&input, &parameters, &mut draws, |_| Ok(()));
            assert_eq!(estimated.ilium_fallback, None);
            let found = estimated.cuts.get(Cut::Ilium);
            assert!(
                (found.normal - truth.normal).norm() < 1e-6,
                "{side}: {found:?} {truth:?}"
            );
            assert!((found.offset_mm - truth.offset_mm).abs() < 1e-4);
            // Nothing marks the pubis, so it stays nominal and says so.
            assert!(
                estimated
                    .pubis_fallback
                    .unwrap()
                    .starts_with("0 sightings are left")
            );
            assert_eq!(estimated.cuts.get(Cut::Pubis), nominal.get(Cut::Pubis));
        }
    }

    #[test]
    fn an_implausible_fragment_keeps_the_nominal_cut() {
        let (hip, surface, views, annotations, _) = scene(Side::Left);
        let nominal = nominal();
        let input = ShapeInput {
            hip: &hip,
            pelvis: &surface,
            views: &views,
            annotations: &annotations,
            nominal: &nominal,
        };
        let mut draws = stream(1, Purpose::Ransac, "implausible");
        let parameters = RansacParameters::default();
        let refuse = |_: &CutPlanes| Err("too small".to_string());
        let estimated = estimate_cuts(&input, &parameters, &mut draws, refuse);
        assert_eq!(estimated.cuts, nominal);
        let reason = estimated.ilium_fallback.unwrap();
        assert_eq!(reason, "no plausible fragment: too small");
    }
}
