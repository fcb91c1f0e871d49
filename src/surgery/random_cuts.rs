//! Random perturbations of the nominal cuts.

use super::fragment::{FragmentError, FragmentParameters, carve};
use super::ranges::out_of_range;
use super::{Cut, CutPlanes};
use crate::anatomy::{Hip, Side};
use crate::geometry::{Plane, Point, Vector};
use crate::random::Stream;
use nalgebra::{Unit, UnitQuaternion};
use rand_distr::{Distribution, StandardNormal, UnitSphere};
use serde::{Deserialize, Serialize};

/// How far one cut is moved at random.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CutSpread {
    /// Standard deviation of the normal's rotation angle, in degrees.
    pub rotation_sd_deg: f64,
    /// Standard deviation of the shift along the normal, in mm.
    pub shift_sd_mm: f64,
}

/// How far the cuts are moved at random: the defaults of the authors' program (facts 2.13), normal
/// distributions as in their study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RandomCutParameters {
    /// 12.5 deg, 7.5 mm.
    pub ilium: CutSpread,
    /// 15 deg, 7.5 mm.
    pub ischium: CutSpread,
    /// 15 deg, 7.5 mm.
    pub posterior: CutSpread,
    /// 30 deg, 10 mm.
    pub pubis: CutSpread,
}

impl Default for RandomCutParameters {
    fn default() -> Self {
        let spread = |rotation_sd_deg, shift_sd_mm| CutSpread {
            rotation_sd_deg,
            shift_sd_mm,
        };
        Self {
            ilium: spread(12.5, 7.5),
            ischium: spread(15.0, 7.5),
            posterior: spread(15.0, 7.5),
            pubis: spread(30.0, 10.0),
        }
    }
}

impl RandomCutParameters {
    /// The spread of one cut.
    pub fn spread(&self, cut: Cut) -> CutSpread {
        match cut {
            Cut::Ilium => self.ilium,
            Cut::Ischium => self.ischium,
            Cut::Posterior => self.posterior,
            Cut::Pubis => self.pubis,
        }
    }

    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let of_one = |cut: Cut| {
            let spread = self.spread(cut);
            out_of_range(&[
                (
                    "rotation_sd_deg",
                    spread.rotation_sd_deg,
                    0.0..=90.0,
                    " deg",
                ),
                ("shift_sd_mm", spread.shift_sd_mm, 0.0..=50.0, " mm"),
            ])
            .into_iter()
            .map(move |(field, message)| (format!("{}.{field}", cut.name()), message))
        };
        Cut::ALL.into_iter().flat_map(of_one).collect()
    }
}

/// The point of each nominal cut that its perturbations turn about: the middle of the bone it
/// cuts, on the plane, in the APP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutPivots {
    points: [Point; 4],
}

impl CutPivots {
    /// Pivots in the order of [`Cut::ALL`].
    pub fn new(points: [Point; 4]) -> Self {
        Self { points }
    }

    /// One pivot.
    pub fn get(&self, cut: Cut) -> &Point {
        &self.points[cut as usize]
    }

    /// The pivots of a hip's nominal cuts: the mean of the candidate voxels (fragment or cut) that
    /// lie less than a voxel's diagonal from the plane, projected on it.
    ///
    /// # Errors
    /// When the nominal cuts give no fragment, or one of them does not touch it.
    pub fn of(
        hip: &Hip,
        nominal: &CutPlanes,
        parameters: &FragmentParameters,
    ) -> Result<Self, FragmentError> {
        let grid = &hip.specimen.labels.grid;
        let diagonal_mm = Vector::from(grid.spacing).norm();
        let carving = carve(hip, nominal, parameters)?;
        let mut points = [Point::origin(); 4];
        for (cut, pivot) in Cut::ALL.into_iter().zip(&mut points) {
            let plane = nominal.get(cut);
            let (mut sum, mut count) = (Vector::zeros(), 0_usize);
            for &offset in carving.cut.iter().chain(&carving.fragment) {
                let p = hip.app_from_volume * grid.center(grid.voxel(offset));
                if plane.signed_distance(&p) > -diagonal_mm {
                    sum += p.coords;
                    count += 1;
                }
            }
            if count == 0 {
                return Err(FragmentError::CutMissesBone {
                    hip: hip.key(),
                    cut,
                });
            }
            *pivot = plane.project(&Point::from(sum / count as f64));
        }
        Ok(Self { points })
    }
}

