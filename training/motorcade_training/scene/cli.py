"""Subcommands of the scene network."""

from motorcade_training.common.stage import Stage

STAGES: dict[str, Stage] = {}
