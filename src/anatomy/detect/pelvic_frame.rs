//! The frame of a pelvis that lies face down on a table: patients lie rotated in the scanner, and
//! every later rule speaks of "anterior" and "superior".

use super::spot::tip;
use super::{BoneSurfaces, DetectError, local::Local};
use crate::anatomy::Side;
use crate::geometry::{Point, Vector};
use crate::volume::Surface;
use nalgebra::Rotation3;

/// Each round changes directions by about a tenth of the round before.
const MAX_ROUNDS: usize = 30;

/// Directions that change by less have settled (rad): by then a landmark moves by less than its last digits.
const SETTLED: f64 = 1e-11;

/// The pubic bones' foremost points lie within this part of the distance between both hip bones' centres
/// from the midline; spines of the ilium lie farther out. Without it, a pelvis seen from above (flexed
/// hips) offers its iliac spines as the foremost points of its lower half.
const PUBIS: f64 = 0.375;

/// Directions of the pelvis, and the points that define them.
#[derive(Clone, Debug)]
pub(super) struct PelvicFrame {
    /// World directions: to the patient's left, superior, anterior.
    axes: [Vector; 3],
    /// The most anterior point of each ilium, by [`Side::index`].
    pub ilium: [Point; 2],
    /// The most anterior point of each pubic bone, by [`Side::index`].
    pub pubis: [Point; 2],
}

impl PelvicFrame {
    /// Distance of the two iliac points in mm: the size that regions scale with.
    pub fn width(&self) -> f64 {
        (self.ilium[0] - self.ilium[1]).norm()
    }

    /// The same pelvis in turned directions.
    pub fn turned(&self, turn: &Rotation3<f64>) -> Self {
        Self {
            axes: self.axes.map(|axis| turn * axis),
            ..self.clone()
        }
    }

    /// World directions: to the patient's left, superior, anterior.
    pub fn axes(&self) -> [Vector; 3] {
        self.axes
    }

    /// The frame of one side.
    pub fn local(&self, side: Side, origin: Point) -> Local {
        let [left, superior, anterior] = self.axes;
        Local {
            origin,
            axes: [left * side.lateral_sign(), superior, anterior],
        }
    }
}

/// The plane on which the pelvis rests face down: through the most anterior points of both ilia
/// and the midpoint of those of the pubic bones. "Anterior" is that plane's normal, so the points
/// are searched again in the frame they define until they stay.
pub(super) fn pelvic_frame(bones: &BoneSurfaces) -> Result<PelvicFrame, DetectError> {
    let [left, right] = Side::BOTH.map(|side| mean(bones.hip(side)));
    let feet = nalgebra::center(
        &mean(bones.femur(Side::Left)),
        &mean(bones.femur(Side::Right)),
    );
    let apart_mm = (left - right).norm();
    if left.x < right.x {
        return Err(DetectError::SidesSwapped {
            apart_mm: right.x - left.x,
        });
    }
    let no_axis = || DetectError::NoAxis { apart_mm };
    let mut axes = axes(&left, &right, &feet).ok_or_else(no_axis)?;
    for _ in 0..MAX_ROUNDS {
        let middle = nalgebra::center(&left, &right);
        let medial = |p: &Point| (p - middle).dot(&axes[0]).abs() < PUBIS * apart_mm;
        let ends = Side::BOTH.map(|side| foremost(bones.hip(side), &axes, &medial));
        let frame = PelvicFrame {
            axes,
            ilium: ends.map(|e| e.0),
            pubis: ends.map(|e| e.1),
        };
        let [l, r] = frame.ilium;
        let pubis = nalgebra::center(&frame.pubis[0], &frame.pubis[1]);
        let next = self::axes(&l, &r, &pubis).ok_or_else(no_axis)?;
        if (0..3).all(|n| (next[n] - axes[n]).norm() < SETTLED) {
            return Ok(frame);
        }
        axes = next;
    }
    Err(DetectError::FrameUnsettled(MAX_ROUNDS))
}

/// Left, superior and anterior, from two points left and right and one below them.
fn axes(left: &Point, right: &Point, below: &Point) -> Option<[Vector; 3]> {
    let x = (left - right).try_normalize(1.0)?;
    let up = nalgebra::center(left, right) - below;
    let y = (up - x * up.dot(&x)).try_normalize(1.0)?;
    Some([x, y, x.cross(&y)])
}

fn mean(surface: &Surface) -> Point {
    let sum: Vector = surface.vertices().iter().map(|p| p.coords).sum();
    Point::from(sum / surface.vertices().len() as f64)
}

/// The most anterior tip of a hip bone's upper half, and of the medial part of its lower half.
fn foremost(
    hip: &Surface,
    [_, superior, anterior]: &[Vector; 3],
    medial: &dyn Fn(&Point) -> bool,
) -> (Point, Point) {
    let height = |p: &Point| p.coords.dot(superior);
    let (mut low, mut high) = (f64::MAX, f64::MIN);
    for p in hip.vertices() {
        low = low.min(height(p));
        high = high.max(height(p));
    }
    let middle = (low + high) / 2.0;
    let best = |upper: bool| {
        let half = |p: &Point| (height(p) > middle) == upper && (upper || medial(p));
        tip(hip, anterior, half).map_or(hip.vertices()[0], |tip| tip.spot.point)
    };
    (best(true), best(false))
}
