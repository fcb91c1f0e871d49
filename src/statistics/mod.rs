//! Summaries, rank tests, effect sizes and the bootstrap.
