//! What is known of one registration.

use super::{CaseKey, RegistrationKey, Shard, Snapshot};
use crate::store::{COMPLETE, CRASHED};

/// Lines that tell how it stands with a registration, and what to do.
pub fn why(study: &Snapshot, key: &RegistrationKey) -> Vec<String> {
    let (name, case) = (key.to_string(), key.case.to_string());
    let folder = study.folder.path().display();
    let mut lines = Vec::new();
    let row = study.state.row(key);
    match row {
        Some(row) => {
            let attempt = row.integer("attempt").unwrap_or(0);
            let seconds = row.number("registration_seconds").unwrap_or(0.0);
            match row.text("status") {
                COMPLETE => lines.push(format!(
                    "complete: made by attempt {attempt} in {seconds:.1} s"
                )),
                status => {
                    lines.push(format!(
                        "{status} in {} of attempt {attempt}: {}",
                        row.text("phase"),
                        row.text("message")
                    ));
                    lines.push(if status == CRASHED {
                        "`pao-sim run CONFIG --retry-failed` tries it again in a process of its own"
                            .into()
                    } else {
                        "`pao-sim run CONFIG --retry-failed` tries it again".into()
                    });
                }
            }
            lines.push(format!("again: pao-sim replay {folder} {name}"));
        }
        None => lines.push("not done yet".into()),
    }
    for attempt in &study.state.attempts {
        let (index, count) = attempt.share;
        let shard = Shard::new(index, count).unwrap_or(Shard::WHOLE);
        let number = attempt.attempt;
        let host = attempt.provenance["host"].as_str().unwrap_or("?");
        for key in attempt
            .in_work
            .iter()
            .filter(|key| **key == name || **key == case)
        {
            let what = if *key == name {
                "it"
            } else {
                "its case's simulation"
            };
            lines.push(if attempt.alive {
                format!("attempt {number} on {host} has {what} in work")
            } else if attempt.died() {
                format!("attempt {number} on {host} died while {what} was in work")
            } else {
                format!("attempt {number} on {host} ran out of time while {what} was in work")
            });
        }
        for (key, how) in attempt
            .crashed
            .iter()
            .filter(|(key, _)| *key == name || *key == case)
        {
            let what = if *key == name {
                "it"
            } else {
                "its case's simulation"
            };
            lines.push(format!(
                "in attempt {number} {what} ended a process of its own: {how}"
            ));
        }
        if attempt.alive && row.is_none() && belongs(study, shard, &key.case) {
            lines.push(format!(
                "it belongs to share {shard}, which attempt {number} on {host} works on"
            ));
        }
    }
    if row.is_none() && (study.state.is_suspect(&name) || study.state.is_suspect(&case)) {
        lines.push(
            "it is suspected of ending its process: the next run tries it in one of its own".into(),
        );
    }
    lines
}

fn belongs(study: &Snapshot, shard: Shard, case: &CaseKey) -> bool {
    let place = study.plan.cases.iter().position(|own| own == case);
    place.is_some_and(|place| shard.has(place))
}
