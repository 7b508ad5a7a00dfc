#!/usr/bin/env python3
"""Time motorcade-graph against GTSAM on g2o files and print a Markdown table.

    pip install gtsam numpy
    scripts/bench_graph.py SHARED [REPEATS]

SHARED holds `posegraphs/` and `tools/gtsam_time.py`. Both sides run on one thread, from the same start (the file's, or
a chordal one that motorcade-graph writes first), and count CPU seconds of the optimisation alone, ordering included,
reading and writing excluded; the best of REPEATS counts. Of GTSAM the faster of Gauss-Newton and Levenberg-Marquardt
is taken among those that reach our cost within 1e-6. Runs alternate, so both meet the same machine.
"""
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

FILES = [
    ("smallGrid3D", "file"), ("parking-garage", "file"), ("sphere2500", "file"), ("torus3D", "chordal"),
    ("sphere_bignoise_vertex3", "chordal"), ("mb1000", "file"),
]
ROOT = Path(__file__).resolve().parent.parent
OURS = ROOT / "target/release/examples/optimise"


def ours(path, repeats, *flags):
    command = [OURS, path, "--repeat", str(repeats), *flags]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def gtsam(tool, path, method, repeats):
    command = [sys.executable, tool, path, method, str(repeats)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300)
    found = re.search(r"min ([\d.]+) s .*iterations (\d+), cost (\S+)", run.stdout)
    return (float(found[1]), int(found[2]), float(found[3])) if found else None


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    shared, repeats = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 5
    tool = shared / "tools/gtsam_time.py"
    subprocess.run(["cargo", "build", "--release", "-q", "-p", "motorcade-graph", "--examples"], cwd=ROOT, check=True)
    print("| graph | start | cost (log) | ours ms (iterations) | GTSAM ms (method, iterations) | ratio |")
    print("|---|---|---|---|---|---|")
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        for name, start in FILES:
            path = shared / f"posegraphs/{name}.g2o"
            if start == "chordal":
                begun = Path(folder) / f"{name}.g2o"
                ours(path, 1, "--init", "chordal", "--iterations", "0", "--out", begun)
                path = begun
            best = None
            for method in ("gn", "lm"):
                theirs = gtsam(tool, path, method, repeats)
                own = ours(path, repeats)
                if theirs and theirs[2] <= own["final_cost"] * (1 + 1e-6) and (best is None or theirs < best[0]):
                    best = (theirs, method, own)
            own = best[2] if best else own
            row = f"| {name} | {start} | {own['final_cost']:.7g} | {own['optimise_s'] * 1e3:.1f} ({own['iterations']}) "
            if best is None:
                print(row + "| does not reach the cost | – |")
                continue
            (seconds, iterations, _), method, _ = best
            ratios.append(seconds / own["optimise_s"])
            print(f"{row}| {seconds * 1e3:.1f} ({method}, {iterations}) | {ratios[-1]:.1f} |")
    ratios.sort()
    print(f"\nGTSAM / ours: smallest {ratios[0]:.1f}, median {ratios[len(ratios) // 2]:.1f}.")


if __name__ == "__main__":
    main()
