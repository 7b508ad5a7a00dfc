#!/usr/bin/env bash
# Records a run as MCAP, reads it back with the Python packages and compares it with the run's tables, and has rerun's own importer
# load it where it installs. The same for ROS 2, by the message definitions of ROS 2 that rosbags brings. Both recordings are also read by the
# libraries that Foxglove itself reads files with (scripts/foxglove/recording.mjs).
#   scripts/check_mcap.sh target/release/motorcade runs/demo
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
run=$(realpath "$2")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$program" draw "$run" --out "$folder/drive.mcap" --progress none
python3 -m venv "$folder/venv"
"$program" draw "$run" --out "$folder/ros.mcap" --mcap-schemas ros2 --progress none
if ! command -v npm >/dev/null; then
  (apt-get update -q && apt-get install -qy --no-install-recommends nodejs npm) >/dev/null
fi
cp -r scripts/foxglove "$folder/foxglove"
(cd "$folder/foxglove" && npm install --silent --no-audit --no-fund)
for file in drive ros; do node "$folder/foxglove/recording.mjs" "$folder/$file.mcap"; done
"$folder/venv/bin/pip" install -q 'mcap>=1.2' 'mcap-protobuf-support>=0.5' 'mcap-ros2-support>=0.5' 'rosbags>=0.10,<0.12'
"$folder/venv/bin/python" scripts/check_ros2.py "$run" "$folder/ros.mcap"
if timeout 300 "$folder/venv/bin/pip" install -q 'rerun-sdk>=0.26'; then
  "$folder/venv/bin/python" scripts/check_mcap.py "$run" "$folder/drive.mcap" rerun
else
  echo "rerun-sdk could not be installed: its importer was not tried"
  "$folder/venv/bin/python" scripts/check_mcap.py "$run" "$folder/drive.mcap"
fi
