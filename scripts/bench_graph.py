#!/usr/bin/env python3
"""Time motorcade-graph against GTSAM, factrs and apex-solver on g2o files and print Markdown tables.

    pip install gtsam numpy
    scripts/bench_graph.py SHARED [REPEATS [NAME ...]]

SHARED holds `posegraphs/`, `tools/gtsam_time.py` and `tools/graph_cost.py`. All run on one thread, from the same start
(the file's, or a chordal one that motorcade-graph writes first), each in a process of its own, and count CPU seconds of
the optimisation alone, ordering included, reading and writing excluded; the best of REPEATS counts. Of every peer the
fastest of Gauss-Newton and Levenberg-Marquardt, and of three tolerances for factrs and apex-solver, is taken among
those whose result, judged by graph_cost.py, costs no more than ours by 1e-6. Memory is the peak of the whole process in
a run of its own with one repetition, reading included; for GTSAM less what Python with gtsam and numpy takes empty.
"""
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FILES = [
    ("smallGrid3D", "file"), ("parking-garage", "file"), ("sphere2500", "file"), ("torus3D", "chordal"),
    ("sphere_bignoise_vertex3", "chordal"), ("cubicle", "chordal"), ("mb1000", "file"), ("mb1000_out10", "file"),
]
ROOT = Path(__file__).resolve().parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
PEERS = ROOT / "crates/motorcade-graph/benches/peers"
PEERS_TARGET = Path(os.environ.get("PEERS_TARGET_DIR", PEERS / "target"))
OURS = TARGET / "release/examples/optimise"
ENV = {**os.environ, "RAYON_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "TBB_NUM_THREADS": "1"}


def run(command):
    """Output and peak memory [MB] of a command; None where it fails."""
    with tempfile.TemporaryFile("w+") as out:
        child = subprocess.Popen([str(c) for c in command], stdout=out, stderr=subprocess.DEVNULL, env=ENV)
        # Polled, because ru_maxrss of a child starts at what Python held when it forked.
        peak = 0
        while child.poll() is None:
            try:
                status = Path(f"/proc/{child.pid}/status").read_text()
                found = re.search(r"VmHWM:\s+(\d+) kB", status)
                peak = int(found[1]) if found else peak
            except OSError:
                break
            time.sleep(0.002)
        child.wait()
        out.seek(0)
        return (out.read(), peak / 1024) if child.returncode == 0 else None


class Judge:
    """Costs by tools/graph_cost.py (`log` residual)."""

    def __init__(self, shared, graph):
        sys.path.insert(0, str(shared / "tools"))
        import graph_cost
        self.module, (self.vertices, self.edges) = graph_cost, graph_cost.read(graph)

    def cost(self, result):
        vertices = self.module.read(result)[0]
        return self.module.costs(vertices, self.edges)["log"] if set(vertices) == set(self.vertices) else float("inf")


def ours(path, repeats, out):
    done = run([OURS, path, "--repeat", repeats, "--out", out])
    report = json.loads(done[0])
    return report["optimise_s"], f"{report['iterations']}", done[1]


def gtsam(tool, path, repeats, out, method, _):
    done = run([sys.executable, tool, path, method, repeats, out])
    found = done and re.search(r"min ([\d.]+) s .*iterations (\d+)", done[0])
    return (float(found[1]), done[1]) if found else None


def rust_peer(name):
    def solve(_, path, repeats, out, method, tolerance):
        done = run([PEERS_TARGET / "release/graph-peers", name, method, path, tolerance, repeats, out])
        return (json.loads(done[0])["optimise_s"], done[1]) if done else None
    return solve


CANDIDATES = {
    "GTSAM": (gtsam, [("gn", 0), ("lm", 0)]),
    "factrs": (rust_peer("factrs"), [(m, t) for m in ("gn", "lm") for t in (1e-4, 1e-6, 1e-8)]),
    "apex-solver": (rust_peer("apex"), [(m, t) for m in ("gn", "lm") for t in (1e-4, 1e-6, 1e-8)]),
}


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    shared, repeats = Path(sys.argv[1]).resolve(), int(sys.argv[2]) if len(sys.argv) > 2 else 5
    names = sys.argv[3:]
    build = ["cargo", "build", "--release", "-q"]
    subprocess.run([*build, "-p", "motorcade-graph", "--examples"], cwd=ROOT, check=True)
    subprocess.run([*build, "--target-dir", str(PEERS_TARGET)], cwd=PEERS, check=True)
    python = run([sys.executable, "-c", "import gtsam, numpy"])[1]
    print("| graph | start | cost (log) | ours ms (iterations, MB) | GTSAM | factrs | apex-solver | best peer / ours |")
    print("|---|---|---|---|---|---|---|---|")
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.g2o"
        for name, start in FILES:
            if names and name not in names:
                continue
            path = shared / f"posegraphs/{name}.g2o"
            if start == "chordal":
                begun = Path(folder) / f"{name}.g2o"
                run([OURS, path, "--init", "chordal", "--iterations", "0", "--out", begun])
                path = begun
            judge = Judge(shared, path)
            own_s, iterations, _ = ours(path, repeats, out)
            cost, own_mb = judge.cost(out), ours(path, 1, out)[2]
            cells, best = [], None
            for peer, (solve, settings) in CANDIDATES.items():
                found = None
                for method, tolerance in settings:
                    first = solve(shared / "tools/gtsam_time.py", path, 1, out, method, tolerance)
                    # Slower than twice the best with one run, or at another cost: no need to repeat.
                    if not first or not judge.cost(out) <= cost * (1 + 1e-6):
                        continue
                    if found and first[0] > 2 * found[0]:
                        continue
                    seconds = min(first[0], solve(shared / "tools/gtsam_time.py", path, repeats, out, method, tolerance)[0])
                    own_s = min(own_s, ours(path, repeats, out)[0])  # both meet the same machine
                    if found is None or seconds < found[0]:
                        found = (seconds, first[1] - (python if peer == "GTSAM" else 0), method)
                if found:
                    best = found if best is None or found[0] < best[0] else best
                    cells.append(f"{found[0] * 1e3:.1f} ({found[2]}, {found[1]:.0f} MB)")
                else:
                    cells.append("does not reach the cost")
            ratio = best[0] / own_s if best else None
            if ratio:
                ratios.append(ratio)
            print(f"| {name} | {start} | {cost:.8g} | {own_s * 1e3:.1f} ({iterations}, {own_mb:.0f} MB) | "
                  + " | ".join(cells) + f" | {'–' if ratio is None else f'{ratio:.1f}'} |", flush=True)
    ratios.sort()
    middle = len(ratios) // 2
    median = ratios[middle] if len(ratios) % 2 else (ratios[middle - 1] + ratios[middle]) / 2
    print(f"\nBest peer / ours: smallest {ratios[0]:.1f}, median {median:.1f}.")


if __name__ == "__main__":
    main()
