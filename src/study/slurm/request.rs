//! What a user asks of Slurm, checked.

use super::quoting::is_line;
use super::{SlurmError, WallTime};
use std::ops::RangeInclusive;

/// The size of arrays that Slurm allows unless a cluster says otherwise: indices 0 to 1000.
pub const MAX_ARRAY_SIZE: u32 = 1001;

/// What the jobs of a study are to be given.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Shares of the study: tasks of the arrays together.
    pub tasks: u32,
    /// Processors of a task, and threads of its program.
    pub cpus: u32,
    /// Wall time of a task; none for the partition's default.
    pub time: Option<WallTime>,
    /// How long before its end a task is told to stop, 1 to 65535 seconds. Slurm may tell it a
    /// minute earlier.
    pub margin: WallTime,
    /// Memory of a task, as `--mem` of sbatch has it: megabytes, or with K, M, G or T.
    pub memory: Option<String>,
    pub partition: Option<String>,
    pub account: Option<String>,
    pub qos: Option<String>,
    pub constraint: Option<String>,
    /// Tasks that run at the same time at most.
    pub max_running: Option<u32>,
    /// Further options, each a line `#SBATCH ...` as it is.
    pub lines: Vec<String>,
    /// `MaxArraySize` of the cluster: one more than the largest index.
    pub max_array_size: u32,
    /// Further arguments of `pao-sim run`.
    pub run: Vec<String>,
}

/// One job array: the tasks 0 to `tasks - 1` work on the shares `first` to `first + tasks - 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Array {
    /// The first task's share, from 1.
    pub first: u32,
    /// Number of tasks.
    pub tasks: u32,
}

impl Array {
    /// Its shares, from 1.
    pub fn shares(&self) -> RangeInclusive<u32> {
        self.first..=self.first + self.tasks - 1
    }
}

/// Options that the scripts rely on, by their long and short names; a line that sets one breaks them.
const OWNED: [(&str, &str); 16] = [
    ("array", "a"),
    ("job-name", "J"),
    ("nodes", "N"),
    ("ntasks", "n"),
    ("cpus-per-task", "c"),
    ("time", "t"),
    ("signal", ""),
    ("requeue", ""),
    ("no-requeue", ""),
    ("open-mode", ""),
    ("output", "o"),
    ("error", "e"),
    ("dependency", "d"),
    ("chdir", "D"),
    ("parsable", ""),
    ("wrap", ""),
];

impl Request {
    /// Refuses what Slurm would refuse late, or what would leave tasks without work. `cases` is how
    /// many the study has.
    ///
    /// # Errors
    /// With the flag, its value and what was expected.
    pub fn check(&self, cases: usize) -> Result<(), SlurmError> {
        let refuse = |flag, value: &dyn ToString, expected: String| {
            Err(SlurmError::Value {
                flag,
                value: value.to_string(),
                expected,
            })
        };
        if self.tasks == 0 || self.tasks as usize > cases {
            let expected = format!(
                "expected 1 to {cases}: a task takes whole cases, and the study has {cases}"
            );
            return refuse("--tasks", &self.tasks, expected);
        }
        if self.cpus == 0 {
            return refuse("--cpus", &self.cpus, "expected 1 or more".into());
        }
        if self.max_running == Some(0) {
            return refuse("--max-running", &0, "expected 1 or more".into());
        }
        if self.max_array_size == 0 {
            let expected =
                "expected 1 or more; this cluster's MaxArraySize allows no arrays".into();
            return refuse("--max-array-size", &0, expected);
        }
        if self.margin.seconds() > 65_535 {
            let expected = "expected at most 65535 seconds, Slurm's largest".into();
            return refuse("--margin", &self.margin, expected);
        }
        if let Some(time) = self.time
            && time <= self.margin
        {
            let expected = format!(
                "expected less than --time {time}: a task works until so long before its end"
            );
            return refuse("--margin", &self.margin, expected);
        }
        if let Some(memory) = &self.memory
            && !is_memory(memory)
        {
            let expected = "expected a whole number of megabytes, or one with K, M, G or T, as 4G";
            return refuse("--mem", memory, expected.into());
        }
        let texts = [
            ("--partition", &self.partition),
            ("--account", &self.account),
            ("--qos", &self.qos),
            ("--constraint", &self.constraint),
        ];
        for (flag, text) in texts {
            if let Some(text) = text
                && (text.is_empty() || !is_line(text))
            {
                return refuse(
                    flag,
                    &format!("{text:?}"),
                    "expected one line of text".into(),
                );
            }
        }
        for line in &self.lines {
            if !line.starts_with('-') || !is_line(line) {
                let expected = "expected one line of sbatch's options, as \"--mail-type=END\"";
                return refuse("--sbatch", &format!("{line:?}"), expected.into());
            }
            if let Some(name) = line.split_whitespace().find_map(owned) {
                let expected = format!(
                    "--{name} is set by the generated scripts; use the flags of `pao-sim slurm`, or edit a script"
                );
                return refuse("--sbatch", &format!("{line:?}"), expected);
            }
        }
        Ok(())
    }

