#!/usr/bin/env python3
"""An hour of video end to end: memory, frames per second and speeds over the run, as a table; a failure where memory grows by over 20 %, the end is
slower, or the drive is not the one that was rendered.

    scripts/soak.py [--motorcade target/release/motorcade] [--frames 36000] [--width 400] [--modes online,drive] [--jumps] [--networks]
        [--set NAME=VALUE …]

A round of 49 s about a block of houses is rendered, cut where the camera comes back to where it was (to centimetres and a fifth of a degree), encoded (H.264, 10
frames/s) and repeated to the number of frames. With --jumps a drive of 30 s is driven forwards and backwards in turn instead, which no car does: asked is only that no
speed is beyond 100 m/s. Each mode is one run, without networks unless asked for. Memory is the resident set of the process (anonymous pages and
those of files); a tenth of the way each is a row. Judged are the ninth tenth against the second: by then everything that is allocated once is
there. What the estimate of a whole drive takes at the end is stated apart. Speed is judged by the processor's
time, which other work on the machine changes less than the clock. Needs ffmpeg, NumPy and Linux (/proc).
"""
import argparse
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--motorcade", default="target/release/motorcade")
parser.add_argument("--frames", type=int, default=36000)
parser.add_argument("--width", type=int, default=400)
parser.add_argument("--modes", default="online,drive")
parser.add_argument("--jumps", action="store_true", help="forwards and backwards in turn")
parser.add_argument("--networks", action="store_true")
parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of the runs")
options = parser.parse_args()
PART = 300
ROUND = 500
MOST_GROWTH = 1.2
MOST_SLOWER = 1.2
MOST_SEAM_M, MOST_SEAM_DEG = 0.05, 0.2
MOST_SPEED_MPS = 100.0


def seam(poses):
    """First frame, frame at which the camera is there again, and the way between them."""
    best = None
    for start in range(20):
        for end in range(300, len(poses)):
            turn = poses[start][:, :3].T @ poses[end][:, :3]
            off = (np.linalg.norm(poses[end][:, 3] - poses[start][:, 3]), np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))))
            score = off[0] / MOST_SEAM_M + off[1] / MOST_SEAM_DEG
            if best is None or score < best[0]:
                best = (score, start, end, off)
    _, start, end, off = best
    if off[0] > MOST_SEAM_M or off[1] > MOST_SEAM_DEG:
        sys.exit(f"the round does not close: {off[0]:.3f} m and {off[1]:.2f} degrees at best")
    steps = np.linalg.norm(np.diff([p[:, 3] for p in poses[start : end + 1]], axis=0), axis=1)
    return start, end, steps.sum()


