#!/usr/bin/env bash
# Opens the Parquet files of `run --parquet` and of `motorcade tables` with pandas, polars and DuckDB and compares them with the CSV files
# of two runs, value by value: that of the demo and one on the first frames of its drive.
#   scripts/check_tables.sh target/release/motorcade runs/demo
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
run=$(realpath "$2")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q 'pandas>=2' 'pyarrow>=14' 'polars>=1' 'duckdb>=1'
"$program" run "$run-drive/training" --frames ..60 --parquet --out "$folder/start" --progress none
"$program" tables "$run" "$folder/start" --out "$folder/tables"
cmp "$folder/start/frames.parquet" "$folder/tables/frames/start.parquet"
cmp "$folder/start/tracks.parquet" "$folder/tables/tracks/start.parquet"
"$folder/venv/bin/python" scripts/check_tables.py "$folder/tables" "$run" "$folder/start"
