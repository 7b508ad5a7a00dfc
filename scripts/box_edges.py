#!/usr/bin/env python3
"""Errors of the edges of a detector's boxes by their height, on rendered drives whose truth is known: for `edge_errors` in models/models.toml.

    scripts/box_edges.py [--motorcade target/release/motorcade] [--frames 100] [--pixels 212992]

Renders drives, detects with a scene network, and prints for each range of heights the median error of the four edges against the visible extent of the
vehicle (positive to the right and down), its spread (1.48 × median absolute deviation) and the median shift of the whole box, in pixels of the network's
input. Cars and vans that are whole and not occluded, nearest box by IoU, at least 0.25. To measure `edge_errors` anew, give a folder with a models.toml
without them (--models).
"""
import argparse
import collections
import pathlib
import statistics
import subprocess
import tempfile

import numpy as np
from PIL import Image

DRIVES = [
    ("oncoming", 1242), ("crowd", 1242), ("dense", 1242), ("parked", 1242), ("overtaking", 1242), ("crossing", 1242), ("lorries", 1242),
    ("demo", 1242), ("crowd", 900), ("dense", 900), ("oncoming", 1600), ("parked", 1600),
]
HEIGHTS = (8, 11, 14, 18, 23, 30, 40, 60, 90)
LEAST_IOU = 0.25
BORDER_PX = 3.0

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--motorcade", default="target/release/motorcade")
parser.add_argument("--models", help="folder of other networks")
parser.add_argument("--frames", type=int, default=100)
parser.add_argument("--pixels", type=int, default=832 * 256, help="of the network's input")
options = parser.parse_args()


def iou(a, b):
    width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0.0
    area = lambda c: (c[2] - c[0]) * (c[3] - c[1])
    return width * height / (area(a) + area(b) - width * height)


def boxes(path):
    """Boxes of a file in KITTI's columns by frame."""
    found = collections.defaultdict(list)
    for line in path.read_text().splitlines():
        row = line.split()
        found[int(row[0])].append([float(v) for v in row[6:10]])
    return found


def extents(folder):
    """Size of the pictures, and by frame the visible extents of the cars that are whole and not occluded, pixel centres at integers."""
    found = collections.defaultdict(list)
    with Image.open(next((folder / "instance/0000").iterdir())) as first:
        size = first.size
    for line in (folder / "label_02/0000.txt").read_text().splitlines():
        row = line.split()
        if row[2] in ("Car", "Van") and float(row[3]) == 0 and row[4] == "0":
            found[int(row[0])].append(int(row[1]))
    for frame, ids in found.items():
        instance = np.array(Image.open(folder / f"instance/0000/{frame:06}.png"))
        of_frame = []
        for vehicle in ids:
            rows, columns = (np.flatnonzero((instance == vehicle + 1).any(axis)) for axis in (1, 0))
            if len(rows):
                of_frame.append([columns[0] - 0.5, rows[0] - 0.5, columns[-1] + 0.5, rows[-1] + 0.5])
        found[frame] = of_frame
    return size, found


def measured(folder, scenario, width, seed):
    """(height, errors of the edges) of each car, in pixels of the input."""
    simulate = ["simulate", "--scenario", scenario, "--frames", options.frames, "--width", width, "--seed", seed, "--instance", "--out", folder / "drive"]
    run = ["run", folder / "drive/training", "--out", folder / "run", *(["--models", options.models] if options.models else [])]
    for command in (simulate, run):
        command = [options.motorcade, *command, "--progress", "none", "--force"]
        subprocess.run([str(c) for c in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    size, truth = extents(folder / "drive/training")
    shrink = min(1.0, (options.pixels / (size[0] * size[1])) ** 0.5)
    scale = [max(1, round(side * shrink / 32)) * 32 / side for side in size]
    found = boxes(folder / "run/detections.txt")
    for frame, cars in truth.items():
        for car in cars:
            best = max(found[frame], key=lambda b: iou(b, car), default=None)
            inside = best and best[0] > BORDER_PX and best[2] < size[0] - 1 - BORDER_PX
            if inside and iou(best, car) >= LEAST_IOU:
                yield (best[3] - best[1]) * scale[1], [(b - c) * scale[k % 2] for k, (b, c) in enumerate(zip(best, car))]


ranges = collections.defaultdict(list)
with tempfile.TemporaryDirectory() as folder:
    for seed, (scenario, width) in enumerate(DRIVES):
        for height, errors in measured(pathlib.Path(folder) / str(seed), scenario, width, seed + 11):
            ranges[sum(height >= h for h in HEIGHTS)].append([height, *errors])
print("boxes  height    left     top   right  bottom   (spread)               shift right, down")
for _, rows in sorted(ranges.items()):
    columns = list(zip(*rows))
    middles = [statistics.median(c) for c in columns]
    spreads = [1.48 * statistics.median(abs(v - m) for v in c) for c, m in zip(columns, middles)]
    shifts = [statistics.median((row[k] + row[k + 2]) / 2 for row in rows) for k in (1, 2)]
    cells = [" ".join(f"{m:+7.2f}" for m in middles[1:]), " ".join(f"{s:.2f}" for s in spreads[1:]), " ".join(f"{m:+.2f}" for m in shifts)]
    print(f"{len(rows):5d} {middles[0]:7.1f} " + "   ".join(cells))
