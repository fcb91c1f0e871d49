//! All bones of one body in its pelvic frame, with a coarse map of distances that tells where
//! the exact ones are needed.

use super::PhantomParameters;
use super::build::{Build, Draws};
use super::distance::meet;
use super::femur::Femur;
use super::hip_bone::HipBone;
use super::sacrum::{Sacrum, Spine};
use crate::anatomy::Side;
use crate::geometry::{Point, Vector};
use rayon::prelude::*;

/// Half the width of the sacroiliac joints in mm, on the sacrum's side.
const SACROILIAC_MM: f64 = 1.6;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bone {
    Hip(Side),
    Femur(Side),
    Sacrum,
    Spine,
}

impl Bone {
    pub const ALL: [Self; 6] = [
        Self::Hip(Side::Left),
        Self::Hip(Side::Right),
        Self::Femur(Side::Left),
        Self::Femur(Side::Right),
        Self::Sacrum,
        Self::Spine,
    ];

    /// A box (template, mm) that holds the bone with room around it.
    fn bounds(self) -> ([f64; 3], [f64; 3]) {
        let sided = |side: Side, lateral: [f64; 2], low: [f64; 2], high: [f64; 2]| {
            let s = side.lateral_sign();
            let (a, b) = (s * lateral[0], s * lateral[1]);
            ([a.min(b), low[0], low[1]], [a.max(b), high[0], high[1]])
        };
        match self {
            Self::Hip(side) => sided(side, [-12.0, 168.0], [-82.0, -92.0], [128.0, 172.0]),
            Self::Femur(side) => sided(side, [35.0, 185.0], [-75.0, -215.0], [105.0, 42.0]),
            Self::Sacrum => ([-85.0, -2.0, -28.0], [85.0, 135.0, 145.0]),
            Self::Spine => ([-75.0, -45.0, 85.0], [75.0, 130.0, 260.0]),
        }
    }
}

/// `p` of the pelvic frame in a side's frame, and back.
pub(super) fn sided(p: &Point, side: Side) -> Point {
    Point::new(side.lateral_sign() * p.x, p.y, p.z)
}

#[derive(Debug)]
pub(super) struct Skeleton {
    pub build: Build,
    pub hips: [HipBone; 2],
    pub femora: [Femur; 2],
    pub sacrum: Sacrum,
    pub spine: Spine,
    maps: Vec<CoarseMap>,
}

impl Skeleton {
    pub fn draw(number: u32, parameters: &PhantomParameters) -> Self {
        let build = Build::draw(number, parameters);
        let draws = |part: &str, own: &str| {
            let part = format!("phantom-{number}/{part}");
            Draws::new(parameters, &part, own, build.scale)
        };
        let down = build.world_from_pelvis.rotation.inverse() * -Vector::z();
        let hips = Side::BOTH.map(|side| {
            let mut d = draws("hip", side.name());
            let lce = d.between(parameters.center_edge_deg).to_radians();
            HipBone::new(&build, &mut d, lce)
        });
        let femora = Side::BOTH.map(|side| {
            let head = hips[side.index()].acetabulum.center;
            let down = Vector::new(side.lateral_sign() * down.x, down.y, down.z);
            Femur::new(&build, &mut draws("femur", side.name()), head, &down)
        });
        let mut middle = draws("sacrum", "middle");
        let sacrum = Sacrum::new(&build, &mut middle);
        let spine = Spine::new(&build, &mut middle, &sacrum);
        let mut skeleton = Self {
            build,
            hips,
            femora,
            sacrum,
            spine,
            maps: Vec::new(),
        };
        skeleton.maps = Bone::ALL
            .iter()
            .map(|&bone| CoarseMap::new(bone, &skeleton))
            .collect();
        skeleton
    }

    /// Exact signed distance to one bone.
    pub fn exact(&self, bone: Bone, p: &Point) -> f64 {
        match bone {
            Bone::Hip(side) => self.hips[side.index()].distance(&sided(p, side)),
            Bone::Femur(side) => self.femora[side.index()].distance(&sided(p, side)),
            Bone::Sacrum => {
                let d = self.sacrum.distance(p);
                if d > 12.0 {
                    return d;
                }
                let hips = Side::BOTH.map(|side| self.exact(Bone::Hip(side), p));
                meet(d, SACROILIAC_MM - hips[0].min(hips[1]), 1.5)
            }
            Bone::Spine => self.spine.distance(p),
        }
    }

    /// Signed distance to one bone, exact near its surface and to about a millimetre elsewhere.
    pub fn distance(&self, bone: Bone, p: &Point) -> f64 {
        let index = Bone::ALL.iter().position(|&b| b == bone);
        let map = &self.maps[index.expect("ALL holds every bone")];
        let rough = map.at(p);
        if rough.abs() < CoarseMap::DOUBT_MM {
            self.exact(bone, p)
        } else {
            rough
        }
    }
}

/// Distances on a coarse grid over a bone's box.
#[derive(Debug)]
struct CoarseMap {
    origin: Point,
    dims: [usize; 3],
    values: Vec<f32>,
}

impl CoarseMap {
    const CELL_MM: f64 = 5.0;
    /// Where interpolation gives less than this, the surface may be near. A distance changes by
    /// at most sqrt(3)/2 cells = 4.3 mm from a cell's middle to its corners.
    const DOUBT_MM: f64 = 6.5;
    /// Returned outside the box, where no bone is.
    const FAR_MM: f64 = 40.0;

    fn new(bone: Bone, skeleton: &Skeleton) -> Self {
        let (low, high) = bone.bounds();
        let scale = skeleton.build.scale;
        let origin = Point::from(std::array::from_fn::<f64, 3, _>(|a| low[a] * scale[a]));
        let dims: [usize; 3] = std::array::from_fn(|a| {
            ((high[a] - low[a]) * scale[a] / Self::CELL_MM).ceil() as usize + 1
        });
        let slice = dims[0] * dims[1];
        let mut values = vec![0f32; slice * dims[2]];
        values
            .par_chunks_mut(slice)
            .enumerate()
            .for_each(|(k, chunk)| {
                for (n, value) in chunk.iter_mut().enumerate() {
                    let index = [n % dims[0], n / dims[0], k];
                    let offset = Vector::from(index.map(|i| i as f64 * Self::CELL_MM));
                    *value = skeleton.exact(bone, &(origin + offset)) as f32;
                }
            });
        Self {
            origin,
            dims,
            values,
        }
    }

    fn at(&self, p: &Point) -> f64 {
        let mut base = [0; 3];
        let mut f = [0.0; 3];
        for a in 0..3 {
            let x = (p[a] - self.origin[a]) / Self::CELL_MM;
            if !(x >= 0.0 && x < (self.dims[a] - 1) as f64) {
                return Self::FAR_MM;
            }
            base[a] = x as usize;
            f[a] = x - base[a] as f64;
        }
        let row = |j: usize, k: usize| {
            let start = ((base[2] + k) * self.dims[1] + base[1] + j) * self.dims[0] + base[0];
            let (a, b) = (
                f64::from(self.values[start]),
                f64::from(self.values[start + 1]),
            );
            a + (b - a) * f[0]
        };
        let (near, far) = (
            row(0, 0) + (row(1, 0) - row(0, 0)) * f[1],
            row(0, 1) + (row(1, 1) - row(0, 1)) * f[1],
        );
        near + (far - near) * f[2]
    }
}
