#!/usr/bin/env python3
"""Prints the expected values of crates/motorcade-geometry/tests/opencv.rs, computed by OpenCV (pip install opencv-python-headless).

    scripts/opencv_distortion.py > crates/motorcade-geometry/tests/opencv_values/mod.rs && cargo fmt -p motorcade-geometry

Cameras: EuRoC's left camera (five coefficients), a 1280x720 camera with eight coefficients, a 848x800 fisheye. `POINTS`: points in the
camera frame [m] and their pixels by projectPoints. `MAPS`: pixels of the undistorted picture and of the distorted one, by
initUndistortRectifyMap (single precision, as OpenCV makes no other).
"""
import cv2
import numpy as np

RADIAL = ([458.654, 457.296, 367.215, 248.375], (752, 480), [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0])
KITTI = ([984.2439, 980.8141, 690.0, 233.1966], (1392, 512), [-0.3728755, 0.2037299, 0.002219027, 0.001383707, -0.07233722])
RATIONAL = (
    [611.902, 611.78, 637.032, 369.051],
    (1280, 720),
    [0.54637021, -2.6014142, 0.00084511022, -0.00037217003, 1.4684651, 0.42450839, -2.430366, 1.4001946],
)
FISHEYE = ([284.9502, 285.1153, 420.5002, 400.7381], (848, 800), [-0.00530046, 0.0423333, -0.0394988, 0.00682388])
CAMERAS = {"EUROC": RADIAL, "KITTI": KITTI, "RATIONAL": RATIONAL, "FISHEYE": FISHEYE}


def matrix(intrinsics):
    fx, fy, cx, cy = intrinsics
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def points(name):
    """Rays up to 38 degrees from the axis, of the fisheye up to 80."""
    steps = (0.0, 0.01, 0.4, 1.5, 3.9) if name == "FISHEYE" else (0.0, 0.01, 0.2, 0.4, 0.55)
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    out = []
    for x, (sign_x, sign_y) in zip(steps, (*signs, signs[0])):
        out += [(sign_x * x * 7.0, sign_y * y * 7.0, 7.0) for y in steps]
    return out


def project(name, p):
    intrinsics, _, d = CAMERAS[name]
    p = np.array(p).reshape(-1, 1, 3)
    by = cv2.fisheye.projectPoints if name == "FISHEYE" else cv2.projectPoints
    return by(p, np.zeros(3), np.zeros(3), matrix(intrinsics), np.array(d))[0].reshape(-1, 2)


def target(name):
    """The camera of the undistorted picture: the same, for the fisheye 100 degrees wide."""
    intrinsics, (width, height), _ = CAMERAS[name]
    if name != "FISHEYE":
        return intrinsics
    focal = 0.5 * width / np.tan(np.radians(50.0))
    return [focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)]


def undistortion(name):
    intrinsics, (width, height), d = CAMERAS[name]
    by = cv2.fisheye.initUndistortRectifyMap if name == "FISHEYE" else cv2.initUndistortRectifyMap
    u, v = by(matrix(intrinsics), np.array(d), np.eye(3), matrix(target(name)), (width, height), cv2.CV_32FC1)
    columns, rows = ([round(i * (n - 1) / 4) for i in range(5)] for n in (width, height))
    return [(x, y, u[y, x], v[y, x]) for y in rows for x in columns]


def literal(value):
    text = f"{value:.9g}"
    return text if set(text) & set(".e") else f"{text}.0"


def rust(name, kind, columns, rows):
    print(f"pub const {name}_{kind}: [[f64; {columns}]; {len(rows)}] = [")
    for row in rows:
        print("    [" + ", ".join(literal(float(v)) for v in row) + "],")
    print("];")


def main():
    print(f"//! Written by scripts/opencv_distortion.py with OpenCV {cv2.__version__}.\n")
    for name in CAMERAS:
        p = points(name)
        print("/// Point [m], pixel.")
        rust(name, "POINTS", 5, [(*a, *b) for a, b in zip(p, project(name, p))])
        print("/// Undistorted pixel, distorted pixel.")
        rust(name, "MAP", 4, undistortion(name))


if __name__ == "__main__":
    main()
