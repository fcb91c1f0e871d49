//! A body's build: sex, proportions and how it lies on the table.

use super::PhantomParameters;
use crate::geometry::{Point, Rigid, Vector};
use crate::random::{Purpose, Stream, stream};
use nalgebra::{Translation3, UnitQuaternion};
use rand::RngExt;
use rand_distr::StandardNormal;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sex {
    Male,
    Female,
}

impl Sex {
    pub fn name(self) -> &'static str {
        match self {
            Self::Male => "male",
            Self::Female => "female",
        }
    }
}

/// A normal draw cut at two standard deviations: bodies vary, but none is a freak whose bones
/// run into each other.
pub(super) fn cut_normal(stream: &mut Stream) -> f64 {
    loop {
        let z: f64 = stream.sample(StandardNormal);
        if z.abs() <= 2.0 {
            return z;
        }
    }
}

/// Draws for one side of a body. Both sides start the same `common` stream and make the same
/// draws, so that what they share is equal without being stored; `own` is the side's.
#[derive(Debug)]
pub(super) struct Draws {
    common: Stream,
    own: Stream,
    asymmetry: f64,
    scale: [f64; 3],
}

/// Share of a quantity's spread by which the two sides of one body differ.
const SIDE_SHARE: f64 = 0.35;

impl Draws {
    pub fn new(parameters: &PhantomParameters, part: &str, own: &str, scale: [f64; 3]) -> Self {
        let seed = parameters.seed;
        Self {
            common: stream(seed, Purpose::PhantomShape, &format!("{part}/common")),
            own: stream(seed, Purpose::PhantomShape, &format!("{part}/{own}")),
            asymmetry: parameters.asymmetry,
            scale,
        }
    }

    fn spread(&mut self) -> f64 {
        let (c, o) = (cut_normal(&mut self.common), cut_normal(&mut self.own));
        c + SIDE_SHARE * self.asymmetry * o
    }

    /// A quantity with this mean and standard deviation.
    pub fn value(&mut self, mean: f64, sd: f64) -> f64 {
        mean + sd * self.spread()
    }

    /// A quantity between the bounds, uniform over bodies.
    pub fn between(&mut self, range: [f64; 2]) -> f64 {
        let t: f64 = self.common.random();
        let o = 0.1 * self.asymmetry * cut_normal(&mut self.own);
        range[0] + (range[1] - range[0]) * (t + o).clamp(0.0, 1.0)
    }

    /// A point of the template, in this body's proportions and displaced by about `sd` mm.
    pub fn place(&mut self, template: [f64; 3], sd: f64) -> Point {
        Point::from(std::array::from_fn::<f64, 3, _>(|a| {
            template[a] * self.scale[a] + sd * self.spread()
        }))
    }
}

/// Proportions and pose of one body. The *pelvic frame* has its origin midway between the
/// femoral heads, x to the left, y posterior and z superior, with both ASIS and both pubic
/// tubercles in one coronal plane; a *side frame* is the pelvic frame with x lateral.
#[derive(Clone, Debug)]
pub(super) struct Build {
    pub sex: Sex,
    /// This body's proportions along x, y, z of the pelvic frame, as factors of the template.
    pub scale: [f64; 3],
    /// Factor of the template's radii and thicknesses.
    pub girth: f64,
    /// Radius of the femoral heads in mm.
    pub head_radius: f64,
    /// Gap between head and acetabulum in mm.
    pub joint_space: f64,
    /// Factor of the cortex' thickness.
    pub cortex: f64,
    /// Factor of the density of trabecular bone.
    pub density: f64,
    /// Thickness of the subcutaneous fat in mm, at the flank.
    pub fat: f64,
    /// Maps the pelvic frame to the world.
    pub world_from_pelvis: Rigid,
}

impl Build {
    pub fn draw(number: u32, parameters: &PhantomParameters) -> Self {
        let mut s = stream(
            parameters.seed,
            Purpose::PhantomShape,
            &format!("phantom-{number}/build"),
        );
        // Every third body is a woman: the first six are the paper's four men and two women.
        let sex = if number.is_multiple_of(3) {
            Sex::Female
        } else {
            Sex::Male
        };
        let mut normal = |mean: f64, sd: f64| mean + sd * cut_normal(&mut s);
        let size = normal(0.0, 0.022);
        let (x, y, z, radius, girth) = match sex {
            Sex::Male => (1.045, 1.0, 1.02, 24.6, 1.0),
            Sex::Female => (1.02, 1.01, 0.955, 22.6, 0.9),
        };
        let scale = [
            x + size + normal(0.0, 0.008),
            y + size + normal(0.0, 0.02),
            z + size + normal(0.0, 0.015),
        ];
        let head_radius = (radius * (1.0 + size) + normal(0.0, 0.5)).clamp(22.0, 26.5);
        let girth = girth + size + normal(0.0, 0.025);
        let cortex = normal(1.0, 0.12);
        let density = normal(1.0, 0.12);
        let fat = normal(if sex == Sex::Female { 26.0 } else { 19.0 }, 4.0);
        let tilt = normal(0.0, parameters.tilt_sd_deg).to_radians();
        let roll = normal(0.0, parameters.table_rotation_sd_deg).to_radians();
        let yaw = normal(0.0, parameters.table_rotation_sd_deg).to_radians();
        let rotation = UnitQuaternion::from_axis_angle(&Vector::z_axis(), roll)
            * UnitQuaternion::from_axis_angle(&Vector::y_axis(), yaw)
            * UnitQuaternion::from_axis_angle(&Vector::x_axis(), tilt);
        let at = Vector::new(normal(6.0, 8.0), normal(-187.0, 10.0), normal(-742.0, 60.0));
        let [low, high] = parameters.joint_space_mm;
        let joint_space = low + (high - low) * s.random::<f64>();
        Self {
            sex,
            scale,
            girth,
            head_radius,
            joint_space,
            cortex,
            density,
            fat,
            world_from_pelvis: Rigid::from_parts(Translation3::from(at), rotation),
        }
    }
}
