//! The label map's values.

use super::Side;

/// What a voxel of a label map is (DESIGN section 1, "specimen").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Label {
    /// Everything that is none of the others: air, soft tissue, and the spine, which is not
    /// labelled.
    Background = 0,
    /// Both hip bones and the sacrum; after a surgery without the fragment and the cuts.
    Pelvis = 1,
    FemurLeft = 2,
    FemurRight = 3,
    /// The acetabular bone that the cuts free (only in a surgery's map).
    Fragment = 4,
    /// Bone that the chisel removed (only in a surgery's map).
    Cut = 5,
}

impl Label {
    /// The femur of a side.
    pub fn femur(side: Side) -> Self {
        match side {
            Side::Left => Self::FemurLeft,
            Side::Right => Self::FemurRight,
        }
    }

    /// The value stored in a label map.
    pub const fn value(self) -> u8 {
        self as u8
    }
}
