//! Tables: their files, their errors, every way to look them up, and what is made of them for engines.
#![cfg(feature = "bake")]

#[path = "../common/mod.rs"]
mod common;

#[cfg(feature = "render")]
mod accuracy;
mod corrupt;
#[cfg(feature = "export")]
mod export;
mod format;
mod hostile_tables;
mod needs;
mod parity;
mod rim;
mod sampling;
mod tiles;
#[cfg(feature = "shader")]
mod volume;
