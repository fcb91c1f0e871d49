//! Simulated annotations of cut lines (paper, supplement on the simulation study; DESIGN section 3,
//! "cut annotations").

use crate::anatomy::{Hip, Label, Side};
use crate::geometry::{Pixel, Plane, Point, Rigid};
use crate::random::Stream;
use crate::shape_estimation::reconstruct::detector_ray;
use crate::shape_estimation::{Crossing, CutAnnotation};
use crate::surgery::{Cut, SurgeryMap};
use crate::volume::{Surface, Volume};
use crate::xray::Camera;
use nalgebra::{Matrix2, Vector2};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// How a person's annotations differ from the true line. The paper gives no numbers; these are ours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AnnotationParameters {
    /// Largest distance from the cut's plane of a ray's intersection that counts as on the cut (mm):
    /// half the chisel's width.
    pub tolerance_mm: f64,
    /// Fewest and most gaps in a line.
    pub gaps: [usize; 2],
    /// Shortest and longest gap as a fraction of the line's length.
    pub gap_fraction: [f64; 2],
    /// SD of the shift, in each direction, of each corner of the line's oriented box (pixels of the
    /// full image).
    pub corner_sd_px: f64,
    /// Fewest pixels of a line that a person can see; shorter lines stay without annotations.
    pub fewest_pixels: usize,
}

impl Default for AnnotationParameters {
    fn default() -> Self {
        Self {
            tolerance_mm: 0.5,
            gaps: [1, 3],
            gap_fraction: [0.05, 0.15],
            corner_sd_px: 10.0,
            fewest_pixels: 20,
        }
    }
}

impl AnnotationParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        let mut refuse = |field: &str, value: String, expected: &str| {
            problems.push((
                field.to_string(),
                format!("is {value}; expected {expected}"),
            ));
        };
        if !(0.01..=10.0).contains(&self.tolerance_mm) {
            refuse(
                "tolerance_mm",
                self.tolerance_mm.to_string(),
                "0.01 to 10 mm",
            );
        }
        if self.gaps[0] > self.gaps[1] || self.gaps[1] > 100 {
            refuse(
                "gaps",
                format!("{:?}", self.gaps),
                "fewest, then most, up to 100",
            );
        }
        let [short, long] = self.gap_fraction;
        if !(0.0 <= short && short <= long && long <= 1.0) {
            let expected = "shortest, then longest, in [0, 1]";
            refuse("gap_fraction", format!("{:?}", self.gap_fraction), expected);
        }
        if !(0.0..=500.0).contains(&self.corner_sd_px) {
            refuse(
                "corner_sd_px",
                self.corner_sd_px.to_string(),
                "0 to 500 pixels",
            );
        }
        problems
    }
}

/// The true lines of a case's cuts on the main pelvis, ready to be seen in its views.
#[derive(Debug)]
pub struct CutLines<'a> {
    hip: &'a Hip,
    pelvis: &'a Surface,
    map: &'a SurgeryMap,
    /// Points of the ilium's and the pubis' line.
    points: [Vec<Point>; 2],
}

/// The cuts that people annotate.
const ANNOTATED: [Cut; 2] = [Cut::Ilium, Cut::Pubis];

impl<'a> CutLines<'a> {
    /// `pelvis` is the surface of the whole preoperative pelvis in the specimen's world, `map` the
    /// true surgery's.
    pub fn new(hip: &'a Hip, pelvis: &'a Surface, map: &'a SurgeryMap) -> Self {
        let mut lines = Self {
            hip,
            pelvis,
            map,
            points: Default::default(),
        };
        lines.points = ANNOTATED.map(|cut| lines.line(cut));
        lines
    }

    /// Points of the true line of the ilium or pubis cut, at most 0.1 mm apart along it, in the world;
    /// none for the other cuts, which nobody annotates.
    pub fn points(&self, cut: Cut) -> &[Point] {
        let place = ANNOTATED.iter().position(|&annotated| annotated == cut);
        place.map_or(&[], |place| &self.points[place])
    }

