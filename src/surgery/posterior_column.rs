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
/// Smallest height of the notch's roof above that point, in mm.
const LOWEST_ROOF_MM: f64 = 15.0;

/// Why the border is not found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ColumnError {
    #[error(
        "no roof of the sciatic notch of {hip} between {LOWEST_ROOF_MM} and {SEARCH_MM} mm above the acetabulum's lowest point (the back of the bone there lies at {last_mm:.0} mm); check the rim, the landmarks ASIS and IPS and the label map, or give this hip's cuts by hand"
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
    /// Follows the border upward. In each axial slice the bone that is connected with the posterior
    /// wall of the acetabulum counts: below the notch's roof the sacrum is not.
    ///
    /// The landmark GSN is not asked: people place it anywhere on the notch's front edge.
    ///
    /// # Errors
    /// When there is no bone at the level of the acetabulum, or the notch has no roof.
    pub fn of(hip: &Hip, acetabulum: &Acetabulum) -> Result<Self, ColumnError> {
        let mut wall = Point::origin();
        for p in &acetabulum.rim {
            if p.z < wall.z {
                wall = *p;
            }
        }
        let lowest = acetabulum.lowest();
        let mut border: Vec<Vector> = Vec::new();
        let mut frontmost = f64::NEG_INFINITY;
        for n in 0..=(SEARCH_MM / STEP_MM) as usize {
            let y = lowest + n as f64 * STEP_MM;
            let z = hindmost(hip, y, &wall).ok_or_else(|| ColumnError::NoBone {
                hip: hip.key(),
                height_mm: y,
            })?;
            if z < frontmost - NOTCH_DEPTH_MM {
                break;
            }
            frontmost = frontmost.max(z);
            border.push(Vector::new(0.0, y, z));
        }
        let height_mm = border.len() as f64 * STEP_MM;
        if !(LOWEST_ROOF_MM..=SEARCH_MM).contains(&height_mm) {
            return Err(ColumnError::NoNotch {
                hip: hip.key(),
                last_mm: border.last().map_or(f64::NAN, |p| p.z),
            });
        }
        Ok(Self { border })
    }

    /// The roof of the notch.
    pub fn roof(&self) -> Vector {
        *self.border.last().expect("a border is never empty")
    }
}

/// The smallest z of the bone in the slice at height `y` that is connected with the bone nearest to
/// `wall`.
fn hindmost(hip: &Hip, y: f64, wall: &Point) -> Option<f64> {
    let [medial, lateral, backward, forward] = SLICE_MM;
    let sign = hip.side.lateral_sign();
    // The slice's own axes: i laterally, j forward.
    let grid = Grid::axis_aligned(
        [
            ((medial + lateral) / STEP_MM) as usize + 1,
            ((backward + forward) / STEP_MM) as usize + 1,
            1,
        ],
        STEP_MM,
        Point::new(-medial, -backward, 0.0),
    );
    let volume_from_app = hip.app_from_volume.inverse();
    let labels = &hip.specimen.labels;
    let bone = Volume::new(
        grid.clone(),
        (0..grid.len())
            .map(|offset| {
                let p = grid.center(grid.voxel(offset));
                let in_volume = volume_from_app * Point::new(p.x * sign, y, p.y);
                labels.nearest(&in_volume) == Some(Label::Pelvis.value())
            })
            .collect(),
    );
    let pieces = components(&bone);
    let seed = Point::new(wall.x * sign, wall.z, 0.0);
    let mut nearest: Option<(f64, u32)> = None;
    for (offset, &piece) in pieces.labels.data.iter().enumerate() {
        if piece != 0 {
            let distance = (grid.center(grid.voxel(offset)) - seed).norm_squared();
            if nearest.is_none_or(|(best, _)| distance < best) {
                nearest = Some((distance, piece));
            }
        }
    }
    let (_, column) = nearest?;
    let bounds = pieces.labels.bounds(|piece| piece == column);
    bounds.map(|(min, _)| grid.center(min).y)
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
