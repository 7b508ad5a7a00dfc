#!/usr/bin/env python3
"""Runs fixed jobs with one build of motorcade and compares the outputs of two such runs byte by byte.

    scripts/same_bytes.py run MOTORCADE OUT [--shared ../shared] [--boxes OUT_BEFORE] [--jobs 0003,files]
    scripts/same_bytes.py compare OUT_BEFORE OUT_AFTER [--jobs 0003,files]

`compare` lists every file and fails when one differs. Left out: `report.html` and the keys of `run.json` that hold times, the
command line, the configuration and the version, which change without a change of result.
"""
import argparse
import hashlib
import json
import pathlib
import subprocess
import sys

IGNORED_KEYS = {"timings", "files", "command", "configuration", "version", "fingerprint", "perception"}


def jobs(out, shared, boxes_of):
    tracking = shared / "kitti/tracking/training"
    models = ["--models", shared / "models"]
    d0005 = ["run", tracking, "--sequence", "0005", "--camera", 3]
    d0003 = ["run", tracking, "--sequence", "0003", "--frames", "16..101", "--ignore", tracking / "mask_02/0003"]
    boxes = lambda name: ["--models", "none", "--detections", boxes_of / name / "detections.txt"]
    ego = out / "0003-degraded.txt"
    files = ["run", tracking, "--sequence", "0003", "--frames", "10..133", "--trajectory", ego]
    files += ["--detections", tracking / "label_02/0003.txt", "--vehicle-poses", *sorted((tracking / "vehicle_poses").glob("3_*.csv"))]
    metric = ["--trajectory-scale", "metric"]
    jobs = {
        "0003": [*d0003, *models],
        "0003-boxes": [*d0003, *boxes("0003")],
        "0003-online": [*d0003, *boxes("0003"), "--online"],
        "0003-paper": [*d0003, *boxes("0003"), "--preset", "paper"],
        "files": [*files, *metric],
        "files-online": [*files, *metric, "--online"],
        "demo": ["demo"],
        "0005": [*d0005, *models],
        "0005-boxes": [*d0005, *boxes("0005")],
        "0005-online": [*d0005, *boxes("0005"), "--online"],
        "unknown-unit": ["run", tracking, "--sequence", "0005", "--camera", 3, "--trajectory", tracking / "gt_poses/0005.txt", "--trajectory-scale", "unknown", "--detections", tracking / "label_02/0005.txt"],
        "odometry-00": ["run", shared / "kitti/odometry/00", "--calibration", out / "odometry.toml", "--models", "none"],
    }
    for name in ("sphere2500", "parking-garage", "smallGrid3D", "torus3D"):
        jobs[f"graph-{name}"] = ["graph", "optimise", shared / f"posegraphs/{name}.g2o", "--out", out / f"graph-{name}.g2o"]
    return jobs


def run(options):
    out, shared = options.out.resolve(), options.shared.resolve()
    out.mkdir(parents=True, exist_ok=True)
    (out / "odometry.toml").write_text("fx = 718.856\nfy = 718.856\ncx = 607.1928\ncy = 185.2157\n")
    degrade = pathlib.Path(__file__).parent / "degrade_trajectory.py"
    poses = shared / "kitti/tracking/training/gt_poses/0003.txt"
    subprocess.check_call([sys.executable, degrade, poses, out / "0003-degraded.txt", "--camera-offset-m", "0.06"])
    wanted = options.jobs.split(",") if options.jobs else None
    for name, arguments in jobs(out, shared, (options.boxes or out).resolve()).items():
        if wanted and not any(name == w for w in wanted):
            continue
        command = [str(options.motorcade.resolve()), *map(str, arguments)]
        if arguments[0] != "graph":
            command += ["--out", str(out / name), "--progress", "none"]
            command += ["--force"] if arguments[0] == "run" else []
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
        if "--online" in command:
            lines = [line for line in done.stdout.splitlines() if line.startswith(b"{")]
            (out / f"{name}.jsonl").write_bytes(b"\n".join(lines))
        print(f"{name:20} exit {done.returncode}", flush=True)
        if done.returncode not in (0, 4):
            sys.exit(done.stderr.decode(errors="replace")[-2000:])


def content(path):
    if path.name == "run.json":
        record = json.loads(path.read_text())
        return json.dumps({k: v for k, v in record.items() if k not in IGNORED_KEYS}, sort_keys=True).encode()
    return path.read_bytes()


def digests(root):
    files = sorted(p for p in root.rglob("*") if p.is_file() and p.name != "report.html")
    return {str(p.relative_to(root)): hashlib.sha256(content(p)).hexdigest()[:16] for p in files}


def compare(options):
    before, after = digests(options.before), digests(options.after)
    if options.jobs:
        names = options.jobs.split(",")
        wanted = lambda path: any(path.split("/")[0] in (name, f"{name}.jsonl", f"{name}.g2o") for name in names)
        before, after = ({k: v for k, v in one.items() if wanted(k)} for one in (before, after))
    different = [name for name in sorted(before | after) if before.get(name) != after.get(name)]
    for name in different:
        state = "missing before" if name not in before else "missing after" if name not in after else "differs"
        print(f"{state:16} {name}")
    print(f"{len(before)} files compared, {len(different)} differ")
    sys.exit(1 if different else 0)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
commands = parser.add_subparsers(required=True)
one = commands.add_parser("run")
one.add_argument("motorcade", type=pathlib.Path)
one.add_argument("out", type=pathlib.Path)
one.add_argument("--shared", default="../shared", type=pathlib.Path)
one.add_argument("--boxes", type=pathlib.Path, help="folder of an earlier run whose detections are taken; OUT by default")
one.add_argument("--jobs", help="comma-separated names; all by default")
one.set_defaults(work=run)
two = commands.add_parser("compare")
two.add_argument("before", type=pathlib.Path)
two.add_argument("after", type=pathlib.Path)
two.add_argument("--jobs", help="comma-separated names; all by default")
two.set_defaults(work=compare)
options = parser.parse_args()
options.work(options)
