#!/usr/bin/env python3
"""Rotations between pairs of frames by OpenCV (SIFT, essential matrix, MAGSAC), beside those of a run and of the ground truth.

    pip install numpy scipy opencv-python-headless
    second_opinion.py RUN GT_POSES IMAGES FX CX CY [A-B ...]

RUN holds ego.kitti.txt; GT_POSES has a KITTI row a frame. Prints rotation vectors in degrees, camera A from camera B. Where two
independent estimates from the pictures agree with each other and not with the ground truth, the ground truth is in doubt.
"""
import sys
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

PAIRS = ["0-5", "5-10", "10-20", "20-30", "40-50", "60-70", "104-107", "107-110", "110-113", "113-116"]


def poses(path):
    return np.loadtxt(path).reshape(-1, 3, 4)[:, :, :3]


def between(rotations, a, b):
    return Rotation.from_matrix(rotations[a].T @ rotations[b]).as_rotvec(degrees=True)


def by_opencv(images, camera, a, b):
    sift = cv2.SIFT_create(4000)
    (points_a, words_a), (points_b, words_b) = (
        sift.detectAndCompute(cv2.imread(str(images[k]), cv2.IMREAD_GRAYSCALE), None) for k in (a, b)
    )
    pairs = cv2.BFMatcher().knnMatch(words_a, words_b, k=2)
    good = [best for best, second in pairs if best.distance < 0.75 * second.distance]
    seen_a = np.float64([points_a[m.queryIdx].pt for m in good])
    seen_b = np.float64([points_b[m.trainIdx].pt for m in good])
    essential, mask = cv2.findEssentialMat(seen_a, seen_b, camera, cv2.USAC_MAGSAC, 0.9999, 0.7)
    count, rotation, _, _ = cv2.recoverPose(essential, seen_a, seen_b, camera, mask=mask)
    return Rotation.from_matrix(rotation.T).as_rotvec(degrees=True), count


def main():
    if len(sys.argv) < 7:
        sys.exit(__doc__)
    run, truth = poses(Path(sys.argv[1]) / "ego.kitti.txt"), poses(sys.argv[2])
    images = sorted(p for p in Path(sys.argv[3]).iterdir() if p.suffix in (".png", ".jpg"))
    fx, cx, cy = map(float, sys.argv[4:7])
    camera = np.array([[fx, 0, cx], [0, fx, cy], [0, 0, 1]])
    print("| frames | OpenCV | run | ground truth | inliers |\n|---|---|---|---|---|")
    for pair in sys.argv[7:] or PAIRS:
        a, b = map(int, pair.split("-"))
        opencv, count = by_opencv(images, camera, a, b)
        cells = (" ".join(f"{v:.2f}" for v in r) for r in (opencv, between(run, a, b), between(truth, a, b)))
        print(f"| {a}–{b} | {' | '.join(cells)} | {count} |")


if __name__ == "__main__":
    main()
