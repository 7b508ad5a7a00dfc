#!/usr/bin/env python3
"""Judges the loops of a run against exact poses: found, missed, false, and the error of the trajectory.

    scripts/loops.py RUN GT_POSES [--without RUN_WITHOUT_LOOPS] [--dark-until FRAME] [--least-found PERCENT]

RUN is a directory of `motorcade run`, GT_POSES a file of KITTI poses (3×4, a row a frame) such as `motorcade simulate` writes. A frame
comes to a place again when an earlier frame, at least 40 m of way before, stands within 3 m and 20° of it. The way of such frames counts
as found where a closed loop lies within 5 m of way. A loop is false when its relative pose is off by more than 1 m or 3°. With --least-found
a smaller share or a false loop is a failure.
"""
import argparse
import csv
import json
import pathlib
import sys

import numpy as np

LEAST_WAY_M, PLACE_M, PLACE_DEG, REACH_M = 40.0, 3.0, 20.0, 5.0
FALSE_M, FALSE_DEG = 1.0, 3.0


def poses(path):
    rows = np.loadtxt(path)
    out = np.tile(np.eye(4), (len(rows), 1, 1))
    out[:, :3, :] = rows.reshape(-1, 3, 4)
    return out


def angle_deg(rotation):
    return np.degrees(np.arccos(np.clip((np.trace(rotation, axis1=-2, axis2=-1) - 1) / 2, -1, 1)))


def ate_m(estimated, truth, scale=False):
    a, b = estimated[:, :3, 3], truth[: len(estimated), :3, 3]
    ma, mb = a.mean(0), b.mean(0)
    u, d, vt = np.linalg.svd((b - mb).T @ (a - ma) / len(a))
    s = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ s @ vt
    factor = np.trace(np.diag(d) @ s) / ((a - ma) ** 2).sum(1).mean() if scale else 1.0
    error = (factor * (rotation @ (a - ma).T)).T + mb - b
    return np.sqrt((error**2).sum(1).mean())


def revisited(truth):
    way = np.concatenate([[0], np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1).cumsum()])
    again = np.zeros(len(truth), bool)
    for k in range(len(truth)):
        early = np.flatnonzero(way[: k + 1] < way[k] - LEAST_WAY_M)
        near = early[np.linalg.norm(truth[early, :3, 3] - truth[k, :3, 3], axis=1) < PLACE_M]
        if len(near):
            again[k] = angle_deg(np.swapaxes(truth[near, :3, :3], 1, 2) @ truth[k, :3, :3]).min() < PLACE_DEG
    return way, again


def loops(run):
    path = run / "loops.csv"
    if not path.exists():
        return []
    return [row for row in csv.DictReader(path.open()) if row["closed"] == "true"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("truth", type=pathlib.Path)
    parser.add_argument("--without", type=pathlib.Path)
    parser.add_argument("--dark-until", type=int, help="first frame with light after a tunnel")
    parser.add_argument("--least-found", type=float, metavar="PERCENT")
    options = parser.parse_args()
    truth = poses(options.truth)
    estimated = poses(options.run / "ego.kitti.txt")
    truth = truth[: len(estimated)]
    way, again = revisited(truth)
    found = loops(options.run)
    errors = []
    for row in found:
        i, j = int(row["later_frame"]), int(row["earlier_frame"])
        right = np.linalg.inv(truth[i]) @ truth[j]
        translation = np.array([float(row[k]) for k in ("tx", "ty", "tz")])
        x, y, z, w = (float(row[k]) for k in ("qx", "qy", "qz", "qw"))
        rotation = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ])
        errors.append((np.linalg.norm(translation - right[:3, 3]), angle_deg(rotation.T @ right[:3, :3])))
    errors = np.array(errors).reshape(-1, 2)
    false = int(((errors[:, 0] > FALSE_M) | (errors[:, 1] > FALSE_DEG)).sum())
    at = np.array([way[int(row["later_frame"])] for row in found])
    covered = np.array([len(at) > 0 and np.abs(at - way[k]).min() < REACH_M for k in np.flatnonzero(again)])
    steps = np.diff(way, prepend=0)
    share = (steps[again] * covered).sum() / max(steps[again].sum(), 1e-9) if len(covered) else float("nan")
    print(f"way {way[-1]:.1f} m, come again {steps[again].sum():.1f} m, found along {100 * share:.1f} % of it")
    print(f"loops {len(found)}, false {false}")
    if len(errors):
        print(f"relative pose: median {np.median(errors[:, 0]):.3f} m {np.median(errors[:, 1]):.3f} deg, worst {errors[:, 0].max():.3f} m {errors[:, 1].max():.3f} deg")
    for name, run in (("with loops", options.run), ("without", options.without)):
        if run:
            own = poses(run / "ego.kitti.txt")
            print(f"ATE {name}: SE(3) {ate_m(own, truth):.3f} m = {100 * ate_m(own, truth) / way[-1]:.3f} % of the way, Sim(3) {ate_m(own, truth, True):.3f} m")
    if options.dark_until is not None:
        later = sorted(int(r["later_frame"]) for r in found if int(r["later_frame"]) >= options.dark_until)
        print(f"first loop after the dark: {later[0] - options.dark_until} frames later" if later else "no loop after the dark")
    record = json.loads((options.run / "run.json").read_text())
    print("run.json loops:", record.get("loops"))
    print("timings:", {k: v for k, v in record.get("timings", {}).items() if k in ("places", "loops", "odometry")} if isinstance(record.get("timings"), dict) else [t for t in record.get("timings", []) if t.get("stage") in ("places", "loops", "odometry", "graph", "road")])
    if options.least_found is not None and (false or not 100 * share >= options.least_found):
        sys.exit(f"{options.run}: {false} false loops, {100 * share:.1f} % found; wanted: none, {options.least_found} %")


if __name__ == "__main__":
    main()
