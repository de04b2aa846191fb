#!/usr/bin/env bash
# Exports read by tools of others: KTX2 by ktx-parse (npm), EXR by OpenImageIO (PyPI), DDS by Panda3D (PyPI), dds and image_dds
# (crates.io), each against the raw texels. (OpenImageIO and Pillow say of DDS that they lack its format of half floats.) Not part of
# check.sh, since it fetches them:
#
#     scripts/readers.sh denim.sateen        SATEEN=PATH takes that tool; else it is built
set -euo pipefail
table=$(realpath "$1")
[[ -z ${SATEEN:-} ]] || SATEEN=$(realpath "$SATEEN")
cd "$(dirname "$0")/.."
work=${SATEEN_READERS:-"${TMPDIR:-/tmp}/sateen-readers"}
mkdir -p "$work"
SATEEN=$(scripts/tool.sh)
export_as() {
    "$SATEEN" --quiet export "$table" --pairs 64 --format "$1" -o "$work/$2" "${@:3}"
}
export_as raw volume.bin
export_as ktx2 plain.ktx2 --no-supercompression
export_as ktx2 small.ktx2
export_as rgb9e5 rgb9e5.ktx2
export_as bc6h bc6h.ktx2
export_as exr atlas.exr
export_as dds volume.dds

[[ -d $work/node_modules/ktx-parse ]] || npm install --silent --prefix "$work" ktx-parse
cp scripts/read_ktx2.mjs "$work/"
node "$work/read_ktx2.mjs" "$work"

[[ -d $work/python ]] || python3 -m venv "$work/python"
"$work/python/bin/pip" install --quiet openimageio panda3d numpy
"$work/python/bin/python" scripts/read_exr.py "$work"
"$work/python/bin/python" scripts/read_dds.py "$work"
CARGO_TARGET_DIR="$work/target" cargo run --quiet --release --manifest-path scripts/read_dds/Cargo.toml -- "$work"
