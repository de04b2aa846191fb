#!/usr/bin/env bash
# What the library adds to a C program, stripped, by what it is built with:
#
#     scripts/size.sh
#
# examples/c/shade.c, which loads a table and looks up single pairs and batches, against a program that prints a line.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Bytes of a stripped program: OUTPUT ARGUMENTS…
bytes_of() {
    cc -O2 -o "$work/$1" "${@:2}" -lm -lpthread -ldl -Wl,--gc-sections
    strip "$work/$1"
    stat --format %s "$work/$1"
}
echo '#include <stdio.h>
int main(int count, char **words) { printf("%d %s\n", count, words[0]); return 0; }' >"$work/line.c"
line=$(bytes_of line "$work/line.c")
for options in "" "--lean" "--lean --no-zstd"; do
    # shellcheck disable=SC2086
    scripts/capi.sh "$work/installed" $options
    bytes=$(bytes_of shade -I"$work/installed/include" examples/c/shade.c "$work/installed/lib/libsateen.a")
    awk -v bytes=$((bytes - line)) -v options="$options" 'BEGIN { printf "%6.1f KiB  capi.sh %s\n", bytes / 1024, options }'
done
