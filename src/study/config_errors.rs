//! What is wrong with a configuration, in the words that a user reads.

use std::fmt;
use std::path::PathBuf;

/// A configuration that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    #[error("cannot read the configuration {}: {cause}; give the path of a TOML file", file.display())]
    Unreadable {
        file: PathBuf,
        #[source]
        cause: std::io::Error,
    },
    #[error("{}", listed(file, mistakes))]
    Mistakes {
        file: PathBuf,
        /// In the order of their lines.
        mistakes: Vec<Mistake>,
    },
}

/// One mistake.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mistake {
    /// Line of the file, from 1; none where the mistake is what the file lacks.
    pub line: Option<usize>,
    /// The key, what is wrong with it, what was expected.
    pub message: String,
}

fn listed(file: &std::path::Path, mistakes: &[Mistake]) -> String {
    let count = match mistakes.len() {
        1 => "1 mistake".to_owned(),
        n => format!("{n} mistakes"),
    };
    let mut text = format!("{} has {count}:", file.display());
    for mistake in mistakes {
        text += &match mistake.line {
            Some(line) => format!("\n  {}:{line}: {}", file.display(), mistake.message),
            None => format!("\n  {}: {}", file.display(), mistake.message),
        };
    }
    text
}

/// Words a message of serde for the entry `path`. Unknown names get the nearest known one.
pub(super) fn describe(message: &str, path: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let parent = path.rsplit_once('.').map_or("", |(parent, _)| parent);
    let section = if parent.is_empty() {
        "the file".to_owned()
    } else {
        format!("[{parent}]")
    };
    let unknown = |kind: &str, found: Option<&str>, known: Vec<&str>| {
        let hint = suggestion(found.unwrap_or(""), known.iter().copied());
        if known.is_empty() {
            format!("{path} is {kind}; {section} has no keys")
        } else if hint.is_empty() {
            format!("{path} is {kind}; expected one of {}", known.join(", "))
        } else {
            format!("{path} is {kind}{hint}")
        }
    };
    if message.starts_with("unknown field") {
        let found = quoted.next();
        return unknown(&format!("no key of {section}"), found, quoted.collect());
    }
    if message.starts_with("unknown variant") {
        let found = quoted.next();
        let kind = format!("no choice: \"{}\"", found.unwrap_or(""));
        return unknown(&kind, found, quoted.collect());
    }
    format!("{path}: {message}")
}

/// `; did you mean "seed"?` when one of `known` looks like `found`, else nothing.
pub(super) fn suggestion<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let likeness = |name: &str| strsim::jaro_winkler(&found.to_lowercase(), name);
    known
        .into_iter()
        .map(|name| (likeness(name), name))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| format!("; did you mean \"{name}\"?"))
        .unwrap_or_default()
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "line {line}: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}
