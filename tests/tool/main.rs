//! The tool and the library for C, from outside.
#![cfg(feature = "zstd")]

#[path = "../common/mod.rs"]
mod common;

#[cfg(feature = "cli")]
mod cli;
mod ffi;
#[cfg(feature = "cli")]
mod mistakes;
#[cfg(feature = "cli")]
mod report;
mod shards;
#[cfg(feature = "cli")]
mod stress;
