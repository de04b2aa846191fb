#!/usr/bin/env bash
# Builds the sample of examples/filament, draws with it on Mesa's software OpenGL, and compares its sphere with `sateen render`:
#
#     scripts/filament.sh [FOLDER]        SATEEN=PATH takes that tool; else it is built
#
# The folder (default: target/filament) gets the pictures. Needs Debian's packages, which are installed where they are missing and may be;
# where they may not, it says so and tests nothing, which with SATEEN_REQUIRE_ALL=1 is an error.
set -euo pipefail
folder=$(realpath -m "${1:-$(dirname "$0")/../target/filament}")
[[ -z ${SATEEN:-} ]] || SATEEN=$(realpath "$SATEEN")
cd "$(dirname "$0")/.."
mkdir -p "$folder"
are_there() {
    { command -v matc && command -v xvfb-run && command -v cmake && ls /usr/include/nlohmann/json.hpp; } >/dev/null 2>&1
}
if ! are_there && command -v apt-get >/dev/null && [[ $(id -u) == 0 ]]; then
    { apt-get update && apt-get install -y --no-install-recommends build-essential cmake libfilament-dev libfilament-tools \
        nlohmann-json3-dev xvfb xauth libgl1-mesa-dri; } >&2 || true
fi
if ! are_there; then
    echo "SKIPPED: Filament is not tested: matc, xvfb-run, cmake or nlohmann/json.hpp is missing" >&2
    [[ ${SATEEN_REQUIRE_ALL:-} != 1 ]] || exit 1
    exit 0
fi
SATEEN=$(scripts/tool.sh)
cmake -S examples/filament -B "$folder/build" -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build "$folder/build"
for fabric in denim felt; do
    table=examples/web/tables/$fabric.sateen
    "$SATEEN" export "$table" --format raw -o "$folder/$fabric.bin"
    xvfb-run -a "$folder/build/cloth" "$folder/$fabric.bin.json" "$folder/$fabric.png" >/dev/null
    xvfb-run -a "$folder/build/cloth" "$folder/$fabric.bin.json" "$folder/$fabric-curtain.png" --scene curtain >/dev/null
    "$SATEEN" render sphere "$table" --light-deg 30 --samples 1 -o "$folder/$fabric-sateen.png"
    "$SATEEN" compare "$folder/$fabric.png" "$folder/$fabric-sateen.png" --max-flip 0.01
done
