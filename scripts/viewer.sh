#!/usr/bin/env bash
# Tests the viewer of examples/web in a headless browser, against pictures of the tool.
#
#     scripts/viewer.sh        SATEEN=PATH takes that tool; else it is built
#
# Where there is no Node.js or no Chromium, and no apt-get to install one with, it says so and tests nothing; with SATEEN_REQUIRE_ALL=1 that
# is an error.
set -euo pipefail
[[ -z ${SATEEN:-} ]] || SATEEN=$(realpath "$SATEEN")
cd "$(dirname "$0")/.."

skip() {
    echo "SKIPPED: the viewer is not tested: $*" >&2
    [[ ${SATEEN_REQUIRE_ALL:-} != 1 ]] || exit 1
    exit 0
}
chromium=${CHROMIUM:-/usr/bin/chromium}
if [[ ! -x $chromium ]] && command -v apt-get >/dev/null && [[ $(id -u) == 0 ]]; then
    { apt-get update && apt-get install -y --no-install-recommends chromium libgl1-mesa-dri libegl1; } >&2 || true
fi
[[ -x $chromium ]] || skip "there is no $chromium (apt-get install chromium)"
command -v node >/dev/null && command -v npm >/dev/null || skip "there is no Node.js (https://nodejs.org, 20 or newer)"
[[ $(node --print 'Number(process.versions.node.split(".")[0])') -ge 20 ]] || skip "Node.js is older than 20"

SATEEN=$(scripts/tool.sh)
export SATEEN CHROMIUM="$chromium"
cd examples/web
npm ci --no-audit --no-fund
npm test
