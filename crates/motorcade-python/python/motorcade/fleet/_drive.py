"""One drive of a fleet, wherever it runs."""

from __future__ import annotations

import os
import tempfile
import time
from typing import Any

import motorcade

from ._manifest import NUMBERS, PATHS, Job
from ._storage import Place, staged


def execute(job: Job, out: str, threads: int) -> dict[str, Any]:
    """Runs a drive and writes its results to `out`; returns its line of the summary.

    A drive that is done there, asked for in the same way, is left alone: a task that is run again after its worker died writes
    nothing twice. Input that does not read is a result; what may pass (a full disk, a place that does not answer) is raised.
    """
    place = Place(out)
    before = place.get_json(f"done/{job.id}.json")
    if before is not None and before.get("key") == job.key and before.get("status") == "done":
        return dict(before)
    start = time.monotonic()
    line: dict[str, Any] = {"id": job.id, "date": job.date, "key": job.key}
    if before is None and place.exists(f"runs/{job.id}/run.json"):
        return line | {"status": "failed", "message": f"{out}/runs/{job.id} holds a run that no fleet made; choose another out"}
    with tempfile.TemporaryDirectory(prefix="motorcade-") as folder:
        # From here on the results there are this fleet's own, which a later attempt may replace.
        place.put_json(line | {"status": "begun"}, f"done/{job.id}.json", folder)
        try:
            drive = motorcade.run(threads=threads, **_arguments(job, folder))
        except (motorcade.InputError, motorcade.SettingsError) as error:
            line |= {"status": "failed", "message": str(error)}
        else:
            line |= _facts(drive)
            # Runs of one name are told apart by their directory.
            results = os.path.join(folder, "results", job.id)
            drive.save(results, parquet=True)
            _put(place, job, results)
        line["wall_s"] = round(time.monotonic() - start, 3)
        # Last: a drive is done when all of it is there.
        place.put_json(line, f"done/{job.id}.json", folder)
    return line


def _arguments(job: Job, folder: str) -> dict[str, Any]:
    """Arguments of `motorcade.run`, files from elsewhere copied into `folder`."""
    values = dict(job.values)
    # The tables are always written.
    values.pop("parquet", None)
    arguments: dict[str, Any] = {name: staged(values.pop(name), folder) for name in PATHS if name in values}
    arguments |= {name: kind(values.pop(name)) for name, kind in NUMBERS.items() if name in values}
    if "height" in values:
        height = values.pop("height")
        arguments["height_m"] = height if height == "auto" else float(height)
    if "vehicle_poses" in values:
        arguments["vehicle_poses"] = [staged(path, folder) for path in values.pop("vehicle_poses").split(";")]
    if "clock_offset" in values:
        offset = [float(part) for part in values.pop("clock_offset").split(",")]
        arguments["clock_offset"] = offset[0] if len(offset) == 1 else tuple(offset)
    if "keep_perception" in values:
        arguments["keep_perception"] = values.pop("keep_perception").lower() == "true"
    for setting in filter(None, values.pop("settings", "").split(";")):
        name, equals, value = setting.strip().partition("=")
        stage, dot, key = name.strip().partition(".")
        if not (equals and dot):
            raise motorcade.SettingsError(f"{job.id}: setting `{setting}`: expected STAGE.KEY=VALUE")
        arguments.setdefault(stage, {})[key] = _value(value.strip())
    return arguments | values


def _value(text: str) -> Any:
    """A number, a truth value or a word."""
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _facts(drive: motorcade.Drive) -> dict[str, Any]:
    return {
        "status": "done",
        "message": None,
        "frames": len(drive),
        "vehicles": len(drive.vehicles),
        "length_m": drive.length_m,
        "duration_s": float(drive.times_s[-1] - drive.times_s[0]) if len(drive) else 0.0,
        "tracked_share": drive.tracked_share,
        "warnings": drive.warnings,
    }


def _put(place: Place, job: Job, results: str) -> None:
    """The run's files under runs/, its tables in the two datasets."""
    for table in ("frames", "tracks"):
        path = os.path.join(results, f"{table}.parquet")
        place.put(path, f"{table}/date={job.date}/{job.id}.parquet")
    place.put_folder(results, f"runs/{job.id}", last="run.json")
