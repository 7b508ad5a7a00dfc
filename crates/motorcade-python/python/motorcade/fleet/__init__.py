"""Many drives on a cluster, by Ray.

    >>> import motorcade.fleet
    >>> lines = motorcade.fleet.run("s3://videos/drives.csv", "s3://results/may", height=1.4)

The manifest has one drive a row, with the columns of `motorcade batch` and `date`, which the tables are partitioned by. Inputs
and results are local or at URLs that fsspec knows; inputs are copied to the disk of the worker. What is written:

- `runs/<id>/`: the files of the run, as `Drive.save` writes them;
- `frames/date=<date>/<id>.parquet`, `tracks/date=<date>/<id>.parquet`: two datasets of all drives;
- `done/<id>.json`: the drive's line, `begun` at first and whole when all else is there;
- `manifest.done.parquet`: all lines.

A drive whose worker or node dies runs again elsewhere. Drives that are done are left alone when the same command runs again.
Needs `pip install motorcade[fleet]`.
"""

from ._run import run

__all__ = ["run"]
