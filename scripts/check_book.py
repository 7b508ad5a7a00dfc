#!/usr/bin/env python3
"""Checks the book in docs/ against the program: runs every command of its `sh` blocks and every `python` block in one temporary directory, in the order of
SUMMARY.md, and stops with file:line at the first that fails. Commands of `console` blocks, and those of other programs in the text, are run in the
repository itself: each one is, word for word, a line of .ci/run or of a script that it calls, or the beginning of one. Before that: links, Rust blocks (copies of README.md or crates/motorcade/examples), TOML
and Python blocks, option names, settings and their defaults; after that: every file and column of a real run is described in the chapter on outputs. Runs
`mdbook build` where it is installed; a warning is a failure.
  scripts/check_book.py                                       what needs no program
  scripts/slurm_node.sh scripts/check_book.py target/release/motorcade [--mdbook PATH] [--python PATH] [--path FOLDER]
Needs a Slurm cluster (scripts/slurm_node.sh) and, at RAY_API_SERVER_ADDRESS, the head of a Ray cluster with the package `motorcade[fleet]` (scripts/ray_head.sh).
"""

import argparse
import csv
import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import tomllib
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BOOK = ROOT / "docs" / "src"
FRAMES, WIDTH, FPS = 60, 640, 10.0
LIMIT_S = 300
STAGES = ("run", "calibration", "odometry", "road", "scale", "tracker", "vehicles", "graph", "online", "outputs")


class Failure(Exception):
    """A check that failed: place and problem."""


def chapters():
    """The files of SUMMARY.md in order. All of them exist, and no chapter is missing from it."""
    names = re.findall(r"\]\(([^)]+\.md)\)", (BOOK / "SUMMARY.md").read_text())
    for path in sorted(BOOK.glob("**/*.md")):
        name = path.relative_to(BOOK).as_posix()
        if name != "SUMMARY.md" and name not in names:
            raise Failure(f"docs/src/{name}: not in SUMMARY.md")
    for name in names:
        if not (BOOK / name).is_file():
            raise Failure(f"docs/src/SUMMARY.md: {name} does not exist")
    return [BOOK / name for name in names]


def blocks(path):
    """Fenced blocks of a file: language, line of the first line inside, lines."""
    language, start, inside = None, 0, []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line.startswith("```"):
            if language is None:
                language, start, inside = line[3:].strip() or "text", number + 1, []
            else:
                yield language, start, inside
                language = None
        elif language is not None:
            inside.append(line)
    if language is not None:
        raise Failure(f"{place(path, start - 1)}: the block does not end")


def prose(path):
    """Lines outside of fenced blocks with their numbers."""
    fenced = False
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line.startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, line


def place(path, line):
    return f"{path.relative_to(ROOT)}:{line}"


def commands(start, lines):
    """Commands of an `sh` block with their lines; a backslash at the end continues a command."""
    command, first = "", 0
    for number, line in enumerate(lines, start):
        if not command:
            first = number
        if line.endswith("\\"):
            command += line[:-1] + " "
            continue
        command += line
        if command.strip() and not command.lstrip().startswith("#"):
            yield first, command.strip()
        command = ""


# ---- without running anything of the book ----

# Programs whose commands in the text, outside of blocks, are taken for commands; those of motorcade are looked at by `check_options`.
PROGRAMS = "apt-get bash buildah cargo conda docker export kubectl maturin npm pip podman python python3 ray rerun ros2 sbatch sh uv".split()


def lines_of_ci():
    """Lines of .ci/run and of the scripts it calls, without what stands before a command: variables, an opening parenthesis."""
    found, waiting = {}, [ROOT / ".ci" / "run"]
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        text = path.read_text()
        found[path] = {re.sub(r"^(?:[A-Z_]+=(?:\"[^\"]*\"|\S*) )+", "", line.strip()) for line in text.splitlines()}
        waiting += [ROOT / name for name in re.findall(r"^[^#\n]*?\b(?:bash )?((?:scripts|deploy)/\w+\.sh)\b", text, re.MULTILINE)]
    return set().union(*found.values())


def check_commands(path, ci):
    """Every command is run: in an `sh` block by this script, elsewhere as a line of CI, there perhaps with further options."""
    elsewhere = [(n, c) for language, start, lines in blocks(path) if language in ("console", "bash", "shell") for n, c in commands(start, lines)]
    for number, line in prose(path):
        for code in re.findall(r"`([^`]+)`", line):
            if code.split()[0] in PROGRAMS and len(code.split()) > 1:
                elsewhere.append((number, code))
    for number, command in elsewhere:
        if not any(line == command or line.startswith(command + " ") for line in ci):
            raise Failure(f"{place(path, number)}: neither run here (a block `sh`) nor a line of .ci/run or a script that it calls: {command}")
    return len(elsewhere)


