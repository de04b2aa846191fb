#!/usr/bin/env bash
# Prints the path of the tool that other scripts run: SATEEN, or the one that is built now.
set -euo pipefail
if [[ -z ${SATEEN:-} ]]; then
    cd "$(dirname "$0")/.."
    cargo build --quiet --release --locked
    SATEEN=${CARGO_TARGET_DIR:-target}/release/sateen
fi
realpath -e "$SATEEN"
