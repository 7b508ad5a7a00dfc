#!/usr/bin/env python3
"""Degrades a KITTI trajectory by a seeded random walk, as an odometry would: input for --trajectory.

    scripts/degrade_trajectory.py POSES.txt OUT.txt [--camera-offset-m 0.06] [--scale 0.01] [--rotation-deg 0.02] [--seed 1]

Every frame's motion gets a rotation error (standard deviation per axis, degrees a frame) and a scale that walks slowly with
the given standard deviation over the drive. --camera-offset-m: x of cam0's origin in the camera whose poses are written.
"""
import argparse

import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("poses")
parser.add_argument("out")
parser.add_argument("--camera-offset-m", type=float, default=0.0)
parser.add_argument("--scale", type=float, default=0.01)
parser.add_argument("--rotation-deg", type=float, default=0.02)
parser.add_argument("--seed", type=int, default=1)
options = parser.parse_args()
rows = np.loadtxt(options.poses, ndmin=2)
poses = np.tile(np.eye(4), (len(rows), 1, 1))
poses[:, :3] = rows.reshape(-1, 3, 4)
shift = np.eye(4)
shift[0, 3] = options.camera_offset_m
poses = poses @ np.linalg.inv(shift)
random = np.random.default_rng(options.seed)


def turn(w):
    angle = np.linalg.norm(w)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = w / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


now, out = poses[0], [poses[0]]
scale = 1 + options.scale * random.standard_normal()
for before, after in zip(poses, poses[1:]):
    step = np.linalg.inv(before) @ after
    scale += options.scale / np.sqrt(len(poses)) * random.standard_normal()
    step[:3, 3] *= scale
    step[:3, :3] = step[:3, :3] @ turn(np.radians(options.rotation_deg) * random.standard_normal(3))
    now = now @ step
    out.append(now)
np.savetxt(options.out, np.array(out)[:, :3].reshape(len(out), 12), fmt="%.9e")
