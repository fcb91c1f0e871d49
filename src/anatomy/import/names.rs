//! What programs call the bones.

use crate::anatomy::{Side, Structure};

/// What a value of a label map stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LabelMeaning {
    One(Structure),
    /// Both femora.
    Femora,
    /// Both hip bones.
    Hips,
    /// Both hip bones and the sacrum.
    Pelvis,
}

impl LabelMeaning {
    /// The names that a label table may hold, in the order of messages.
    pub const ALL: [Self; 8] = [
        Self::One(Structure::Sacrum),
        Self::One(Structure::Hip(Side::Left)),
        Self::One(Structure::Hip(Side::Right)),
        Self::One(Structure::Femur(Side::Left)),
        Self::One(Structure::Femur(Side::Right)),
        Self::Femora,
        Self::Hips,
        Self::Pelvis,
    ];

    /// As a label table names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::One(structure) => structure.name(),
            Self::Femora => "femora",
            Self::Hips => "hips",
            Self::Pelvis => "pelvis",
        }
    }

    /// The exact name of a label table.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name)
    }

    /// What a segmentation program's free name stands for: a bone's word and a side's, in any order and
    /// writing (`Hip_L`, `left hemipelvis`, `upper-sacrum`, `Femur right`). `None` for other names, and
    /// for parts of a femur, which would not be one bone with its rest.
    pub fn recognized(name: &str) -> Option<Self> {
        let lower = name.to_lowercase();
        let words: Vec<&str> = lower
            .split(|c: char| !c.is_alphanumeric())
            .filter(|word| !word.is_empty())
            .collect();
        let has = |list: &[&str]| words.iter().any(|word| list.contains(word));
        let side = match (
            has(&["l", "left", "links", "sinister", "sinistra"]),
            has(&["r", "right", "rechts", "dexter", "dextra"]),
        ) {
            (true, false) => Some(Side::Left),
            (false, true) => Some(Side::Right),
            (false, false) => None,
            (true, true) => return None,
        };
        // Soft tissue and implants carry a bone's word too.
        let other = [
            "muscle",
            "artery",
            "vein",
            "nerve",
            "cartilage",
            "joint",
            "implant",
            "head",
            "neck",
            "implants",
            "canal",
            "marrow",
        ];
        if has(&other) {
            return None;
        }
        let hip = [
            "hip",
            "hips",
            "hipbone",
            "hipbones",
            "innominate",
            "hemipelvis",
            "coxae",
            "hemipelves",
        ];
        match side {
            _ if has(&["sacrum"]) => side.is_none().then_some(Self::One(Structure::Sacrum)),
            Some(side) if has(&["femur"]) => Some(Self::One(Structure::Femur(side))),
            Some(side) if has(&hip) => Some(Self::One(Structure::Hip(side))),
            None if has(&["femur", "femurs", "femora"]) => Some(Self::Femora),
            None if has(&hip) => Some(Self::Hips),
            None if has(&["pelvis"]) => Some(Self::Pelvis),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_programs_are_understood() {
        let of = |name| LabelMeaning::recognized(name).map(LabelMeaning::name);
        for (name, meaning) in [
            ("hip_left", Some("hip_left")),
            ("Hip_R", Some("hip_right")),
            ("left-hemipelvis", Some("hip_left")),
            ("Right hip bone", Some("hip_right")),
            ("Femur_L", Some("femur_left")),
            ("upper-sacrum", Some("sacrum")),
            ("Sacrum", Some("sacrum")),
            ("femur", Some("femora")),
            ("pelvis", Some("pelvis")),
            ("hip bones", Some("hips")),
            ("vertebrae_S1", None),
            ("femoral head left", None),
            ("hip_implant", None),
            ("gluteus_maximus_left", None),
            ("left_right_femur", None),
        ] {
            assert_eq!(of(name), meaning, "{name}");
        }
        for meaning in LabelMeaning::ALL {
            assert_eq!(LabelMeaning::parse(meaning.name()), Some(meaning));
            assert_eq!(LabelMeaning::recognized(meaning.name()), Some(meaning));
        }
    }
}
