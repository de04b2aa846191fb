#!/usr/bin/env bash
# Fuzzes everything that reads files, every target in turn, with AddressSanitizer.
#
#     scripts/fuzz.sh [SECONDS] [TARGET…]       default: 1200 seconds for each of fuzz/fuzz_targets/
#
# Seeds are written anew, what earlier runs have found in fuzz/corpus/ is used again. An input that panics, takes longer than
# 5 s or asks for more memory than Table::from_bytes promises (3 × MAX_DECODED_BYTES) is left in fuzz/artifacts/; exit
# status 1 says that there was one. On a machine whose toolchain has no AddressSanitizer: SANITIZER=none scripts/fuzz.sh
set -euo pipefail
cd "$(dirname "$0")/../fuzz"
seconds=${1:-1200}
targets=("${@:2}")
if [ ${#targets[@]} -eq 0 ]; then
    targets=(table table_repaired fabric pattern pairs scene mesh image needs)
fi

command -v cargo-fuzz >/dev/null || cargo install --locked cargo-fuzz
# Sanitizers are unstable options of the compiler: the nightly one takes them, the stable one when told so.
toolchain=()
if cargo +nightly --version >/dev/null 2>&1; then
    toolchain=(+nightly)
else
    export RUSTC_BOOTSTRAP=1
fi

# gcc 12 takes a constant array of zstd's for one that is used out of its scope.
export CFLAGS="${CFLAGS:+$CFLAGS }-fno-sanitize-address-use-after-scope"
fuzz() {
    local command=$1
    shift
    cargo "${toolchain[@]}" fuzz "$command" --target-dir "$PWD/target" --sanitizer "${SANITIZER:-address}" "$@"
}
fuzz build
# FLIP's C++ code defines the tables of miniz twice, alike.
export ASAN_OPTIONS="detect_odr_violation=0${ASAN_OPTIONS:+:$ASAN_OPTIONS}"
host=$(rustc -vV | sed -n 's/^host: //p')
rm -rf seeds
"target/$host/release/seeds"

logs=artifacts/logs
mkdir -p "$logs"
found=0
for target in "${targets[@]}"; do
    mkdir -p "corpus/$target"
    dictionary=()
    if [ -f "$target.dict" ]; then
        dictionary=("-dict=$target.dict")
    fi
    echo "fuzzing $target for $seconds s, log in fuzz/$logs/$target.log"
    fuzz run "$target" "corpus/$target" "seeds/$target" -- \
        "${dictionary[@]}" -max_total_time="$seconds" -timeout=5 -rss_limit_mb=2560 -malloc_limit_mb=768 \
        -print_final_stats=1 >"$logs/$target.log" 2>&1 || found=1
done

printf '%-16s %12s %10s %8s\n' target executions features corpus
for target in "${targets[@]}"; do
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$logs/$target.log")
    last=$(grep -aE '^#[0-9]+.* ft: ' "$logs/$target.log" | tail -n 1)
    features=$(sed -nE 's/.* ft: ([0-9]+).*/\1/p' <<<"$last")
    corpus=$(sed -nE 's/.* corp: ([0-9]+).*/\1/p' <<<"$last")
    printf '%-16s %12s %10s %8s\n' "$target" "${executions:-none}" "${features:-?}" "${corpus:-?}"
    grep -aE '^(SUMMARY:|thread .* panicked|Test unit written)|out-of-memory' "$logs/$target.log" || true
done
exit "$found"
