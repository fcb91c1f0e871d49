//! May this process work on the study?

use super::folder::{StudyError, StudyFolder, io};
use super::provenance::FORMAT;
use super::snapshot::{provenances, select_simd};
use super::{Config, Plan, Provenance, Shard};
use crate::store::Attempt;
use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

/// What a user accepts or asks for when a study is opened.
#[derive(Clone, Debug)]
pub struct OpenOptions {
    /// Configuration keys, `specimen.NAME` or `code`, that may differ from what the study was begun
    /// with.
    pub accept: Vec<String>,
    /// The share of this process.
    pub shard: Shard,
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            accept: Vec::new(),
            shard: Shard::WHOLE,
        }
    }
}

/// Looks whether a study may go on with this configuration and specimens of these fingerprints, fixes the
/// process' level of vector instructions to that of the study, and gives the attempts so far and the
/// keys of accepted changes. Changes no file.
pub(super) fn examine(
    folder: &StudyFolder,
    config: &Config,
    specimens: &BTreeMap<String, String>,
    options: &OpenOptions,
) -> Result<(Vec<Attempt>, Vec<String>), StudyError> {
    check_format(folder)?;
    let attempts = folder.store().attempts()?;
    select_simd(&attempts)?;
    let changes = changes(folder, config, specimens, &provenances(&attempts))?;
    let accepted = |(key, _): &(String, String)| options.accept.contains(key);
    if !changes.iter().all(accepted) {
        let (keys, differences) = changes.into_iter().unzip();
        return Err(StudyError::Mixed {
            path: folder.path().to_owned(),
            differences,
            keys,
        });
    }
    Ok((attempts, changes.into_iter().map(|(key, _)| key).collect()))
}

/// A newer program may have laid out the folder in a way that this one would spoil.
fn check_format(folder: &StudyFolder) -> Result<(), StudyError> {
    let path = folder.manifest();
    let text = match std::fs::read_to_string(&path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        text => text.map_err(io("read", &path))?,
    };
    // Nothing depends on what else the manifest holds: it is made anew from the records.
    let manifest: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    match manifest["format"].as_u64() {
        Some(found) if found > FORMAT => Err(StudyError::Newer {
            path,
            found,
            expected: FORMAT,
        }),
        _ => Ok(()),
    }
}

/// What differs from what the study was begun with: a key that may be accepted, and a line for people.
pub(super) fn changes(
    folder: &StudyFolder,
    config: &Config,
    specimens: &BTreeMap<String, String>,
    earlier: &[Provenance],
) -> Result<Vec<(String, String)>, StudyError> {
    let mut changes = Vec::new();
    if !earlier.is_empty()
        && let Some(before) = stored_config(folder)?
    {
        for difference in before.differences(config) {
            let line = difference.to_string();
            changes.push((difference.key, line));
        }
    }
    for (name, now) in specimens {
        let last = earlier.iter().rev().find_map(|p| p.specimens.get(name));
        if let Some(before) = last
            && before != now
        {
            let short = |hash: &str| hash.chars().take(12).collect::<String>();
            let key = format!("specimen.{name}");
            let line = format!(
                "  {key}: was data of fingerprint {}, is {}: its files were changed",
                short(before),
                short(now)
            );
            changes.push((key, line));
        }
    }
    let now = Provenance::code_now();
    if let Some(last) = earlier.last()
        && last.code != now
    {
        let line = format!(
            "  code: was {} of version {} (commit {}), is {now} of version {} (commit {})",
            last.code,
            last.version,
            last.commit,
            env!("CARGO_PKG_VERSION"),
            env!("PAO_SIM_COMMIT")
        );
        changes.push(("code".into(), line));
    }
    Ok(changes)
}

/// The configuration that the study's folder has.
pub(super) fn stored_config(folder: &StudyFolder) -> Result<Option<Config>, StudyError> {
    let file = folder.config_file();
    if !file.is_file() {
        return Ok(None);
    }
    Ok(Some(Config::read_as_named(&file)?))
}

/// Refuses a share of which a living attempt has a part.
pub(super) fn check_free(
    folder: &StudyFolder,
    config: &Config,
    plan: &Plan,
    shard: Shard,
    attempts: &[Attempt],
) -> Result<(), StudyError> {
    let living = attempts.iter().filter(|attempt| attempt.alive);
    for attempt in living {
        let text = |name: &str| attempt.provenance[name].as_str().unwrap_or("?").to_owned();
        if let Some(before) = stored_config(folder)?
            && before.to_toml() != config.to_toml()
        {
            return Err(StudyError::Diverging {
                path: folder.path().to_owned(),
                attempt: attempt.attempt,
                host: text("host"),
                differences: before.all_differences(config),
            });
        }
        let theirs = Shard::new(attempt.share.0, attempt.share.1).unwrap_or(Shard::WHOLE);
        if theirs.meets(shard, plan.cases.len()) {
            let now = SystemTime::now().duration_since(UNIX_EPOCH);
            let now = now.map_or(0, |elapsed| elapsed.as_secs());
            return Err(StudyError::Busy {
                path: folder.path().to_owned(),
                ours: shard.to_string(),
                theirs: theirs.to_string(),
                attempt: attempt.attempt,
                host: text("host"),
                process: attempt.provenance["process"].as_u64().unwrap_or(0),
                silence: now.saturating_sub(attempt.last_sign_unix),
            });
        }
    }
    Ok(())
}
