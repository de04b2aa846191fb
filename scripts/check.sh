#!/usr/bin/env bash
# Format, lints, documentation, every feature layer alone, so that an upward `use` between layers does not build, the tests
# of the core, what names what, that vector code is inlined, and that generated shaders are those of today.
set -euo pipefail
cd "$(dirname "$0")/.."
export RUSTDOCFLAGS="-D warnings"

for component in rustfmt clippy; do
    cargo "${component/rustfmt/fmt}" --version >/dev/null 2>&1 || rustup component add "$component"
done
cargo fmt --check
for layer in std ffi,libm,small zstd,libm shader render scene report export; do
    echo "layer $layer"
    cargo clippy --locked --quiet --lib --no-default-features --features "$layer" -- -D warnings
done
# This with its tests, which name the feature that they need; that of the tool with everything, below.
echo "layer bake"
cargo clippy --locked --quiet --tests --no-default-features --features bake -- -D warnings
# Those of the core pass as an engine has it: all of them, since none at all would pass, too.
count=$(grep -c '^#\[test\]' tests/core.rs)
for layer in std libm,zstd libm,small; do
    result=$(scripts/core.sh test --quiet --lib --features "$layer")
    echo "core with $layer: $result"
    [[ $result == *"ok. $count passed"* ]]
done
# Workers have 2 MiB of stack, as tests do, and builds that are debugged no optimization.
result=$(scripts/core.sh test --quiet --lib --features std --config profile.dev.opt-level=0 batches)
[[ $result == *"ok. 1 passed"* ]]
cargo clippy --locked --quiet --all-targets -- -D warnings
cargo doc --locked --quiet --no-deps --lib
# No intrinsic is called instead of inlined; and that is found where one is.
if command -v objdump >/dev/null; then
    scripts/inlined.sh --self-test
    scripts/inlined.sh
else
    echo "SKIPPED: scripts/inlined.sh needs objdump"
    [[ ${SATEEN_REQUIRE_ALL:-} != 1 ]]
fi
# A module names only those below it; and what finds names above is tried on three that are.
scripts/layers.py
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
cp -r src "$copy/"
printf 'use crate::{math, bake::{Preset,\n    Settings}, report};\n' >>"$copy/src/table/mod.rs"
printf 'use super::super::super::metrics;\n' >>"$copy/src/table/format/read.rs"
found=$(scripts/layers.py "$copy/src" 2>&1 || true)
for above in "table/mod.rs:$(wc -l <"$copy/src/table/mod.rs"): table names report" "table/mod.rs:[0-9]*: table names bake" \
    "table/format/read.rs:[0-9]*: table names metrics"; do
    grep -q "$above" <<<"$found" || {
        echo "check.sh: scripts/layers.py does not find that $above" >&2
        exit 1
    }
done
# HLSL's functions are made of GLSL's.
scripts/hlsl.sh --check
# Tables of documents are those of tables/baseline.csv, their links lead somewhere, every key is explained.
python3 scripts/docs.py --check
