//! Evaluation of a baked fabric.
//!
//! `scalar` takes one pair of directions at a time and is the specification of every other path.

mod scalar;
