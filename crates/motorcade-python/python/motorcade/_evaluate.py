"""Errors of a run against ground truth."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any

from . import _native
from ._drive import Drive


class Evaluation:
    """Errors of a run. `print(evaluation)` gives the table of the program, `evaluation["ego"]` and so on its numbers."""

    data: dict[str, Any]
    """All errors by name: ego (ATE, RPE, scale), consistency (NEES), vehicles, vehicles_mean; lengths in metres."""

    def __init__(self, data: dict[str, Any], text: str) -> None:
        """Not to be called: use `evaluate`."""
        self.data, self._text = data, text

    def __getitem__(self, name: str) -> Any:
        return self.data[name]

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"Evaluation of sequence {self.data['sequence']}: ATE {self.data['ego']['ate_origin_m']:.3f} m"


def evaluate(
    run: Drive | str | os.PathLike[str],
    *,
    kitti: str | os.PathLike[str],
    sequence: str | None = None,
    camera: int | None = None,
    first: int | None = None,
) -> Evaluation:
    """Compares a run with the ground truth of a KITTI tracking sequence, or of a drive by `simulate`.

    Args:
        run: A `Drive`, or the directory of a run or of any trajectories (ego.kitti.txt or ego.tum, tracks.kitti.txt).
        kitti: KITTI tracking split with calib/, gt_poses/ and label_02/ (label_03/ for camera 3).
        sequence, camera, first: Sequence, camera, and number of the first frame; by default those of the run's run.json.

    Raises `InputError` for files that do not read, `SettingsError` for a run that does not go with the ground truth.
    """
    if isinstance(run, Drive) and run.directory is None:
        with tempfile.TemporaryDirectory(prefix="motorcade-") as folder:
            saved = Path(folder) / "run"
            run.save(saved)
            return evaluate(saved, kitti=kitti, sequence=sequence, camera=camera, first=first)
    directory = run.directory if isinstance(run, Drive) else Path(run)
    assert directory is not None
    given = _input(directory)
    sequence = sequence if sequence is not None else given.get("sequence")
    if sequence is None:
        raise _native.SettingsError(f"{directory}: its run.json names no KITTI sequence; give sequence")
    camera = camera if camera is not None else given.get("camera")
    if first is None:
        first = _first(directory)
    if first is None:
        first = (given.get("numbers") or [0])[0]
    found = _native.evaluate(
        os.fspath(directory), os.fspath(kitti), sequence, 2 if camera is None else camera, first
    )
    return Evaluation(json.loads(found[0]), found[1])


def _input(directory: Path) -> dict[str, Any]:
    """The input as run.json describes it; trajectories of other programs have none."""
    try:
        record = json.loads((directory / "run.json").read_text(encoding="utf-8"))
        return dict(record.get("input") or {})
    except (OSError, ValueError, AttributeError):
        return {}


def _first(directory: Path) -> int | None:
    """Number of the first frame in frames.csv."""
    try:
        with (directory / "frames.csv").open(encoding="utf-8") as file:
            file.readline()
            return int(file.readline().split(",")[0])
    except (OSError, ValueError):
        return None
