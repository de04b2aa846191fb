#!/usr/bin/env bash
# Format, lints, documentation, and every feature layer alone, so that an upward `use` between layers does not build.
set -euo pipefail
cd "$(dirname "$0")/.."
export RUSTFLAGS="${RUSTFLAGS:-} -D warnings" RUSTDOCFLAGS="-D warnings"
# Its own folder: other flags would rebuild what `cargo test` has built.
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-target}/check"

for component in rustfmt clippy; do
    cargo "${component/rustfmt/fmt}" --version >/dev/null 2>&1 || rustup component add "$component"
done
cargo fmt --check
for layer in libm std zstd bake cli; do
    echo "layer $layer"
    cargo check --locked --quiet --lib --bins --no-default-features --features "$layer"
done
cargo clippy --locked --quiet --all-targets
cargo doc --locked --quiet --no-deps --lib
# What uses what: lookup never names the model, and the model never names a table.
if grep -rn 'crate::model' src/math src/brdf src/chart src/table src/lookup || grep -rn 'crate::table' src/math src/brdf src/chart src/model src/fabric; then
    echo "a module names one above it" >&2
    exit 1
fi
