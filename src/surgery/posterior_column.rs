//! The posterior column: its border between sciatic notch and ischium, and whether a surgery leaves
//! it whole.

use super::acetabulum::Acetabulum;
use super::fragment::{Carving, midline};
use super::site::OsteotomySite;
use super::{Cut, CutPlanes};
use crate::anatomy::frame::FrameError;
use crate::anatomy::{Hip, Label};
use crate::geometry::{Point, Vector};
use crate::volume::components::components;
use crate::volume::{Grid, Volume, morphology};

/// Part of each axial slice that is looked at, in mm from the femoral head: medial, lateral,
/// backward, forward.
const SLICE_MM: [f64; 4] = [70.0, 50.0, 110.0, 60.0];
/// Distance in mm of slices, and of the points in them.
const STEP_MM: f64 = 1.0;
/// How far behind its frontmost point (mm) the border lies where the notch has ended: above its
/// roof the ilium reaches back to the sacrum. The ischial spine stands out less.
const NOTCH_DEPTH_MM: f64 = 25.0;
/// Height in mm above the acetabulum's lowest point up to which the notch is looked for.
const SEARCH_MM: f64 = 130.0;

/// Connected bone of a slice up to this area (mm^2) is a crumb and not the posterior column.
const CRUMB_MM2: f64 = 100.0;
/// Where the bone of a slice falls into pieces in the next, the least share of a piece that counts.
const SHARE: f64 = 0.25;

/// Why the border is not found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ColumnError {
    #[error(
        "no roof of the sciatic notch of {hip} within {SEARCH_MM} mm above the acetabulum's lowest point (the back of the bone there lies at {last_mm:.0} mm); check the rim, the landmarks ASIS and IPS and the label map, or give this hip's cuts by hand"
    )]
    NoNotch { hip: String, last_mm: f64 },
    #[error(
        "no pelvis behind the femoral head of {hip} at a height of {height_mm:.1} mm above its centre; check that the label map holds the pelvis as 1"
    )]
    NoBone { hip: String, height_mm: f64 },
}

/// The posterior column seen from the side: points of the sagittal plane through the femoral head
/// (x = 0 in the APP).
#[derive(Clone, Debug)]
pub struct PosteriorColumn {
    /// Its hindmost points from the level of the acetabulum's lowest point up to the roof of the
    /// greater sciatic notch, in steps of 1 mm.
    pub border: Vec<Vector>,
}

impl PosteriorColumn {
    /// Finds the border in axial slices, each from the bone of the slice before: from the posterior
    /// wall of the acetabulum down to the acetabulum's lowest point, and up to the roof of the notch.
    /// Where the bone falls into pieces the hindmost one counts: the anterior column is not it, nor
    /// are the horns of the articular surface, which hang down beside the ischium. The sacrum is
    /// connected with neither below the roof.
    ///
    /// The landmark GSN is not asked: people place it anywhere on the notch's front edge.
    ///
    /// # Errors
    /// When there is no bone at the level of the acetabulum, or the notch has no roof.
    pub fn of(hip: &Hip, acetabulum: &Acetabulum) -> Result<Self, ColumnError> {
        let no_bone = |height_mm: f64| ColumnError::NoBone {
            hip: hip.key(),
            height_mm,
        };
        let mut wall = Point::origin();
        for p in &acetabulum.rim {
            if p.z < wall.z {
                wall = *p;
            }
        }
        let start = Slice::of(hip, wall.y).nearest_to(&wall);
        let start = start.ok_or_else(|| no_bone(wall.y))?;

        let mut below = Vec::new();
        let mut slice = start.clone();
        for n in 1..=((wall.y - acetabulum.lowest()) / STEP_MM) as usize {
            let y = wall.y - n as f64 * STEP_MM;
            slice = Slice::of(hip, y)
                .next_to(&slice)
                .ok_or_else(|| no_bone(y))?;
            below.push(Vector::new(0.0, y, slice.hindmost()));
        }
        let mut border: Vec<Vector> = below.into_iter().rev().collect();

        let mut frontmost = border.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        slice = start;
        let mut y = wall.y;
        while slice.hindmost() >= frontmost - NOTCH_DEPTH_MM {
            frontmost = frontmost.max(slice.hindmost());
            border.push(Vector::new(0.0, y, slice.hindmost()));
            let height_mm = border.len() as f64 * STEP_MM;
            y += STEP_MM;
            slice = Slice::of(hip, y)
                .next_to(&slice)
                .ok_or_else(|| no_bone(y))?;
            if height_mm > SEARCH_MM {
                return Err(ColumnError::NoNotch {
                    hip: hip.key(),
                    last_mm: slice.hindmost(),
                });
            }
        }
        Ok(Self { border })
    }

