#!/usr/bin/env bash
# Places a run on the map by a GPS track made of it (as CSV, GPX and NMEA), and checks every file from outside: place, heading and clock against what they were
# made with, drive.xosc against ASAM's schema, drive.gpx with gpxpy.
#   scripts/check_map.sh target/release/motorcade runs/demo
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
run=$(realpath "$2")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q lxml 'gpxpy>=1.6' 'numpy>=1.24'
# The schemas alone: the packages around them are not installed.
"$folder/venv/bin/pip" download -q --no-deps -d "$folder" asam-qc-openscenarioxml==1.0.0
(cd "$folder" && python3 -m zipfile -e asam_qc_openscenarioxml-*.whl xosc)
schema="$folder/xosc/qc_openscenario/schema/1.2.0/OpenSCENARIO.xsd"
"$folder/venv/bin/python" scripts/check_map.py track "$run" "$folder/drive.csv"
for kind in csv gpx nmea; do
  "$program" export "$run" --out "$folder/$kind" --track "$folder/drive.$kind" --clock-offset 1700000012.1,0.3
  "$folder/venv/bin/python" scripts/check_map.py check "$run" "$folder/$kind" "$schema"
done
