//! Where the C-arm truly stands for the three views of a case (paper, supplement on the simulation
//! study; facts 2.15).

use crate::anatomy::{Hip, frame::ap_view_rotation};
use crate::geometry::{Rigid, Vector};
use crate::random::Stream;
use crate::xray::{Camera, Orbit};
use nalgebra::{Translation3, Unit, UnitQuaternion};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal, UnitSphere};
use serde::{Deserialize, Serialize};

/// How the views of a case are drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ViewParameters {
    /// Distance of the femoral head from the source as a fraction of the source-detector distance,
    /// in (0, 1).
    pub head_depth_fraction: f64,
    /// How far medial of the femoral head the central ray passes, before the perturbation (mm).
    pub medial_offset_mm: f64,
    /// How far superior of the femoral head the central ray passes, before the perturbation (mm).
    pub superior_offset_mm: f64,
    /// Largest rotation of the first view's perturbation (degrees).
    pub first_rotation_deg: f64,
    /// Largest translation of the first view's perturbation (mm).
    pub first_translation_mm: f64,
    /// Mean orbital angle of views 2 and 3 relative to view 1 (degrees).
    pub orbital_mean_deg: [f64; 2],
    /// Standard deviation of the orbital angle of views 2 and 3 (degrees).
    pub orbital_sd_deg: [f64; 2],
    /// Largest rotation of the perturbation of views 2 and 3 (degrees).
    pub orbital_rotation_deg: f64,
    /// Largest translation of the perturbation of views 2 and 3 (mm).
    pub orbital_translation_mm: f64,
}

impl Default for ViewParameters {
    fn default() -> Self {
        Self {
            head_depth_fraction: 0.8,
            medial_offset_mm: 25.0,
            superior_offset_mm: 35.0,
            first_rotation_deg: 10.0,
            first_translation_mm: 10.0,
            orbital_mean_deg: [-10.0, 15.0],
            orbital_sd_deg: [3.0, 3.0],
            orbital_rotation_deg: 2.0,
            orbital_translation_mm: 2.0,
        }
    }
}

impl ViewParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        let mut check = |field: &str, value: f64, min: f64, max: f64, unit: &str| {
            if !(min..=max).contains(&value) {
                let message = format!("is {value}; expected {min} to {max}{unit}");
                problems.push((field.to_string(), message));
            }
        };
        check(
            "head_depth_fraction",
            self.head_depth_fraction,
            0.3,
            0.95,
            "",
        );
        check(
            "medial_offset_mm",
            self.medial_offset_mm,
            -100.0,
            100.0,
            " mm",
        );
        check(
            "superior_offset_mm",
            self.superior_offset_mm,
            -100.0,
            100.0,
            " mm",
        );
        check(
            "first_rotation_deg",
            self.first_rotation_deg,
            0.0,
            90.0,
            " degrees",
        );
        check(
            "first_translation_mm",
            self.first_translation_mm,
            0.0,
            100.0,
            " mm",
        );
        for k in 0..2 {
            let (mean, sd) = (self.orbital_mean_deg[k], self.orbital_sd_deg[k]);
            check(
                &format!("orbital_mean_deg[{k}]"),
                mean,
                -90.0,
                90.0,
                " degrees",
            );
            check(&format!("orbital_sd_deg[{k}]"), sd, 0.0, 45.0, " degrees");
        }
        check(
            "orbital_rotation_deg",
            self.orbital_rotation_deg,
            0.0,
            90.0,
            " degrees",
        );
        check(
            "orbital_translation_mm",
            self.orbital_translation_mm,
            0.0,
            100.0,
            " mm",
        );
        problems
    }
}

/// The true geometry of the three views of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    /// Maps the specimen's world (LPS, mm) to the camera of each view.
    pub camera_from_volume: [Rigid; 3],
    /// Orbital angles of views 2 and 3 relative to view 1 (rad), without their perturbation.
    pub orbital_angles: [f64; 2],
}