def check_links(path):
    for number, line in prose(path):
        for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", line)):
            file = target.split("#")[0]
            if "://" in target or not file:
                continue
            inside = (path.parent / file).absolute()
            if BOOK not in inside.parents:
                raise Failure(f"{place(path, number)}: {target} leaves docs/src; name the file in the text instead")
            if not inside.exists():
                raise Failure(f"{place(path, number)}: {target} does not exist")


def check_rust(path):
    """Rust blocks are compiled elsewhere: they include an example, or stand in README.md word for word."""
    readme = (ROOT / "README.md").read_text()
    for language, start, lines in blocks(path):
        if language.split(",")[0] != "rust":
            continue
        included = re.fullmatch(r"\{\{#include (\S+)\}\}", "\n".join(lines).strip())
        if included:
            file = (path.parent / included[1]).resolve()
            if not file.is_file() or ROOT / "crates" / "motorcade" / "examples" not in file.parents:
                raise Failure(f"{place(path, start)}: {included[1]} is no file of crates/motorcade/examples")
        elif "\n".join(lines) not in readme:
            raise Failure(f"{place(path, start)}: this Rust block is neither an include of an example nor in README.md")


def check_toml(path):
    for language, start, lines in blocks(path):
        if language == "toml":
            try:
                tomllib.loads("\n".join(lines))
            except tomllib.TOMLDecodeError as error:
                raise Failure(f"{place(path, start)}: {error}") from error


def check_python(path):
    for language, start, lines in blocks(path):
        if language == "python":
            try:
                compile("\n".join(lines), place(path, start), "exec")
            except SyntaxError as error:
                raise Failure(f"{place(path, start)}: {error}") from error


