#!/usr/bin/env bash
# Format, lints, documentation, every feature layer alone, so that an upward `use` between layers does not build, and the tests
# of the core.
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
cargo clippy --locked --quiet --all-targets -- -D warnings
cargo doc --locked --quiet --no-deps --lib
# What uses what: a module names only those below it (src/lib.rs).
names_none_of() {
    local folders=$1
    shift
    for above in "$@"; do
        # shellcheck disable=SC2086
        if grep -rnE "crate::(\{[^}]*\b)?$above\b" $folders | grep -vE ':[0-9]+: *//'; then
            echo "$folders must not name $above" >&2
            exit 1
        fi
    done
}
names_none_of "src/math src/needs" brdf chart table lookup fabric model metrics fit bake progress report stress render scene volume shader export
names_none_of "src/brdf src/chart" table lookup fabric model metrics fit bake progress report stress render scene volume shader export
names_none_of "src/table" lookup fabric model metrics fit bake progress report stress render scene volume shader export
names_none_of "src/lookup src/table src/brdf src/chart src/math src/needs src/volume src/shader" ffi
names_none_of "src/ffi" fabric pattern model metrics fit bake progress report stress render scene volume shader export
names_none_of "src/lookup" fabric model metrics fit bake progress report stress render scene volume shader export
names_none_of "src/volume" fabric model metrics fit bake progress report stress render scene shader export
names_none_of "src/shader" fabric model metrics fit bake progress report stress render scene export
names_none_of "src/text.rs" fabric pattern mesh chart table lookup model metrics fit bake progress report stress render scene volume shader export
names_none_of "src/mesh" fabric pattern chart table lookup model metrics fit bake progress report stress render scene volume shader export
names_none_of "src/fabric" mesh pattern chart table lookup model metrics fit bake progress report stress render scene volume shader export
names_none_of "src/pattern" chart table lookup model metrics fit bake progress report stress render scene volume shader export
names_none_of "src/model" chart table lookup metrics fit bake progress report stress render scene volume shader export
names_none_of "src/metrics" fit bake report stress render scene export
names_none_of "src/fit" chart table lookup bake report stress render scene export
names_none_of "src/bake" fit report stress render scene export
names_none_of "src/render" bake fit report stress scene export
names_none_of "src/scene" bake fit report stress export
names_none_of "src/report" stress scene export
names_none_of "src/stress" export
names_none_of "src/export" fit report stress render scene
