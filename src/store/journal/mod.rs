//! The journal: what an attempt did, record by record, on a disk that may fail at any moment.
//!
//! One file an attempt, `journal/0001.journal`, only ever appended to, and locked by its attempt. It opens with eight bytes
//! that name format and version, then frames follow: length (u32), kind (u8), payload, CRC-32 of
//! all before it (u32), little-endian. The first frame is the header. A frame that is cut or
//! damaged ends the reading; everything before it counts.

mod frame;
mod read;
mod record;
mod stream;
mod write;

pub use read::{Journal, read, read_all, read_header};
pub(super) use read::{numbered, places};
pub(super) use record::todays_columns;
pub use record::{End, Header, Record};
pub use stream::{Sink, StreamWriter, read_stream};
pub use write::Writer;

use std::path::PathBuf;

/// A journal that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        action: &'static str,
        path: PathBuf,
        #[source]
        cause: std::io::Error,
    },
    #[error(
        "{} is no journal of this version of the program: {problem}; continue the study with the version that began it, or take another results folder",
        path.display()
    )]
    Foreign { path: PathBuf, problem: String },
}