def output(program, *arguments, cwd=None):
    """What a program prints; not one of the book's commands."""
    try:
        done = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=LIMIT_S, cwd=cwd)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Failure(f"{program} is needed: {error}") from error
    if done.returncode != 0:
        raise Failure(f"{program} {' '.join(arguments)}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def options_of(program, command=()):
    """Names of all options of the program and its commands."""
    text = output(program, *command, "--help")
    found = set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", text))
    listed = re.search(r"^Commands:\n((?:  .*\n|\n)*)", text, re.MULTILINE)
    for name in re.findall(r"^  ([a-z][a-z-]*)", listed[1] if listed else "", re.MULTILINE):
        if name != "help":
            found |= options_of(program, (*command, name))
    return found


# Of programs that were built with further features; of sbatch and ray.
OTHER_OPTIONS = {"--rerun", "--wait", "--address"}


def check_options(path, known):
    mentioned = [(n, code) for n, line in prose(path) for code in re.findall(r"`([^`]+)`", line)]
    for language, start, lines in blocks(path):
        if language in ("sh", "console"):
            mentioned += [(n, c) for n, c in commands(start, lines) if c.startswith("motorcade")]
    for number, code in mentioned:
        for option in re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", code):
            if option not in known | OTHER_OPTIONS and not code.startswith(("cargo ", "python ")):
                raise Failure(f"{place(path, number)}: the program has no option {option}")


def check_settings(path, config):
    """Names of settings exist, and the defaults in tables whose second column is `default` are the program's."""
    header = []
    for number, line in prose(path):
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []
        header = [] if not cells else header or cells
        for code in re.findall(r"`([a-z_]+(?:\.[a-z_]+)+)(?:=[^`]*| = [^`]*)?`", line):
            if code.split(".")[0] in STAGES and not code.endswith((".json", ".csv")):
                setting(config, code, place(path, number))
        if header[1:2] == ["default"] and len(cells) > 2 and cells[0].startswith("`") and "." in cells[0]:
            value = setting(config, cells[0].strip("`"), place(path, number))
            stated = cells[1].strip("`").split(" ")[0]
            same = stated == (f"{value:g}" if isinstance(value, float) else str(value).lower())
            if not same:
                raise Failure(f"{place(path, number)}: the default of {cells[0]} is {value}, not {cells[1]}")


def setting(config, name, where):
    node = config
    for part in name.split("."):
        if not isinstance(node, dict) or part not in node:
            raise Failure(f"{where}: there is no setting {name}")
        node = node[part]
    return node


# ---- the directory that the text assumes ----


def png(path, width, height, rows):
    """An 8-bit grey PNG."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + row for row in rows))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


def prepare(folder, program):
    """A rendered drive as KITTI split, folder and video, its camera in several formats, a mask, boxes, a GPS track."""
    binaries = folder / "bin"
    binaries.mkdir()
    (binaries / "motorcade").symlink_to(program)
    simulate = ["simulate", "--scenario", "demo", "--frames", str(FRAMES), "--width", str(WIDTH)]
    output(program, *simulate, "--out", str(folder / "kitti"), "--progress", "none")
    training = folder / "kitti" / "training"
    images = sorted((training / "image_02" / "0000").glob("*.png"))
    (folder / "frames").mkdir()
    for image in images:
        shutil.copy(image, folder / "frames")
    video = ["-loglevel", "error", "-framerate", str(FPS), "-i", "frames/%06d.png"]
    coding = ["-c:v", "libx264", "-crf", "10", "-pix_fmt", "yuv444p", "drive.mp4"]
    output("ffmpeg", *video, *coding, cwd=folder)
    calibration = (training / "calib" / "0000.txt").read_text()
    p = [float(v) for v in re.search(r"^P2:(.*)$", calibration, re.MULTILINE)[1].split()]
    fx, fy, cx, cy = p[0], p[5], p[2], p[6]
    width, height = struct.unpack(">II", images[0].read_bytes()[16:24])
    (folder / "camera.toml").write_text(f"fx = {fx}\nfy = {fy}\ncx = {cx}\ncy = {cy}\n")
    (folder / "calib.txt").write_text(calibration)
    k = f"[{fx}, 0., {cx}, 0., {fy}, {cy}, 0., 0., 1.]"
    matrix = "!!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: {}\n"
    (folder / "opencv.yaml").write_text(
        f"%YAML:1.0\nimage_width: {width}\nimage_height: {height}\ncamera_matrix: {matrix.format(3, 3, k)}"
        f"distortion_coefficients: {matrix.format(1, 5, '[0., 0., 0., 0., 0.]')}"
    )
    (folder / "camera_info.yaml").write_text(
        f"image_width: {width}\nimage_height: {height}\ncamera_name: front\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: {k}\n"
        "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n"
    )
    (folder / "camchain.yaml").write_text(
        f"cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n  distortion_model: equidistant\n"
        f"  intrinsics: [{fx}, {fy}, {cx}, {cy}]\n  resolution: [{width}, {height}]\n"
    )
    png(folder / "mask.png", width, height, (bytes([255 * (y > height - 8)]) * width for y in range(height)))
    shutil.copy(training / "detections" / "0000.txt", folder / "boxes.txt")
    (folder / "deploy").symlink_to(ROOT / "deploy")
    listed = re.search(r"^```text\n(id,.*?)^```", (BOOK / "fleet.md").read_text(), re.MULTILINE | re.DOTALL)
    (folder / "drives.csv").write_text(listed[1])
    (folder / "speed.csv").write_text(speeds((training / "gt_poses" / "0000.txt").read_text()))
    (folder / "track.gpx").write_text(gpx((training / "gt_poses" / "0000.txt").read_text()))


def speeds(poses):
    """The speed over every half second of the drive, in whole km/h."""
    step = int(FPS / 2)
    places = [(float(v[3]), float(v[11])) for v in map(str.split, poses.splitlines()[::step])]
    ways = [math.dist(a, b) for a, b in zip(places, places[1:])]
    rows = [f"{(k + 0.5) * step / FPS:.2f},{way * 3.6 * FPS / step:.0f}" for k, way in enumerate(ways)]
    return "time,speed_kmh\n" + "\n".join(rows) + "\n"


def gpx(poses):
    """Two fixes a second of a drive that starts to the north at 49° N, 8.4° E, by its true KITTI poses."""
    points = []
    for k, line in list(enumerate(poses.splitlines()))[:: int(FPS / 2)]:
        row = [float(v) for v in line.split()]
        latitude, longitude = 49.0 + row[11] / 111_200.0, 8.4 + row[3] / 73_170.0
        clock = f"2024-05-01T10:00:{k / FPS:06.3f}Z"
        points.append(f'<trkpt lat="{latitude:.8f}" lon="{longitude:.8f}"><time>{clock}</time><hdop>0.5</hdop></trkpt>')
    return f'<gpx version="1.1"><trk><trkseg>\n{chr(10).join(points)}\n</trkseg></trk></gpx>\n'


# ---- running the book ----


def run(command, where, folder, environment):
    start = time.monotonic()
    try:
        done = subprocess.run(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LIMIT_S
        )
    except subprocess.TimeoutExpired as error:
        raise Failure(f"{where}: did not end within {LIMIT_S} s: {command[-1]}") from error
    seconds = time.monotonic() - start
    if done.returncode != 0:
        tail = "\n".join((done.stdout + done.stderr).splitlines()[-25:])
        raise Failure(f"{where}: exit code {done.returncode}: {command[-1]}\n{tail}")
    print(f"{seconds:6.1f} s  {where}  {command[-1].splitlines()[0][:110]}", flush=True)


def run_blocks(paths, folder, python, programs):
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MOTORCADE_")}
    environment["PATH"] = ":".join([str(folder / "bin"), *programs, environment["PATH"]])
    imports = subprocess.run([python, "-c", "import motorcade"], capture_output=True, timeout=60).returncode == 0
    ran, left_out = 0, 0
    for path in paths:
        for language, start, lines in blocks(path):
            if language == "sh":
                for number, command in commands(start, lines):
                    run(["bash", "-eo", "pipefail", "-c", command], place(path, number), folder, environment)
                    ran += 1
            elif language == "python" and imports:
                run([python, "-c", "\n".join(lines)], place(path, start), folder, environment)
                ran += 1
            elif language == "python":
                left_out += 1
    return ran, left_out


def section(text, name):
    """The section of the outputs chapter whose heading names a file."""
    for part in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        if f"`{name}`" in part.splitlines()[0]:
            return part
    raise Failure(f"docs/src/outputs.md: no section on {name}")


def check_outputs(run_folder):
    """Every file and every column of a run is described, and every described column exists."""
    text = (BOOK / "outputs.md").read_text()
    for listed in json.loads((run_folder / "run.json").read_text())["files"]:
        name = re.sub(r"^vehicles/\d+\.tum$", "vehicles/<id>.tum", listed["name"])
        if f"`{name}`" not in text:
            raise Failure(f"docs/src/outputs.md: the file {name} of a run is not described")
    for key in json.loads((run_folder / "run.json").read_text()):
        if f"`{key}`" not in section(text, "run.json"):
            raise Failure(f"docs/src/outputs.md: the key {key} of run.json is not described")
    for path in sorted(run_folder.glob("*.csv")):
        with path.open() as file:
            columns = next(csv.reader(file))
        part = section(text, path.name)
        for column in columns:
            if f"`{column}`" not in part:
                raise Failure(f"docs/src/outputs.md: the column {column} of {path.name} is not described")
        for column in re.findall(r"^\| `([^`]+)` \|", part, re.MULTILINE):
            if column not in columns:
                raise Failure(f"docs/src/outputs.md: {path.name} has no column {column}")


def build(mdbook, folder):
    """The book without a warning, and pages that load nothing from elsewhere."""
    done = subprocess.run(
        [mdbook, "build", str(ROOT / "docs"), "-d", str(folder / "book")], capture_output=True, text=True, timeout=120
    )
    said = done.stdout + done.stderr
    if done.returncode != 0 or re.search(r"\b(WARN|ERROR)", said):
        raise Failure(f"mdbook build: exit code {done.returncode}\n{said}")
    for page in sorted((folder / "book").glob("*.html")):
        found = re.search(r"<(?:script|link|img|iframe)[^>]*(?:src|href)=\"(?:https?:)?//[^\"]*\"", page.read_text())
        if found:
            raise Failure(f"docs/src: the page {page.name} loads from elsewhere: {found[0]}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, nargs="?", help="without it only what can be checked without running anything of the book")
    parser.add_argument("--mdbook", default=shutil.which("mdbook"))
    parser.add_argument("--python", default=sys.executable, help="interpreter for the python blocks")
    parser.add_argument("--path", action="append", default=[], help="folder of further programs: `ray`")
    arguments = parser.parse_args()
    start = time.monotonic()
    paths = chapters()
    ci, elsewhere = lines_of_ci(), 0
    for path in paths:
        elsewhere += check_commands(path, ci)
        check_links(path)
        check_rust(path)
        check_toml(path)
        check_python(path)
    if arguments.program is None:
        print(f"{elsewhere} commands of the book are lines of CI")
        return
    program = arguments.program.resolve()
    known, config = options_of(program), tomllib.loads(output(program, "config"))
    for path in paths:
        check_options(path, known)
        check_settings(path, config)
    with tempfile.TemporaryDirectory(prefix="book-") as name:
        folder = Path(name).resolve()
        if arguments.mdbook:
            build(arguments.mdbook, folder)
        else:
            print("mdbook is not installed: the book was not built")
        prepare(folder, program)
        print(f"{time.monotonic() - start:6.1f} s  prepared", flush=True)
        ran, left_out = run_blocks(paths, folder, arguments.python, arguments.path)
        check_outputs(folder / "runs" / "drive")
    if left_out:
        print(f"{left_out} python blocks were not run: the package motorcade cannot be imported by {arguments.python}")
    print(f"{elsewhere} commands of the book are lines of CI, {ran} ran in {time.monotonic() - start:.0f} s")


if __name__ == "__main__":
    try:
        main()
    except Failure as failure:
        sys.exit(f"the book: {failure}")
