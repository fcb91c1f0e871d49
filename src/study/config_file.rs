//! Reads and checks a configuration file: every mistake at once, each with its line.

use super::config_errors::{ConfigError, Mistake, describe, suggestion};
use super::config_table::{overlay, remove, span_of};
use super::{Config, StrategyParameters};
use crate::registration::paper::PaperParameters;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

/// Gives the value of an environment variable. Tests give their own.
pub type Environment<'a> = &'a dyn Fn(&str) -> Option<String>;

impl Config {
    /// Reads a configuration file, with `${NAME}` replaced by the environment's value and folders of specimens
    /// by the specimens that they hold now.
    ///
    /// # Errors
    /// When the file cannot be read, or with all its mistakes: syntax, unknown keys, wrong types,
    /// values out of range, variables that are not set, folders without a specimen.
    pub fn read(file: &Path) -> Result<Self, ConfigError> {
        Self::parse_with(&text_of(file)?, file, &variable, Folders::Searched)
    }

    /// The same without a look for specimens: for the configuration that a study's folder keeps, which names
    /// them, and where other keys are wanted and the specimens may not be there.
    ///
    /// # Errors
    /// As [`Self::read`], but for folders.
    pub fn read_as_named(file: &Path) -> Result<Self, ConfigError> {
        Self::parse(&text_of(file)?, file, &variable)
    }

    /// The same for a text; `file` gives messages, the study's default name, and the folder that
    /// relative paths start from. Nothing is looked for on the disk.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(text: &str, file: &Path, environment: Environment) -> Result<Self, ConfigError> {
        Self::parse_with(text, file, environment, Folders::AsNamed)
    }

    fn parse_with(
        text: &str,
        file: &Path,
        environment: Environment,
        folders: Folders,
    ) -> Result<Self, ConfigError> {
        let mut source = Source {
            text,
            mistakes: Vec::new(),
        };
        let (document, errors) = DeTable::parse_recoverable(text);
        for error in errors {
            source.report(error.span(), error.message().to_owned());
        }
        // After a syntax error the document is a guess, and whatever else is said of it would be.
        if source.mistakes.is_empty() {
            let mut document = document.into_inner();
            source.expand(&mut document, environment);
            let whole = document.clone();
            let mut config = source.config(document, file);
            config.population.resolve_paths(file);
            if folders == Folders::Searched {
                for problem in config.population.expand_folders() {
                    let key = "population.specimens";
                    source.report(span_of(&whole, key), format!("{key} {problem}"));
                }
            }
            for (path, problem) in config.problems() {
                let span = span_of(&whole, &path);
                source.report(span, format!("{path} {problem}"));
            }
            if source.mistakes.is_empty() {
                return Ok(config);
            }
        }
        source.mistakes.sort();
        Err(ConfigError::Mistakes {
            file: file.to_owned(),
            mistakes: source.mistakes,
        })
    }

    /// The whole configuration as TOML, every key with its value, as `study.toml` keeps it.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a configuration has neither maps with other keys than strings nor other values that TOML lacks")
    }
}

/// What becomes of folders in `population.specimens` that hold specimens.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Folders {
    AsNamed,
    Searched,
}

fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok()
}

fn text_of(file: &Path) -> Result<String, ConfigError> {
    std::fs::read_to_string(file).map_err(|cause| ConfigError::Unreadable {
        file: file.to_owned(),
        cause,
    })
}

/// The sections that are read as they stand.
#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Sections {
    study: super::config::StudySection,
    population: super::config::PopulationSection,
    surgery: super::config::SurgerySection,
    movement: super::config::MovementSection,
    xray: super::config::XraySection,
    run: super::config::RunSection,
    /// Named only so that an unknown section's message lists it; taken out before.
    #[serde(skip_serializing)]
    registration: (),
}

struct Source<'a> {
    text: &'a str,
    mistakes: Vec<Mistake>,
}

