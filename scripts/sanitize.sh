#!/usr/bin/env bash
# Looks for undefined behaviour in what is `unsafe`, src/math/simd, src/lookup/interpolate.rs and src/table/numbers.rs (src/ffi:
# tests/tool/ffi.rs), by tests/core.rs: under Miri,
# AddressSanitizer and valgrind. What is not installed is skipped, and said to be:
#
#     rustup toolchain install nightly --component miri,rust-src; apt install valgrind
#
# Neither Miri nor valgrind knows AVX-512; AddressSanitizer takes what the machine has.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$(rustc -vV | sed -n 's/^host: //p')

if cargo +nightly miri --version >/dev/null 2>&1; then
    for features in "" "+avx2,+fma"; do
        echo "Miri ${features:-portable}"
        RUSTFLAGS="-C target-feature=$features" scripts/core.sh +nightly miri test --lib --features std -- --nocapture
    done
else
    echo "skipped: no Miri"
fi

if cargo +nightly --version >/dev/null 2>&1; then
    echo "AddressSanitizer"
    # With --target, build scripts are built without it.
    RUSTFLAGS="-Z sanitizer=address" scripts/core.sh +nightly test --lib --features std --target "$target" -- --nocapture
else
    echo "skipped: no nightly toolchain for AddressSanitizer"
fi

if command -v valgrind >/dev/null; then
    echo "valgrind"
    scripts/core.sh test --lib --features std --no-run
    tests=$(find "${CARGO_TARGET_DIR:-target}/core/debug/deps" -name 'sateen_core-*' -executable -printf '%T@ %p\n' | sort -n | tail -1)
    valgrind --quiet --error-exitcode=1 "${tests#* }" --test-threads 1 --nocapture
else
    echo "skipped: no valgrind"
fi
