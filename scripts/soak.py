#!/usr/bin/env python3
"""An hour of video end to end: memory and frames per second over the run, as a table; a failure where memory grows by over 20 % or the end is slower.

    scripts/soak.py [--motorcade target/release/motorcade] [--frames 36000] [--width 480] [--modes drive,online] [--networks]

A drive of 300 frames is rendered, driven forwards and backwards, encoded (H.264, 10 frames/s) and repeated to the number of frames. Each mode is one run on
it, without networks unless asked for. Memory is the resident set of the process (anonymous pages and those of files); a tenth of the way each is a row. Judged
are the ninth tenth against the second: by then everything that is allocated once is there. Speed is judged by the processor's time, which other work
on the machine changes less than the clock. Needs ffmpeg and Linux (/proc).
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--motorcade", default="target/release/motorcade")
parser.add_argument("--frames", type=int, default=36000)
parser.add_argument("--width", type=int, default=480)
parser.add_argument("--modes", default="drive,online")
parser.add_argument("--networks", action="store_true")
options = parser.parse_args()
PART = 300
MOST_GROWTH = 1.2
MOST_SLOWER = 1.2


def video(folder):
    """The video and its calibration."""
    call = lambda *command: subprocess.run([str(c) for c in command], check=True, stdout=subprocess.DEVNULL)
    call(options.motorcade, "simulate", "--scenario", "demo", "--frames", PART, "--width", options.width, "--out", folder / "drive", "--progress", "none")
    training = next((folder / "drive").rglob("image_02")).parent
    pictures = next(iter((training / "image_02" / "0000").iterdir())).suffix
    pattern = training / "image_02" / "0000" / f"%06d{pictures}"
    encode = ["-c:v", "libx264", "-preset", "veryfast", "-crf", "20", "-pix_fmt", "yuv420p"]
    both = "crop=trunc(iw/2)*2:trunc(ih/2)*2,split[a][b];[b]reverse[r];[a][r]concat"
    call("ffmpeg", "-v", "error", "-framerate", 10, "-i", pattern, "-filter_complex", both, *encode, folder / "part.mp4")
    repeats = -(-options.frames // (2 * PART))
    call("ffmpeg", "-v", "error", "-stream_loop", repeats - 1, "-i", folder / "part.mp4", "-c", "copy", "-frames:v", options.frames, folder / "hour.mp4")
    line = next(l for l in (training / "calib" / "0000.txt").read_text().splitlines() if l.startswith("P2"))
    p = [float(v) for v in line.split()[1:]]
    (folder / "camera.toml").write_text(f"fx = {p[0]}\nfy = {p[5]}\ncx = {p[2]}\ncy = {p[6]}\n")
    return folder / "hour.mp4"


def resident_mb(pid):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return 0.0


def processor_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def soak(mode, folder, movie):
    """Prints the table of a run; what was wrong."""
    command = [options.motorcade, "run", movie, "--calibration", folder / "camera.toml", "--height", "1.65", "--out", folder / f"run-{mode}", "--progress", "json"]
    command += [] if options.networks else ["--models", "none"]
    command += ["--online"] if mode == "online" else []
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
    if rows[8][3] > MOST_GROWTH * rows[1][3]:
        wrong.append(f"{mode}: memory from {rows[1][3]:.0f} to {rows[8][3]:.0f} MB")
    if rows[8][2] > MOST_SLOWER * rows[1][2]:
        wrong.append(f"{mode}: processor from {rows[1][2]:.1f} to {rows[8][2]:.1f} ms a frame")
    if mode == "online" and lines[0] < options.frames:
        wrong.append(f"{mode}: {lines[0]} lines for {options.frames} frames")
    return wrong


with tempfile.TemporaryDirectory(prefix="motorcade-soak-") as name:
    folder = pathlib.Path(name)
    movie = video(folder)
    print(f"{options.frames} frames, {movie.stat().st_size / 1e6:.0f} MB of video, {options.width} px wide")
    problems = [problem for mode in options.modes.split(",") for problem in soak(mode, folder, movie)]
if problems:
    sys.exit("failed: " + "; ".join(problems))
