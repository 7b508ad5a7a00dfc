#!/usr/bin/env bash
# Reads a run's files with TrackEval, evo, GTSAM and g2o (Python packages), and checks its JSON files against docs/schemas.
#   scripts/check_clients.sh target/release/motorcade runs/demo
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
run=$(realpath "$2")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q 'trackeval==1.3.0' 'evo>=1.31,<2' 'gtsam>=4.2,<5' 'g2opy==2.3.0' 'jsonschema>=4,<5'
"$program" evaluate "$run" --kitti "$run-drive/training" --json "$folder/evaluation.json" >/dev/null
# The two classes that KITTI does not have: a drive behind a bus, in which a truck is called a motorcycle.
"$program" simulate --scenario lorries --width 400 --frames 40 --out "$folder/lorries" --progress none
awk '$2 == 1 { $3 = "Motorcycle" } { print }' "$folder/lorries/training/label_02/0000.txt" >"$folder/classes.txt"
"$program" run "$folder/lorries/training" --models none --detections "$folder/classes.txt" --out "$folder/classes" --progress none
"$program" graph info "$run/graph.g2o" --json >"$folder/graph.json"
"$folder/venv/bin/python" scripts/check_clients.py "$run" "$run-drive" "$folder/evaluation.json" "$folder/classes" "$folder/classes.txt" "$folder/graph.json"
# Corrections of an online run: by a kept map, and by a place seen again, round a block at 5 frames/s.
"$program" run "$run-drive/training" --models none --save-map "$folder/places.map" --out "$folder/mapped" --progress none
"$program" run "$run-drive/training" --models none --map "$folder/places.map" --online --out "$folder/by-map" --progress none >"$folder/revised.jsonl"
grep -q '"map"' "$folder/revised.jsonl"
"$program" simulate --scenario block --width 400 --fps 5 --frames 280 --out "$folder/block" --progress none
"$program" run "$folder/block/training" --fps 5 --models none --online --out "$folder/round" --progress none >"$folder/round.jsonl"
grep '"revision"' "$folder/round.jsonl" >>"$folder/revised.jsonl"
# A run online, and one that skips frames it cannot read and knows no vehicles.
"$program" run "$run-drive/training" --frames ..40 --online --out "$folder/online" --progress none >"$folder/online.jsonl"
cp -r "$run-drive/training" "$folder/broken"
images=("$folder"/broken/image_02/*/*)
printf 'no picture' >"${images[5]}"
rm "${images[9]}"
"$program" run "$folder/broken" --frames ..20 --models none --out "$folder/unreadable" --progress none
"$folder/venv/bin/python" scripts/check_schemas.py "$run" "$folder/online" "$folder/unreadable" "$folder/by-map" "$folder/round" \
  --evaluation "$folder/evaluation.json" --online "$folder/online.jsonl" "$folder/revised.jsonl"
