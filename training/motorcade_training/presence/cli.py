"""Subcommands of the head that tells whether a box shows a vehicle."""

from motorcade_training.common.stage import Stage
from motorcade_training.presence import candidates, train

STAGES: dict[str, Stage] = {
    "make-data": Stage("collect what the scene network takes for vehicles", candidates.add_arguments, candidates.run),
    "train": Stage("train the head on candidates, the rest of the vehicle network held", train.add_arguments, train.run),
}