    /// A person's annotations of the ilium and pubis cuts in one view.
    ///
    /// Every pixel of the full image that the true line (the cut's plane where it meets the pelvis
    /// surface, with the fragment on one side and the main pelvis on the other) falls on is a label
    /// when its ray meets the surface on the cut; the flag says whether entering, leaving or both. Then
    /// groups of labels are erased along the line's principal axis, and the rest is moved by a
    /// deformation that is bilinear between random shifts of the corners of the line's oriented box.
    /// A cut that shows fewer than a few pixels gives none.
    ///
    /// The draws of a right hip are mirrored with its image.
    pub fn annotate(
        &self,
        view: usize,
        camera: &Camera,
        camera_from_volume: &Rigid,
        parameters: &AnnotationParameters,
        stream: &mut Stream,
    ) -> Vec<CutAnnotation> {
        let mut annotations = Vec::new();
        for (cut, points) in ANNOTATED.into_iter().zip(&self.points) {
            let tolerance_mm = parameters.tolerance_mm;
            let seen = self.seen(cut, points, camera, camera_from_volume, tolerance_mm);
            if seen.len() < parameters.fewest_pixels {
                continue;
            }
            let drawn = Drawing::of(&seen, self.hip.side).blurred(parameters, stream);
            annotations.extend(drawn.into_iter().map(|(pixel, crossing)| CutAnnotation {
                view,
                cut,
                pixel,
                crossing,
            }));
        }
        annotations
    }

    /// The labels of one cut, whose line has these `points`, without human error: pixel centres, row
    /// after row.
    fn seen(
        &self,
        cut: Cut,
        points: &[Point],
        camera: &Camera,
        camera_from_volume: &Rigid,
        tolerance_mm: f64,
    ) -> Vec<(Pixel, Crossing)> {
        let plane = self.plane(cut);
        let mut pixels = BTreeSet::new();
        for point in points {
            let pixel = camera.project(&(camera_from_volume * point));
            let (x, y) = (pixel.x.round(), pixel.y.round());
            let inside =
                (0.0..camera.width as f64).contains(&x) && (0.0..camera.height as f64).contains(&y);
            if inside {
                pixels.insert((y as usize, x as usize));
            }
        }
        pixels
            .into_iter()
            .filter_map(|(y, x)| {
                let pixel = Pixel::new(x as f64, y as f64);
                let ray = detector_ray(camera, camera_from_volume, &pixel);
                let (mut entry, mut exit) = (false, false);
                for hit in self.pelvis.intersections(&ray) {
                    let point = ray.at(hit.t);
                    let near = plane.signed_distance(&point).abs() <= tolerance_mm;
                    if near && self.on_cut(&plane, &point, hit.triangle) {
                        entry |= hit.entering;
                        exit |= !hit.entering;
                    }
                }
                let crossing = match (entry, exit) {
                    (true, true) => Crossing::Both,
                    (true, false) => Crossing::Entry,
                    (false, true) => Crossing::Exit,
                    (false, false) => return None,
                };
                Some((pixel, crossing))
            })
            .collect()
    }

    /// Points of the true line, at most [`SPACING_MM`] apart along it, in the world.
    fn line(&self, cut: Cut) -> Vec<Point> {
        let plane = self.plane(cut);
        let mut points = Vec::new();
        for triangle in 0..self.pelvis.triangles().len() {
            let corners = self.pelvis.corners(triangle);
            let Some([a, b]) = section(&plane, &corners) else {
                continue;
            };
            if !self.on_cut(&plane, &nalgebra::center(&a, &b), triangle) {
                continue;
            }
            let steps = ((b - a).norm() / SPACING_MM).ceil().max(1.0);
            points.extend((0..steps as usize).map(|n| a + (b - a) * ((n as f64 + 0.5) / steps)));
        }
        points
    }

    /// The cut's plane in the world, normal out of the fragment.
    fn plane(&self, cut: Cut) -> Plane {
        self.map
            .cuts
            .get(cut)
            .transformed(&self.hip.app_from_volume.inverse())
    }