    /// The roof of the notch.
    pub fn roof(&self) -> Vector {
        *self.border.last().expect("a border is never empty")
    }
}

/// Bone of one axial slice, on a grid whose i runs laterally and whose j runs forward.
#[derive(Clone)]
struct Slice {
    bone: Volume<bool>,
    lateral_sign: f64,
}

impl Slice {
    /// All pelvis of the slice at height `y`.
    fn of(hip: &Hip, y: f64) -> Self {
        let [medial, lateral, backward, forward] = SLICE_MM;
        let lateral_sign = hip.side.lateral_sign();
        let points = |reach: f64| (reach / STEP_MM) as usize + 1;
        let dims = [points(medial + lateral), points(backward + forward), 1];
        let grid = Grid::axis_aligned(dims, STEP_MM, Point::new(-medial, -backward, 0.0));
        let volume_from_app = hip.app_from_volume.inverse();
        let labels = &hip.specimen.labels;
        let is_bone = |offset| {
            let p = grid.center(grid.voxel(offset));
            let in_volume = volume_from_app * Point::new(p.x * lateral_sign, y, p.y);
            labels.nearest(&in_volume) == Some(Label::Pelvis.value())
        };
        let data = (0..grid.len()).map(is_bone).collect();
        Self {
            bone: Volume::new(grid, data),
            lateral_sign,
        }
    }

    /// Only the connected bone that comes nearest to a point, crumbs aside.
    fn nearest_to(self, p: &Point) -> Option<Self> {
        let pieces = components(&self.bone);
        let grid = &self.bone.grid;
        let seed = Point::new(p.x * self.lateral_sign, p.z, 0.0);
        let mut nearest: Option<(f64, u32)> = None;
        for (offset, &piece) in pieces.labels.data.iter().enumerate() {
            if piece != 0 && pieces.sizes[piece as usize - 1] as f64 * STEP_MM * STEP_MM > CRUMB_MM2
            {
                let distance = (grid.center(grid.voxel(offset)) - seed).norm_squared();
                if nearest.is_none_or(|(best, _)| distance < best) {
                    nearest = Some((distance, piece));
                }
            }
        }
        let (_, nearest) = nearest?;
        Some(self.only(&pieces.labels, nearest))
    }

    /// Only the hindmost connected bone of those that lie over or under the bone of the slice
    /// before, with at least [`SHARE`] of what the largest of them shares with it.
    fn next_to(self, before: &Self) -> Option<Self> {
        let pieces = components(&self.bone);
        let mut shared = vec![0_usize; pieces.sizes.len()];
        for (&piece, &bone) in pieces.labels.data.iter().zip(&before.bone.data) {
            if piece != 0 && bone {
                shared[piece as usize - 1] += 1;
            }
        }
        let most = shared.iter().copied().max().filter(|&n| n > 0)? as f64;
        // Rows are ordered from behind, so the first voxel of any of them is the hindmost.
        let enough =
            |&&piece: &&u32| piece != 0 && shared[piece as usize - 1] as f64 >= SHARE * most;
        let hindmost = *pieces.labels.data.iter().find(enough)?;
        Some(self.only(&pieces.labels, hindmost))
    }

    fn only(&self, pieces: &Volume<u32>, piece: u32) -> Self {
        Self {
            bone: pieces.map(|p| p == piece),
            lateral_sign: self.lateral_sign,
        }
    }

    /// The smallest z of its bone, of which there must be some.
    fn hindmost(&self) -> f64 {
        let (min, _) = self.bone.bounds(|b| b).expect("a slice holds bone");
        self.bone.grid.center(min).y
    }
}

/// How far above the notch's roof and below the acetabulum (mm) bone has to be connected.
const BEYOND_MM: f64 = 10.0;

