#!/usr/bin/env python3
"""Judges vehicles that were met again: passes of one track that labels call one vehicle, and passes of one vehicle that are two tracks.

    scripts/met_again.py RUN LABELS [RUN_WITHOUT_LOOPS] [--least PERCENT]

LABELS are KITTI tracking labels with one identity a vehicle over the whole drive, as `motorcade simulate` writes. A pass is a stretch of
frames of a track without a gap of 20 frames; it is the labelled vehicle whose box it overlaps most (IoU at least 0.4). With --least a
smaller share of vehicles that are one track, a track that holds two, or a run without loops that joins any, is a failure.
"""
import argparse
import collections
import csv
import json
import pathlib
import sys

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("run", type=pathlib.Path)
parser.add_argument("labels", type=pathlib.Path)
parser.add_argument("without", type=pathlib.Path, nargs="?")
parser.add_argument("--least", type=float, metavar="PERCENT")
options = parser.parse_args()

truth = collections.defaultdict(list)
for line in options.labels.read_text().splitlines():
    field = line.split()
    if field[2] != "DontCare":
        truth[int(field[0])].append((int(field[1]), [float(v) for v in field[6:10]]))


def overlap(a, b):
    w, h = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    both = max(w, 0) * max(h, 0)
    return both / max((a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - both, 1e-9)


def passes(run):
    seen = collections.defaultdict(list)
    for line in (run / "tracks.kitti.txt").read_text().splitlines():
        field = line.split()
        seen[int(field[1])].append((int(field[0]), [float(v) for v in field[6:10]]))
    out = []
    for track, boxes in seen.items():
        boxes.sort(key=lambda b: b[0])
        part, last = [], None
        for frame, box in boxes + [(10**9, None)]:
            if last is not None and frame - last > 20:
                votes = collections.Counter()
                for f, b in part:
                    best = max(truth.get(f, []), key=lambda t: overlap(t[1], b), default=None)
                    if best and overlap(best[1], b) >= 0.4:
                        votes[best[0]] += 1
                if len(part) >= 5 and votes:
                    out.append((track, votes.most_common(1)[0][0], part[0][0]))
                part = []
            part.append((frame, box))
            last = frame
    return out


for name, run in (("with loops", options.run), ("without", options.without)):
    if run is None:
        continue
    found = passes(run)
    vehicles = collections.defaultdict(list)
    for track, vehicle, _ in found:
        vehicles[vehicle].append(track)
    again = {v: t for v, t in vehicles.items() if len(t) > 1}
    one = sum(len(set(t)) == 1 for t in again.values())
    tracks = collections.defaultdict(set)
    for track, vehicle, _ in found:
        tracks[track].add(vehicle)
    wrong = sum(len(v) > 1 for v in tracks.values())
    print(f"{name}: {len(again)} labelled vehicles passed more than once, {one} of them one track; tracks that hold two vehicles: {wrong}")
    if options.least is not None:
        right = 100 * one >= options.least * len(again) > 0 if run is options.run else one == 0
        if wrong or not right:
            sys.exit(f"{run}: wanted are {options.least} % with loops, none without, and no track that holds two")
    rows = list(csv.DictReader((run / "tracks.csv").open()))
    sigma = [k for k in rows[0] if k.startswith("sigma") and k.endswith("_m")]
    print("   run.json loops.vehicles_met_again:", json.loads((run / "run.json").read_text()).get("loops", {}).get("vehicles_met_again"), "columns", sigma)
