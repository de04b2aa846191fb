#!/usr/bin/env bash
# The tests that `cargo test` leaves out because they bake or integrate for many minutes: those marked `#[ignore]`.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo test --locked --test model --test table -- --ignored --nocapture