impl Source<'_> {
    fn report(&mut self, span: Option<Range<usize>>, message: String) {
        let line = span.map(|span| 1 + self.text[..span.start].matches('\n').count());
        self.mistakes.push(Mistake { line, message });
    }

    fn config(&mut self, mut document: DeTable, file: &Path) -> Config {
        let registration = document.remove("registration");
        let sections: Sections = self.section(document, "");
        let mut config = Config {
            study: sections.study,
            population: sections.population,
            surgery: sections.surgery,
            movement: sections.movement,
            xray: sections.xray,
            registration: self.strategies(registration),
            run: sections.run,
        };
        if config.study.name.is_empty() {
            let stem = file.file_stem().map(|stem| stem.to_string_lossy());
            config.study.name = stem.unwrap_or_default().into_owned();
        }
        config
    }

    fn strategies(
        &mut self,
        registration: Option<Spanned<DeValue>>,
    ) -> BTreeMap<String, StrategyParameters> {
        let mut strategies = BTreeMap::new();
        if let Some(registration) = registration {
            let span = registration.span();
            let DeValue::Table(table) = registration.into_inner() else {
                self.report(
                    Some(span),
                    "registration is no table; expected sections like [registration.paper]".into(),
                );
                return strategies;
            };
            for (name, value) in table {
                if let Some(parameters) = self.strategy(name.get_ref(), &name, value) {
                    strategies.insert(name.into_inner().into_owned(), parameters);
                }
            }
        }
        if strategies.is_empty() {
            let paper = StrategyParameters::Paper(PaperParameters::default());
            strategies.insert("paper".to_owned(), paper);
        }
        strategies
    }

    fn strategy(
        &mut self,
        name: &str,
        key: &Spanned<std::borrow::Cow<str>>,
        value: Spanned<DeValue>,
    ) -> Option<StrategyParameters> {
        let DeValue::Table(mut table) = value.into_inner() else {
            self.report(
                Some(key.span()),
                format!(
                    "registration.{name} is no table; expected a section [registration.{name}]"
                ),
            );
            return None;
        };
        let (method, span) = match table.remove("method") {
            Some(method) => (
                method.get_ref().as_str().unwrap_or("").to_owned(),
                method.span(),
            ),
            None => (name.to_owned(), key.span()),
        };
        match method.as_str() {
            "paper" => {
                let parameters = self.section(table, &format!("registration.{name}."));
                Some(StrategyParameters::Paper(parameters))
            }
            "paper_slice" => {
                let parameters = self.section(table, &format!("registration.{name}."));
                Some(StrategyParameters::PaperSlice(parameters))
            }
            _ => {
                let methods = StrategyParameters::METHODS;
                let hint = suggestion(&method, methods);
                self.report(
                    Some(span),
                    format!("registration.{name} has no method \"{method}\"{hint}; set method to one of {}", methods.join(", ")),
                );
                None
            }
        }
    }

    /// Lays the file's entries over the defaults. An entry that does not fit is reported and left
    /// out, and the rest tried again, so that one mistake hides no other.
    fn section<T: Default + Serialize + DeserializeOwned>(
        &mut self,
        mut entries: DeTable,
        prefix: &str,
    ) -> T {
        let defaults = toml::to_string(&T::default()).expect("defaults are values that TOML has");
        loop {
            let parsed = DeTable::parse(&defaults).expect("what toml wrote it reads");
            let mut merged = parsed.into_inner();
            overlay(&mut merged, entries.clone());
            let value = Spanned::new(0..0, DeValue::Table(merged));
            let error = match T::deserialize(ValueDeserializer::from(value)) {
                Ok(section) => return section,
                Err(error) => error,
            };
            let removed = error
                .span()
                .and_then(|span| remove(&mut entries, &span, prefix));
            match removed {
                Some(path) => self.report(error.span(), describe(error.message(), &path)),
                None => {
                    // Not an entry's fault that could be set aside.
                    self.report(error.span(), error.message().to_owned());
                    return T::default();
                }
            }
        }
    }

    /// Replaces `${NAME}` in every string.
    fn expand(&mut self, table: &mut DeTable, environment: Environment) {
        let keys: Vec<_> = table.keys().cloned().collect();
        for key in keys {
            if let Some(value) = table.get_mut(key.get_ref().as_ref()) {
                self.expand_value(value, environment);
            }
        }
    }

    fn expand_value(&mut self, value: &mut Spanned<DeValue>, environment: Environment) {
        let span = value.span();
        match value.get_mut() {
            DeValue::String(text) => match expanded(text, environment) {
                Ok(None) => {}
                Ok(Some(new)) => *text = new.into(),
                Err(problem) => self.report(Some(span), problem),
            },
            DeValue::Array(values) => {
                for value in values.iter_mut() {
                    self.expand_value(value, environment);
                }
            }
            DeValue::Table(table) => self.expand(table, environment),
            _ => {}
        }
    }
}

