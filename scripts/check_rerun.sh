#!/usr/bin/env bash
# Builds the program with the feature `rerun`, shows a run in a file of rerun's while it goes on, and has rerun's own package of the same
# version read it. Takes minutes: not part of .ci/run.
#   scripts/check_rerun.sh runs/demo-drive
set -euo pipefail
cd "$(dirname "$0")/.."
drive=$(realpath "$1")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cargo build --release --locked -p motorcade-cli --features rerun
target/release/motorcade run "$drive/training" --out "$folder/run" --online --rerun "$folder/live.rrd" --progress none >"$folder/online.jsonl"
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q 'rerun-sdk==0.36.*'
"$folder/venv/bin/python" -m rerun rrd verify "$folder/live.rrd"
"$folder/venv/bin/python" -m rerun rrd print "$folder/live.rrd" >"$folder/told.txt"
for entity in world/camera world/camera/image world/camera_path world/vehicles speed/camera; do
  grep -q "/$entity" "$folder/told.txt" || { echo "rerun does not know /$entity"; exit 1; }
done
frames=$(wc -l <"$folder/online.jsonl")
rows=$(grep '/world/camera_path ' "$folder/told.txt" | grep -o '[0-9]* rows' | awk '{ sum += $1 } END { print sum }')
[ "$rows" = "$frames" ] || { echo "$rows frames in the file, $frames estimated"; exit 1; }
echo "$frames frames, $(stat -c %s "$folder/live.rrd") bytes: read by rerun"
