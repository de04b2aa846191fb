#!/usr/bin/env bash
# Writes src/shader/lookup.hlsl: src/shader/lookup.glsl with HLSL's names of types and functions.
#
#     scripts/hlsl.sh [--check]
#
# With --check it writes nothing, and fails if the file is another. What it knows is all that the two languages differ in here, so
# lookup.glsl stays within what both have: no matrices, no `in` or `out`, no function of one of them alone but mix.
set -euo pipefail
cd "$(dirname "$0")/.."

translated() {
    cat <<'HEAD'
// sateen: a fabric's reflectance, in HLSL (shader model 4 and later). Made of lookup.glsl by scripts/hlsl.sh. Needs, before it:
//
//     float4 sateen_parameter(int index)      parameters[index]: 32-bit floats
//     float4 sateen_volume(float3 uvw)        the volume there: Texture3D.SampleLevel, linear filter, clamped, mip 0
//
// Directions are unit vectors in the surface frame: x warp, y weft, z normal; wi to the light, wr to the viewer. All of
// it needs 32-bit floats. Functions are those of the Rust library (src/shader/lookup.rs, src/brdf, src/chart), where every step is
// derived; src/shader/mod.rs has the layout of the parameters.
HEAD
    # GLSL's head ends at the first empty line.
    sed -E -e '1,/^$/{/^$/!d}' -e 's/\bvec([234])\b/float\1/g' -e 's/\bmix\(/lerp(/g' -e 's/^const /static const /' src/shader/lookup.glsl
}

if [ "${1:-}" = --check ]; then
    translated | diff src/shader/lookup.hlsl - || {
        echo "hlsl.sh: src/shader/lookup.hlsl is not made of lookup.glsl: run scripts/hlsl.sh" >&2
        exit 1
    }
else
    translated >src/shader/lookup.hlsl
fi
