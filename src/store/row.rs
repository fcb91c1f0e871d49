//! One row: the values of a registration in the order of the schema.

use super::schema::{Kind, Role, SCHEMA};

/// A value of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Text(String),
    Integer(i64),
    Number(f64),
    Flag(bool),
}

impl Value {
    /// The kind of column that holds it.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Text(_) => Kind::Text,
            Self::Integer(_) => Kind::Integer,
            Self::Number(_) => Kind::Number,
            Self::Flag(_) => Kind::Flag,
        }
    }
}

impl From<&str> for Value {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl From<String> for Value {
    fn from(value: String) -> Self {
        Self::Text(value)
    }
}

impl From<i64> for Value {
    fn from(value: i64) -> Self {
        Self::Integer(value)
    }
}

impl From<u32> for Value {
    fn from(value: u32) -> Self {
        Self::Integer(value.into())
    }
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Self::Flag(value)
    }
}

/// The values of one registration; empty where nothing was set.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    pub(super) values: Vec<Option<Value>>,
}

impl Default for Row {
    fn default() -> Self {
        Self {
            values: vec![None; SCHEMA.columns.len()],
        }
    }
}

impl Row {
    /// Sets a column.
    ///
    /// # Panics
    /// When the schema has no such column or it holds another kind: the schema is the program's own.
    pub fn set(&mut self, column: &str, value: impl Into<Value>) {
        let value = value.into();
        let place = place(column);
        let kind = SCHEMA.columns[place].kind;
        assert!(
            value.kind() == kind,
            "column {column} holds {kind:?}, not {value:?}"
        );
        self.values[place] = Some(value);
    }

    /// The value of a column, if it was set.
    ///
    /// # Panics
    /// When the schema has no such column.
    pub fn get(&self, column: &str) -> Option<&Value> {
        self.values[place(column)].as_ref()
    }

    /// The text of a column; empty when it was not set.
    ///
    /// # Panics
    /// When the schema has no such column, or it holds no text.
    pub fn text(&self, column: &str) -> &str {
        match self.get(column) {
            None => "",
            Some(Value::Text(text)) => text,
            Some(other) => panic!("column {column} holds {other:?}, not text"),
        }
    }

    /// The integer of a column, if it was set.
    ///
    /// # Panics
    /// When the schema has no such column, or it holds no integer.
    pub fn integer(&self, column: &str) -> Option<i64> {
        match self.get(column)? {
            Value::Integer(value) => Some(*value),
            other => panic!("column {column} holds {other:?}, not an integer"),
        }
    }

    /// The number of a column, if it was set.
    ///
    /// # Panics
    /// When the schema has no such column, or it holds no number.
    pub fn number(&self, column: &str) -> Option<f64> {
        match self.get(column)? {
            Value::Number(value) => Some(*value),
            other => panic!("column {column} holds {other:?}, not a number"),
        }
    }

    /// The columns that two rows of one key must agree on and do not, each with both values.
    /// Numbers are compared by their bits.
    pub fn differences(&self, other: &Self) -> Vec<(&'static str, Option<Value>, Option<Value>)> {
        let columns = SCHEMA
            .columns
            .iter()
            .zip(self.values.iter().zip(&other.values));
        columns
            .filter(|(column, (a, b))| column.role != Role::Measurement && !equal_bits(a, b))
            .map(|(column, (a, b))| (column.name.as_str(), a.clone(), b.clone()))
            .collect()
    }
}

fn equal_bits(a: &Option<Value>, b: &Option<Value>) -> bool {
    match (a, b) {
        (Some(Value::Number(a)), Some(Value::Number(b))) => a.to_bits() == b.to_bits(),
        _ => a == b,
    }
}

fn place(column: &str) -> usize {
    SCHEMA
        .place(column)
        .unwrap_or_else(|| panic!("the schema has no column {column}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back() {
        let mut row = Row::default();
        row.set("specimen", "phantom-1");
        row.set("fragment", 3u32);
        row.set("rotation_error_deg", 1.25);
        assert_eq!(row.text("specimen"), "phantom-1");
        assert_eq!(row.integer("fragment"), Some(3));
        assert_eq!(row.number("rotation_error_deg"), Some(1.25));
        assert_eq!(row.get("lce_error_deg"), None);
        assert_eq!(row.text("message"), "");
    }

    #[test]
    #[should_panic(expected = "column fragment holds Integer, not Text")]
    fn another_kind_is_a_mistake() {
        Row::default().set("fragment", "three");
    }

    #[test]
    fn only_results_must_agree() {
        let (mut a, mut b) = (Row::default(), Row::default());
        a.set("registration_seconds", 1.0);
        b.set("registration_seconds", 2.0);
        assert!(a.differences(&b).is_empty());
        a.set("true_lce_deg", 0.0);
        b.set("true_lce_deg", -0.0);
        let names: Vec<_> = a.differences(&b).into_iter().map(|d| d.0).collect();
        assert_eq!(names, ["true_lce_deg"]);
    }
}
