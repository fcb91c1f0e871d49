//! What the name of a point or curve means.
//!
//! One rule: of a name only letters and digits count, in either case. It means a landmark if it is
//! the landmark's abbreviation ([`Landmark::name`]) with `l`, `left`, `r` or `right` directly before
//! or behind it: `ASIS_l`, `ASIS-l`, `L.ASIS`, `asis left` and `LeftASIS` are one landmark. A rim's
//! name is `rim` with a side in the same way; a number behind it counts points along the rim:
//! `rim_l_01`, `Left rim 2`. Any other name means nothing, however near it is.

use crate::anatomy::{Landmark, Side};

/// What a name means.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Meaning {
    Landmark(Landmark, Side),
    /// A side's rim and, if the name has one, the number behind it.
    Rim(Side, Option<u64>),
    /// Nothing, with the landmark that may have been meant.
    Nothing(Option<String>),
}

/// A name this near to a landmark's spelling is probably meant so: one letter added, dropped,
/// changed, or two swapped.
const NEAR: usize = 1;

/// What a name means by the rule of this module.
pub fn meaning(name: &str) -> Meaning {
    let plain: String = name
        .chars()
        .filter(|c| c.is_alphanumeric())
        .flat_map(char::to_lowercase)
        .collect();
    for (landmark, side) in every_landmark() {
        if spellings(&landmark.name().to_lowercase(), side).contains(&plain) {
            return Meaning::Landmark(landmark, side);
        }
    }
    for side in Side::BOTH {
        for spelling in spellings("rim", side) {
            match plain.strip_prefix(&spelling) {
                Some("") => return Meaning::Rim(side, None),
                Some(digits) if digits.bytes().all(|b| b.is_ascii_digit()) => {
                    if let Ok(number) = digits.parse() {
                        return Meaning::Rim(side, Some(number));
                    }
                }
                _ => {}
            }
        }
    }
    Meaning::Nothing(suggestion(&plain))
}

fn every_landmark() -> impl Iterator<Item = (Landmark, Side)> {
    Landmark::ALL
        .into_iter()
        .flat_map(|landmark| Side::BOTH.map(|side| (landmark, side)))
}

/// A word with its side, in small letters without separators.
fn spellings(word: &str, side: Side) -> [String; 4] {
    let [long, short] = [side.name(), &side.name()[..1]];
    [
        format!("{word}{long}"),
        format!("{word}{short}"),
        format!("{long}{word}"),
        format!("{short}{word}"),
    ]
}

/// What a name that means nothing may have been meant for.
fn suggestion(plain: &str) -> Option<String> {
    for landmark in Landmark::ALL {
        if landmark.name().eq_ignore_ascii_case(plain) {
            let [left, right] = Side::BOTH.map(|side| landmark.key(side));
            return Some(format!("{left} or {right}"));
        }
    }
    every_landmark()
        .flat_map(|(landmark, side)| {
            spellings(&landmark.name().to_lowercase(), side).map(|spelling| {
                (
                    strsim::damerau_levenshtein(&spelling, plain),
                    landmark,
                    side,
                )
            })
        })
        .filter(|(distance, ..)| *distance <= NEAR)
        .min_by_key(|(distance, ..)| *distance)
        .map(|(_, landmark, side)| landmark.key(side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spellings_of_one_landmark_are_one_and_others_none() {
        let asis = Meaning::Landmark(Landmark::Asis, Side::Left);
        for name in [
            "ASIS_l",
            "ASIS-l",
            "L.ASIS",
            "ASIS L",
            "left ASIS",
            "l_asis",
            "LeftASIS",
            "asis.LEFT",
            " asisl ",
            "ASIS (left)",
        ] {
            assert_eq!(meaning(name), asis, "{name}");
        }
        // As the files of xReg and DeepFluoro have them.
        for (name, landmark) in [
            ("FH", Landmark::Fh),
            ("SPS", Landmark::Sps),
            ("IPS", Landmark::Ips),
            ("MOF", Landmark::Mof),
            ("IOF", Landmark::Iof),
            ("GSN", Landmark::Gsn),
        ] {
            for (end, side) in [("-l", Side::Left), ("-r", Side::Right)] {
                let name = format!("{name}{end}");
                assert_eq!(meaning(&name), Meaning::Landmark(landmark, side), "{name}");
            }
        }
        for (name, near) in [
            ("ASIS", Some("ASIS_l or ASIS_r")),
            ("ASSI-l", Some("ASIS_l")),
            ("left AISI", Some("AIIS_l")),
            ("IPS_1", Some("IPS_l")),
            ("ASIS_l_1", Some("ASIS_l")),
            ("left ASIS right", None),
            ("l ASIS l", Some("ASIS_l")),
            ("F-1", None),
            ("PT_l", None),
            ("", None),
            ("左", None),
        ] {
            let expected = Meaning::Nothing(near.map(str::to_owned));
            assert_eq!(meaning(name), expected, "{name}");
        }
    }

    #[test]
    fn no_two_landmarks_share_a_spelling() {
        for (landmark, side) in every_landmark() {
            for spelling in spellings(&landmark.name().to_lowercase(), side) {
                assert_eq!(meaning(&spelling), Meaning::Landmark(landmark, side));
            }
        }
    }

    #[test]
    fn rims_have_a_side_and_may_have_a_number() {
        for (name, side, number) in [
            ("rim_l", Side::Left, None),
            ("Right rim", Side::Right, None),
            ("rim_r_01", Side::Right, Some(1)),
            ("left-rim-12", Side::Left, Some(12)),
            ("rrim2", Side::Right, Some(2)),
        ] {
            assert_eq!(meaning(name), Meaning::Rim(side, number), "{name}");
        }
        for name in [
            "rim",
            "rim_01_l",
            "rim_l_x",
            "rim_l_99999999999999999999999",
            "trim_l",
        ] {
            assert_eq!(meaning(name), Meaning::Nothing(None), "{name}");
        }
    }
}
