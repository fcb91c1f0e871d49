//! Progress: a bar on a terminal, a line a minute elsewhere, JSON for machines.

use super::output::say;
use indicatif::{ProgressBar, ProgressStyle};
use pao_sim::store::{COMPLETE, Row};
use pao_sim::study::{Event, RegistrationKey};
use serde_json::json;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// How often a line is printed where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(60);

/// Shows how a run goes on.
#[derive(Debug)]
pub struct Progress {
    bar: Option<ProgressBar>,
    json: bool,
    planned: usize,
    state: Mutex<Counts>,
}

#[derive(Debug)]
struct Counts {
    done: usize,
    failed: usize,
    /// Rows of this run.
    now: usize,
    begin: Instant,
    last_line: Instant,
}

impl Progress {
    /// Begins with `done` of `planned` registrations.
    pub fn new(planned: usize, done: usize, failed: usize, json: bool) -> Self {
        let bar = (!json && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::new(planned as u64).with_position(done as u64);
            let template = "{elapsed_precise} [{bar:40}] {pos}/{len} registrations{msg}";
            let style = ProgressStyle::with_template(template);
            bar.set_style(style.expect("the template is a constant that a test passes"));
            bar
        });
        let now = Instant::now();
        Self {
            bar,
            json,
            planned,
            state: Mutex::new(Counts {
                done,
                failed,
                now: 0,
                begin: now,
                last_line: now,
            }),
        }
    }

    /// Takes in what a run tells.
    pub fn on(&self, event: Event) {
        let mut counts = self.state.lock().expect("no thread panics while it prints");
        match event {
            Event::Row(row) => {
                counts.done += 1;
                counts.now += 1;
                let failed = row.text("status") != COMPLETE;
                counts.failed += usize::from(failed);
                if self.json {
                    say!("{}", described(row));
                } else if failed {
                    let key = RegistrationKey::of_row(row);
                    let key = key.map_or_else(String::new, |key| key.to_string());
                    let (phase, message) = (row.text("phase"), row.text("message"));
                    self.line(&format!("failed: {key} in {phase}: {message}"));
                }
                if let Some(bar) = &self.bar {
                    bar.set_position(counts.done as u64);
                }
            }
            Event::Simulated(case, seconds) => {
                tracing::info!("simulated {case} in {seconds:.1} s");
            }
            Event::Tick => {
                if let Some(bar) = &self.bar {
                    bar.set_message(self.rest(&counts));
                } else if !self.json && counts.last_line.elapsed() >= LINE_EVERY {
                    counts.last_line = Instant::now();
                    let (done, planned) = (counts.done, self.planned);
                    eprintln!("{done} of {planned} registrations{}", self.rest(&counts));
                }
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None => eprintln!("{text}"),
        }
    }

    /// Failures so far, rate and time to go.
    fn rest(&self, counts: &Counts) -> String {
        let failed = match counts.failed {
            0 => String::new(),
            failed => format!(", {failed} failed"),
        };
        if counts.now == 0 {
            return failed;
        }
        let each = counts.begin.elapsed().as_secs_f64() / counts.now as f64;
        let left = each * self.planned.saturating_sub(counts.done) as f64;
        format!(
            "{failed}, {:.0} an hour, {} to go",
            3600.0 / each,
            duration(left)
        )
    }
}

fn described(row: &Row) -> serde_json::Value {
    let key = RegistrationKey::of_row(row).map(|key| key.to_string());
    json!({
        "key": key,
        "status": row.text("status"),
        "rotation_error_deg": row.number("rotation_error_deg"),
        "translation_error_mm": row.number("translation_error_mm"),
        "lce_error_deg": row.number("lce_error_deg"),
        "seconds": row.number("registration_seconds"),
        "message": row.text("message"),
    })
}

/// `42 s`, `5 min`, `3.4 h`, `2.1 days`.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s if s < 48.0 * 3600.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.1} days", s / 86400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_short() {
        let texts = [3.2, 300.0, 12_240.0, 200_000.0].map(duration);
        assert_eq!(texts, ["3 s", "5 min", "3.4 h", "2.3 days"]);
    }

    #[test]
    fn the_bar_and_its_template_work() {
        ProgressStyle::with_template("{elapsed_precise} [{bar:40}] {pos}/{len} registrations{msg}")
            .unwrap();
        let progress = Progress::new(10, 4, 0, false);
        progress.on(Event::Tick);
        let counts = progress.state.lock().unwrap();
        assert_eq!((counts.done, progress.rest(&counts).as_str()), (4, ""));
    }
}
