#!/usr/bin/env bash
# Reads a run's files with TrackEval, evo and GTSAM (Python packages), and checks its JSON files against docs/schemas.
#   scripts/check_clients.sh target/release/motorcade runs/demo
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
run=$(realpath "$2")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q 'trackeval==1.3.0' 'evo>=1.31,<2' 'gtsam>=4.2,<5' 'jsonschema>=4,<5'
"$program" evaluate "$run" --kitti "$run-drive/training" --json "$folder/evaluation.json" >/dev/null
"$folder/venv/bin/python" scripts/check_clients.py "$run" "$run-drive" "$folder/evaluation.json"
# A run online, and one that skips frames it cannot read and knows no vehicles.
"$program" run "$run-drive/training" --frames ..40 --online --out "$folder/online" --progress none >"$folder/online.jsonl"
cp -r "$run-drive/training" "$folder/broken"
images=("$folder"/broken/image_02/*/*)
printf 'no picture' >"${images[5]}"
rm "${images[9]}"
"$program" run "$folder/broken" --frames ..20 --models none --out "$folder/unreadable" --progress none
"$folder/venv/bin/python" scripts/check_schemas.py "$run" "$folder/online" "$folder/unreadable" \
  --evaluation "$folder/evaluation.json" --online "$folder/online.jsonl"
