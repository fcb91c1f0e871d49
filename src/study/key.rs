//! The names of fragments, cases and registrations.
//!
//! `phantom-1/left/f03/m07/i2/no_cuts_known/paper` reads: specimen, side, fragment, movement,
//! initialization, scenario, strategy. Numbers count from 0. Keys name random streams, rows, log
//! lines and the arguments of `replay` and `show`, so each has one spelling only.

use super::Scenario;
use crate::anatomy::{Side, is_specimen_name};
use std::fmt;
use std::str::FromStr;

/// A random perturbation of a hip's nominal cuts: `phantom-1/left/f03`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FragmentKey {
    /// The specimen's name: letters, digits and `-`.
    pub specimen: String,
    pub side: Side,
    /// Number of the fragment, from 0.
    pub fragment: u32,
}

/// One movement of a fragment, so one set of images: `phantom-1/left/f03/m07`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CaseKey {
    pub fragment: FragmentKey,
    /// Number of the movement, from 0.
    pub movement: u32,
}

/// One row of results: `phantom-1/left/f03/m07/i2/no_cuts_known/paper`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RegistrationKey {
    pub case: CaseKey,
    /// Number of the initialization, from 0.
    pub initialization: u32,
    pub scenario: Scenario,
    /// The strategy's name in the configuration: letters, digits, `-` and `_`.
    pub strategy: String,
}

impl FragmentKey {
    /// `phantom-1/left`.
    pub fn hip(&self) -> String {
        format!("{}/{}", self.specimen, self.side)
    }
}

impl RegistrationKey {
    /// `phantom-1/left/f03/m07/i2`: the key of what scenarios and strategies share, the noisy pick
    /// and the optimizers' draws.
    pub fn initialization_key(&self) -> String {
        format!("{}/i{}", self.case, self.initialization)
    }
}

impl fmt::Display for FragmentKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/f{:02}", self.specimen, self.side, self.fragment)
    }
}

impl fmt::Display for CaseKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/m{:02}", self.fragment, self.movement)
    }
}

impl fmt::Display for RegistrationKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}/{}/{}",
            self.initialization_key(),
            self.scenario,
            self.strategy
        )
    }
}

/// A text that is no key.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{text}\" is no key of a {kind}: {problem}; expected a form like \"{example}\"")]
pub struct KeyError {
    text: String,
    kind: &'static str,
    example: &'static str,
    problem: String,
}

const CASE_EXAMPLE: &str = "phantom-1/left/f03/m07";
const REGISTRATION_EXAMPLE: &str = "phantom-1/left/f03/m07/i2/no_cuts_known/paper";

impl FromStr for CaseKey {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        let parts: Vec<&str> = text.split('/').collect();
        let key = match parts[..] {
            [specimen, side, fragment, movement] => case(specimen, side, fragment, movement),
            _ => Err(format!("it has {} parts, not 4", parts.len())),
        };
        key.map_err(|problem| KeyError {
            text: text.to_owned(),
            kind: "case",
            example: CASE_EXAMPLE,
            problem,
        })
    }
}

impl FromStr for RegistrationKey {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        registration(text).map_err(|problem| KeyError {
            text: text.to_owned(),
            kind: "registration",
            example: REGISTRATION_EXAMPLE,
            problem,
        })
    }
}

fn registration(text: &str) -> Result<RegistrationKey, String> {
    let parts: Vec<&str> = text.split('/').collect();
    let [
        specimen,
        side,
        fragment,
        movement,
        initialization,
        scenario,
        strategy,
    ] = parts[..]
    else {
        return Err(format!("it has {} parts, not 7", parts.len()));
    };
    if !is_name(strategy) {
        return Err(format!("\"{strategy}\" is no strategy's name"));
    }
    Ok(RegistrationKey {
        case: case(specimen, side, fragment, movement)?,
        initialization: number(initialization, 'i', 1)?,
        scenario: Scenario::from_name(scenario)
            .ok_or_else(|| format!("\"{scenario}\" is no scenario"))?,
        strategy: strategy.to_owned(),
    })
}

