"""The list of drives."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import fsspec

from .._native import InputError

#: Values of path columns that are no paths: no networks, and a calibration by the drive itself.
WORDS = ("none", "auto")
PATHS = ("input", "calibration", "ignore", "models", "detections", "road_masks", "trajectory", "speed", "gps",
         "keypoints", "config")  # fmt: skip
"""Columns that name a file or folder: local, or a URL that fsspec knows."""
OTHERS = ("sequence", "frames", "format", "trajectory_scale", "preset", "height", "camera", "stride", "fps", "seed",
          "keep_perception", "parquet", "settings", "clock_offset", "vehicle_poses", "id", "date")  # fmt: skip
NUMBERS = {"stride": int, "fps": float, "seed": int, "camera": int}


@dataclass(frozen=True)
class Job:
    """One drive."""

    id: str
    """Name of its results: letters, digits, `.`, `_`, `-`."""
    date: str
    """Partition of its tables."""
    values: dict[str, str]
    """Columns that are filled, paths absolute or URLs."""

    @property
    def key(self) -> str:
        """Hash of all that was asked for."""
        text = json.dumps([self.id, self.date, self.values], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def read(manifest: str, defaults: Mapping[str, Any]) -> list[Job]:
    """The drives of a .csv, .jsonl or .parquet file, local or at a URL, in its order. `defaults` are for cells that are empty."""
    jobs = []
    lines: dict[str, int] = {}
    for line, row in _rows(manifest):
        where = f"{manifest}:{line}"
        cells = {name.replace("-", "_"): str(value).strip() for name, value in row.items() if _filled(value)}
        for name, value in defaults.items():
            cells.setdefault(name, str(value))
        for name in cells:
            if name not in PATHS + OTHERS:
                raise InputError(f"{where}: column `{name}` is not known; columns: {', '.join(sorted(PATHS + OTHERS))}")
        job = _job(cells, _base(manifest), where)
        if job.id in lines:
            raise InputError(f"{where}: `{job.id}` is the id of line {lines[job.id]} too; give each drive its own `id`")
        lines[job.id] = line
        jobs.append(job)
    return jobs


def _filled(value: object) -> bool:
    return value is not None and value == value and str(value).strip() != ""


def _rows(manifest: str) -> Iterable[tuple[int, dict[str, Any]]]:
    try:
        with fsspec.open(manifest, "rb") as file:
            data: bytes = file.read()
    except OSError as error:
        raise InputError(f"{manifest}: cannot be read: {error}") from error
    kind = manifest.rsplit(".", 1)[-1].lower()
    if kind == "parquet":
        import pyarrow.parquet

        yield from enumerate(pyarrow.parquet.read_table(io.BytesIO(data)).to_pylist(), 1)
    elif kind == "csv":
        reader = csv.DictReader(io.StringIO(data.decode("utf-8-sig")), strict=True)
        for row in reader:
            if None in row or None in row.values():
                raise InputError(f"{manifest}:{reader.line_num}: expected {len(reader.fieldnames or [])} cells")
            yield reader.line_num, {name.strip(): value for name, value in row.items()}
    elif kind in ("jsonl", "ndjson"):
        for number, text in enumerate(data.decode("utf-8-sig").splitlines(), 1):
            if text.strip():
                try:
                    row = json.loads(text)
                except ValueError as error:
                    raise InputError(f"{manifest}:{number}: is not JSON: {error}") from error
                if not isinstance(row, dict):
                    raise InputError(f"{manifest}:{number}: expected an object")
                yield number, {k: ";".join(map(str, v)) if isinstance(v, list) else v for k, v in row.items()}
    else:
        raise InputError(f"{manifest}: expected a name that ends in .csv, .jsonl or .parquet")


def _base(manifest: str) -> str:
    """What relative paths are relative to."""
    return manifest.rsplit("/", 1)[0] if "://" in manifest else os.path.dirname(os.path.abspath(manifest))


def _absolute(path: str, base: str) -> str:
    if "://" in path or os.path.isabs(path) or path in WORDS:
        return path
    return f"{base}/{path}" if "://" in base else os.path.join(base, path)


def _job(cells: dict[str, str], base: str, where: str) -> Job:
    if "input" not in cells:
        raise InputError(f"{where}: column `input` is empty")
    named = [cells["input"].rstrip("/").rsplit("/", 1)[-1].rsplit(".", 1)[0], cells.get("sequence"), cells.get("camera")]
    name = cells.pop("id", None) or "-".join(part for part in named if part)
    if not re.fullmatch(r"[A-Za-z0-9._-]{1,200}", name) or name.strip(".") == "":
        raise InputError(f"{where}: `{name}` cannot name a directory; give an `id` of letters, digits, `.`, `_`, `-`")
    date = cells.pop("date", "unknown")
    if not re.fullmatch(r"[A-Za-z0-9._-]{1,40}", date):
        raise InputError(f"{where}: column `date`: `{date}`; expected a date such as 2026-05-01")
    for column, kind in NUMBERS.items():
        if column in cells:
            try:
                kind(cells[column])
            except ValueError:
                raise InputError(f"{where}: column `{column}`: `{cells[column]}` is no number") from None
    height = cells.get("height", "auto")
    if height != "auto":
        try:
            float(height)
        except ValueError:
            raise InputError(f"{where}: column `height`: `{height}` is neither metres nor `auto`") from None
    for column in PATHS:
        if column in cells:
            cells[column] = _absolute(cells[column], base)
    if "vehicle_poses" in cells:
        cells["vehicle_poses"] = ";".join(_absolute(path, base) for path in cells["vehicle_poses"].split(";"))
    return Job(name, date, cells)
