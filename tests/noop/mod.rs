//! A worker that takes no time: for tests and benches of the engine, never a strategy of the program.

#![allow(dead_code, reason = "each test uses a part of it")]

use pao_sim::store::journal::{StreamWriter, read_stream};
use pao_sim::store::{Kind, Record, Role, Row, SCHEMA};
use pao_sim::study::isolation::{Fate, Isolation};
use pao_sim::study::queue::CaseWork;
use pao_sim::study::runner::run;
use pao_sim::study::{
    CaseKey, Config, Failure, OpenOptions, Outcome, Redo, RegistrationKey, RunOptions, Shard, Stop,
    Study, StudyError, Worker,
};
use std::path::Path;
use std::time::Duration;

/// Fills every column from the hash of the row's key.
pub struct NoOp {
    /// Time that a registration seems to take.
    pub pause: Duration,
}

impl Worker for NoOp {
    type Case = ();

    fn simulate(&self, _: &CaseKey) -> Result<(), Failure> {
        Ok(())
    }

    fn register(&self, _: &(), key: &RegistrationKey, row: &mut Row) -> Result<(), Failure> {
        if !self.pause.is_zero() {
            std::thread::sleep(self.pause);
        }
        let mut bytes = blake3::Hasher::new()
            .update(key.to_string().as_bytes())
            .finalize_xof();
        let mut number = || {
            let mut of = [0; 8];
            bytes.fill(&mut of);
            u64::from_le_bytes(of)
        };
        row.set("specimen_kind", "phantom");
        for column in &SCHEMA.columns {
            let value = number();
            if column.role != Role::Result {
                continue;
            }
            match column.kind {
                Kind::Text => {}
                Kind::Integer => row.set(&column.name, (value % 1000) as i64),
                Kind::Number => row.set(&column.name, (value >> 11) as f64 / (1u64 << 53) as f64),
                Kind::Flag => row.set(&column.name, value & 1 == 1),
            }
        }
        Ok(())
    }
}

/// Suspects of no process run in this one.
pub struct SameProcess(pub Duration);

impl Isolation for SameProcess {
    fn run(
        &self,
        keys: &[RegistrationKey],
        threads: usize,
        stop: &Stop,
        record: &mut dyn FnMut(Record),
    ) -> Result<Fate, String> {
        let mut work: Vec<CaseWork> = Vec::new();
        for key in keys {
            match work.last_mut() {
                Some(last) if last.case == key.case => last.registrations.push(key.clone()),
                _ => work.push(CaseWork {
                    case: key.case.clone(),
                    registrations: vec![key.clone()],
                }),
            }
        }
        let options = RunOptions {
            threads,
            cases_in_flight: 0,
            stop,
            leave: &|_| {},
        };
        let mut bytes = Vec::new();
        let worker = NoOp { pause: self.0 };
        run(
            &worker,
            work,
            0,
            &mut StreamWriter(&mut bytes),
            &options,
            &|_| {},
        )
        .map_err(|error| error.to_string())?;
        read_stream(&bytes[..], record).map_err(|error| error.to_string())?;
        Ok(Fate::Ended)
    }
}

/// Runs a share of a study whose registrations take `pause`.
pub fn run_share(
    config: &str,
    results: &Path,
    shard: Shard,
    threads: usize,
    pause: Duration,
) -> Result<Outcome, StudyError> {
    let config = Config::parse(config, Path::new("noop.toml"), &|_| None)?;
    let options = OpenOptions {
        shard,
        ..OpenOptions::default()
    };
    let study = Study::open(config, results, &options, threads)?;
    let stop = Stop::new(None);
    let run = RunOptions {
        threads,
        cases_in_flight: 0,
        stop: &stop,
        leave: &|_| {},
    };
    study.run(
        &NoOp { pause },
        Redo::Nothing,
        &run,
        &SameProcess(pause),
        &|_| {},
    )
}