/// The text with its variables replaced, or `None` when it has none.
fn expanded(text: &str, environment: Environment) -> Result<Option<String>, String> {
    if !text.contains("${") {
        return Ok(None);
    }
    let (mut out, mut rest) = (String::new(), text);
    while let Some(start) = rest.find("${") {
        let end = rest[start..].find('}').map(|length| start + length);
        let end = end.ok_or_else(|| format!("\"{text}\" opens \"${{\" and does not close it"))?;
        let name = &rest[start + 2..end];
        let value = environment(name).ok_or_else(|| {
            format!("\"{text}\" needs the environment variable {name}, which is not set; set it or write the path itself")
        })?;
        out += &rest[..start];
        out += &value;
        rest = &rest[end + 1..];
    }
    Ok(Some(out + rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Scenario;

    fn parse(text: &str) -> Result<Config, String> {
        let environment = |name: &str| (name == "DATA").then(|| "/data".to_owned());
        Config::parse(text, Path::new("my.toml"), &environment).map_err(|error| error.to_string())
    }

    #[test]
    fn an_empty_file_is_the_paper() {
        let config = parse("").unwrap();
        assert_eq!(config.study.name, "my");
        assert_eq!(config.population.phantoms, [1, 2, 3, 4, 5, 6]);
        assert_eq!(config.registration.len(), 1);
        assert_eq!(config.study.scenarios, Scenario::ALL);
    }

    #[test]
    fn every_mistake_has_its_line() {
        let text = r#"
[study]
sed = 1
initializations = "many"
scenarios = ["all_cuts_known", "no_cut_known"]

[population]
phantoms = []
sides = ["left", "left"]
specimens = ["${NOWHERE}/a"]

[surgery.fragment]
chisel_width_mm = -3.0

[registration.paper]
crop = 50
pelvis.population = 2

[registration.mine]
method = "papr"

[xrays]
photons = 3
"#;
        insta::assert_snapshot!(parse(text).unwrap_err());
    }

    #[test]
    fn syntax_errors_are_told_together() {
        let message = parse("[study]\nname = \nseed = 1 2\n").unwrap_err();
        assert!(message.contains("my.toml:2: "), "{message}");
        assert!(message.contains("my.toml:3: "), "{message}");
    }

    #[test]
    fn a_part_of_a_nested_table_keeps_the_rest() {
        let config = parse("[registration.paper.pelvis]\npopulation = 40\n").unwrap();
        let StrategyParameters::Paper(paper) = &config.registration["paper"] else {
            panic!("{:?}", config.registration);
        };
        let defaults = PaperParameters::default();
        assert_eq!(paper.pelvis.population, 40);
        assert_eq!(
            paper.pelvis.sd_rotation_deg,
            defaults.pelvis.sd_rotation_deg
        );
        assert_eq!(paper.femur, defaults.femur);
    }

    #[test]
    fn the_papers_search_has_a_variant_with_slices() {
        let text = "[registration.paper]\n[registration.paper_slice]\npitch_px = 0.75\n\
                    paper.pelvis.population = 40\n";
        let config = parse(text).unwrap();
        assert_eq!(config.registration.len(), 2);
        let StrategyParameters::PaperSlice(slice) = &config.registration["paper_slice"] else {
            panic!("{:?}", config.registration);
        };
        assert_eq!((slice.pitch_px, slice.paper.pelvis.population), (0.75, 40));
        let message = parse("[registration.paper_slice]\npitch_px = 9\n").unwrap_err();
        assert!(message.contains("pitch_px 9 lies outside"), "{message}");
    }

    #[test]
    fn variants_of_a_method_stand_beside_each_other() {
        let text =
            "[registration.paper]\n[registration.sum]\nmethod = \"paper\"\nviews = \"sum\"\n";
        let config = parse(text).unwrap();
        assert_eq!(
            config.registration.keys().collect::<Vec<_>>(),
            ["paper", "sum"]
        );
        assert_ne!(config.registration["paper"], config.registration["sum"]);
    }

    #[test]
    fn variables_are_replaced() {
        let config =
            parse("[population]\nphantoms = 0\nspecimens = [\"${DATA}/vsd/z001\"]\n").unwrap();
        assert_eq!(config.population.specimens, [Path::new("/data/vsd/z001")]);
        assert!(config.population.phantoms.is_empty());
        let open = expanded("${DATA", &|_| None).unwrap_err();
        assert!(open.contains("does not close it"), "{open}");
    }

    #[test]
    fn paths_start_at_the_files_folder() {
        let text = "[population]\nspecimens = [\"../data/a\", \"/b\"]\nsurfaces = [\"c\"]\n";
        let config = Config::parse(text, Path::new("/studies/one/my.toml"), &|_| None).unwrap();
        let population = &config.population;
        assert_eq!(
            population.specimens,
            [Path::new("/studies/one/../data/a"), Path::new("/b")]
        );
        assert_eq!(population.surfaces, [Path::new("/studies/one/c")]);
        // What is written elsewhere means the same folders.
        let written = Config::parse(&config.to_toml(), Path::new("/x/study.toml"), &|_| None);
        assert_eq!(written.unwrap(), config);
    }

    #[test]
    fn a_folder_of_specimens_is_expanded_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("my.toml");
        for name in ["one", "people"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        std::fs::write(folder.path().join("one/specimen.toml"), "").unwrap();
        let text = "[population]\nphantoms = 0\nspecimens = [\"one\", \"people\"]\n";
        std::fs::write(&file, text).unwrap();
        let none = Config::read(&file).unwrap_err().to_string();
        assert!(
            none.contains("my.toml:3: population.specimens names"),
            "{none}"
        );
        for name in ["b", "a"] {
            let person = folder.path().join("people").join(name);
            std::fs::create_dir(&person).unwrap();
            std::fs::write(person.join("specimen.toml"), "").unwrap();
        }
        let config = Config::read(&file).unwrap();
        let expected = ["one", "people/a", "people/b"].map(|name| folder.path().join(name));
        assert_eq!(config.population.specimens, expected);
        // What the study keeps needs no data.
        std::fs::write(&file, config.to_toml()).unwrap();
        std::fs::remove_file(folder.path().join("people/a/specimen.toml")).unwrap();
        assert_eq!(Config::read_as_named(&file).unwrap(), config);
    }

    #[test]
    fn what_is_written_reads_back() {
        let config = parse(
            "[study]\nseed = 7\n[population]\nphantoms = [2, 5]\n[xray.c_arm]\npixel_mm = 0.388\n",
        )
        .unwrap();
        let written = config.to_toml();
        let again = Config::parse(&written, Path::new("study.toml"), &|_| None).unwrap();
        assert_eq!(again, config, "{written}");
    }

    mod fuzz {
        use super::*;
        use proptest::prelude::*;

        fn pieces() -> impl Strategy<Value = String> {
            let words = [
                "[study]",
                "[run]",
                "[xray.c_arm]",
                "[registration.a]",
                "seed",
                "name",
                "threads",
                "=",
                ".",
                "\"a\"",
                "\"${HOME}/x\"",
                "\"${\"",
                "-1",
                "1e400",
                "nan",
                "inf",
                "[",
                "]",
                "{",
                "}",
                "\n",
                "\"\"\"",
                "'",
                "#",
                "\u{0}",
                "1979-05-27",
                "0x",
                "true",
                ",",
                "method",
                "\"paper\"",
                "phantoms",
                "sides",
                "9223372036854775808",
            ];
            prop::collection::vec(prop::sample::select(words.to_vec()), 0..40)
                .prop_map(|words| words.join(" "))
        }

        proptest! {
            #![proptest_config(ProptestConfig::with_cases(400))]

            /// Whatever is written, it is read or refused with lines of the file; nothing panics, and what
            /// was read is in range and reads back as it was written out.
            #[test]
            fn anything_is_read_or_refused(text in pieces()) {
                check(&text)?;
            }

            /// The paper's configuration, every key written out, with a few bytes changed.
            #[test]
            fn a_damaged_configuration_is_read_or_refused(
                changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)
            ) {
                let mut bytes = Config::parse("", Path::new("a.toml"), &|_| None).unwrap().to_toml().into_bytes();
                for (place, byte) in changes {
                    let place = place.index(bytes.len());
                    bytes[place] = byte;
                }
                check(&String::from_utf8_lossy(&bytes))?;
            }
        }

        fn check(text: &str) -> Result<(), TestCaseError> {
            match Config::parse(text, Path::new("a.toml"), &|_| None) {
                Ok(config) => {
                    prop_assert!(config.problems().is_empty());
                    let again = Config::parse(&config.to_toml(), Path::new("a.toml"), &|_| None);
                    prop_assert_eq!(again.unwrap(), config);
                }
                Err(error) => prop_assert!(error.to_string().contains("a.toml"), "{}", error),
            }
            Ok(())
        }
    }
}
