//! Range checks of parameters.

use std::ops::RangeInclusive;

/// A field's name, its value, the range that it may have, and the unit (with a leading blank, or
/// empty).
pub(crate) type Check<'a> = (&'a str, f64, RangeInclusive<f64>, &'a str);

/// The fields out of range, as (field, what is wrong and what is expected).
pub(crate) fn out_of_range(checks: &[Check]) -> Vec<(String, String)> {
    checks
        .iter()
        .filter(|(_, value, range, _)| !range.contains(value))
        .map(|(field, value, range, unit)| {
            let (low, high) = (range.start(), range.end());
            let message = format!("is {value}{unit}; expected {low} to {high}{unit}");
            ((*field).to_owned(), message)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_what_is_wrong_and_refuses_nan() {
        let found = out_of_range(&[
            ("good", 1.0, 0.0..=1.0, " mm"),
            ("far", 2.5, 0.0..=1.0, " mm"),
            ("none", f64::NAN, 0.0..=1.0, ""),
        ]);
        assert_eq!(
            found[0],
            ("far".into(), "is 2.5 mm; expected 0 to 1 mm".into())
        );
        assert_eq!(found[1].0, "none");
        assert_eq!(found.len(), 2);
    }
}
