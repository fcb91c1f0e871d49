//! Rows on disk: schema, journal, Parquet parts and the manifest.