    /// True where the plane truly divides bone: just inside of the surface, its inner side is cut or
    /// fragment and its outer side main pelvis.
    fn on_cut(&self, plane: &Plane, point: &Point, triangle: usize) -> bool {
        let labels: &Volume<u8> = &self.map.labels;
        let inward = -self.pelvis.normal_at(point, triangle);
        let on_plane = plane.project(point);
        let label = |aside: f64, depth: f64| {
            labels.nearest(&(on_plane + plane.normal * aside + inward * depth))
        };
        let voxel = labels.grid.spacing.iter().copied().fold(0.0, f64::max);
        let any = |aside: f64, wanted: &[Label]| {
            DEPTHS.iter().any(|depth| {
                label(aside * voxel, depth * voxel)
                    .is_some_and(|l| wanted.iter().any(|w| w.value() == l))
            })
        };
        any(-ASIDE, &[Label::Cut, Label::Fragment]) && any(ASIDE, &[Label::Pelvis])
    }
}

/// Distance of points along the line (mm), below the size of a pixel at the patient (0.15 mm).
const SPACING_MM: f64 = 0.1;
/// How far beside the plane bone is looked for, in voxels: beyond half a voxel, so that the nearest
/// voxel lies on the wanted side.
const ASIDE: f64 = 0.9;
/// How deep below the surface bone is looked for, in voxels.
const DEPTHS: [f64; 3] = [0.5, 1.0, 1.5];

/// The part of a plane inside a triangle.
fn section(plane: &Plane, corners: &[Point; 3]) -> Option<[Point; 2]> {
    let distance = corners.map(|p| plane.signed_distance(&p));
    let mut ends = (0..3).filter_map(|i| {
        let (a, b) = (i, (i + 1) % 3);
        let crosses = (distance[a] > 0.0) != (distance[b] > 0.0);
        let t = distance[a] / (distance[a] - distance[b]);
        crosses.then(|| corners[a] + (corners[b] - corners[a]) * t)
    });
    Some([ends.next()?, ends.next()?])
}

/// A line of labels in the coordinates of its oriented box.
struct Drawing {
    /// (position along the principal axis, position across it, flag).
    labels: Vec<(Vector2<f64>, Crossing)>,
    center: Vector2<f64>,
    /// Columns: the principal axis, with a component towards higher columns, and the one across.
    axes: Matrix2<f64>,
    /// Sign of the rows: the images of right hips are mirrored.
    rows: f64,
}

impl Drawing {
    fn of(seen: &[(Pixel, Crossing)], side: Side) -> Self {
        let rows = side.lateral_sign();
        let upright = |p: &Pixel| Vector2::new(p.x, p.y * rows);
        let n = seen.len() as f64;
        let center: Vector2<f64> = seen.iter().map(|(p, _)| upright(p)).sum::<Vector2<f64>>() / n;
        let scatter: Matrix2<f64> = seen
            .iter()
            .map(|(p, _)| {
                let d = upright(p) - center;
                d * d.transpose()
            })
            .sum();
        // The angle of the principal axis of a symmetric 2 x 2 matrix, in (-90, 90] deg.
        let angle = 0.5 * (2.0 * scatter[(0, 1)]).atan2(scatter[(0, 0)] - scatter[(1, 1)]);
        let (sin, cos) = angle.sin_cos();
        let axes = Matrix2::new(cos, -sin, sin, cos);
        let labels = seen
            .iter()
            .map(|(p, crossing)| (axes.transpose() * (upright(p) - center), *crossing))
            .collect();
        Self {
            labels,
            center,
            axes,
            rows,
        }
    }

