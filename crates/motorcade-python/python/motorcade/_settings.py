"""Settings of the pipeline."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from . import _native


def arguments(
    preset: str,
    config: str | os.PathLike[str] | None,
    online: bool,
    seed: int | None,
    settings: Mapping[str, Any],
) -> dict[str, Any]:
    """Settings as the native part takes them."""
    try:
        text = json.dumps(dict(settings), default=_plain)
    except (TypeError, ValueError) as error:
        raise _native.SettingsError(f"settings: {error}") from None
    return {
        "preset": preset,
        "config": None if config is None else os.fspath(config),
        "online": online,
        "seed": seed,
        "settings": text,
    }


def flattened(settings: Mapping[str, Any], before: str = "") -> list[str]:
    """`stage.key=value` of every setting, as the program's `--set` takes them."""
    out: list[str] = []
    for key, value in settings.items():
        name = f"{before}{key}"
        if isinstance(value, Mapping):
            out += flattened(value, f"{name}.")
        else:
            out.append(f"{name}={value if isinstance(value, str) else json.dumps(value, default=_plain)}")
    return out


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays as Python's."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no value of a setting")


def settings_text(
    *, preset: str = "default", config: str | os.PathLike[str] | None = None, **settings: Any
) -> str:
    """All settings as commented TOML, each with unit, source and what it trades.

    `preset` is "default" or "paper"; `config` a TOML file or the run.json of an earlier run; `settings` a dictionary for each
    stage, such as `road={"far_heights": 12}`. Raises `SettingsError` for unknown settings and values out of range.
    """
    return _native.settings_text(arguments(preset, config, False, None, settings))