impl Views {
    /// Draws the three views of a hip.
    ///
    /// View 1 is [`ap_view`] times a perturbation: anatomy moved rigidly in the APP by a rotation
    /// about the femoral head of uniform axis and angle U[-10, 10] deg, then a translation of
    /// uniform direction and length U[0, 10] mm. Views 2 and 3 are view 1 turned along the orbit by
    /// N(-10, 3) and N(15, 3) deg, each with a perturbation of its own in the APP of U[-2, 2] deg and
    /// U[-2, 2] mm, which the orbital search of the registration does not model.
    ///
    /// The draws of a right hip are mirrored with the anatomy, so that the same stream gives the
    /// mirror image of the left hip's views.
    pub fn sample(
        hip: &Hip,
        camera: &Camera,
        orbit: &Orbit,
        parameters: &ViewParameters,
        stream: &mut Stream,
    ) -> Self {
        let mut perturbed = |rotation_deg: f64, translation_mm: f64| {
            let twist = Perturbation::sample(rotation_deg, translation_mm, stream);
            twist.in_app(hip.side.lateral_sign())
        };
        let delta = [
            perturbed(
                parameters.first_rotation_deg,
                parameters.first_translation_mm,
            ),
            perturbed(
                parameters.orbital_rotation_deg,
                parameters.orbital_translation_mm,
            ),
            perturbed(
                parameters.orbital_rotation_deg,
                parameters.orbital_translation_mm,
            ),
        ];
        let orbital_angles = std::array::from_fn(|k| {
            let normal: f64 = StandardNormal.sample(stream);
            let degrees = parameters.orbital_mean_deg[k] + parameters.orbital_sd_deg[k] * normal;
            degrees.to_radians()
        });
        let first = ap_view(hip, camera, parameters) * delta[0];
        let turned = |k: usize| orbit.turned(orbital_angles[k]) * first * delta[k + 1];
        let camera_from_app = [first, turned(0), turned(1)];
        Self {
            camera_from_volume: camera_from_app.map(|pose| pose * hip.app_from_volume),
            orbital_angles,
        }
    }
}

/// `camera_from_app` of the unperturbed first view: APP and camera aligned (supine, detector in front
/// of the patient), the head at its fraction of the source-detector distance, the patient shifted so
/// that the central ray passes medial and superior of the head.
pub fn ap_view(hip: &Hip, camera: &Camera, parameters: &ViewParameters) -> Rigid {
    let rotation = ap_view_rotation(hip.side);
    let aim =
        hip.lateral() * -parameters.medial_offset_mm + Vector::y() * parameters.superior_offset_mm;
    let depth = parameters.head_depth_fraction * camera.source_detector_mm;
    let translation = -(rotation * aim) - Vector::z() * depth;
    Rigid::from_parts(Translation3::from(translation), rotation)
}

/// A random rigid movement, as drawn for a left hip.
struct Perturbation {
    axis: Vector,
    angle: f64,
    translation: Vector,
}

impl Perturbation {
    /// Uniform axis with an angle of U[-`rotation_deg`, `rotation_deg`], uniform direction with a
    /// length of U[0, `translation_mm`]. (The paper has U[-2, 2] mm for views 2 and 3; along a uniform
    /// direction that is the same distribution as U[0, 2].)
    fn sample(rotation_deg: f64, translation_mm: f64, stream: &mut Stream) -> Self {
        let axis: [f64; 3] = UnitSphere.sample(stream);
        let angle = rotation_deg.to_radians() * (2.0 * stream.random::<f64>() - 1.0);
        let direction: [f64; 3] = UnitSphere.sample(stream);
        let length = translation_mm * stream.random::<f64>();
        Self {
            axis: Vector::from(axis),
            angle,
            translation: Vector::from(direction) * length,
        }
    }

    /// The movement in the APP of a side. Under the mirror x -> -x a rotation's axis (x, y, z)
    /// becomes (x, -y, -z) at the same angle.
    fn in_app(&self, lateral_sign: f64) -> Rigid {
        let axis = Vector::new(
            self.axis.x,
            self.axis.y * lateral_sign,
            self.axis.z * lateral_sign,
        );
        let translation = Vector::new(
            self.translation.x * lateral_sign,
            self.translation.y,
            self.translation.z,
        );
        Rigid::from_parts(
            Translation3::from(translation),
            UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), self.angle),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::{Landmark, Side};
    use crate::geometry::{Point, se3::rotation_angle};
    use crate::random::{Purpose, stream};
    use crate::simulation::testing;

    fn draw(side: Side, key: &str) -> Views {
        let mut s = stream(7, Purpose::Views, key);
        let (camera, orbit) = (Camera::cios_fusion(), Orbit::cios_fusion());
        let hip = testing::hip(side);
        Views::sample(&hip, &camera, &orbit, &ViewParameters::default(), &mut s)
    }

    #[test]
    fn the_central_ray_passes_medial_and_superior_of_the_head() {
        let camera = Camera::cios_fusion();
        for side in Side::BOTH {
            let hip = testing::hip(side);
            let camera_from_app = ap_view(&hip, &camera, &ViewParameters::default());
            let aimed = camera_from_app * Point::from(hip.lateral() * -25.0 + Vector::y() * 35.0);
            assert!(
                (aimed - Point::new(0.0, 0.0, -816.0)).norm() < 1e-9,
                "{side}"
            );
            // Lateral is to the right in the image of either side. Superior is up for a left hip
            // and down for a right one, whose camera is turned by 180 deg.
            let head = camera.project(&(camera_from_app * Point::origin()));
            let scale = camera.focal_px() / 816.0;
            assert!((head.x - 767.5 - 25.0 * scale).abs() < 1e-9);
            let down = 35.0 * scale * side.lateral_sign();
            assert!((head.y - 767.5 - down).abs() < 1e-9);
            // Supine with the detector in front: anterior points are nearer to the detector.
            let anterior = camera_from_app * Point::new(0.0, 0.0, 10.0);
            assert!((anterior.z + 826.0).abs() < 1e-9);
        }
    }

