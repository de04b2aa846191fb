#!/usr/bin/env bash
# Draws the sphere of `sateen render` by the Bevy example, on Mesa's software Vulkan, and says how far the pictures are apart.
#
#     scripts/bevy.sh [FOLDER]      default: examples/bevy/target/pictures; ten minutes, Bevy's build, the first time
#
# SATEEN=PATH takes that tool; else it is built. Fails where mean FLIP is more than 0.012. Where the driver is missing
# (Debian: mesa-vulkan-drivers), it says so and tests nothing; with SATEEN_REQUIRE_ALL=1 that is an error.
set -euo pipefail
folder=$(realpath -m "${1:-$(dirname "$0")/../examples/bevy/target/pictures}")
[[ -z ${SATEEN:-} ]] || SATEEN=$(realpath "$SATEEN")
cd "$(dirname "$0")/.."
export VK_ICD_FILENAMES=${VK_ICD_FILENAMES:-/usr/share/vulkan/icd.d/lvp_icd.$(uname -m).json}
if [[ ! -e $VK_ICD_FILENAMES ]]; then
    echo "SKIPPED: Bevy is not tested: there is no $VK_ICD_FILENAMES" >&2
    [[ ${SATEEN_REQUIRE_ALL:-} != 1 ]] || exit 1
    exit 0
fi
SATEEN=$(scripts/tool.sh)
cargo build --quiet --locked --manifest-path examples/bevy/Cargo.toml
built=${CARGO_TARGET_DIR:-examples/bevy/target}/debug

table=examples/web/tables/denim.sateen
mkdir -p "$folder"
# Both pictures, and what is between them: NAME MIB ARGUMENTS…
picture() {
    local name=$1 mib=$2
    shift 2
    "$SATEEN" --quiet render sphere "$table" --samples 1 -o "$folder/$name-sateen.png" "$@"
    RUST_LOG=${RUST_LOG:-error} "$built/sateen-bevy" "$table" --mib "$mib" --screenshot "$folder/$name-bevy.png" "$@"
    echo "$name, volume of $mib MiB"
    "$SATEEN" compare "$folder/$name-bevy.png" "$folder/$name-sateen.png" --max-flip 0.012
}
picture camera 1
picture camera 8
picture aside 8 --light-deg 50 --light-elevation-deg 30