fn case(specimen: &str, side: &str, fragment: &str, movement: &str) -> Result<CaseKey, String> {
    if !is_specimen_name(specimen) {
        return Err(format!("\"{specimen}\" is no specimen's name"));
    }
    let side = Side::BOTH
        .into_iter()
        .find(|candidate| candidate.name() == side)
        .ok_or_else(|| format!("\"{side}\" is neither left nor right"))?;
    Ok(CaseKey {
        fragment: FragmentKey {
            specimen: specimen.to_owned(),
            side,
            fragment: number(fragment, 'f', 2)?,
        },
        movement: number(movement, 'm', 2)?,
    })
}

/// A number behind its letter, of at least `width` digits, in its one spelling.
fn number(text: &str, letter: char, width: usize) -> Result<u32, String> {
    text.strip_prefix(letter)
        .and_then(|digits| digits.parse::<u32>().ok())
        .filter(|value| format!("{letter}{value:0width$}") == text)
        .ok_or_else(|| {
            format!("\"{text}\" is not \"{letter}\" and a number of {width} or more digits")
        })
}

/// True for names of studies and strategies: ASCII letters, digits, `-` and `_`.
pub(super) fn is_name(text: &str) -> bool {
    !text.is_empty()
        && text
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "-_".contains(c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_key_comes_back(
            specimen in "[a-zA-Z0-9-]{1,12}", left: bool, fragment in 0u32..2000,
            movement in 0u32..2000, initialization in 0u32..200, scenario in 0usize..4,
            strategy in "[a-zA-Z0-9_-]{1,12}",
        ) {
            let key = RegistrationKey {
                case: CaseKey {
                    fragment: FragmentKey {
                        specimen,
                        side: if left { Side::Left } else { Side::Right },
                        fragment,
                    },
                    movement,
                },
                initialization,
                scenario: Scenario::ALL[scenario],
                strategy,
            };
            prop_assert_eq!(key.to_string().parse::<RegistrationKey>(), Ok(key.clone()));
            prop_assert_eq!(key.case.to_string().parse::<CaseKey>(), Ok(key.case));
        }

        #[test]
        fn what_parses_has_one_spelling(text in "[a-c0-9-]{1,3}/(left|right)/f[0-9]{1,4}/m[0-9]{1,4}") {
            if let Ok(key) = text.parse::<CaseKey>() {
                prop_assert_eq!(key.to_string(), text);
            }
        }
    }

    #[test]
    fn the_form_is_that_of_the_documents() {
        let key: RegistrationKey = REGISTRATION_EXAMPLE.parse().unwrap();
        assert_eq!(key.case.to_string(), CASE_EXAMPLE);
        assert_eq!(key.case.fragment.to_string(), "phantom-1/left/f03");
        assert_eq!(key.initialization_key(), "phantom-1/left/f03/m07/i2");
        assert_eq!(key.to_string(), REGISTRATION_EXAMPLE);
    }

    #[test]
    fn mistakes_are_named() {
        for (text, problem) in [
            ("phantom-1/left", "it has 2 parts, not 4"),
            (
                "phantom 1/left/f03/m07",
                "\"phantom 1\" is no specimen's name",
            ),
            ("phantom-1/up/f03/m07", "\"up\" is neither left nor right"),
            (
                "phantom-1/left/f3/m07",
                "\"f3\" is not \"f\" and a number of 2 or more digits",
            ),
        ] {
            let message = text.parse::<CaseKey>().unwrap_err().to_string();
            assert!(message.contains(problem), "{message}");
            assert!(message.contains(CASE_EXAMPLE), "{message}");
        }
        let message = REGISTRATION_EXAMPLE
            .replace("no_cuts", "none")
            .parse::<RegistrationKey>();
        assert!(
            message
                .unwrap_err()
                .to_string()
                .contains("\"none_known\" is no scenario")
        );
    }
}
