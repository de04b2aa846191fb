#!/usr/bin/env bash
# What a batch costs from C and from Rust, in turn, both built with the same profile:
#
#     scripts/capi_overhead.sh [TABLE] [PAIRS…]
#
# prints the median over ROUNDS=25 runs of either of the least nanoseconds per pair of 200 batches, and the median of the ratios of the
# two runs of a round.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
table=${1:-tests/data/tables/silk-crepe-de-chine-3.sateen}
sizes=("${@:2}")
if [ ${#sizes[@]} -eq 0 ]; then
    sizes=(16 256 4096)
fi
package=$(realpath -m "${CARGO_TARGET_DIR:-target}/overhead")
mkdir -p "$package"
cat >"$package/Cargo.toml" <<MANIFEST
[package]
name = "overhead"
edition = "2024"

[[bin]]
name = "overhead"
path = "$root/scripts/capi_overhead.rs"

[dependencies]
sateen = { path = "$root", default-features = false, features = ["std", "zstd"] }

[profile.capi]
inherits = "release"
$(sed -n '/^\[profile.capi\]/,/^$/p' Cargo.toml | grep -E '^(opt-level|lto|codegen-units|panic)')

[workspace]
MANIFEST
cp Cargo.lock "$package/"
scripts/capi.sh "$package/installed"
(cd "$package" && CARGO_TARGET_DIR="$package" cargo build --quiet --profile capi)
cc -std=c11 -O2 -I"$package/installed/include" examples/c/overhead.c "$package/installed/lib/libsateen.a" \
    -lm -lpthread -ldl -Wl,--gc-sections -o "$package/c"

median() { sort -g | awk '{ all[NR] = $1 } END { print all[int((NR + 1) / 2)] }'; }
for pairs in "${sizes[@]}"; do
    for ((round = 0; round < ${ROUNDS:-25}; ++round)); do
        echo "$("$package/capi/overhead" "$table" "$pairs" 200) $("$package/c" "$table" "$pairs" 200)"
    done >"$package/times"
    echo "$pairs pairs: Rust $(cut -d' ' -f1 "$package/times" | median) ns, C $(cut -d' ' -f3 "$package/times" | median) ns," \
        "C / Rust $(awk '{ print $3 / $1 }' "$package/times" | median)"
done
