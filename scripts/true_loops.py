#!/usr/bin/env python3
"""The error that loops without any error of their own would leave: a bound for what loops can do on a drive.

    scripts/true_loops.py MOTORCADE RUN RUN_WITHOUT_LOOPS GT_POSES

The steps of the run without loops (2 mm and 0.2 mrad each; the result hardly depends on it) and, between the frames that the loops of RUN
join, the exact relative poses (0.1 mm, 0.01 mrad) make a pose graph, which `MOTORCADE graph optimise` solves.
"""
import argparse
import pathlib
import subprocess
import tempfile

import numpy as np

from loops import ate_m, loops, poses

STEP_M, STEP_RAD, LOOP_M, LOOP_RAD = 2e-3, 2e-4, 1e-4, 1e-5


def quaternion(rotation):
    """x, y, z, w, as the eigenvector of the largest eigenvalue (Bar-Itzhack, 2000)."""
    r = rotation
    k = np.array([
        [r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
        [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
        [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)],
    ])
    return np.linalg.eigh(k)[1][:, -1]


def numbers(pose):
    return " ".join(f"{x:.12g}" for x in [*pose[:3, 3], *quaternion(pose[:3, :3])])


def edge(first, second, measured, sigma_m, sigma_rad):
    information = [sigma_m**-2] * 3 + [sigma_rad**-2] * 3
    upper = " ".join(f"{information[r] if r == c else 0:g}" for r in range(6) for c in range(r, 6))
    return f"EDGE_SE3:QUAT {first} {second} {numbers(measured)} {upper}\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("motorcade", "run", "without", "truth"):
        parser.add_argument(name, type=pathlib.Path)
    options = parser.parse_args()
    own, truth = poses(options.without / "ego.kitti.txt"), poses(options.truth)
    lines = [f"VERTEX_SE3:QUAT {k} {numbers(pose)}\n" for k, pose in enumerate(own)] + ["FIX 0\n"]
    lines += [edge(k, k + 1, np.linalg.inv(own[k]) @ own[k + 1], STEP_M, STEP_RAD) for k in range(len(own) - 1)]
    for row in loops(options.run):
        i, j = int(row["earlier_frame"]), int(row["later_frame"])
        lines.append(edge(i, j, np.linalg.inv(truth[i]) @ truth[j], LOOP_M, LOOP_RAD))
    with tempfile.TemporaryDirectory() as folder:
        given, solved = pathlib.Path(folder) / "given.g2o", pathlib.Path(folder) / "solved.g2o"
        given.write_text("".join(lines))
        subprocess.run([options.motorcade, "graph", "optimise", given, "--out", solved], check=True, capture_output=True)
        places = [line.split()[2:5] for line in solved.open() if line.startswith("VERTEX")]
    moved = own.copy()
    moved[:, :3, 3] = np.array(places, float)
    for name, all_poses in (("without loops", own), ("loops of the run", poses(options.run / "ego.kitti.txt")), ("true loops", moved)):
        print(f"ATE {name}: SE(3) {ate_m(all_poses, truth):.3f} m, Sim(3) {ate_m(all_poses, truth, True):.3f} m")


if __name__ == "__main__":
    main()
