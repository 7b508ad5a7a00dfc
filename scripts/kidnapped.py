#!/usr/bin/env python3
"""Relocalisation from many starts: a drive is cut at many frames, each piece is run with a kept map, and the time to the first pose by
the map is taken.

    scripts/kidnapped.py MOTORCADE MAP TRAINING GT_FIRST_VISIT_POSES MAP_GT_POSES --out FOLDER [--starts 40] [--frames 80] [--online] [--least PERCENT]

A piece is found where its first match is at most a second after its first frame and its pose is right by 1 m and 3 degrees. A match
counts only with the agreement of others along the way, so that a piece must hold some keyframes: relocalised means told at the end of it.
With --online the time is that of the first frame that was told in the world of the map as it came.
"""
import argparse
import csv
import json
import pathlib
import subprocess
import sys

import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
for name in ("program", "map", "training", "truth", "map_truth"):
    parser.add_argument(name, type=pathlib.Path)
parser.add_argument("--out", type=pathlib.Path, required=True)
parser.add_argument("--starts", type=int, default=40)
parser.add_argument("--frames", type=int, default=80)
parser.add_argument("--online", action="store_true")
parser.add_argument("--least", type=float, metavar="PERCENT", help="fail where fewer are found within a second, or a match is off by more than 1 m")
parser.add_argument("--fps", type=float, default=10.0)
options = parser.parse_args()


def poses(path):
    rows = np.loadtxt(path)
    out = np.tile(np.eye(4), (len(rows), 1, 1))
    out[:, :3, :] = rows.reshape(-1, 3, 4)
    return out


truth, map_truth = poses(options.truth), poses(options.map_truth)
seconds, worst, missed = [], 0.0, 0
for start in np.linspace(0, len(truth) - options.frames - 1, options.starts).astype(int):
    out = options.out / f"{start:05d}"
    detections = options.training / "detections/0000.txt"
    command = [options.program.resolve(), "run", options.training, "--sequence", "0000", "--camera", "2", "--models", "none", "--detections", detections,
               "--frames", f"{start}..{start + options.frames}", "--map", options.map, "--out", out, "--progress", "none", "--force"]
    command += ["--online"] if options.online else []
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode:
        print(start, done.stderr[-300:])
    used = json.loads((out / "run.json").read_text())["map"]
    met = used.get("first_estimated_frame" if options.online else "first_frame")
    if met is None:
        missed += 1
        print(f"start {start}: never met")
        continue
    seconds.append((met - start) / options.fps)
    off = 0.0
    for row in csv.DictReader((out / "map_matches.csv").open()):
        if row["holds"] != "true":
            continue
        right = np.linalg.inv(truth[int(row["frame"])]) @ map_truth[int(row["map_row"])]
        off = max(off, float(np.linalg.norm(right[:3, 3] - [float(row[k]) for k in ("tx", "ty", "tz")])))
    worst = max(worst, off)
    if seconds[-1] > 1.0 or off > 1.0:
        print(f"start {start}: first match after {seconds[-1]:.1f} s, worst match off by {off:.2f} m")
within = sum(s <= 1.0 for s in seconds)
print(f"{options.starts} starts: {within} within 1 s ({100 * within / options.starts:.1f} %), {missed} never met; "
      f"time to the first match median {np.median(seconds) if seconds else float('nan'):.1f} s, worst {max(seconds, default=float('nan')):.1f} s; worst match {worst:.3f} m")
if options.least is not None and (100 * within < options.least * options.starts or worst > 1.0):
    sys.exit(f"wanted: {options.least} % within 1 s, no match off by more than 1 m")
