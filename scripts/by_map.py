#!/usr/bin/env python3
"""Judges runs in the world of a kept map against exact poses, without any alignment but that of the map itself.

    scripts/by_map.py MAP_RUN MAP_GT_POSES GT_FIRST_VISIT_POSES RUN [RUN_WITHOUT_MAP]

MAP_RUN kept the map, MAP_GT_POSES are its exact poses; GT_FIRST_VISIT_POSES are those of the later drive in the exact world of the first
one (`motorcade simulate --traffic-seed` writes them). The map's own error is taken out by its nearest frame: a pose counts as right
relative to the map where it stands to that frame's pose as it does in truth. A run without the map is put where its first exact pose is.
"""
import argparse
import json
import pathlib

import numpy as np


def poses(path):
    rows = np.loadtxt(path)
    out = np.tile(np.eye(4), (len(rows), 1, 1))
    out[:, :3, :] = rows.reshape(-1, 3, 4)
    return out


def angle_deg(rotation):
    return float(np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))))


def tell(name, errors, turns):
    q = np.quantile(errors, [0.5, 0.95, 1.0])
    print(f"{name}: median {q[0]:.3f} m, 95 % {q[1]:.3f} m, worst {q[2]:.3f} m, rms {np.sqrt((errors**2).mean()):.3f} m; orientation median {np.median(turns):.3f} deg")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("map_run", "map_truth", "truth", "run"):
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument("without", type=pathlib.Path, nargs="?")
    options = parser.parse_args()
    kept, exact = poses(options.map_run / "ego.kitti.txt"), poses(options.map_truth)
    truth, found = poses(options.truth), poses(options.run / "ego.kitti.txt")
    truth = truth[: len(found)]
    print("run.json map:", json.loads((options.run / "run.json").read_text()).get("map"))
    way = np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1).sum()
    print(f"way {way:.1f} m, {len(found)} frames")
    errors, turns, straight = [], [], []
    for pose, right in zip(found, truth):
        near = np.linalg.norm(exact[: len(kept), :3, 3] - right[:3, 3], axis=1).argmin()
        expected = kept[near] @ np.linalg.inv(exact[near]) @ right
        errors.append(np.linalg.norm(pose[:3, 3] - expected[:3, 3]))
        turns.append(angle_deg(pose[:3, :3].T @ expected[:3, :3]))
        straight.append(np.linalg.norm(pose[:3, 3] - right[:3, 3]))
    tell("by map, against the map", np.array(errors), np.array(turns))
    tell("by map, against exact poses", np.array(straight), np.array(turns))
    if options.without:
        own = poses(options.without / "ego.kitti.txt")
        moved = np.array([truth[0] @ np.linalg.inv(own[0]) @ pose for pose in own])
        errors = np.linalg.norm(moved[:, :3, 3] - truth[: len(own), :3, 3], axis=1)
        turns = [angle_deg(a[:3, :3].T @ b[:3, :3]) for a, b in zip(moved, truth)]
        tell("without map, first pose exact", errors, np.array(turns))


if __name__ == "__main__":
    main()
