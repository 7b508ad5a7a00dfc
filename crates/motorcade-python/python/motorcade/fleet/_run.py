"""A manifest as Ray tasks."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from typing import Any

from . import _drive, _manifest
from ._manifest import Job
from ._storage import Place

# Types of the columns of manifest.done.parquet: they do not depend on the drives.
COLUMNS = {
    "id": "string", "date": "string", "status": "string", "message": "string", "frames": "int64", "vehicles": "int64",
    "length_m": "float64", "duration_s": "float64", "tracked_share": "float64", "wall_s": "float64", "key": "string",
}  # fmt: skip


def run(
    manifest: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    defaults: Mapping[str, Any] | None = None,
    address: str | None = None,
    cpus: float = 1.0,
    memory_mb: float | None = None,
    retries: int = 3,
    in_flight: int = 10_000,
    progress: Callable[[int, int, dict[str, Any]], None] | None = None,
    **more_defaults: Any,
) -> list[dict[str, Any]]:
    """Runs all drives of a manifest as Ray tasks.

    Args:
        manifest: .csv, .jsonl or .parquet, local or at a URL.
        out: Folder of the results, local (then shared by all nodes) or at a URL.
        defaults: Values for cells that are empty, by column; keyword arguments are such too, as `height=1.4`.
        address: Of the cluster; by default the one of the environment (as under `ray job submit`), else this machine.
        cpus: Cores that a drive is given; its threads are as many, at least one.
        memory_mb: Memory that a drive is given by the scheduler.
        retries: How often a drive runs again whose worker or node died, or whose place did not answer.
        in_flight: Largest number of drives that Ray knows at a time: its own memory grows with them.
        progress: Called as progress(done, total, line) after every drive.

    Returns:
        One line a drive in the order of the manifest, as in manifest.done.parquet: id, date, status ("done" or "failed"), message,
        warnings, frames, vehicles, length_m, duration_s, tracked_share, wall_s, key.

    Raises:
        InputError: a manifest that does not read. A drive that fails is a line, not an error. KeyboardInterrupt: tasks are
        cancelled, and what is done stays.
    """
    import ray

    values = {**(defaults or {}), **more_defaults}
    jobs = _manifest.read(_text(manifest), {k: v for k, v in values.items() if v is not None})
    if not ray.is_initialized():
        ray.init(address=address, log_to_driver=False)
    options: dict[str, Any] = {"num_cpus": cpus, "max_retries": retries, "retry_exceptions": True}
    if memory_mb is not None:
        options["memory"] = int(memory_mb * 1e6)
    task = ray.remote(_drive.execute).options(name="motorcade drive", **options)
    waiting, lines = list(reversed(jobs)), {}
    running: dict[Any, Job] = {}
    try:
        while waiting or running:
            while waiting and len(running) < in_flight:
                job = waiting.pop()
                running[task.remote(job, _text(out), max(1, round(cpus)))] = job
            ended, _ = ray.wait(list(running), num_returns=1)
            for reference in ended:
                job = running.pop(reference)
                lines[job.id] = _line(job, reference)
                if progress is not None:
                    progress(len(lines), len(jobs), lines[job.id])
    finally:
        for reference in running:
            ray.cancel(reference, force=True)
        ordered = [lines[job.id] for job in jobs if job.id in lines]
        _write(ordered, Place(_text(out)))
    return ordered


def _text(path: str | os.PathLike[str]) -> str:
    text = os.fspath(path)
    return text if "://" in text else os.path.abspath(text)


def _line(job: Job, reference: Any) -> dict[str, Any]:
    import ray

    try:
        return dict(ray.get(reference))
    except ray.exceptions.RayError as error:
        # Its last line: the rest is the trace of the worker.
        message = str(error).strip().splitlines()[-1] if str(error).strip() else type(error).__name__
        return {"id": job.id, "date": job.date, "key": job.key, "status": "failed", "message": message}


def _write(lines: list[dict[str, Any]], place: Place) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(name, kind) for name, kind in COLUMNS.items()] + [pa.field("warnings", pa.list_(pa.string()))]
    rows = [{field.name: line.get(field.name) for field in fields} for line in lines]
    with tempfile.TemporaryDirectory(prefix="motorcade-") as folder:
        path = os.path.join(folder, "manifest.done.parquet")
        pq.write_table(pa.Table.from_pylist(rows, schema=pa.schema(fields)), path, compression="zstd")
        place.put(path, "manifest.done.parquet")
