//! Shares of a study.

use super::Plan;
use super::plan::CaseNumber;
use std::str::FromStr;

/// One of several shares of a study's cases. Case number `n` (from 0, in the plan's order) belongs to the
/// share `n mod count`: whatever number of shares was used before, what is left is spread evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    index: u32,
    count: u32,
}

/// Shares at most.
const MOST: u32 = 1_000_000;

impl Shard {
    /// The whole study.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// The share of a place, from 0, of `count`; `None` when there is no such place.
    pub fn new(index: u32, count: u32) -> Option<Self> {
        (index < count && count <= MOST).then_some(Self { index, count })
    }

    /// The share that a Slurm array task has: the array must be 0 to n - 1, so that its number of tasks
    /// is the number of shares. `None` outside of an array.
    ///
    /// # Errors
    /// When the array has another form; the message says what to do.
    pub fn of_slurm(variable: &dyn Fn(&str) -> Option<String>) -> Result<Option<Self>, String> {
        let Some(task) = variable("SLURM_ARRAY_TASK_ID") else {
            return Ok(None);
        };
        let number = |name: &str| -> Result<u32, String> {
            let text = variable(name).ok_or(format!("{name} is not set"))?;
            text.parse()
                .map_err(|_| format!("{name} is \"{text}\", expected a whole number"))
        };
        let find = || -> Result<Self, String> {
            let task = task
                .parse()
                .map_err(|_| format!("SLURM_ARRAY_TASK_ID is \"{task}\""))?;
            let (low, high) = (
                number("SLURM_ARRAY_TASK_MIN")?,
                number("SLURM_ARRAY_TASK_MAX")?,
            );
            let count = number("SLURM_ARRAY_TASK_COUNT")?;
            if low != 0 || high.checked_add(1) != Some(count) {
                return Err(format!(
                    "it has {count} tasks from {low} to {high}, which does not tell how many shares there are"
                ));
            }
            Self::new(task, count).ok_or(format!("it has no task {task}"))
        };
        find().map(Some).map_err(|problem| {
            format!("cannot take a share from this Slurm array: {problem}; expected --array=0-(n-1), or say --shard I/N")
        })
    }

    /// Place, from 0, and number of shares.
    pub fn parts(self) -> (u32, u32) {
        (self.index, self.count)
    }

    /// True for the whole study.
    pub fn is_whole(self) -> bool {
        self.count == 1
    }

    /// True when the case of this number, from 0, belongs to the share.
    pub fn has(self, case: usize) -> bool {
        case % self.count as usize == self.index as usize
    }

    /// True when some of the first `cases` cases belong to both shares.
    pub fn meets(self, other: Self, cases: usize) -> bool {
        let own = (self.index as usize..cases).step_by(self.count as usize);
        own.into_iter().any(|case| other.has(case))
    }

    /// The cases of a plan that belong to the share, with their numbers.
    pub fn cases(self, plan: &Plan) -> impl Iterator<Item = CaseNumber<'_>> {
        let numbered = plan.cases.iter().enumerate();
        numbered.filter(move |(number, _)| self.has(*number))
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index + 1, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    /// Reads `I/N` with I from 1 to N.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/');
        parts
            .and_then(|(i, n)| {
                let i: u32 = i.parse().ok()?;
                Self::new(i.checked_sub(1)?, n.parse().ok()?)
            })
            .ok_or_else(|| {
                format!("expected I/N with I from 1 to N and N at most {MOST}, as in 3/16")
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Every case belongs to exactly one share.
        #[test]
        fn shares_part_the_cases(count in 1u32..50, cases in 0usize..200) {
            let shards: Vec<Shard> = (0..count).map(|i| Shard::new(i, count).unwrap()).collect();
            for case in 0..cases {
                prop_assert_eq!(shards.iter().filter(|shard| shard.has(case)).count(), 1);
            }
        }

        #[test]
        fn meeting_means_having_a_case_in_common(
            (a, m) in (1u32..20).prop_flat_map(|m| (0..m, Just(m))),
            (b, n) in (1u32..20).prop_flat_map(|n| (0..n, Just(n))),
            cases in 0usize..100,
        ) {
            let (x, y) = (Shard::new(a, m).unwrap(), Shard::new(b, n).unwrap());
            let common = (0..cases).any(|case| x.has(case) && y.has(case));
            prop_assert_eq!(x.meets(y, cases), common);
            prop_assert_eq!(y.meets(x, cases), common);
        }
    }

    #[test]
    fn shares_are_written_from_one() {
        let shard: Shard = "3/16".parse().unwrap();
        assert_eq!((shard.parts(), shard.to_string()), ((2, 16), "3/16".into()));
        for wrong in ["0/4", "5/4", "3", "a/b", "1/0", "-1/4", "1/4294967295"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn an_array_from_zero_gives_its_share_and_another_is_refused() {
        let of = |values: [(&'static str, &'static str); 4]| {
            Shard::of_slurm(&move |name| {
                let found = values.iter().find(|(key, _)| name.ends_with(key));
                found.map(|(_, value)| (*value).to_owned())
            })
        };
        let array = |id, min, max, count| {
            [
                ("TASK_ID", id),
                ("TASK_MIN", min),
                ("TASK_MAX", max),
                ("TASK_COUNT", count),
            ]
        };
        assert_eq!(of(array("3", "0", "7", "8")).unwrap(), Shard::new(3, 8));
        for wrong in [
            array("3", "3", "7", "2"),
            array("3", "1", "8", "8"),
            array("3", "0", "8", "5"),
            array("x", "0", "7", "8"),
        ] {
            let message = of(wrong).unwrap_err();
            assert!(message.contains("--shard I/N"), "{message}");
        }
        assert_eq!(Shard::of_slurm(&|_| None), Ok(None));
    }
}
