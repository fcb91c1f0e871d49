//! Keys in rows.

use super::{CaseKey, FragmentKey, RegistrationKey, Scenario};
use crate::anatomy::Side;
use crate::store::Row;

impl RegistrationKey {
    /// A row with the key's columns set.
    pub fn row(&self) -> Row {
        let mut row = Row::default();
        let fragment = &self.case.fragment;
        row.set("specimen", fragment.specimen.as_str());
        row.set("side", fragment.side.name());
        row.set("fragment", fragment.fragment);
        row.set("movement", self.case.movement);
        row.set("initialization", self.initialization);
        row.set("scenario", self.scenario.name());
        row.set("strategy", self.strategy.as_str());
        row
    }

    /// The key of a row; `None` when one of its columns is empty or no key's.
    pub fn of_row(row: &Row) -> Option<Self> {
        let number = |column| u32::try_from(row.integer(column)?).ok();
        let text = |column| Some(row.text(column).to_owned()).filter(|text| !text.is_empty());
        let side = text("side")?;
        Some(Self {
            case: CaseKey {
                fragment: FragmentKey {
                    specimen: text("specimen")?,
                    side: Side::BOTH.into_iter().find(|s| s.name() == side)?,
                    fragment: number("fragment")?,
                },
                movement: number("movement")?,
            },
            initialization: number("initialization")?,
            scenario: Scenario::from_name(&text("scenario")?)?,
            strategy: text("strategy")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_comes_back_from_its_row() {
        let key: RegistrationKey = "z001/right/f03/m07/i2/no_cuts_known/paper".parse().unwrap();
        assert_eq!(RegistrationKey::of_row(&key.row()), Some(key));
        assert_eq!(RegistrationKey::of_row(&Row::default()), None);
    }
}