/// Draws one perturbation of all four cuts (facts 2.13): each normal is turned about an axis drawn
/// uniformly from the sphere by an angle of N(0, SD), then the pivot is moved along the NEW normal
/// by N(0, SD), and the plane passes through it. Normals are turned, never reversed, so they keep
/// pointing out of the fragment as long as the fragment is a plausible one.
///
/// The same stream gives mirrored cuts for mirrored hips: the axis is a pseudo-vector, so on the
/// right its components along IS and AP change sign.
pub fn random_cuts(
    nominal: &CutPlanes,
    pivots: &CutPivots,
    side: Side,
    parameters: &RandomCutParameters,
    stream: &mut Stream,
) -> CutPlanes {
    CutPlanes::new(Cut::ALL.map(|cut| {
        let [x, y, z]: [f64; 3] = UnitSphere.sample(stream);
        let turn: f64 = StandardNormal.sample(stream);
        let shift: f64 = StandardNormal.sample(stream);
        let sign = side.lateral_sign();
        let axis = Unit::new_unchecked(Vector::new(x, y * sign, z * sign));
        let spread = parameters.spread(cut);
        let angle = turn * spread.rotation_sd_deg.to_radians();
        let normal = UnitQuaternion::from_axis_angle(&axis, angle) * nominal.get(cut).normal;
        let moved = pivots.get(cut) + normal * (shift * spread.shift_sd_mm);
        Plane::through(&moved, &normal)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    fn nominal() -> (CutPlanes, CutPivots) {
        let planes = [
            ([0.1, 0.8, -0.5], [5.0, 40.0, -6.0]),
            ([0.0, -1.0, -0.3], [-7.0, -30.0, -10.0]),
            ([0.0, 0.1, -1.0], [-5.0, 0.0, -35.0]),
            ([-1.0, 0.0, 0.0], [-36.0, 5.0, 15.0]),
        ];
        let pivots = planes.map(|(_, p)| Point::from(p));
        let planes = planes.map(|(n, p)| Plane::through(&Point::from(p), &Vector::from(n)));
        (CutPlanes::new(planes), CutPivots::new(pivots))
    }

    fn mirrored(v: Vector) -> Vector {
        Vector::new(-v.x, v.y, v.z)
    }

    #[test]
    fn mirrored_hips_get_mirrored_cuts() {
        let (planes, pivots) = nominal();
        let other_planes = CutPlanes::new(Cut::ALL.map(|cut| Plane {
            normal: mirrored(planes.get(cut).normal),
            ..*planes.get(cut)
        }));
        let other_pivots =
            CutPivots::new(Cut::ALL.map(|cut| mirrored(pivots.get(cut).coords).into()));
        let parameters = RandomCutParameters::default();
        for n in 0..20 {
            let stream = || stream(7, Purpose::Cuts, &format!("{n}"));
            let left = random_cuts(&planes, &pivots, Side::Left, &parameters, &mut stream());
            let right = random_cuts(
                &other_planes,
                &other_pivots,
                Side::Right,
                &parameters,
                &mut stream(),
            );
            for cut in Cut::ALL {
                let (l, r) = (left.get(cut), right.get(cut));
                assert!((mirrored(l.normal) - r.normal).norm() < 1e-12);
                assert!((l.offset_mm - r.offset_mm).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn spreads_follow_their_distributions() {
        let (planes, pivots) = nominal();
        let parameters = RandomCutParameters::default();
        let mut stream = stream(1, Purpose::Cuts, "spread");
        let draws = 20_000;
        let (mut tilt, mut shift, mut sum) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        for _ in 0..draws {
            let cuts = random_cuts(&planes, &pivots, Side::Left, &parameters, &mut stream);
            for cut in Cut::ALL {
                let n = cut as usize;
                let d = cuts.get(cut).signed_distance(pivots.get(cut));
                tilt[n] += 1.0 - cuts.get(cut).normal.dot(&planes.get(cut).normal);
                shift[n] += d * d;
                sum[n] += d;
            }
        }
        for cut in Cut::ALL {
            let spread = parameters.spread(cut);
            let (sd, n) = (spread.rotation_sd_deg.to_radians(), draws as f64);
            // For an axis at the angle a from the normal, cos(tilt) = cos^2 a + sin^2 a cos(turn);
            // sin^2 a has the mean 2/3 over the sphere, cos(turn) the mean exp(-sd^2 / 2).
            let expected = 2.0 / 3.0 * (1.0 - (-0.5 * sd * sd).exp());
            let found = tilt[cut as usize] / n;
            assert!(
                (found / expected - 1.0).abs() < 0.05,
                "{cut:?} {found} {expected}"
            );
            let found = (shift[cut as usize] / n).sqrt();
            assert!(
                (found / spread.shift_sd_mm - 1.0).abs() < 0.02,
                "{cut:?} {found}"
            );
            assert!((sum[cut as usize] / n).abs() < 4.0 * spread.shift_sd_mm / n.sqrt());
        }
    }

    /// A change of these values changes every study.
    #[test]
    fn values_are_pinned() {
        let (planes, pivots) = nominal();
        let mut stream = stream(20190506, Purpose::Cuts, "phantom-1/left/f00");
        let parameters = RandomCutParameters::default();
        let cuts = random_cuts(&planes, &pivots, Side::Left, &parameters, &mut stream);
        let plane = cuts.get(Cut::Pubis);
        let n = plane.normal;
        insta::assert_snapshot!(
            format!("{:.9} {:.9} {:.9} {:.9}", n.x, n.y, n.z, plane.offset_mm),
            @"-0.093516055 0.071799158 0.993025492 6.428263193"
        );
    }

    #[test]
    fn problems_name_the_cut() {
        let mut parameters = RandomCutParameters::default();
        assert!(parameters.problems().is_empty());
        parameters.posterior.shift_sd_mm = -1.0;
        assert_eq!(parameters.problems()[0].0, "posterior.shift_sd_mm");
    }
}
