"""Checkpoints that a training resumes from."""

import os
import pickle
from pathlib import Path
from typing import Any

import torch

from motorcade_training.common.ema import Ema


def save(path: Path, model: torch.nn.Module, ema: Ema, optimiser: torch.optim.Optimizer, step: int, **more: Any) -> None:
    """Writes all that a resumed training needs, beside its place first and then renamed."""
    state = {
        "model": model.state_dict(),
        "ema": ema.module.state_dict(),
        "optimiser": optimiser.state_dict(),
        "random": torch.get_rng_state(),
        "step": step,
        **more,
    }
    write(path, state)


def load(path: Path, model: torch.nn.Module, ema: Ema, optimiser: torch.optim.Optimizer) -> dict[str, Any]:
    """Restores what `save` wrote and returns it. Small checkpoints hold the average alone: training starts from it."""
    state = read(path)
    ema.module.load_state_dict(state["ema"])
    model.load_state_dict(state.get("model", state["ema"]))
    if "optimiser" in state:
        optimiser.load_state_dict(state["optimiser"])
        torch.set_rng_state(state["random"])
    return state


def save_small(path: Path, ema: Ema, **more: Any) -> None:
    """The averaged weights in half precision, without the optimiser: small enough to keep in a repository."""
    weights = {k: v.half() if v.dtype.is_floating_point else v for k, v in ema.module.state_dict().items()}
    write(path, {"ema": weights, "step": 0, **more})


def read(path: Path) -> dict[str, Any]:
    """A checkpoint; nothing in it is executed, except by PyTorch 1."""
    if not path.is_file():
        raise ValueError(f"{path}: no such checkpoint")
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError:
        # PyTorch 1 reads tensors alone this way; Debian's is one. The checkpoint is then trusted.
        if int(torch.__version__.split(".")[0]) >= 2:
            raise
        return torch.load(path, map_location="cpu")


def write(path: Path, state: dict[str, Any]) -> None:
    """Writes a checkpoint beside its place and renames it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(".tmp")
    torch.save(state, beside)
    os.replace(beside, path)
