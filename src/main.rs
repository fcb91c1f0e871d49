//! The `pao-sim` command.

fn main() {}
