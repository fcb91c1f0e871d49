//! Rows on disk: schema, journal, Parquet and the manifest. Bytes, and nothing of their meaning.

pub mod durable;
pub mod journal;
pub mod row;
pub mod schema;
pub mod table;

pub use journal::{Journal, JournalError, Record};
pub use row::{Row, Value};
pub use schema::{COMPLETE, Column, FAILED, Kind, Role, SCHEMA, SET_ASIDE, STAGES};
pub use table::{TableError, write_parquet};
