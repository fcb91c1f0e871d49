//! The five bones that a segmentation names.

use super::{Label, Side};
use crate::volume::{Volume, components::Components};

/// A bone of a segmentation, before both hip bones and the sacrum become one label.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Structure {
    Sacrum,
    Hip(Side),
    Femur(Side),
}

impl Structure {
    /// All of them, in the order of their values; where two claim one voxel, the first has it.
    pub const ALL: [Self; 5] = [
        Self::Sacrum,
        Self::Hip(Side::Left),
        Self::Hip(Side::Right),
        Self::Femur(Side::Left),
        Self::Femur(Side::Right),
    ];

    /// Its value in [`StructureLabels`]: 1 to 5 in the order of [`Self::ALL`].
    pub const fn value(self) -> u8 {
        match self {
            Self::Sacrum => 1,
            Self::Hip(Side::Left) => 2,
            Self::Hip(Side::Right) => 3,
            Self::Femur(Side::Left) => 4,
            Self::Femur(Side::Right) => 5,
        }
    }

    /// `hip_left` and so on, as files name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sacrum => "sacrum",
            Self::Hip(Side::Left) => "hip_left",
            Self::Hip(Side::Right) => "hip_right",
            Self::Femur(Side::Left) => "femur_left",
            Self::Femur(Side::Right) => "femur_right",
        }
    }

    /// The specimen's label that it belongs to.
    pub fn label(self) -> Label {
        match self {
            Self::Sacrum | Self::Hip(_) => Label::Pelvis,
            Self::Femur(side) => Label::femur(side),
        }
    }
}

impl std::fmt::Display for Structure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Sacrum => write!(f, "sacrum"),
            Self::Hip(side) => write!(f, "{side} hip bone"),
            Self::Femur(side) => write!(f, "{side} femur"),
        }
    }
}

/// A map of the five bones: 0 where there is none, else [`Structure::value`].
#[derive(Clone, Debug, PartialEq)]
pub struct StructureLabels(Volume<u8>);

impl StructureLabels {
    /// Takes a map of values.
    ///
    /// # Panics
    /// When a value is above 5.
    pub fn new(values: Volume<u8>) -> Self {
        assert!(values.data.iter().all(|&v| v <= 5), "values are 0 to 5");
        Self(values)
    }

    /// The map.
    pub fn volume(&self) -> &Volume<u8> {
        &self.0
    }

    /// The number of voxels of a bone.
    pub fn count(&self, structure: Structure) -> usize {
        let value = structure.value();
        self.0.data.iter().filter(|&&v| v == value).count()
    }

    /// Bones without a voxel.
    pub fn absent(&self) -> Vec<Structure> {
        let mut seen = [false; 6];
        for &v in &self.0.data {
            seen[usize::from(v)] = true;
        }
        let absent = |s: &Structure| !seen[usize::from(s.value())];
        Structure::ALL.into_iter().filter(absent).collect()
    }

    /// The specimen's label map: sacrum and hip bones are one.
    pub fn labels(&self) -> Volume<u8> {
        let mut label = [Label::Background.value(); 6];
        for structure in Structure::ALL {
            label[usize::from(structure.value())] = structure.label().value();
        }
        self.0.map(|v| label[usize::from(v)])
    }
}

/// The numbers of the `count` largest components, largest first; of equal ones the lower number
/// first.
pub(in crate::anatomy) fn largest(found: &Components, count: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (1..=found.sizes.len() as u32).collect();
    order.sort_by_key(|&n| (std::cmp::Reverse(found.sizes[n as usize - 1]), n));
    order.truncate(count);
    order
}