    #[test]
    fn perturbations_have_the_published_sizes() {
        let camera = Camera::cios_fusion();
        let hip = testing::hip(Side::Right);
        let still = ap_view(&hip, &camera, &ViewParameters::default());
        let app_from_volume = hip.app_from_volume;
        let n = 4000;
        let (mut angle, mut length, mut orbital) = (0.0, 0.0, [[0.0; 2]; 2]);
        for draw_number in 0..n {
            let views = draw(Side::Right, &format!("{draw_number}"));
            let in_app = |k: usize| views.camera_from_volume[k] * app_from_volume.inverse();
            let delta = still.inverse() * in_app(0);
            let degrees = rotation_angle(&delta.rotation).to_degrees();
            assert!(degrees <= 10.0 && delta.translation.vector.norm() <= 10.0);
            angle += degrees / n as f64;
            length += delta.translation.vector.norm() / n as f64;
            for k in 0..2 {
                let a = views.orbital_angles[k];
                orbital[k][0] += a.to_degrees() / n as f64;
                orbital[k][1] += a.to_degrees().powi(2) / n as f64;
                let planned = Orbit::cios_fusion().turned(a) * in_app(0);
                let rest = planned.inverse() * in_app(k + 1);
                assert!(rotation_angle(&rest.rotation).to_degrees() <= 2.0 + 1e-9);
                assert!(rest.translation.vector.norm() <= 2.0 + 1e-9);
            }
        }
        // |U[-10, 10]| has mean 5 and SD 2.89; five standard errors.
        let margin = 5.0 * 2.89 / (n as f64).sqrt();
        assert!((angle - 5.0).abs() < margin, "{angle}");
        assert!((length - 5.0).abs() < margin, "{length}");
        for (k, mean) in [-10.0, 15.0].into_iter().enumerate() {
            let sd = (orbital[k][1] - orbital[k][0].powi(2)).sqrt();
            assert!((orbital[k][0] - mean).abs() < 5.0 * 3.0 / (n as f64).sqrt());
            assert!((sd - 3.0).abs() < 5.0 * 3.0 / (2.0 * n as f64).sqrt());
        }
    }

    /// DESIGN section 3, "left and right". The specimen is its own mirror image in x, and mirroring
    /// it flips the rows of the image: the C-arm stands on the other side of the table, and its
    /// orbital angles keep their sign.
    #[test]
    fn a_mirrored_hip_has_mirrored_views() {
        let camera = Camera::cios_fusion();
        for key in ["a", "b", "c", "d"] {
            let (left, right) = (draw(Side::Left, key), draw(Side::Right, key));
            assert_eq!(left.orbital_angles, right.orbital_angles);
            for k in 0..3 {
                for point in [
                    Point::new(88.0, -10.0, 0.0),
                    Point::new(-30.0, 44.0, 71.0),
                    Point::new(5.0, -90.0, -64.0),
                ] {
                    let mirrored = Point::new(-point.x, point.y, point.z);
                    let a = left.camera_from_volume[k] * point;
                    let b = right.camera_from_volume[k] * mirrored;
                    assert!((a - Point::new(b.x, -b.y, b.z)).norm() < 1e-9);
                    let (p, q) = (camera.project(&a), camera.project(&b));
                    assert!((p.x - q.x).abs() < 1e-9 && (p.y - (1535.0 - q.y)).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn the_landmark_lies_in_the_cropped_first_image() {
        let camera = Camera::cios_fusion().cropped(50);
        for side in Side::BOTH {
            let landmark = testing::hip(side).landmark(Landmark::Mof).unwrap();
            for draw_number in 0..2000 {
                let views = draw(side, &format!("mof/{draw_number}"));
                let pixel = camera.project(&(views.camera_from_volume[0] * landmark));
                assert!(
                    (0.0..1435.0).contains(&pixel.x) && (0.0..1435.0).contains(&pixel.y),
                    "{side}, draw {draw_number}: {pixel}"
                );
            }
        }
    }

    #[test]
    fn the_defaults_are_valid_and_nonsense_is_named() {
        assert_eq!(ViewParameters::default().problems(), Vec::new());
        let wrong = ViewParameters {
            head_depth_fraction: 1.5,
            orbital_sd_deg: [3.0, f64::NAN],
            ..Default::default()
        };
        let fields: Vec<String> = wrong.problems().into_iter().map(|(f, _)| f).collect();
        assert_eq!(fields, ["head_depth_fraction", "orbital_sd_deg[1]"]);
    }
}
