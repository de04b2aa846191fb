#!/usr/bin/env bash
# Vector code is fast where all of it is inlined into functions of its instruction set: an intrinsic that is not is a call for each addition.
# Builds the library as it is released, and fails if a single intrinsic has a symbol in it; prints which, and which functions call it.
#
#     scripts/inlined.sh [RLIB]
#
# As `--self-test` it tries this on a function that leaves one out.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}

# Names as in the source.
readable() {
    c++filt | sed -E 's/::h[0-9a-f]{16}//g; s/\[[0-9a-f]{6,16}\]//g'
}

# Lines "times CALLER -> INTRINSIC" of an archive of objects. Local functions are called by the name of their section.
callers() {
    objdump --disassemble --reloc --no-show-raw-insn "$1" | awk '
        /^[0-9a-f]+ <.*>:$/ {
            caller = substr($2, 2, length($2) - 3)
        }
        /R_[A-Z0-9_]+[ \t]/ && /core_arch/ && caller !~ /core_arch/ {
            callee = $3
            sub(/^\.text\.(unlikely\.)?/, "", callee)
            sub(/[-+]0x[0-9a-f]+$/, "", callee)
            print caller " -> " callee
        }
    ' | readable | sort | uniq -c | sort -rn
}

check() {
    local symbols
    # Not nm: it takes the compiler's intermediate code, which is in the archive, too, for that of a linker's plugin.
    symbols=$(objdump --syms "$1" | awk '/ F \.text/ && /core_arch/ { print $NF }' | readable | sort -u)
    if [ -z "$symbols" ]; then
        echo "inlined.sh: no intrinsic has a symbol in $1"
        return 0
    fi
    echo "inlined.sh: $(wc -l <<<"$symbols") intrinsics are not inlined in $1:" >&2
    sed "s/^/    /" <<<"$symbols" >&2
    echo "called, so many times, by" >&2
    callers "$1" >&2
    return 1
}

if [ "${1:-}" = --self-test ]; then
    if [ "$(uname -m)" != x86_64 ]; then
        echo "SKIPPED: the self-test of inlined.sh is of x86-64"
        exit 0
    fi
    folder=$(mktemp -d)
    trap 'rm -rf "$folder"' EXIT
    cat >"$folder/left.rs" <<'RUST'
#![crate_type = "rlib"]
use std::arch::x86_64::*;
// Without the target feature, which is why it cannot be inlined.
#[unsafe(no_mangle)]
pub fn left_out(a: &mut __m256) {
    *a = unsafe { _mm256_add_ps(*a, *a) };
}
RUST
    rustc -O --edition 2024 -o "$folder/left.rlib" "$folder/left.rs"
    if check "$folder/left.rlib" >/dev/null 2>"$folder/found" || ! grep -q 'left_out -> .*_mm256_add_ps' "$folder/found"; then
        cat "$folder/found" >&2
        echo "inlined.sh: what is not inlined is not found" >&2
        exit 1
    fi
    exit 0
fi
rlib=${1:-}
if [ -z "$rlib" ]; then
    cargo build --locked --quiet --release --lib --no-default-features --features std,zstd,bake,shader
    rlib=$target/release/libsateen.rlib
fi
check "$rlib"
