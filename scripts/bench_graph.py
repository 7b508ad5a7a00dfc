#!/usr/bin/env python3
"""Time motorcade-graph against GTSAM, factrs and apex-solver on g2o files and print Markdown tables.

    pip install gtsam numpy
    scripts/bench_graph.py SHARED [BATCHES [NAME ...]]

SHARED holds `posegraphs/`, `tools/gtsam_time.py` and `tools/graph_cost.py`. All run on one thread, from the same start
(the file's, or a chordal one that motorcade-graph writes first), each in a process of its own, and count CPU seconds of
the optimisation alone, ordering included, reading and writing excluded. After one trial of every setting, BATCHES rounds
run ours and the two fastest settings of every peer in turn, REPEATS solves each, and the fastest solve of each counts.
Settings of a peer are Gauss-Newton and Levenberg-Marquardt, with three tolerances for factrs and apex-solver; only those
count whose result, judged by graph_cost.py, costs no more than ours by 1e-6 (by 1e-5, marked *, where no peer comes
closer). The last column is how far our cost lies
above (+) or below (-) the lowest of any peer. Memory is the peak of the whole process in the trial with one solve,
reading included; for GTSAM less what Python with gtsam and numpy takes empty. mb1000_out10 is solved as plain least
squares by all.
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
REPEATS = 2
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


def ours(_, path, repeats, out, *__):
    done = run([OURS, path, "--init", "file", "--repeat", repeats, "--out", out])
    report = json.loads(done[0])
    return report["optimise_s"], done[1], report["iterations"]


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
    shared, batches = Path(sys.argv[1]).resolve(), int(sys.argv[2]) if len(sys.argv) > 2 else 4
    names = sys.argv[3:]
    build = ["cargo", "build", "--release", "-q"]
    subprocess.run([*build, "-p", "motorcade-graph", "--examples"], cwd=ROOT, check=True)
    subprocess.run([*build, "--target-dir", str(PEERS_TARGET)], cwd=PEERS, check=True)
    python = run([sys.executable, "-c", "import gtsam, numpy"])[1]
    tool = shared / "tools/gtsam_time.py"
    print("| graph | start | cost (log) | ours ms (iterations, MB) | GTSAM | factrs | apex-solver | best peer / ours | "
          "GTSAM / ours | cost against lowest peer |")
    print("|---|---|---|---|---|---|---|---|---|---|")
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
            own_s, own_mb, iterations = ours(tool, path, 1, out)
            cost = judge.cost(out)
            found, lowest = {}, float("inf")
            for peer, (solve, settings) in CANDIDATES.items():
                good = []
                for method, tolerance in settings:
                    first = solve(tool, path, 1, out, method, tolerance)
                    reached = judge.cost(out) if first else float("inf")
                    lowest = min(lowest, reached)
                    if first:
                        mb = first[1] - (python if peer == "GTSAM" else 0)
                        good.append((first[0], mb, method, tolerance, reached))
                found[peer] = sorted(good)
            within = next((w for w in (1e-6, 1e-5) if lowest <= cost * (1 + w)), 0)
            kept = {peer: [g[:4] for g in good if g[4] <= cost * (1 + within)][:2] for peer, good in found.items()}
            mark = "*" if within == 1e-5 else ""
            seconds = {}
            for _ in range(batches):
                own_s = min(own_s, ours(tool, path, REPEATS, out)[0])
                for peer, settings in kept.items():
                    for first, mb, method, tolerance in settings:
                        again = CANDIDATES[peer][0](tool, path, REPEATS, out, method, tolerance)[0]
                        best = min(again, first, seconds.get(peer, (again,))[0])
                        if peer not in seconds or best < seconds[peer][0]:
                            seconds[peer] = (best, mb, method)
            cells = [f"{s * 1e3:.1f} ({method}, {mb:.0f} MB){mark}" if s else "does not reach the cost"
                     for s, mb, method in (seconds.get(peer, (None, 0, "")) for peer in CANDIDATES)]
            ratio = min(s[0] for s in seconds.values()) / own_s if seconds else None
            if ratio:
                ratios.append(ratio)
            to_gtsam = f"{seconds['GTSAM'][0] / own_s:.1f}" if "GTSAM" in seconds else "–"
            print(f"| {name} | {start} | {cost:.8g} | {own_s * 1e3:.1f} ({iterations}, {own_mb:.0f} MB) | "
                  + " | ".join(cells) + f" | {'–' if ratio is None else f'{ratio:.1f}'} | {to_gtsam} | "
                  f"{cost / lowest - 1:+.1e} |", flush=True)
    ratios.sort()
    middle = len(ratios) // 2
    median = ratios[middle] if len(ratios) % 2 else (ratios[middle - 1] + ratios[middle]) / 2
    print(f"\nBest peer / ours: smallest {ratios[0]:.1f}, median {median:.1f}.")


if __name__ == "__main__":
    main()
