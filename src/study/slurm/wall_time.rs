//! Wall times as Slurm writes them.

use std::fmt;
use std::str::FromStr;

/// A time limit of a job.
///
/// Read as Slurm does (`30` are minutes, `30:00`, `12:00:00`, `2-12`, `2-12:00`, `2-12:00:00`) or with a
/// unit (`90s`, `45m`, `11.5h`, `2d`); printed as Slurm reads it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct WallTime {
    seconds: u64,
}

impl WallTime {
    /// A time of whole seconds.
    pub const fn from_seconds(seconds: u64) -> Self {
        Self { seconds }
    }

    /// The time in seconds.
    pub const fn seconds(self) -> u64 {
        self.seconds
    }
}

/// A text that is no wall time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected a time as Slurm reads it (30 for minutes, 12:00:00, 2-12:00:00) or with a unit (90s, 45m, 11.5h, 2d)"
)]
pub struct WallTimeError;

impl FromStr for WallTime {
    type Err = WallTimeError;

    fn from_str(text: &str) -> Result<Self, WallTimeError> {
        let seconds = match text.char_indices().last() {
            Some((last, unit @ ('s' | 'm' | 'h' | 'd'))) => with_unit(&text[..last], unit),
            _ => of_slurm(text),
        };
        match seconds {
            Some(seconds @ 1..) => Ok(Self { seconds }),
            _ => Err(WallTimeError),
        }
    }
}

fn with_unit(number: &str, unit: char) -> Option<u64> {
    let number: f64 = number.parse().ok()?;
    let each = match unit {
        's' => 1.0,
        'm' => 60.0,
        'h' => 3600.0,
        _ => 86400.0,
    };
    // Above ten thousand days somebody mistook the unit.
    let seconds = (number * each).ceil();
    (0.0..=1e4 * 86400.0)
        .contains(&seconds)
        .then_some(seconds as u64)
}

fn of_slurm(text: &str) -> Option<u64> {
    let (days, clock) = match text.split_once('-') {
        Some((days, clock)) => (Some(number(days)?), clock),
        None => (None, text),
    };
    let parts: Vec<u64> = clock.split(':').map(number).collect::<Option<_>>()?;
    let seconds = match (days, parts.as_slice()) {
        (Some(_), &[hours]) => 3600 * hours,
        (Some(_), &[hours, minutes]) => 3600 * hours + 60 * minutes,
        (None, &[minutes]) => 60 * minutes,
        (None, &[minutes, seconds]) => 60 * minutes + seconds,
        (_, &[hours, minutes, seconds]) => 3600 * hours + 60 * minutes + seconds,
        _ => return None,
    };
    Some(86400 * days.unwrap_or(0) + seconds)
}

/// Up to seven digits, so that no sum of such numbers overflows.
fn number(text: &str) -> Option<u64> {
    let digits = (1..=7).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
    digits.then(|| text.parse().ok())?
}

impl fmt::Display for WallTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (days, rest) = (self.seconds / 86400, self.seconds % 86400);
        if days > 0 {
            write!(f, "{days}-")?;
        }
        write!(
            f,
            "{:02}:{:02}:{:02}",
            rest / 3600,
            rest / 60 % 60,
            rest % 60
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn times_are_read_as_slurm_and_with_units() {
        let seconds = |text: &str| text.parse().map(WallTime::seconds);
        for (text, expected) in [
            ("30", 1800),
            ("30:00", 1800),
            ("12:00:00", 43_200),
            ("2-12", 216_000),
            ("2-12:30", 217_800),
            ("2-12:00:01", 216_001),
            ("90s", 90),
            ("45m", 2700),
            ("11.5h", 41_400),
            ("2d", 172_800),
        ] {
            assert_eq!(seconds(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in [
            "", "0", "0:00", "-5", "soon", "1:2:3:4", "1-", "1-2-3", "12:", "1h30m", "-1h", "NaNh",
            "1e9d", "99999999", "1.5", "ü",
        ] {
            assert_eq!(
                text.parse::<WallTime>(),
                Err(WallTimeError),
                "{text:?} was taken"
            );
        }
    }

    proptest! {
        #[test]
        fn what_is_printed_reads_back(seconds in 1_u64..100_000_000) {
            let time = WallTime::from_seconds(seconds);
            prop_assert_eq!(time.to_string().parse(), Ok(time));
        }

        #[test]
        fn no_text_panics(text in "[-:0-9smhd.]{0,24}") {
            let _ = text.parse::<WallTime>();
        }
    }
}
