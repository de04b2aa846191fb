#!/usr/bin/env bash
# Holds the shaders to the library, pair by pair for every fabric, on whatever GPU there is, else on Mesa's software.
#
# Skips what the machine lacks (Debian: mesa-vulkan-drivers, glslang-tools, spirv-tools), unless SATEEN_REQUIRE_ALL=1.
set -euo pipefail
cd "$(dirname "$0")/.."
# What `cargo test` has built already is not built again.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
cargo fmt --check --manifest-path tests/gpu/Cargo.toml
cargo clippy --locked --quiet --tests --manifest-path tests/gpu/Cargo.toml -- -D warnings
cargo test --locked --manifest-path tests/gpu/Cargo.toml -- --nocapture
