"""Many runs as one dataset."""

from __future__ import annotations

import os
from collections.abc import Iterable

from . import _native


def tables(
    runs: Iterable[str | os.PathLike[str]], out: str | os.PathLike[str], *, force: bool = False
) -> None:
    """Writes frames and vehicles of many saved runs as one dataset of Parquet files, as the program's `tables` does.

    `out` gets frames/<drive_id>.parquet and tracks/<drive_id>.parquet of every run and drives.parquet with a row a run; drive_id is the
    name of the run's directory. `pandas.read_parquet(f"{out}/tracks")`, `polars.read_parquet(f"{out}/tracks/*.parquet")` and
    DuckDB's `FROM '{out}/tracks/*.parquet'` open all drives at once. Units and frame conventions stand in the files' metadata.

    Args:
        runs: Directories of runs, as `Drive.save` and the program's `run` write them.
        out: A new or empty directory; earlier tables in it are replaced with `force`.

    Raises `InputError` for a run that does not read, `SettingsError` for two runs of one name, `ResourceError` for an `out` that
    cannot be written. Nothing is written then.
    """
    paths = [os.fspath(run) for run in runs]
    out = os.fspath(out)
    command = ["motorcade", "tables", *paths, "--out", out, *(["--force"] if force else [])]
    _native.tables(paths, out, force, command)