/// True if bone at least `column_mm` thick still connects the ischium (below the acetabulum) with the
/// ilium (above the notch) behind the posterior cut.
///
/// Counted is bone of this side, behind the head's frontal plane, that lies outside of the ilium,
/// ischium or posterior cut: neither the way round by the pubic rami nor a strip that the pubis cut
/// leaves medial of the acetabulum makes a posterior column.
pub(super) fn column_holds(
    hip: &Hip,
    site: &OsteotomySite,
    cuts: &CutPlanes,
    carving: &Carving,
    column_mm: f64,
) -> Result<bool, FrameError> {
    let ischium_y = site.acetabulum.lowest() - BEYOND_MM;
    let ilium_y = site.column.roof().y + BEYOND_MM;
    let midline = midline(hip)?;
    let [_, lateral, backward, _] = SLICE_MM;
    let sign = hip.side.lateral_sign();
    let corners = [
        Point::new(midline, ischium_y - BEYOND_MM, -backward),
        Point::new(lateral * sign, ilium_y + BEYOND_MM, 0.0),
    ];
    let labels = &hip.specimen.labels;
    let Some((min, max)) = box_in_grid(hip, &labels.grid, &corners) else {
        return Ok(false);
    };
    let mut bone = labels.cropped(min, max).map(|l| l == Label::Pelvis.value());
    let grid = bone.grid.clone();
    for &offset in carving.fragment.iter().chain(&carving.cut) {
        let voxel = labels.grid.voxel(offset);
        if (0..3).all(|a| (min[a]..=max[a]).contains(&voxel[a])) {
            let [i, j, k] = std::array::from_fn(|a| voxel[a] - min[a]);
            bone.data[grid.offset(i, j, k)] = false;
        }
    }
    let position = |offset: usize| hip.app_from_volume * grid.center(grid.voxel(offset));
    let around = [Cut::Ilium, Cut::Ischium, Cut::Posterior].map(|cut| *cuts.get(cut));
    for offset in 0..bone.data.len() {
        if bone.data[offset] {
            let p = position(offset);
            bone.data[offset] = p.z < 0.0
                && (p.x - midline) * sign > 0.0
                && around.iter().any(|plane| plane.signed_distance(&p) > 0.0);
        }
    }
    let pieces = components(&morphology::erode(&bone, 0.5 * column_mm));
    let mut reaches = vec![(false, false); pieces.sizes.len()];
    for (offset, &piece) in pieces.labels.data.iter().enumerate() {
        if piece != 0 {
            let y = position(offset).y;
            let (down, up) = &mut reaches[piece as usize - 1];
            *down |= y < ischium_y;
            *up |= y > ilium_y;
        }
    }
    Ok(reaches.contains(&(true, true)))
}

