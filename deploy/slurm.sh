#!/usr/bin/env bash
# Slurm array: each task works on one shard of a manifest; all share one directory.
#   sbatch deploy/slurm.sh /data/drives.csv /data/fleet --calibration /data/camera.toml --height 1.4
# When all tasks have ended, one more command writes the table of all drives and runs nothing that is done:
#   motorcade batch /data/drives.csv --out /data/fleet --calibration /data/camera.toml --height 1.4
#SBATCH --job-name=motorcade
#SBATCH --array=0-7
#SBATCH --cpus-per-task=4
#SBATCH --mem-per-cpu=2G
#SBATCH --time=24:00:00
#SBATCH --signal=B:TERM@300
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail
manifest=$1 out=$2
shift 2
# Tasks that are submitted again alone (--array=3,5) need the first count: SHARDS=8 sbatch --array=3,5 ...
shards=${SHARDS:-$SLURM_ARRAY_TASK_COUNT}

"${MOTORCADE:-motorcade}" batch "$manifest" --out "$out" --shard "$SLURM_ARRAY_TASK_ID/$shards" \
    --jobs "${SLURM_CPUS_PER_TASK:-1}" --threads 1 --progress plain "$@" &
child=$!
trap 'kill -TERM "$child"' TERM INT
code=0
wait "$child" || code=$?
# A signal ends `wait`, not the program: it writes what it has.
while kill -0 "$child" 2>/dev/null; do
    code=0
    wait "$child" || code=$?
done
# Stopped by the time limit: the task goes on with the same command when Slurm starts it again.
if [ "$code" = 130 ] && [ -n "${SLURM_ARRAY_JOB_ID:-}" ]; then
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"
fi
exit "$code"
