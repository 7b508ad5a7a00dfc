#!/usr/bin/env python3
"""Throughput of `motorcade batch` with 1 and 2 jobs against the sum of single runs.

    scripts/bench_fleet.py [--motorcade target/release/motorcade] [--drives 6] [--frames 40] [--networks] [--rounds 1] [--no-pin]

Renders short drives, runs each alone, then all of them by `motorcade batch --jobs 1` and `--jobs 2`, which gives each job its share of the
cores. Linear is the sum of the single runs divided by the number of jobs, where a single run has as many cores and threads as a job:
all of the machine for one job, half of it for two. The share of linear is printed with drives an hour a core, the processor time
of a drive, and the load of the machine before each step. With more load than idle cores a share says more of the machine than of the
program; shares by processor time, in which what else runs counts little, stand beside it.

A single run with `--threads 1` that has both cores decodes on the other one; its time is printed too.
"""
import argparse
import csv
import os
import pathlib
import resource
import subprocess
import tempfile
import time


def timed(command, cores=None, **options):
    """Wall-clock and processor seconds of a command that may use so many cores."""
    if cores is not None:
        options["preexec_fn"] = lambda: os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cores])
    start, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(c) for c in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.monotonic() - start, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motorcade", default="target/release/motorcade")
    parser.add_argument("--drives", type=int, default=6)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--networks", action="store_true", help="with the program's own networks")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--no-pin", action="store_true", help="`batch --no-pin`: what binding jobs to cores gives")
    arguments = parser.parse_args()
    program = pathlib.Path(arguments.motorcade).resolve()
    environment = {k: v for k, v in os.environ.items() if k != "MOTORCADE_MODELS"}
    if not arguments.networks:
        environment["MOTORCADE_MODELS"] = "none"
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        names = [f"drive{k}" for k in range(arguments.drives)]
        for seed, name in enumerate(names):
            rendered = ["simulate", "--scenario", "demo", "--frames", arguments.frames, "--seed", seed, "--out", folder / name]
            timed([program, *rendered, "--progress", "none"])
        inputs = [next((folder / name).rglob("image_02")).parent for name in names]
        (folder / "drives.csv").write_text("id,input\n" + "".join(f"{n},{i}\n" for n, i in zip(names, inputs)))
        print(f"{len(inputs)} drives of {arguments.frames} frames, {len(os.sched_getaffinity(0))} cores")
        for number in range(arguments.rounds):
            one_round(program, folder, inputs, number, environment, arguments)


def singles(program, folder, inputs, name, threads, cores, environment):
    """Sum over single runs of wall-clock and processor seconds."""
    load, times = os.getloadavg()[0], []
    for k, drive in enumerate(inputs):
        command = [program, "run", drive, "--threads", threads, "--progress", "none", "--out", folder / f"{name}-{k}"]
        times.append(timed(command, cores, env=environment))
    wall, cpu = (sum(column) for column in zip(*times))
    print(f"single runs, {threads} threads on {cores} cores: {wall:.1f} s, {cpu:.1f} s of processor in all; load before {load:.1f}", flush=True)
    return wall, cpu


def one_round(program, folder, inputs, number, environment, arguments):
    machine = len(os.sched_getaffinity(0))
    singles(program, folder, inputs, f"free{number}", 1, machine, environment)
    for jobs in (1, 2):
        cores = max(1, machine // jobs)
        wall, cpu = singles(program, folder, inputs, f"single{number}-{jobs}", cores, cores, environment)
        load = os.getloadavg()[0]
        out = folder / f"batch{number}-{jobs}"
        command = [program, "batch", folder / "drives.csv", "--out", out, "--jobs", jobs, "--progress", "none"]
        seconds, _ = timed(command + ["--no-pin"] * arguments.no_pin, env=environment)
        with open(out / "manifest.done.csv") as file:
            rows = list(csv.DictReader(file))
        own = sum(float(row["cpu_s"] or 0) for row in rows)
        peak = max(float(row["peak_rss_mb"] or 0) for row in rows)
        done = sum(row["status"] == "done" for row in rows)
        print(f"--jobs {jobs}: {seconds:.1f} s, {wall / seconds / jobs:.2f} of linear ({cpu / own:.2f} by processor time), "
              f"{3600 * len(rows) / seconds / machine:.0f} drives an hour a core; {done} done, {own / len(rows):.2f} s of processor a drive, "
              f"at most {peak:.0f} MB; load before {load:.1f}", flush=True)


if __name__ == "__main__":
    main()
