//! Pictures of cloth on shapes, meshes and in scenes, and patterns of several fabrics.
#![cfg(feature = "cli")]

#[path = "../common/mod.rs"]
mod common;

mod drape;
mod pattern;
mod render;
mod scene;
