//! Records and their bytes.

use crate::store::row::{Row, Value};
use crate::store::schema::{Kind, SCHEMA};
use serde::{Deserialize, Serialize};

/// What opens a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Number of the attempt, from 1.
    pub attempt: u32,
    /// The attempt's share of the study: a place from 0 and a number of shares.
    pub share: (u32, u32),
    /// Columns of the rows, in their order.
    pub columns: Vec<(String, Kind)>,
    /// Where, with what and how the attempt ran.
    pub provenance: serde_json::Value,
}

impl Header {
    /// The header of an attempt that writes today's rows.
    pub fn new(attempt: u32, share: (u32, u32), provenance: serde_json::Value) -> Self {
        Self {
            attempt,
            share,
            columns: todays_columns(),
            provenance,
        }
    }
}

/// Names and kinds of the schema's columns.
pub(in crate::store) fn todays_columns() -> Vec<(String, Kind)> {
    let columns = SCHEMA.columns.iter();
    columns.map(|c| (c.name.clone(), c.kind)).collect()
}

/// How an attempt ended in order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// True when time was up and work that had begun was dropped: nobody is to blame for it.
    pub left: bool,
    /// The most memory that the process held at once, in bytes, where the system tells.
    pub peak_memory_bytes: Option<u64>,
}

/// One thing that an attempt did.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// Work on a key (a case's simulation, or a registration) began.
    Started(String),
    /// Work on a key that leaves no row of its own (a case's simulation) ended.
    Finished(String),
    /// A registration ended, well or not.
    Row(Box<Row>),
    /// Work on a key ended the process that did nothing else; the text says how it died.
    Crashed { key: String, how: String },
    /// The attempt ended in order.
    Ended(End),
}

pub(super) const HEADER: u8 = 0;
const STARTED: u8 = 1;
const FINISHED: u8 = 2;
const ROW: u8 = 3;
const ENDED: u8 = 4;
const CRASHED: u8 = 5;

impl Record {
    /// Kind and payload of the record's frame.
    pub(super) fn encode(&self) -> (u8, Vec<u8>) {
        match self {
            Self::Started(key) => (STARTED, key.clone().into_bytes()),
            Self::Finished(key) => (FINISHED, key.clone().into_bytes()),
            Self::Row(row) => (ROW, encode_row(row)),
            Self::Crashed { key, how } => (CRASHED, format!("{key}\n{how}").into_bytes()),
            Self::Ended(end) => (ENDED, serde_json::to_vec(end).expect("it is plain data")),
        }
    }

    /// The record of a frame; `columns` gives the place in today's schema of each value of a row.
    /// `None` when the payload is not what the kind says.
    pub(super) fn decode(kind: u8, payload: &[u8], columns: &[usize]) -> Option<Self> {
        let text = || String::from_utf8(payload.to_vec()).ok();
        match kind {
            STARTED => Some(Self::Started(text()?)),
            FINISHED => Some(Self::Finished(text()?)),
            ROW => Some(Self::Row(Box::new(decode_row(payload, columns)?))),
            CRASHED => {
                let text = text()?;
                let (key, how) = text.split_once('\n')?;
                Some(Self::Crashed {
                    key: key.into(),
                    how: how.into(),
                })
            }
            ENDED => Some(Self::Ended(serde_json::from_slice(payload).ok()?)),
            _ => None,
        }
    }
}

fn encode_row(row: &Row) -> Vec<u8> {
    let mut out = Vec::with_capacity(9 * row.values.len());
    for value in &row.values {
        encode_value(value.as_ref(), &mut out);
    }
    out
}

/// A tag, then the value's bytes. Numbers keep their bits.
fn encode_value(value: Option<&Value>, out: &mut Vec<u8>) {
    match value {
        None => out.push(0),
        Some(Value::Text(text)) => {
            out.push(1);
            let length = u32::try_from(text.len()).expect("a text is far below 4 GiB");
            out.extend_from_slice(&length.to_le_bytes());
            out.extend_from_slice(text.as_bytes());
        }
        Some(Value::Integer(number)) => {
            out.push(2);
            out.extend_from_slice(&number.to_le_bytes());
        }
        Some(Value::Number(number)) => {
            out.push(3);
            out.extend_from_slice(&number.to_le_bytes());
        }
        Some(Value::Flag(flag)) => out.push(4 + u8::from(*flag)),
    }
}

fn decode_row(payload: &[u8], columns: &[usize]) -> Option<Row> {
    let mut rest = payload;
    let mut row = Row::default();
    for &column in columns {
        let value = match take(&mut rest, 1)?[0] {
            0 => continue,
            1 => {
                let length = u32::from_le_bytes(take(&mut rest, 4)?.try_into().ok()?);
                let text = take(&mut rest, length as usize)?;
                Value::Text(String::from_utf8(text.to_vec()).ok()?)
            }
            2 => Value::Integer(i64::from_le_bytes(take(&mut rest, 8)?.try_into().ok()?)),
            3 => Value::Number(f64::from_le_bytes(take(&mut rest, 8)?.try_into().ok()?)),
            4 => Value::Flag(false),
            5 => Value::Flag(true),
            _ => return None,
        };
        if value.kind() != SCHEMA.columns[column].kind {
            return None;
        }
        row.values[column] = Some(value);
    }
    rest.is_empty().then_some(row)
}

fn take<'a>(rest: &mut &'a [u8], length: usize) -> Option<&'a [u8]> {
    let (taken, left) = rest.split_at_checked(length)?;
    *rest = left;
    Some(taken)
}