/// The voxels (min, max, both included) of a grid that a box of the APP, given by two opposite
/// corners, touches; `None` if it touches none.
fn box_in_grid(hip: &Hip, grid: &Grid, corners: &[Point; 2]) -> Option<([usize; 3], [usize; 3])> {
    let volume_from_app = hip.app_from_volume.inverse();
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for n in 0..8 {
        let corner = Point::from(Vector::from_fn(|a, _| corners[n >> a & 1][a]));
        let index = grid.index(&(volume_from_app * corner));
        for a in 0..3 {
            low[a] = low[a].min(index[a]);
            high[a] = high[a].max(index[a]);
        }
    }
    let last = |a: usize| grid.dims[a] as f64 - 1.0;
    let touches = (0..3).all(|a| high[a] >= 0.0 && low[a] <= last(a));
    touches.then(|| {
        (
            std::array::from_fn(|a| low[a].clamp(0.0, last(a)).floor() as usize),
            std::array::from_fn(|a| high[a].clamp(0.0, last(a)).ceil() as usize),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;
    use crate::geometry::Plane;
    use crate::surgery::block_hip::{BORDER_MM, VOXEL_MM, block_hip, block_hip_without};
    use crate::surgery::fragment::{FragmentParameters, carve};
    use crate::surgery::nominal_cuts::{NominalCutParameters, nominal_cuts};

    #[test]
    fn the_border_is_the_back_of_the_column() {
        for side in Side::BOTH {
            let hip = block_hip(side);
            let site = OsteotomySite::of(&hip).unwrap();
            for p in &site.column.border {
                assert!((p.z - BORDER_MM).abs() <= VOXEL_MM, "{side} {p}");
            }
            // The wing's border steps back at 40 mm.
            let top = site.column.roof().y;
            assert!((top - 40.0).abs() <= 1.0 + 0.5 * VOXEL_MM, "{side} {top}");
        }
    }

    #[test]
    fn bone_behind_a_gap_is_not_the_border() {
        // What is left behind the gap stands for the sacrum.
        let hip = block_hip_without(Side::Left, |_, y, z| {
            y < 40.0 && (-45.0..=-40.0).contains(&z)
        });
        let column = OsteotomySite::of(&hip).unwrap().column;
        let behind = |p: &Vector| (p.z + 40.0).abs() > 2.0 * VOXEL_MM;
        assert!(!column.border.iter().any(behind), "{:?}", column.border);
    }

    /// As a horn of the articular surface does on some people.
    #[test]
    fn a_horn_beside_the_ischium_is_not_the_border() {
        for side in Side::BOTH {
            let mut hip = block_hip(side);
            let mut specimen = (*hip.specimen).clone();
            let grid = specimen.labels.grid.clone();
            for offset in 0..grid.len() {
                let p = hip.app_from_volume * grid.center(grid.voxel(offset));
                let u = p.x * side.lateral_sign();
                let beside = (7.5..11.0).contains(&u) && (-31.0..-19.0).contains(&p.y);
                if beside && (-30.0..-22.0).contains(&p.z) {
                    specimen.labels.data[offset] = Label::Pelvis.value();
                }
            }
            hip.specimen = std::sync::Arc::new(specimen);
            let column = OsteotomySite::of(&hip).unwrap().column;
            let astray = |p: &Vector| (p.z - BORDER_MM).abs() > VOXEL_MM;
            assert!(!column.border.iter().any(astray), "{:?}", column.border);
        }
    }

    #[test]
    fn a_pelvis_without_a_notch_is_refused() {
        // Nothing is left above the level at which the wing steps back.
        let hip = block_hip_without(Side::Left, |_, y, _| y > 40.0);
        let error = OsteotomySite::of(&hip).unwrap_err().to_string();
        assert!(
            error.contains("no pelvis behind the femoral head"),
            "{error}"
        );
        // The wing ends in front of the column's border.
        let hip = block_hip_without(Side::Left, |_, y, z| y > 40.0 && z < -50.0);
        let error = OsteotomySite::of(&hip).unwrap_err().to_string();
        assert!(error.contains("no roof of the sciatic notch"), "{error}");
    }

    fn holds(hip: &Hip, posterior_mm: f64, column_mm: f64) -> bool {
        let site = OsteotomySite::of(&block_hip(hip.side)).unwrap();
        let whole = block_hip(hip.side);
        let nominal = nominal_cuts(&whole, &NominalCutParameters::default()).unwrap();
        let plane = Plane {
            normal: -Vector::z(),
            offset_mm: posterior_mm,
        };
        let cuts = nominal.with(Cut::Posterior, plane);
        let carving = carve(hip, &cuts, &FragmentParameters::default()).unwrap();
        column_holds(hip, &site, &cuts, &carving, column_mm).unwrap()
    }

    #[test]
    fn the_column_holds_as_long_as_it_is_thick_enough() {
        for side in Side::BOTH {
            let hip = block_hip(side);
            // 12 and 5 mm are left behind the cut.
            assert!(holds(&hip, -BORDER_MM - 12.0, 4.0), "{side}");
            assert!(!holds(&hip, -BORDER_MM - 5.0, 10.0), "{side}");
            assert!(holds(&hip, -BORDER_MM - 12.0, 8.0), "{side}");
            assert!(!holds(&hip, -BORDER_MM + 2.0, 0.0), "{side}: cut through");
        }
    }

    #[test]
    fn the_way_round_by_the_pubis_is_no_column() {
        // A gap across the column below the ilium cut; ischium and ilium still hang together by
        // the rami and the symphysis.
        let hip = block_hip_without(Side::Left, |_, y, z| (0.0..6.0).contains(&y) && z < -36.0);
        assert!(!holds(&hip, -BORDER_MM - 12.0, 4.0));
    }
}
