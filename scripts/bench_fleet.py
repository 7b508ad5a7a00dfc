#!/usr/bin/env python3
"""Throughput of `motorcade batch` with 1 and 2 jobs against the sum of single runs.

    scripts/bench_fleet.py [--motorcade target/release/motorcade] [--drives 6] [--frames 40] [--networks] [--rounds 1] [--pin]

Renders short drives, runs each alone (`motorcade run --threads 1`), then all of them by `motorcade batch --jobs 1` and `--jobs 2`.
Linear would be the sum of the single runs divided by the number of jobs; the share of it is printed with the load of the machine
before each step. With more load than idle cores the share of two jobs says more of the machine than of the program.

A drive alone uses more than one core: decoding and networks work ahead in threads of their own. `--pin` gives single runs and one job
one core, two jobs two, so that the shares are those of drives an hour a core.
"""
import argparse
import csv
import os
import pathlib
import subprocess
import tempfile
import time


def timed(command, cores=None, **options):
    if cores is not None:
        options["preexec_fn"] = lambda: os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cores])
    start = time.monotonic()
    subprocess.run([str(c) for c in command], check=True, stdout=subprocess.DEVNULL, **options)
    return time.monotonic() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motorcade", default="target/release/motorcade")
    parser.add_argument("--drives", type=int, default=6)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--networks", action="store_true", help="with the program's own networks")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--pin", action="store_true", help="a core for each job")
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
        for number in range(arguments.rounds):
            one_round(program, folder, inputs, number, environment, arguments)


def one_round(program, folder, inputs, number, environment, arguments):
    loads = [os.getloadavg()[0]]
    single = 0.0
    for k, drive in enumerate(inputs):
        out = folder / f"single{number}-{k}"
        single += timed([program, "run", drive, "--threads", 1, "--progress", "none", "--out", out], 1 if arguments.pin else None, env=environment)
    times, tables = {}, {}
    for jobs in (1, 2):
        loads.append(os.getloadavg()[0])
        out = folder / f"batch{number}-{jobs}"
        command = [program, "batch", folder / "drives.csv", "--out", out, "--jobs", jobs, "--progress", "none"]
        times[jobs] = timed(command, jobs if arguments.pin else None, env=environment)
        with open(out / "manifest.done.csv") as file:
            tables[jobs] = list(csv.DictReader(file))
    print(f"{len(inputs)} drives of {arguments.frames} frames; load before: " + ", ".join(f"{load:.1f}" for load in loads))
    print(f"single runs: {single:.1f} s in all")
    for jobs, seconds in times.items():
        rows = tables[jobs]
        share = single / seconds / jobs
        hour = 3600 * len(rows) / seconds / jobs
        cpu = sum(float(row["cpu_s"] or 0) for row in rows) / len(rows)
        peak = max(float(row["peak_rss_mb"] or 0) for row in rows)
        done = sum(row["status"] == "done" for row in rows)
        print(f"--jobs {jobs}: {seconds:.1f} s, {share:.2f} of linear, {hour:.0f} drives an hour a job; {done} done, "
              f"{cpu:.2f} s of processor a drive, at most {peak:.0f} MB")


if __name__ == "__main__":
    main()
