//! The list of cases and registrations of a study, in their fixed order.

use super::config::SpecimenSource;
use super::{CaseKey, Config, FragmentKey, RegistrationKey, Scenario};

/// What a study consists of. Cases come specimen by specimen, side by side, fragment by fragment;
/// the registrations of a case initialization by initialization, scenario by scenario, strategy by
/// strategy. Rows of results have this order.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub specimens: Vec<SpecimenSource>,
    pub cases: Vec<CaseKey>,
    initializations: u32,
    scenarios: Vec<Scenario>,
    strategies: Vec<String>,
}

/// A case and its number in the plan, from 0.
pub type CaseNumber<'a> = (usize, &'a CaseKey);

impl Plan {
    /// The plan of a configuration.
    pub fn of(config: &Config) -> Self {
        let specimens = config.population.sources();
        let mut cases = Vec::new();
        for specimen in &specimens {
            for &side in &config.population.sides {
                for fragment in 0..config.surgery.fragments {
                    for movement in 0..config.movement.movements {
                        let fragment = FragmentKey {
                            specimen: specimen.name(),
                            side,
                            fragment,
                        };
                        cases.push(CaseKey { fragment, movement });
                    }
                }
            }
        }
        Self {
            specimens,
            cases,
            initializations: config.study.initializations,
            scenarios: config.study.scenarios.clone(),
            strategies: config.registration.keys().cloned().collect(),
        }
    }

    /// The registrations of one case, in their order.
    pub fn registrations(&self, case: &CaseKey) -> Vec<RegistrationKey> {
        let mut keys = Vec::with_capacity(self.registrations_per_case());
        for initialization in 0..self.initializations {
            for &scenario in &self.scenarios {
                for strategy in &self.strategies {
                    keys.push(RegistrationKey {
                        case: case.clone(),
                        initialization,
                        scenario,
                        strategy: strategy.clone(),
                    });
                }
            }
        }
        keys
    }

    /// Registrations of each case.
    pub fn registrations_per_case(&self) -> usize {
        self.initializations as usize * self.scenarios.len() * self.strategies.len()
    }

    /// Registrations of the whole study.
    pub fn len(&self) -> usize {
        self.cases.len() * self.registrations_per_case()
    }

    /// True for a study without any registration, which no valid configuration has.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Registrations of each cell (scenario, strategy), in their order.
    pub fn cells(&self) -> Vec<(Scenario, &str, usize)> {
        let each = self.cases.len() * self.initializations as usize;
        let strategies = || self.strategies.iter().map(String::as_str);
        let scenarios = self.scenarios.iter();
        scenarios
            .flat_map(|&scenario| strategies().map(move |strategy| (scenario, strategy, each)))
            .collect()
    }

    /// True when the registration is part of the plan.
    pub fn contains(&self, key: &RegistrationKey) -> bool {
        key.initialization < self.initializations
            && self.scenarios.contains(&key.scenario)
            && self.strategies.contains(&key.strategy)
            && self.cases.contains(&key.case)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn plan(text: &str) -> Plan {
        Plan::of(&Config::parse(text, Path::new("test.toml"), &|_| None).unwrap())
    }

    #[test]
    fn the_default_is_the_papers_study() {
        let plan = plan("");
        assert_eq!(plan.len(), 72_000);
        assert_eq!(plan.cases.len(), 6 * 2 * 15 * 20);
        let cells = plan.cells();
        assert_eq!(cells.len(), 4);
        assert!(cells.iter().all(|(_, _, count)| *count == 18_000));
    }

    #[test]
    fn the_order_is_fixed() {
        let plan = plan(
            "[population]\nphantoms = [2]\nspecimens = [\"data/z001\"]\n[study]\ninitializations = 2\n",
        );
        assert_eq!(plan.cases[0].to_string(), "phantom-2/left/f00/m00");
        assert_eq!(plan.cases[21].to_string(), "phantom-2/left/f01/m01");
        assert_eq!(plan.cases.last().unwrap().to_string(), "z001/right/f14/m19");
        let keys: Vec<String> = plan
            .registrations(&plan.cases[0])
            .iter()
            .map(|key| key.to_string().replace("phantom-2/left/f00/m00/", ""))
            .collect();
        assert_eq!(keys.len(), 8);
        assert_eq!(keys[0], "i0/all_cuts_known/paper");
        assert_eq!(keys[1], "i0/no_cuts_known/paper");
        assert_eq!(keys[7], "i1/ilium_pubis_estimated/paper");
    }

    #[test]
    fn every_planned_key_is_contained() {
        let plan = plan(
            "[population]\nphantoms = 1\n[surgery]\nfragments = 2\n[movement]\nmovements = 2\n",
        );
        for case in &plan.cases {
            assert!(
                plan.registrations(case)
                    .iter()
                    .all(|key| plan.contains(key))
            );
        }
        let other = "phantom-2/left/f00/m00/i0/no_cuts_known/paper";
        assert!(!plan.contains(&other.parse().unwrap()));
    }
}
