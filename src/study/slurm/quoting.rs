//! Texts that the shell, and sbatch, take as one word each.

use super::SlurmError;
use std::path::Path;

/// A path as text for a job script.
///
/// # Errors
/// When it is not text or has control characters (a line break would end an `#SBATCH` line).
pub fn path_text(path: &Path) -> Result<&str, SlurmError> {
    let text = path.to_str().filter(|text| is_line(text));
    text.ok_or_else(|| SlurmError::Path {
        path: path.to_owned(),
    })
}

/// True for text without control characters.
pub fn is_line(text: &str) -> bool {
    !text.chars().any(char::is_control)
}

/// A text as one word of bash, on one line: as it is where that is plain, else quoted.
pub fn shell(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else if !is_line(text) {
        let escaped: String = text.chars().map(escaped).collect();
        format!("$'{escaped}'")
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

/// A character between `$'` and `'`.
fn escaped(c: char) -> String {
    match c {
        '\\' | '\'' => format!("\\{c}"),
        c if c.is_control() => c
            .to_string()
            .bytes()
            .map(|byte| format!("\\x{byte:02x}"))
            .collect(),
        c => c.to_string(),
    }
}

/// Words as one line of the shell, for a person to copy.
pub fn shell_words<T: AsRef<str>>(words: impl IntoIterator<Item = T>) -> String {
    let words: Vec<String> = words.into_iter().map(|word| shell(word.as_ref())).collect();
    words.join(" ")
}

/// The value of an option in an `#SBATCH` line. sbatch knows quotes and backslashes, and begins a comment at `#`.
pub fn sbatch(text: &str) -> String {
    if shell(text) == text {
        text.to_owned()
    } else {
        format!("\"{}\"", text.replace('\\', r"\\").replace('"', "\\\""))
    }
}

/// A path in an `--output`, where sbatch replaces `%` and a letter.
pub fn file_pattern(path: &str) -> String {
    path.replace('%', "%%")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::process::Command;

    #[test]
    fn plain_words_stay_plain() {
        assert_eq!(
            shell("/data/results_2/a-b.sbatch"),
            "/data/results_2/a-b.sbatch"
        );
        assert_eq!(shell("it's $HOME"), r"'it'\''s $HOME'");
        assert_eq!(shell(""), "''");
        assert_eq!(shell_words(["a", "b c"]), "a 'b c'");
        assert_eq!(shell_words(["--shard=1/4"]), "--shard=1/4");
        assert_eq!(shell_words(["my study.toml"]), "'my study.toml'");
        assert_eq!(shell_words(["it's"]), r"'it'\''s'");
        assert_eq!(sbatch("[a|b]"), "\"[a|b]\"");
        assert_eq!(sbatch(r#"a "b" \c"#), r#""a \"b\" \\c""#);
        assert_eq!(file_pattern("/100%/a"), "/100%%/a");
    }

    #[test]
    fn lines_that_end_early_are_refused() {
        assert!(path_text(Path::new("/a\nb")).is_err());
        assert_eq!(path_text(Path::new("/a b'c")).unwrap(), "/a b'c");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        /// The shell itself is the oracle.
        #[test]
        #[cfg(target_os = "linux")]
        fn the_shell_reads_the_word_back(text in "[\x01-\x7fäµ€\u{85}]{0,20}") {
            let word = shell(&text);
            prop_assert!(is_line(&word), "{:?}", word);
            let script = format!("printf %s {word}");
            let output = Command::new("/bin/bash").arg("-c").arg(script).output().unwrap();
            prop_assert_eq!(String::from_utf8(output.stdout).unwrap(), text);
        }
    }
}
