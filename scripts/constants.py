#!/usr/bin/env python3
"""What chosen constants are worth: errors over rendered drives of many scenarios, seeds and frame rates, with one constant changed at a time.

    scripts/constants.py OUT [--motorcade target/release/motorcade] [--seeds 1,2] [--fps 10,20] [--frames 100]

Each drive is rendered and seen by the project's networks once (kept in OUT; a second call goes on from there). Per value of a constant the
table gives means over all drives: error of the camera's scale, of the vehicles' depth (median within a drive), 3D AP (moderate, IoU 0.5) and of
P(moving), as the mean of -ln P(what is true) over the tracks that follow a labelled vehicle.
"""
import argparse
import collections
import csv
import json
import math
import pathlib
import subprocess

SCENARIOS = ["oncoming", "overtaking", "parked", "dense", "crossing", "turning", "stop-and-go", "lorries", "rough"]
# Name in the configuration, default, other values: about two thirds and one and a half times as much.
CONSTANTS = [
    ("vehicles.advanced.box_fit.own_lane_half_width_m", 1.8, [1.2, 2.7]),
    ("vehicles.advanced.box_fit.border_px", 3.0, [2.0, 6.0]),
    ("vehicles.advanced.box_fit.occluded_share", 0.4, [0.25, 0.6]),
    ("vehicles.advanced.kinematic_state.common_depth_share", 0.05, [0.03, 0.08]),
    ("vehicles.advanced.kinematic_state.even_odds_sigmas", 3.0, [2.0, 4.5]),
    ("vehicles.advanced.kinematic_state.logistic_slope", 2.0, [1.3, 3.0]),
    ("vehicles.advanced.hypothesis.least_mean_score_ratio", 1.0, [0.0, 1.67]),
    ("road.half_width_heights", 1.7, [1.2, 2.5]),
    ("road.advanced.height.half_width_heights", 1.9, [1.3, 2.8]),
]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--motorcade", default="target/release/motorcade")
    parser.add_argument("--seeds", default="1,2")
    parser.add_argument("--fps", default="10,20")
    parser.add_argument("--frames", default=100, type=int, help="at 10 frames/s")
    parser.add_argument("--scenarios", default=",".join(SCENARIOS))
    parser.add_argument("--only", default="", help="names of constants, separated by commas; all without")
    parser.add_argument("--json", type=pathlib.Path)
    return parser.parse_args()


def call(*command):
    done = subprocess.run([str(c) for c in command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}")


def prepare(options, scenario, seed, fps):
    """Renders a drive and keeps what the networks see in it."""
    folder = options.out / f"{scenario}-{seed}-{fps}"
    if not (folder / "run/run.json").exists():
        frames = options.frames * fps // 10
        call(options.motorcade, "simulate", "--scenario", scenario, "--seed", seed, "--fps", fps, "--frames", frames,
             "--out", folder / "drive", "--force", "--progress", "none")
        call(options.motorcade, "run", folder / "drive/training", "--fps", fps, "--out", folder / "run", "--keep-perception", "--force", "--progress", "none")
    return folder


def errors(options, folder, configuration):
    """Errors of a run with this configuration (key, value) from the kept perception."""
    out = folder / "variant"
    file = folder / "variant.toml"
    key, value = configuration
    table, name = key.rsplit(".", 1)
    file.write_text(f"[{table}]\n{name} = {value}\n")
    call(options.motorcade, "run", folder / "drive/training", "--perception", folder / "run/perception.jsonl", "--config", file, "--out", out,
         "--force", "--progress", "none")
    call(options.motorcade, "evaluate", out, "--kitti", folder / "drive/training", "--json", folder / "variant.json")
    found = json.loads((folder / "variant.json").read_text())
    mean = found.get("vehicles_mean") or {}
    boxes = found.get("boxes3d") or {}
    return {
        "scale": abs(1 - found["ego"]["best_scale"]) * 100,
        "depth": mean.get("depth_error_pct_median"),
        "ap": boxes.get("ap3d_50", {}).get("moderate"),
        "moving": moving_loss(out, folder / "drive/training"),
    }


def moving_loss(run, training):
    """Mean of -ln P(what is true) over the tracks that follow one labelled vehicle in most of their frames."""
    sequence = next((training / "label_02").glob("*.txt")).stem
    poses = [list(map(float, row.split())) for row in (training / f"gt_poses/{sequence}.txt").read_text().splitlines()]
    labels, ways = collections.defaultdict(list), collections.defaultdict(list)
    for row in (training / f"label_02/{sequence}.txt").read_text().splitlines():
        p = row.split()
        if p[2] != "DontCare":
            frame, x = int(p[0]), list(map(float, p[13:16]))
            labels[frame].append((int(p[1]), x))
            m = poses[frame]
            ways[int(p[1])].append([sum(m[4 * r + c] * x[c] for c in range(3)) + m[4 * r + 3] for r in (0, 2)])
    moves = {i: math.dist(way[0], way[-1]) > 1.0 for i, way in ways.items()}
    follows, count = collections.defaultdict(collections.Counter), collections.Counter()
    for row in (run / "tracks.kitti.txt").read_text().splitlines():
        p = row.split()
        frame, x = int(p[0]), list(map(float, p[13:16]))
        near = [(math.hypot(x[0] - y[0], x[2] - y[2]), i) for i, y in labels[frame]]
        near = min((n for n in near if n[0] < 2.0 + 0.1 * abs(x[2])), default=None)
        count[int(p[1])] += 1
        if near:
            follows[int(p[1])][near[1]] += 1
    with open(run / "tracks.csv") as file:
        told = {int(row["id"]): float(row["p_moving"]) for row in csv.DictReader(file)}
    losses = []
    for track, seen in follows.items():
        label, frames = seen.most_common(1)[0]
        if 2 * frames > count[track]:
            p = told[track] if moves[label] else 1 - told[track]
            losses.append(-math.log(max(p, 1e-6)))
    return sum(losses) / len(losses) if losses else None


def main():
    options = arguments()
    options.out.mkdir(parents=True, exist_ok=True)
    drives = [prepare(options, scenario, seed, int(fps)) for scenario in options.scenarios.split(",") for seed in options.seeds.split(",")
              for fps in options.fps.split(",")]
    print(f"{len(drives)} drives")
    print("| constant | value | scale, % | depth, % | AP moderate | -ln P(moving) |\n|---|---|---|---|---|---|")
    rows, as_default = [], None
    wanted = [name for name in options.only.split(",") if name]
    for key, default, others in CONSTANTS:
        if wanted and key.rsplit(".", 1)[1] not in wanted:
            continue
        for value in [default, *others]:
            if value == default and as_default:
                means = as_default
            else:
                found = [errors(options, folder, (key, value)) for folder in drives]
                means = {name: mean([f[name] for f in found]) for name in found[0]}
            as_default = as_default or means
            rows.append({"constant": key, "value": value, "default": value == default, **means})
            print(f"| `{key}` | {value}{' (default)' if value == default else ''} | " + " | ".join(f"{means[n]:.3f}" for n in ("scale", "depth", "ap", "moving")) + " |",
                  flush=True)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1))


def mean(values):
    known = [v for v in values if v is not None]
    return sum(known) / len(known) if known else math.nan


if __name__ == "__main__":
    main()
