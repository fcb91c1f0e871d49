//! The four fragment-shape scenarios (paper, section "Simulation Study").

use serde::{Deserialize, Serialize};

/// Which fragment shape a registration is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scenario {
    /// The true cuts.
    AllCutsKnown,
    /// The nominal cuts.
    NoCutsKnown,
    /// The true ilium and pubis cuts, the nominal ischium and posterior ones.
    IliumPubisKnown,
    /// Ilium and pubis from the images, the others nominal.
    IliumPubisEstimated,
}

impl Scenario {
    /// All four, in the order of the paper's Table I.
    pub const ALL: [Self; 4] = [
        Self::AllCutsKnown,
        Self::NoCutsKnown,
        Self::IliumPubisKnown,
        Self::IliumPubisEstimated,
    ];

    /// The name in keys, columns and configurations.
    pub fn name(self) -> &'static str {
        match self {
            Self::AllCutsKnown => "all_cuts_known",
            Self::NoCutsKnown => "no_cuts_known",
            Self::IliumPubisKnown => "ilium_pubis_known",
            Self::IliumPubisEstimated => "ilium_pubis_estimated",
        }
    }

    /// The name as the paper's tables print it.
    pub fn title(self) -> &'static str {
        match self {
            Self::AllCutsKnown => "All Cuts Known",
            Self::NoCutsKnown => "No Cuts Known",
            Self::IliumPubisKnown => "Ilium & Pubis Known",
            Self::IliumPubisEstimated => "Ilium & Pubis Est.",
        }
    }

    /// The scenario of a name as [`Self::name`] gives it.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|scenario| scenario.name() == name)
    }
}

impl std::fmt::Display for Scenario {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
