//! What two configurations differ in, and whether rows of both may stand in one table.

use super::Config;
use std::collections::BTreeMap;

/// Keys that say how much is done or how, never what comes out for one registration.
const FREE: [&str; 12] = [
    "study.name",
    "study.description",
    "study.reduced",
    "study.scenarios",
    "study.initializations",
    "population.phantoms",
    "population.specimens",
    "population.surfaces",
    "population.sides",
    "surgery.fragments",
    "movement.movements",
    "run",
];

/// A key with two values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// `section.key`
    pub key: String,
    /// The value of the one and of the other; none where a strategy's section is missing.
    pub values: [Option<String>; 2],
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [before, now] = self
            .values
            .each_ref()
            .map(|v| v.as_deref().unwrap_or("nothing"));
        write!(f, "  {}: was {before}, is {now}", self.key)
    }
}

impl Config {
    /// BLAKE3 of every key that a registration's result depends on.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for (key, value) in flat(self) {
            if !is_free(&key) {
                hasher.update(format!("{key} = {value}\n").as_bytes());
            }
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Every key in which `now` differs from this configuration, a line each.
    pub fn all_differences(&self, now: &Self) -> Vec<String> {
        let (ours, theirs) = (flat(self), flat(now));
        let keys: std::collections::BTreeSet<&String> = ours.keys().chain(theirs.keys()).collect();
        keys.into_iter()
            .filter(|key| ours.get(*key) != theirs.get(*key))
            .map(|key| {
                let values = [ours.get(key).cloned(), theirs.get(key).cloned()];
                let key = key.clone();
                Difference { key, values }.to_string()
            })
            .collect()
    }

    /// The keys in which `now` would give other results than this configuration. More or fewer
    /// cases, scenarios or strategies are no difference: what both have in common is equal.
    pub fn differences(&self, now: &Self) -> Vec<Difference> {
        let (mut ours, theirs) = (flat(self), flat(now));
        let common = |key: &str| match key.strip_prefix("registration.") {
            None => true,
            Some(rest) => {
                let name = rest.split('.').next().unwrap_or(rest);
                self.registration.contains_key(name) && now.registration.contains_key(name)
            }
        };
        let mut found = Vec::new();
        for (key, value) in theirs {
            let before = ours.remove(&key);
            if before.as_ref() != Some(&value) {
                found.push((key, [before, Some(value)]));
            }
        }
        found.extend(
            ours.into_iter()
                .map(|(key, value)| (key, [Some(value), None])),
        );
        found.sort();
        found
            .into_iter()
            .filter(|(key, _)| !is_free(key) && common(key))
            .map(|(key, values)| Difference { key, values })
            .collect()
    }
}

fn is_free(key: &str) -> bool {
    FREE.iter().any(|free| {
        key.strip_prefix(free)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    })
}

/// Every key with its value's text.
fn flat(config: &Config) -> BTreeMap<String, String> {
    let table = toml::Table::try_from(config).expect("a configuration is what TOML can hold");
    let mut out = BTreeMap::new();
    flatten("", &table, &mut out);
    out
}

fn flatten(prefix: &str, table: &toml::Table, out: &mut BTreeMap<String, String>) {
    for (key, value) in table {
        let path = format!("{prefix}{key}");
        match value {
            toml::Value::Table(inner) => flatten(&format!("{path}."), inner, out),
            other => {
                out.insert(path, other.to_string());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn config(text: &str) -> Config {
        Config::parse(text, Path::new("a.toml"), &|_| None).unwrap()
    }

    #[test]
    fn how_much_is_done_is_no_difference() {
        let a = config("");
        let b = config(
            "[study]\nname = \"b\"\ninitializations = 2\n[population]\nphantoms = 1\n[run]\nthreads = 3\n[registration.paper]\n[registration.sum]\nmethod = \"paper\"\nviews = \"sum\"\n",
        );
        assert_eq!(a.differences(&b), []);
        assert_ne!(a.hash(), config("[study]\nseed = 3\n").hash());
        assert_eq!(a.hash(), config("[run]\nthreads = 3\n").hash());
    }

    #[test]
    fn what_changes_results_is_told_with_both_values() {
        let b = config("[study]\nseed = 3\n[registration.paper.femur]\npopulation = 50\n");
        let lines: Vec<String> = config("")
            .differences(&b)
            .iter()
            .map(Difference::to_string)
            .collect();
        assert_eq!(
            lines,
            [
                "  registration.paper.femur.population: was 100, is 50",
                "  study.seed: was 20190506, is 3"
            ]
        );
    }
}
