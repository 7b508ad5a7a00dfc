#!/usr/bin/env bash
# Checks deploy/: two tasks of the Slurm script, the command line of the Kubernetes job, the container.
#   scripts/check_deploy.sh target/release/motorcade
# The static program is built (deploy/static.sh), and the container from it: where docker or podman works, else by Debian's buildah
# (scripts/check_container.sh). Where that cannot be installed the static program runs as user 10001 on a root file system that is mounted
# read-only.
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "$1")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
say() { printf -- '-- %s\n' "$*"; }
rows() { tail -n +2 "$1" | cut -d, -f2 | sort | uniq -c | tr -s ' ' | tr '\n' ' '; }
expect() { [ "$2" = "$3" ] || { echo "$1: expected \`$3\`, found \`$2\`"; exit 1; }; }
export MOTORCADE_MODELS=none

say "three short drives"
mkdir "$folder/data"
"$program" simulate --scenario demo --frames 14 --width 320 --out "$folder/data/drive" --progress none >/dev/null
split=$(dirname "$(find "$folder/data/drive" -name image_02 -type d | head -1)")
printf 'id,input,frames\na,%s,0..10\nb,%s,2..12\nc,%s,4..14\n' "$split" "$split" "$split" |
    sed "s|$folder/data/||g" >"$folder/data/drives.csv"

say "deploy/slurm.sh: tasks 0 and 1 of 2 at once, then the whole list"
bash -n deploy/slurm.sh
grep -q '^#SBATCH --array=' deploy/slurm.sh
pids=()
for task in 0 1; do
    SLURM_ARRAY_TASK_ID=$task SLURM_ARRAY_TASK_COUNT=2 SLURM_CPUS_PER_TASK=1 MOTORCADE=$program \
        bash deploy/slurm.sh "$folder/data/drives.csv" "$folder/slurm" 2>"$folder/task$task.log" >/dev/null &
    pids+=($!)
done
for pid in "${pids[@]}"; do wait "$pid" || { cat "$folder"/task*.log; exit 1; }; done
expect "task 0" "$(rows "$folder/slurm/manifest.done.0-of-2.csv")" " 2 done "
expect "task 1" "$(rows "$folder/slurm/manifest.done.1-of-2.csv")" " 1 done "
"$program" batch "$folder/data/drives.csv" --out "$folder/slurm" --progress plain >/dev/null 2>"$folder/whole.log"
grep -q "3 drives, 3 done before" "$folder/whole.log"
expect "whole list" "$(rows "$folder/slurm/manifest.done.csv")" " 3 done "

say "deploy/slurm.sh: SIGTERM before the time is up, then the task again"
SLURM_ARRAY_TASK_ID=0 SLURM_ARRAY_TASK_COUNT=1 MOTORCADE=$program \
    bash deploy/slurm.sh "$folder/data/drives.csv" "$folder/again" 2>"$folder/term.log" >/dev/null &
pid=$!
until grep -q begins "$folder/term.log"; do sleep 0.05; done
kill -TERM "$pid"
code=0
wait "$pid" || code=$?
expect "stopped task" "$code" 130
SLURM_ARRAY_TASK_ID=0 SLURM_ARRAY_TASK_COUNT=1 MOTORCADE=$program \
    bash deploy/slurm.sh "$folder/data/drives.csv" "$folder/again" >/dev/null 2>&1
expect "task started again" "$(rows "$folder/again/manifest.done.csv")" " 3 done "

say "deploy/kubernetes.yaml: read, its command line run with another place for /data"
python=python3
if ! python3 -c 'import yaml' 2>/dev/null; then
    python3 -m venv "$folder/venv"
    "$folder/venv/bin/pip" install -q pyyaml
    python=$folder/venv/bin/python
fi
"$python" scripts/check_kubernetes.py deploy/kubernetes.yaml "$folder/data" >"$folder/args"
mapfile -t args <"$folder/args"
"$program" "${args[@]}" >/dev/null 2>"$folder/kubernetes.log" || { cat "$folder/kubernetes.log"; exit 1; }
expect "index 0 of 8" "$(rows "$folder"/data/fleet/manifest.done.0-of-8.csv)" " 1 done "

say "deploy/Containerfile"
bash deploy/static.sh
program=$PWD/target/container/motorcade
if ldd "$program" 2>/dev/null | grep -q '=>'; then echo "$program is not static"; exit 1; fi
builder=
for tool in podman docker; do
    if command -v "$tool" >/dev/null && timeout 20 "$tool" info >/dev/null 2>&1; then builder=$tool; break; fi
done
rm -rf "$folder/data/fleet"
# Containers and `unshare` below write as user 10001.
chmod 755 "$folder"
chmod -R a+rwX "$folder/data"
if [ -n "$builder" ]; then
    say "built and run by $builder"
    "$builder" build -q -f deploy/Containerfile -t motorcade-check target/container
    "$builder" run --rm --read-only --tmpfs /tmp -e MOTORCADE_MODELS=none -v "$folder/data:/data" motorcade-check \
        batch drives.csv --out fleet --jobs 2
    "$builder" rmi -f motorcade-check >/dev/null
    expect "container" "$(rows "$folder/data/fleet/manifest.done.csv")" " 3 done "
    exit 0
fi
say "by buildah"
code=0
bash scripts/check_container.sh "$folder/data" || code=$?
[ "$code" = 0 ] && exit 0
[ "$code" = 77 ] || exit "$code"
say "no builder: as user 10001 on a read-only root file system"
cat >"$folder/inside.sh" <<'INSIDE'
set -eu
mount --make-rprivate /
mount --bind "$1/data" "$1/data"
mount -o remount,bind,ro /
cd "$1/data"
if touch /written-by-check 2>/dev/null; then echo "the root file system can be written"; exit 1; fi
exec setpriv --reuid=10001 --regid=10001 --clear-groups --no-new-privs --bounding-set=-all \
    "$2" batch drives.csv --out fleet --jobs 2 --progress plain
INSIDE
cp "$program" "$folder/motorcade"
chmod 755 "$folder/motorcade"
if [ "$(id -u)" = 0 ] && unshare -m true 2>/dev/null; then
    unshare -m bash "$folder/inside.sh" "$folder" "$folder/motorcade" >/dev/null 2>"$folder/inside.log" ||
        { cat "$folder/inside.log"; exit 1; }
    expect "read-only" "$(rows "$folder/data/fleet/manifest.done.csv")" " 3 done "
    expect "owner" "$(stat -c %u "$folder/data/fleet/manifest.done.csv")" 10001
else
    echo "not checked: neither a builder nor the right to mount here"
fi
