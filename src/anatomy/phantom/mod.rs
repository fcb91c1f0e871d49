//! Built-in phantom bodies.
