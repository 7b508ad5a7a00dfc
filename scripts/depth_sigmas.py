#!/usr/bin/env python3
"""Errors of the depth of vehicles in units of their standard deviations, by distance and by how sure it is that they move.

    scripts/depth_sigmas.py RUN:LABELS …          (labels of KITTI's tracking format, of the run's camera)

Of each state of a run that was seen in its frame, against the labelled car, van or lorry whose box it overlaps by 0.6 and more: median error and standard
deviation as shares of the distance, and the shares of errors below one, two and three standard deviations (68, 95 and 99.7 % wanted). The standard
deviation is that relative to the camera, along the view (`tracks.csv`). Needs NumPy.
"""
import collections
import csv
import pathlib
import sys

import numpy as np

DISTANCES_M = (0, 15, 30, 45, 60, 150)
KINDS = (("moves", 0.85, 1.01), ("undecided", 0.15, 0.85), ("stands", -0.01, 0.15))


def iou(a, b):
    width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0.0
    both = width * height
    return both / ((a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - both)


def labels_of(path):
    """Box and depth of the whole vehicles of each frame."""
    out = collections.defaultdict(list)
    for row in map(str.split, path.read_text().splitlines()):
        if row[2] in ("Car", "Van", "Truck") and float(row[3]) <= 0:
            out[int(row[0])].append((tuple(map(float, row[6:10])), float(row[15])))
    return out


def errors(run, labels):
    """Depth of the label, error, standard deviation and P(moving), a row each."""
    placed = {}
    for row in map(str.split, (run / "tracks.kitti.txt").read_text().splitlines()):
        placed[int(row[0]), int(row[1])] = tuple(map(float, row[6:10])), *map(float, (row[13], row[15], row[16]))
    out = []
    for row in csv.DictReader((run / "tracks.csv").open()):
        key = int(row["frame"]), int(row["id"])
        if key not in placed or row["source"] == "predicted":
            continue
        box, x, z, ry = placed[key]
        overlap, depth_m = max(((iou(box, other), depth) for other, depth in labels[key[0]]), default=(0.0, 0.0))
        if overlap < 0.6:
            continue
        # Direction of view in the vehicle's axes, forward and left.
        along = abs((x * np.cos(ry) - z * np.sin(ry)) / np.hypot(x, z))
        sigma_m = np.hypot(float(row["sigma_relative_forward_m"]) * along, float(row["sigma_relative_left_m"]) * np.sqrt(max(0.0, 1.0 - along**2)))
        out.append((depth_m, z - depth_m, sigma_m, float(row["p_moving"])))
    return out


if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
    sys.exit(__doc__)
found = []
for argument in sys.argv[1:]:
    run, labels = argument.rsplit(":", 1)
    found += errors(pathlib.Path(run), labels_of(pathlib.Path(labels)))
found = np.array(found).reshape(-1, 4)
print("| vehicle | distance | states | error, median | σ, median | < 1, 2, 3 σ | largest |\n|---|---|---|---|---|---|---|")
for kind, low, high in KINDS:
    for near, far in zip(DISTANCES_M, DISTANCES_M[1:]):
        depth, error, sigma, _ = found[(found[:, 3] >= low) & (found[:, 3] < high) & (found[:, 0] >= near) & (found[:, 0] < far)].T
        if len(depth) < 10:
            continue
        within = ", ".join(f"{100 * np.mean(abs(error) < k * sigma):.0f}" for k in (1, 2, 3))
        shares = [100 * np.median(values / depth) for values in (abs(error), sigma)]
        print(f"| {kind} | {near} to {far} m | {len(depth)} | {shares[0]:.1f} % | {shares[1]:.1f} % | {within} % | {max(abs(error) / sigma):.1f} σ |")
