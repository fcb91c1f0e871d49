//! Named random streams: every draw of a study has a purpose and a key of its own.

mod stream;

pub use stream::{Purpose, Stream, stream};
