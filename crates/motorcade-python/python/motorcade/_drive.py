"""A drive as it was estimated."""

from __future__ import annotations

import json
import os
import shutil
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from . import _native, _tables, _vehicle
from ._camera import Camera
from ._vehicle import Vehicle

if TYPE_CHECKING:
    import numpy as np
    import pandas
    import polars
    import pyarrow
    from numpy.typing import NDArray

T = TypeVar("T")


class Tables(NamedTuple, Generic[T]):
    """The tables of a drive, with the columns and numbers of its files."""

    frames: T
    """frames.csv: one row a frame."""
    tracks: T
    """tracks.csv: one row a vehicle and frame, by frame."""


class Drive:
    """The result of a drive of n frames.

    Made by `run`, `Motorcade.finish` and `load`. Row k of every array belongs to the k-th frame; every frame of the input has
    a row, those that could not be read too (`status` then says "bridged").
    """

    frame_numbers: NDArray[np.int64]
    """The input's own numbers; shape [n]."""
    times_ns: NDArray[np.int64]
    """Times [ns]; shape [n]."""
    poses: NDArray[np.float64]
    """world_from_camera [m]; shape [n, 4, 4]."""
    pose_covariances: NDArray[np.float64]
    """Covariances of the poses, tangent [ω, ν] of the camera (rad, m); shape [n, 6, 6]."""
    vehicles: list[Vehicle]
    """Vehicles by identity."""
    camera: Camera | None
    """Intrinsics of the (undistorted) frames; None where a loaded record does not say."""
    height_m: float | None
    """Height of the camera above the road [m], as given or as estimated."""
    length_m: float
    """Way of the camera [m]."""
    warnings: list[str]
    """Messages for the user, as they stand in run.json."""
    directory: Path | None
    """Directory it was loaded from; None for a drive in memory."""

    def __init__(
        self,
        camera: dict[str, Any],
        vehicles: list[dict[str, Any]],
        facts: dict[str, Any],
        tables: tuple[bytes, bytes],
        native: _native.NativeDrive | None,
        directory: Path | None,
    ) -> None:
        """Not to be called: use `run`, `Motorcade.finish` or `load`."""
        self.frame_numbers, self.times_ns = camera["numbers"], camera["times_ns"]
        self.poses, self.pose_covariances = camera["poses"], camera["covariances"]
        self._csv = tables
        self._native, self.directory = native, directory
        self.vehicles = [_vehicle.from_native(data, self.tables.tracks) for data in vehicles]
        intrinsics, size = facts["intrinsics_px"], facts["size_px"]
        self.camera = None if intrinsics is None else Camera(*intrinsics, *size)
        self.height_m, self.length_m = facts["height_m"], facts["length_m"]
        self.warnings = list(facts["warnings"])

    @cached_property
    def tables(self) -> Tables[dict[str, NDArray[Any]]]:
        """frames.csv and tracks.csv as dictionaries of columns."""
        frames, tracks = self._csv
        return Tables(_tables.parsed(frames), _tables.parsed(tracks))

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Times [s]; shape [n]."""
        import numpy as np

        return np.asarray(self.times_ns, dtype=np.float64) * 1e-9

    @property
    def status(self) -> NDArray[np.str_]:
        """tracked, standstill, bridged (interpolated) or filled_in (before the first map); shape [n]."""
        return self.tables.frames["status"]

    @property
    def speeds_mps(self) -> NDArray[np.float64]:
        """Speed of the camera over the interval before each frame [m/s]; shape [n]."""
        return self.tables.frames["speed_mps"]

    @property
    def positions_m(self) -> NDArray[np.float64]:
        """Positions of the camera [m]; shape [n, 3]."""
        positions: NDArray[np.float64] = self.poses[:, :3, 3]
        return positions

    @property
    def tracked_share(self) -> float:
        """Share of frames whose pose was tracked or stood."""
        import numpy as np

        if len(self) == 0:
            return 0.0
        return float(np.isin(self.status, ["tracked", "standstill"]).mean())

    def vehicle(self, id: int) -> Vehicle:
        """The vehicle with this identity; raises `KeyError`."""
        for vehicle in self.vehicles:
            if vehicle.id == id:
                return vehicle
        raise KeyError(id)

    def to_pandas(self) -> Tables[pandas.DataFrame]:
        """frames and tracks as pandas data frames."""
        import pandas

        return Tables(*(pandas.DataFrame(_tables.columns(table)) for table in self.tables))

    def to_polars(self) -> Tables[polars.DataFrame]:
        """frames and tracks as polars data frames."""
        import polars

        return Tables(*(polars.DataFrame(_tables.columns(table)) for table in self.tables))

    def to_arrow(self) -> Tables[pyarrow.Table]:
        """frames and tracks as Arrow tables; columns of numbers share the memory of `tables`."""
        import pyarrow

        return Tables(*(pyarrow.table(_tables.columns(table)) for table in self.tables))

    def save(self, directory: str | os.PathLike[str], *, force: bool = False, parquet: bool = False) -> None:
        """Writes all files of a run, as the program's `run --out` does, whole or not at all.

        The directory is new or empty; an earlier run in it is replaced with `force`, which removes only files that its run.json
        lists. With `parquet` the tables are written as frames.parquet and tracks.parquet too, with units and the camera's pose.
        A drive that was loaded is copied as it is. Raises `SettingsError` for a directory that holds something, `ResourceError`
        for one that cannot be written.
        """
        if self._native is not None:
            self._native.save(os.fspath(directory), force, parquet)
        elif parquet:
            hint = "a loaded drive is copied as it is; motorcade.tables writes Parquet files of saved runs"
            raise _native.SettingsError(f"parquet=True: {hint}")
        else:
            self._copy(Path(directory), force)

    def report(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes the report, one HTML file without need of a network. A file that is there is replaced with `force` only."""
        if self._native is not None:
            self._native.report(os.fspath(path), force)
            return
        assert self.directory is not None
        if Path(path).exists() and not force:
            raise _native.SettingsError(f"{os.fspath(path)} exists; force=True replaces it")
        try:
            shutil.copyfile(self.directory / "report.html", path)
        except OSError as error:
            raise _native.ResourceError(f"cannot copy the report: {error}") from error

    def _copy(self, to: Path, force: bool) -> None:
        assert self.directory is not None
        if to.exists() and any(to.iterdir()):
            hint = "; a loaded drive replaces nothing" if force else ""
            raise _native.SettingsError(f"{to} is not empty; choose another directory{hint}")
        try:
            record = json.loads((self.directory / "run.json").read_text(encoding="utf-8"))
            # The record last: without it nobody takes a half for a run.
            for name in [*(file["name"] for file in record["files"]), "run.json"]:
                (to / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(self.directory / name, to / name)
        except (OSError, KeyError, ValueError) as error:
            raise _native.ResourceError(f"cannot copy {self.directory} to {to}: {error}") from error

    def __len__(self) -> int:
        return len(self.times_ns)

    def __repr__(self) -> str:
        return f"Drive({len(self)} frames, {self.length_m:.1f} m, {len(self.vehicles)} vehicles)"


def from_native(native: _native.NativeDrive) -> Drive:
    """A drive in memory."""
    facts = native.facts()
    if facts["tracking_failed"]:
        import logging

        share = 100.0 * facts["tracked_share"]
        logging.getLogger("motorcade").warning("only %.1f %% of the frames were tracked", share)
    tables = (native.frames_csv(), native.tracks_csv())
    return Drive(native.camera(), native.vehicles(), facts, tables, native, None)
