#!/usr/bin/env python3
"""KITTI tracking 0005 as it was and re-enacted in synthetic scenery: the same camera poses and vehicles, both judged alike.

    cargo build --release
    scripts/reenacted_drive.py [--shared ../shared] [--motorcade target/release/motorcade] [--out DIR] [--seed 0]

Prints the table of crates/motorcade-simulate/BENCHMARK.md as Markdown and fails where the camera's errors are not of the same
order (ten times apart or more).
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--shared", default="../shared", type=pathlib.Path)
parser.add_argument("--motorcade", default="target/release/motorcade", type=pathlib.Path)
parser.add_argument("--out", type=pathlib.Path)
parser.add_argument("--seed", default=0, type=int, help="of scenery, colours and detections")
options = parser.parse_args()
out = options.out or pathlib.Path(tempfile.mkdtemp(prefix="motorcade-reenacted-"))
kitti = options.shared / "kitti/tracking/training"


def motorcade(command, *arguments):
    subprocess.run(
        [str(options.motorcade), command, *map(str, arguments), "--force", "--progress", "none"],
        check=True, stdout=subprocess.DEVNULL,
    )


def judge(folder, root, sequence, camera):
    command = [sys.executable, str(options.shared / "tools/judge.py"), str(folder), "--kitti", str(root)]
    command += ["--seq", sequence, "--camera", str(camera), "--first", "0"]
    return json.loads(subprocess.check_output(command, text=True))


motorcade("run", kitti, "--sequence", "0005", "--camera", 3, "--models", options.shared / "models", "--out", out / "real")
real = judge(out / "real", kitti, "0005", 3)

motorcade(
    "simulate", "--trajectory", kitti / "gt_poses/0005.txt", "--labels", kitti / "label_02/0005.txt",
    "--calibration", kitti / "calib/0005.txt", "--camera", 3, "--seed", options.seed, "--out", out / "drive",
)
again = out / "drive/training"
motorcade(
    "run", again, "--sequence", "0000", "--camera", 2, "--height", 1.65,
    "--detections", again / "detections/0000.txt", "--road-masks", again / "road_masks/0000", "--out", out / "again",
)
reenacted = judge(out / "again", again, "0000", 2)

rows = [
    ("ego ATE, SE(3)-aligned", lambda r: f"{r['ego']['ate_se3_m']:.2f} m"),
    ("ego ATE, first poses identified", lambda r: f"{r['ego']['ate_origin_m']:.2f} m"),
    ("vehicles: mean ATE in the world, first poses identified", lambda r: f"{r['vehicles_mean']['ate_origin_m']:.2f} m"),
    ("vehicles: coverage", lambda r: f"{100 * r['vehicles_mean']['coverage']:.0f} %"),
    ("vehicles that count", lambda r: str(len(r["vehicles"]))),
]
print("| | real, networks | re-enacted |\n|---|---|---|")
for name, value in rows:
    print(f"| {name} | {value(real)} | {value(reenacted)} |")
ratio = real["ego"]["ate_se3_m"] / reenacted["ego"]["ate_se3_m"]
if not 0.1 < ratio < 10.0:
    sys.exit(f"ego ATE: real is {ratio:.2f} times the re-enacted")