    /// The labels with gaps and deformed, as pixels.
    fn blurred(
        mut self,
        parameters: &AnnotationParameters,
        stream: &mut Stream,
    ) -> Vec<(Pixel, Crossing)> {
        let (mut min, mut max) = (Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN));
        for (p, _) in &self.labels {
            min = min.inf(p);
            max = max.sup(p);
        }
        let size = max - min;
        let [fewest, most] = parameters.gaps;
        let [short, long] = parameters.gap_fraction;
        for _ in 0..stream.random_range(fewest..=most) {
            let length = short + (long - short) * stream.random::<f64>();
            let start = (1.0 - length) * stream.random::<f64>();
            let (from, to) = (min.x + start * size.x, min.x + (start + length) * size.x);
            self.labels.retain(|(p, _)| !(from..to).contains(&p.x));
        }
        let corners: [Vector2<f64>; 4] = std::array::from_fn(|_| {
            let mut shift = || -> f64 { StandardNormal.sample(stream) };
            Vector2::new(shift(), shift()) * parameters.corner_sd_px
        });
        let fraction =
            |p: f64, min: f64, size: f64| if size > 0.0 { (p - min) / size } else { 0.5 };
        self.labels
            .iter()
            .map(|(p, crossing)| {
                let (u, v) = (fraction(p.x, min.x, size.x), fraction(p.y, min.y, size.y));
                let shift = (corners[0] * (1.0 - u) + corners[1] * u) * (1.0 - v)
                    + (corners[2] * (1.0 - u) + corners[3] * u) * v;
                let moved = self.center + self.axes * p + shift;
                (Pixel::new(moved.x, moved.y * self.rows), *crossing)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector;
    use crate::random::{Purpose, stream};
    use crate::simulation::testing::{toy, toy_cuts};
    use crate::simulation::views::{ViewParameters, ap_view};
    use crate::surgery::{FragmentParameters, cut_fragment};

    struct Scene {
        hip: &'static Hip,
        pelvis: &'static Surface,
        map: SurgeryMap,
        camera: Camera,
        /// An AP view turned a little, so that entry and exit of the ilium cut come apart.
        pose: Rigid,
    }

    fn scene(side: Side) -> Scene {
        let (hip, pelvis) = toy(side);
        let map = cut_fragment(hip, &toy_cuts(side), &FragmentParameters::default()).unwrap();
        let camera = Camera::cios_fusion();
        let s = side.lateral_sign();
        let tilt = Rigid::rotation(Vector::new(0.15, -0.05 * s, 0.1 * s));
        let pose = ap_view(hip, &camera, &ViewParameters::default()) * tilt * hip.app_from_volume;
        Scene {
            hip,
            pelvis,
            map,
            camera,
            pose,
        }
    }

    #[test]
    fn the_line_runs_around_the_bone_that_was_cut() {
        for side in Side::BOTH {
            let scene = scene(side);
            let lines = CutLines::new(scene.hip, scene.pelvis, &scene.map);
            // The pubic bar: a circle of radius 8 mm, cut at an angle.
            let plane = scene.map.cuts.get(Cut::Pubis);
            let points: Vec<Point> = lines
                .line(Cut::Pubis)
                .into_iter()
                .map(|p| scene.hip.app_from_volume * p)
                .collect();
            assert!(points.len() > 400, "{}", points.len());
            for p in &points {
                assert!(plane.signed_distance(p).abs() < 1e-9);
                let x = p.x * side.lateral_sign();
                let radius = (p.y + 8.0 - 0.1 * x).hypot(p.z - 20.0);
                assert!((radius - 8.0).abs() < 0.8, "{side}: {p} at {radius}");
            }
            // The wing: both its sides, 80 mm each, and the front; behind, the posterior cut ends it.
            let ilium = lines.line(Cut::Ilium).len() as f64 * SPACING_MM;
            assert!((160.0..220.0).contains(&ilium), "{ilium}");
        }
    }

    #[test]
    fn labels_lie_on_the_cut_as_their_flag_says() {
        for side in Side::BOTH {
            let scene = scene(side);
            let lines = CutLines::new(scene.hip, scene.pelvis, &scene.map);
            for cut in [Cut::Ilium, Cut::Pubis] {
                let plane = lines.plane(cut);
                let seen = lines.seen(cut, &lines.line(cut), &scene.camera, &scene.pose, 0.5);
                let count = |wanted| seen.iter().filter(|(_, c)| *c == wanted).count();
                assert!(seen.len() > 100, "{side} {}: {}", cut.name(), seen.len());
                if cut == Cut::Ilium {
                    assert!(count(Crossing::Entry) > 20 && count(Crossing::Exit) > 20);
                }
                for (pixel, crossing) in seen {
                    let ray = detector_ray(&scene.camera, &scene.pose, &pixel);
                    let hits = scene.pelvis.intersections(&ray);
                    let on = |entering: bool| {
                        hits.iter().any(|h| {
                            h.entering == entering
                                && plane.signed_distance(&ray.at(h.t)).abs() <= 0.5
                        })
                    };
                    assert!(on(true) || crossing == Crossing::Exit);
                    assert!(on(false) || crossing == Crossing::Entry);
                }
            }
        }
    }

    #[test]
    fn a_cut_out_of_the_image_gives_no_annotations() {
        let scene = scene(Side::Left);
        let lines = CutLines::new(scene.hip, scene.pelvis, &scene.map);
        let away = Rigid::translation(400.0, 0.0, 0.0) * scene.pose;
        let parameters = AnnotationParameters::default();
        let mut s = stream(1, Purpose::Annotation, "test/0");
        let none = lines.annotate(0, &scene.camera, &away, &parameters, &mut s);
        assert!(none.is_empty());
    }

    /// A straight line of labels at 30 degrees, on an image of either side.
    fn straight() -> Vec<(Pixel, Crossing)> {
        (0..600)
            .map(|n| {
                let t = f64::from(n);
                (
                    Pixel::new(300.0 + 0.866 * t, 500.0 + 0.5 * t),
                    Crossing::Entry,
                )
            })
            .collect()
    }

    #[test]
    fn gaps_take_their_part_of_the_line_and_nothing_moves_without_deformation() {
        let parameters = AnnotationParameters {
            corner_sd_px: 0.0,
            ..Default::default()
        };
        let all = straight();
        for n in 0..50 {
            let mut s = stream(1, Purpose::Annotation, &format!("gap/{n}"));
            let left = Drawing::of(&all, Side::Left).blurred(&parameters, &mut s);
            let kept = left.len() as f64 / 600.0;
            assert!((0.54..0.96).contains(&kept), "{kept}");
            for (p, _) in &left {
                let near = all
                    .iter()
                    .map(|(q, _)| (p - q).norm())
                    .fold(f64::MAX, f64::min);
                assert!(near < 1e-9);
            }
            // What was erased are runs of neighbours: at most three.
            let mut places: Vec<i64> = left
                .iter()
                .map(|(p, _)| ((p.x - 300.0) / 0.866).round() as i64)
                .collect();
            places.sort_unstable();
            let holes = places.windows(2).filter(|w| w[1] - w[0] > 1).count();
            assert!(holes <= 3);
        }
    }

    #[test]
    fn corners_move_by_the_given_deviation_and_the_middle_by_half() {
        let parameters = AnnotationParameters {
            gaps: [0, 0],
            ..Default::default()
        };
        // A band, so that the box has four corners.
        let band: Vec<(Pixel, Crossing)> = straight()
            .into_iter()
            .flat_map(|(p, c)| {
                (0..5).map(move |k| (p + Vector2::new(-5.0, 8.66) * f64::from(k), c))
            })
            .collect();
        let n = 2000;
        let (mut corner, mut middle) = (0.0, 0.0);
        for draw in 0..n {
            let mut s = stream(1, Purpose::Annotation, &format!("corner/{draw}"));
            let moved = Drawing::of(&band, Side::Left).blurred(&parameters, &mut s);
            let shift = |i: usize| (moved[i].0 - band[i].0).norm_squared() / (2.0 * n as f64);
            corner += shift(0);
            middle += 0.5 * (shift(299 * 5 + 2) + shift(300 * 5 + 2));
        }
        // The mean of four independent corners has half their SD.
        assert!((corner.sqrt() - 10.0).abs() < 0.5, "{}", corner.sqrt());
        assert!((middle.sqrt() - 5.0).abs() < 0.25, "{}", middle.sqrt());
    }

    #[test]
    fn mirrored_lines_are_annotated_as_mirror_images() {
        let parameters = AnnotationParameters::default();
        let left = straight();
        let flip = |p: &Pixel| Pixel::new(p.x, 1535.0 - p.y);
        let right: Vec<_> = left.iter().map(|(p, c)| (flip(p), *c)).collect();
        let draw = || stream(1, Purpose::Annotation, "mirror");
        let a = Drawing::of(&left, Side::Left).blurred(&parameters, &mut draw());
        let b = Drawing::of(&right, Side::Right).blurred(&parameters, &mut draw());
        assert_eq!(a.len(), b.len());
        for ((p, _), (q, _)) in a.iter().zip(&b) {
            assert!((p - flip(q)).norm() < 1e-6);
        }
    }
}
