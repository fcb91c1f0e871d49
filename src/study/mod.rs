//! Configuration, plan, runner and resume of a study.
