#!/usr/bin/env bash
# Runs cargo on the core as an engine has it:
#
#     scripts/core.sh [+TOOLCHAIN] test --features std
#
# `cargo test --no-default-features --features libm` tests something else: what the tests themselves depend on switches
# `num-traits/std` on, and `libm` is never called. Here tests/core.rs is a package that depends on nothing but sateen.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
package="${CARGO_TARGET_DIR:-target}/core"
mkdir -p "$package"
package=$(realpath "$package")
export CARGO_TARGET_DIR=$package
cat >"$package/Cargo.toml" <<MANIFEST
[package]
name = "sateen-core"
edition = "2024"

[lib]
path = "$root/tests/core.rs"

[dependencies]
sateen = { path = "$root", default-features = false }

[features]
std = ["sateen/std"]
libm = ["sateen/libm"]
small = ["sateen/small"]
zstd = ["sateen/zstd"]
bake = ["sateen/bake"]

[profile.dev]
opt-level = 2

[workspace]
MANIFEST
# The same versions of what sateen depends on.
cp Cargo.lock "$package/"
toolchain=()
if [[ ${1:-} == +* ]]; then
    toolchain=("$1")
    shift
fi
cd "$package"
cargo "${toolchain[@]}" "$@"
