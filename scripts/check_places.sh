#!/usr/bin/env bash
# Places seen again, end to end on a rendered drive of two rounds about a block: loops found and none false, parked vehicles met again, and a later drive
# with other traffic, cut into pieces, told in the world of the kept map within a second as it goes.
#
#     scripts/check_places.sh MOTORCADE
set -euo pipefail
motorcade=$(realpath "$1")
here=$(dirname "$(realpath "$0")")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
for drive in block again; do
  more=(); [ $drive = again ] && more=(--traffic-seed 2)
  "$motorcade" simulate --scenario block --frames 980 --width 621 "${more[@]}" --out $drive --progress none
done
boxes=(--models none --detections block/training/detections/0000.txt --progress none)
"$motorcade" run block/training "${boxes[@]}" --save-map block.map --out with
"$motorcade" run block/training "${boxes[@]}" --set loops.enabled=false --out without
truth=block/training/gt_poses/0000.txt
python3 "$here/loops.py" with $truth --without without --least-found 90
python3 "$here/met_again.py" with block/training/label_02/0000.txt without --least 60
python3 "$here/kidnapped.py" "$motorcade" block.map again/training again/training/gt_first_visit_poses/0000.txt $truth \
  --out pieces --starts 40 --frames 40 --online --least 95
