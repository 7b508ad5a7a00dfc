"""Renders crops with the simulator."""

import argparse
import subprocess
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of `make-data vehicle`."""
    parser.add_argument("--motorcade", type=Path, required=True, help="the program, a release build")
    parser.add_argument("--out", type=Path, default=Path("work/vehicle/crops"))
    parser.add_argument("--count", type=int, default=40_000)
    parser.add_argument("--seed", type=int, default=1)


def run(options: argparse.Namespace) -> None:
    """One folder of crops."""
    command = [options.motorcade, "simulate", "--training", "vehicle", "--count", options.count]
    command += ["--seed", options.seed, "--out", options.out]
    try:
        subprocess.run([str(part) for part in command], check=True)
    except subprocess.CalledProcessError as error:
        raise ValueError(f"{options.motorcade}: exit status {error.returncode}") from error
