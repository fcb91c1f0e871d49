//! Rows on disk: schema, journals, parts, table. Bytes, and nothing of their meaning.

pub mod attempt;
pub mod durable;
pub mod journal;
pub mod ledger;
pub mod locks;
pub mod parts;
pub mod row;
pub mod schema;
pub mod sealing;
pub mod table;

pub use attempt::Attempt;
pub use journal::{End, Journal, JournalError, Record};
pub use ledger::{Ledger, Store, StoreError};
pub use row::{Row, Value};
pub use schema::{COMPLETE, CRASHED, Column, FAILED, Kind, Role, SCHEMA, STAGES};
pub use table::{TableError, write_parquet};
