//! Evaluation of a baked fabric.
mod scalar;
