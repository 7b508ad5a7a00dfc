"""A subcommand that one of the networks adds to the command line."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

#: Stages in the order they are used, with their help.
STAGES: dict[str, str] = {
    "make-data": "make labelled training data",
    "train": "train a network; resumes from a checkpoint",
    "evaluate": "measure a network",
    "export": "write a network as ONNX",
}


@dataclass(frozen=True)
class Stage:
    """One stage of one network. `motorcade_training/<network>/cli.py` holds `STAGES: dict[str, Stage]`."""

    help: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], None]