def video(folder):
    """The video, its calibration, and the way of all its frames where that is known [m]."""
    call = lambda *command: subprocess.run([str(c) for c in command], check=True, stdout=subprocess.DEVNULL)
    scenario, frames = ("demo", PART) if options.jumps else ("block", ROUND)
    call(options.motorcade, "simulate", "--scenario", scenario, "--frames", frames, "--width", options.width, "--out", folder / "drive", "--progress", "none")
    training = next((folder / "drive").rglob("image_02")).parent
    pictures = next(iter((training / "image_02" / "0000").iterdir())).suffix
    pattern = training / "image_02" / "0000" / f"%06d{pictures}"
    encode = ["-c:v", "libx264", "-preset", "veryfast", "-crf", "20", "-pix_fmt", "yuv420p"]
    even = "crop=trunc(iw/2)*2:trunc(ih/2)*2"
    if options.jumps:
        part, way_m = 2 * PART, None
        call("ffmpeg", "-v", "error", "-framerate", 10, "-i", pattern, "-filter_complex", f"{even},split[a][b];[b]reverse[r];[a][r]concat", *encode, folder / "part.mp4")
    else:
        poses = np.loadtxt(training / "gt_poses" / "0000.txt").reshape(-1, 3, 4)
        start, end, round_m = seam(poses)
        part, way_m = end - start, round_m * (options.frames - 1) / (end - start)
        call("ffmpeg", "-v", "error", "-framerate", 10, "-start_number", start, "-i", pattern, "-frames:v", part, "-vf", even, *encode, folder / "part.mp4")
    repeats = -(-options.frames // part)
    call("ffmpeg", "-v", "error", "-stream_loop", repeats - 1, "-i", folder / "part.mp4", "-c", "copy", "-frames:v", options.frames, folder / "hour.mp4")
    line = next(l for l in (training / "calib" / "0000.txt").read_text().splitlines() if l.startswith("P2"))
    p = [float(v) for v in line.split()[1:]]
    (folder / "camera.toml").write_text(f"fx = {p[0]}\nfy = {p[5]}\ncx = {p[2]}\ncy = {p[6]}\n")
    return folder / "hour.mp4", way_m


def resident_mb(pid):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return 0.0


def processor_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def soak(mode, folder, movie, way_m):
    """Prints the table of a run; what was wrong."""
    command = [options.motorcade, "run", movie, "--calibration", folder / "camera.toml", "--height", "1.65", "--out", folder / f"run-{mode}", "--progress", "json"]
    command += [] if options.networks else ["--models", "none"]
    command += ["--online"] if mode == "online" else []
    command += [part for setting in options.set for part in ("--set", setting)]
    child = subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    lines = [0]
    def count():
        lines[0] = sum(1 for _ in child.stdout)
    counter = threading.Thread(target=count)
    counter.start()
    every = options.frames // 10
    rows, start, last = [], time.time(), (time.time(), 0.0)
    end = None
    print(f"\n{mode}\n| frames | frames/s | processor ms a frame | memory MB |\n|---|---|---|---|", flush=True)
    for text in child.stderr:
        try:
            said = json.loads(text)
        except ValueError:
            print(text.rstrip()[:200], file=sys.stderr)
            continue
        if said.get("stage") == "odometry" and said.get("done", 0) and said["done"] % every == 0:
            now = (time.time(), processor_s(child.pid))
            rows.append((said["done"], every / (now[0] - last[0]), 1e3 * (now[1] - last[1]) / every, resident_mb(child.pid)))
            last = now
            print("| {} | {:.1f} | {:.1f} | {:.0f} |".format(*rows[-1]), flush=True)
        if "warning" in said:
            print(said["warning"][:200], file=sys.stderr)
        end = said
    _, status, usage = os.wait4(child.pid, 0)
    counter.join()
    code = os.waitstatus_to_exitcode(status)
    print(f"exit {code}, {time.time() - start:.0f} s in all, at most {usage.ru_maxrss / 1024:.0f} MB, {lines[0]} lines on stdout")
    wrong = []
    if code != 0 or len(rows) < 10:
        return [f"{mode}: exit {code}, {len(rows)} of 10 parts"]
    allowed = MOST_GROWTH * rows[1][3]
    growth_kb = 1024 * (rows[8][3] - rows[1][3]) / (7 * every)
    if rows[8][3] > allowed:
        wrong.append(f"{mode}: memory from {rows[1][3]:.0f} to {rows[8][3]:.0f} MB, at most {allowed:.0f}")
    table = list(csv.DictReader((folder / f"run-{mode}" / "frames.csv").open()))
    speeds = [float(row["speed_mps"]) for row in table]
    record = json.loads((folder / f"run-{mode}" / "run.json").read_text())
    print(f"{growth_kb:.2f} kB a frame; at most {max(speeds):.1f} m/s, {record['length_m']:.0f} m driven" + (f" of {way_m:.0f}" if way_m else ""))
    if max(speeds) > MOST_SPEED_MPS:
        wrong.append(f"{mode}: {max(speeds):.0f} m/s")
    if way_m and abs(record["length_m"] / way_m - 1) > 0.03:
        wrong.append(f"{mode}: {record['length_m']:.0f} m driven of {way_m:.0f}")
    if rows[8][2] > MOST_SLOWER * rows[1][2]:
        wrong.append(f"{mode}: processor from {rows[1][2]:.1f} to {rows[8][2]:.1f} ms a frame")
    if mode == "online" and lines[0] < options.frames:
        wrong.append(f"{mode}: {lines[0]} lines for {options.frames} frames")
    return wrong


with tempfile.TemporaryDirectory(prefix="motorcade-soak-") as name:
    folder = pathlib.Path(name)
    movie, way_m = video(folder)
    print(f"{options.frames} frames, {movie.stat().st_size / 1e6:.0f} MB of video, {options.width} px wide")
    problems = [problem for mode in options.modes.split(",") for problem in soak(mode, folder, movie, way_m)]
if problems:
    sys.exit("failed: " + "; ".join(problems))
