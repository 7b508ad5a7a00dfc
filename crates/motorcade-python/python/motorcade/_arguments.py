"""Arguments of a run, checked."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Union

from . import _native, _settings

PathArgument = Union[str, "os.PathLike[str]"]


def rig(camera: object) -> int | None:
    """The number of a camera of a rig."""
    return camera if isinstance(camera, int) and not isinstance(camera, bool) else None


def path(path: Any) -> str | None:
    """A path as text."""
    if path is None:
        return None
    try:
        return os.fsdecode(path)
    except TypeError as error:
        raise _native.SettingsError(f"expected a path: {error}") from None


def number(name: str, value: Any) -> float | None:
    """A number that may be left out."""
    try:
        return None if value is None else float(value)
    except (TypeError, ValueError):
        raise _native.SettingsError(f"{name}: expected a number, got {value!r}") from None


def whole(name: str, value: Any, least: int) -> int:
    """A whole number."""
    if not isinstance(value, int) or not least <= value <= 1 << 31:
        raise _native.SettingsError(f"{name}: expected a whole number from {least}, got {value!r}")
    return value


def frame_range(frames: str | tuple[int | None, int | None] | None) -> str:
    """A range of frames as the native part reads it."""
    if frames is None:
        return ".."
    if isinstance(frames, str):
        return frames
    first, end = frames
    return f"{'' if first is None else first}..{'' if end is None else end}"


def clock(offset: float | tuple[float, float] | None) -> tuple[float, float] | None:
    """Offset of a clock and its standard deviation [s]."""
    if offset is None:
        return None
    pair = tuple(offset) if isinstance(offset, (tuple, list)) else (offset, 2.0)
    if len(pair) != 2 or not (abs(float(pair[0])) <= 1e11 and 1e-3 <= float(pair[1]) <= 3600.0):
        raise _native.SettingsError(f"clock_offset: expected seconds, or seconds and their deviation, got {offset!r}")
    return float(pair[0]), float(pair[1])


def command(
    arguments: dict[str, Any],
    preset: str,
    config: PathArgument | None,
    online: bool,
    seed: int | None,
    settings: Mapping[str, Any],
) -> list[str]:
    """The same run on the command line: `motorcade draw` finds the frames of a saved run by it."""
    words = ["motorcade", "run", arguments["input"]]
    names = ["format", "sequence", "camera", "calibration", "fps", "ignore", "models", "detections"]
    names += ["road_masks", "trajectory", "speed", "gps", "keypoints", "shape_prior", "map"]
    for name in names:
        if arguments[name] is not None:
            words += [f"--{name.replace('_', '-')}", str(arguments[name])]
    words += ["--frames", arguments["frames"], "--stride", str(arguments["stride"])]
    if arguments["height_auto"] or arguments["height_m"] is not None:
        words += ["--height", "auto" if arguments["height_auto"] else repr(arguments["height_m"])]
    if arguments["trajectory"] is not None and arguments["metric"]:
        words += ["--trajectory-scale", "metric"]
    if arguments["clock_offset"] is not None:
        words += ["--clock-offset", ",".join(map(repr, arguments["clock_offset"]))]
    if arguments["vehicle_poses"]:
        words += ["--vehicle-poses", *arguments["vehicle_poses"]]
    words += ["--preset", preset] + (["--config", os.fsdecode(config)] if config is not None else [])
    words += ["--online"] * online + ["--keep-perception"] * bool(arguments["keep_perception"])
    words += ["--seed", str(seed)] if seed is not None else []
    for setting in _settings.flattened(settings):
        words += ["--set", setting]
    return words