    /// The arrays that hold all tasks, each as large as the cluster allows.
    pub fn arrays(&self) -> Vec<Array> {
        let firsts = (1..=self.tasks).step_by(self.max_array_size as usize);
        firsts
            .map(|first| Array {
                first,
                tasks: (self.tasks - first + 1).min(self.max_array_size),
            })
            .collect()
    }
}

/// The owned option that a word sets.
fn owned(word: &str) -> Option<&'static str> {
    let sets = |&&(long, short): &&(&str, &str)| match word.strip_prefix("--") {
        Some(rest) => rest.split('=').next() == Some(long),
        None => {
            let rest = word.strip_prefix('-');
            !short.is_empty() && rest.is_some_and(|rest| rest.starts_with(short))
        }
    };
    OWNED.iter().find(sets).map(|&(long, _)| long)
}

fn is_memory(text: &str) -> bool {
    let number = text.strip_suffix(['K', 'M', 'G', 'T']).unwrap_or(text);
    (1..=12).contains(&number.len()) && number.bytes().all(|byte| byte.is_ascii_digit())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    pub fn request(tasks: u32) -> Request {
        Request {
            tasks,
            cpus: 4,
            time: Some(WallTime::from_seconds(12 * 3600)),
            margin: WallTime::from_seconds(120),
            memory: None,
            partition: None,
            account: None,
            qos: None,
            constraint: None,
            max_running: None,
            lines: Vec::new(),
            max_array_size: MAX_ARRAY_SIZE,
            run: Vec::new(),
        }
    }

    fn refused(change: impl FnOnce(&mut Request)) -> String {
        let mut request = request(4);
        change(&mut request);
        request.check(8).unwrap_err().to_string()
    }

    #[test]
    fn values_that_cannot_work_are_refused_by_name() {
        assert!(request(8).check(8).is_ok());
        let text = |text: &str| Some(text.to_owned());
        let messages = [
            refused(|r| r.tasks = 9),
            refused(|r| r.tasks = 0),
            refused(|r| r.cpus = 0),
            refused(|r| r.max_running = Some(0)),
            refused(|r| r.max_array_size = 0),
            refused(|r| r.margin = WallTime::from_seconds(70_000)),
            refused(|r| r.time = Some(r.margin)),
            refused(|r| r.memory = text("4 GB")),
            refused(|r| r.partition = text("")),
            refused(|r| r.constraint = text("a\n#SBATCH --array=1")),
            refused(|r| r.lines = vec!["mail".into()]),
            refused(|r| r.lines = vec!["--mail-type=END -o x".into()]),
            refused(|r| r.lines = vec!["--array=1-5".into()]),
        ];
        insta::assert_snapshot!(messages.join("\n"));
    }

    #[test]
    fn lines_and_sizes_that_are_fine_are_taken() {
        let mut request = request(4);
        request.lines = vec![
            "--mail-type=END".into(),
            "-x node7".into(),
            "--gres=gpu:1 --nice".into(),
        ];
        for memory in ["0", "4000", "4G", "512M"] {
            request.memory = Some(memory.into());
            request.check(4).unwrap_or_else(|e| panic!("{e}"));
        }
    }

    proptest! {
        /// Every share belongs to one task, in order, and no index passes the cluster's largest.
        #[test]
        fn the_arrays_hold_every_share_once(tasks in 1_u32..5000, max_array_size in 1_u32..1500) {
            let arrays = Request { max_array_size, ..request(tasks) }.arrays();
            let shares: Vec<u32> = arrays.iter().flat_map(Array::shares).collect();
            prop_assert_eq!(shares, (1..=tasks).collect::<Vec<_>>());
            prop_assert!(arrays.iter().all(|array| array.tasks <= max_array_size));
            prop_assert_eq!(arrays.len(), tasks.div_ceil(max_array_size) as usize);
        }
    }
}
