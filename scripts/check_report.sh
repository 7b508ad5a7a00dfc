#!/usr/bin/env bash
# Opens reports in Chromium and Firefox without a screen (scripts/browser/report.mjs): slider, keys, filters, zoom, three sizes,
# printing, screenshots compared by structure, no error on the console, loaded within 3 s.
#   scripts/check_report.sh REPORT...
set -euo pipefail
cd "$(dirname "$0")/.."
# Debian's node, npm, chromium and firefox-esr.
missing=()
command -v node >/dev/null || missing+=(nodejs)
command -v npm >/dev/null || missing+=(npm)
command -v chromium >/dev/null || missing+=(chromium)
command -v firefox-esr >/dev/null || missing+=(firefox-esr)
if [ ${#missing[@]} -gt 0 ]; then
  (apt-get update -q && apt-get install -qy --no-install-recommends "${missing[@]}") >/dev/null
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp scripts/browser/* "$folder"
(cd "$folder" && npm install --silent --no-audit --no-fund)
for report in "$@"; do
  report=$(realpath "$report")
  (cd "$folder" && timeout 120 node report.mjs chrome "$(command -v chromium)" "$report" structure.json)
  (cd "$folder" && timeout 120 node report.mjs firefox "$(command -v firefox-esr)" "$report" structure.json)
done
