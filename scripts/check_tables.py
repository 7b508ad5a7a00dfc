"""Compares the dataset that `motorcade tables` wrote with the CSV files of its runs, read with pandas, polars and DuckDB.

    python scripts/check_tables.py TABLES RUN...

Needs pandas, pyarrow, polars and duckdb.
"""

import csv
import json
import pathlib
import sys
import time

import duckdb
import pandas
import polars
import pyarrow.parquet

FLAGS = {"true": True, "false": False}


def expected(path):
    """Columns of a CSV file: numbers, flags and text; None for empty cells."""

    def value(cell):
        try:
            return FLAGS[cell] if cell in FLAGS else float(cell)
        except ValueError:
            return cell or None

    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return {name: [value(row[k]) for row in rows[1:]] for k, name in enumerate(rows[0])}


def readers(pattern):
    """The columns of all files of a pattern, by the name of the package that read them; rows by drive, as the files have them."""
    frame = pandas.concat([pandas.read_parquet(path) for path in sorted(pattern.parent.glob(pattern.name))])
    yield "pandas", {name: frame[name].astype(object).where(frame[name].notna(), None).tolist() for name in frame}
    # The folder as one dataset; its order of files is that of their names.
    frame = pandas.read_parquet(pattern.parent)
    yield "pandas, folder", {name: frame[name].astype(object).where(frame[name].notna(), None).tolist() for name in frame}
    yield "polars", polars.read_parquet(pattern).sort("drive_id", maintain_order=True).to_dict(as_series=False)
    lazy = polars.scan_parquet(pattern).collect().sort("drive_id", maintain_order=True)
    yield "polars, lazy", lazy.to_dict(as_series=False)
    table = duckdb.sql(f"SELECT * FROM read_parquet('{pattern}', file_row_number = true) ORDER BY drive_id, file_row_number")
    yield "duckdb", dict(zip(table.columns, map(list, zip(*table.fetchall()))))


def compare(name, runs, tables):
    """One of the two tables of all runs."""
    own = [(run.name, expected(run / f"{name}.csv")) for run in sorted(runs, key=lambda run: run.name)]
    ids = [drive for drive, columns in own for _ in columns["frame"]]
    for reader, found in readers(tables / name / "*.parquet"):
        assert found["drive_id"] == ids, reader
        for column in own[0][1]:
            wanted = [value for _, columns in own for value in columns[column]]
            pairs = zip(wanted, found[column], strict=True)
            different = [(a, b) for a, b in pairs if a != b or isinstance(a, bool) != isinstance(b, bool)]
            assert not different, (reader, name, column, different[:3])
        print(f"{name}, {reader}: {len(ids)} rows, {len(own[0][1])} columns as in the CSV files")


def poses(run, tables):
    """Times and poses of ego.tum, digit by digit."""
    lines = [line.split() for line in (run / "ego.tum").read_text().splitlines() if not line.startswith("#")]
    table = polars.read_parquet(tables / "frames" / f"{run.name}.parquet")
    for k, name in enumerate(["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]):
        assert table[name].to_list() == [float(line[k + 1]) for line in lines], name
    assert table["timestamp_ns"].to_list() == [int(line[0].replace(".", "")) for line in lines]


def metadata(run, tables):
    """Units, conventions, compression and row groups of a minute."""
    for name in ("frames", "tracks"):
        path = tables / name / f"{run.name}.parquet"
        file = pyarrow.parquet.ParquetFile(path)
        for field in file.schema_arrow:
            about = field.metadata or {}
            assert b"description" in about, field.name
            assert field.name[-4:] != "_mps" or about[b"unit"] == b"m/s", field.name
        pairs = duckdb.sql(f"SELECT key, value FROM parquet_kv_metadata('{path}')").fetchall()
        pairs = {bytes(key).decode(): bytes(value).decode() for key, value in pairs}
        assert "x right, y down, z forward" in pairs["world"] and "z up" in pairs["vehicle"]
        assert [c["name"] for c in json.loads(pairs["columns"])] == file.schema_arrow.names
        start = polars.read_parquet(tables / "frames" / f"{run.name}.parquet")["timestamp_ns"][0]
        for k in range(file.num_row_groups):
            minutes = {(t - start) // 60_000_000_000 for t in file.read_row_group(k)["timestamp_ns"].to_pylist()}
            assert len(minutes) == 1, (name, k, minutes)
            assert file.metadata.row_group(k).column(0).compression == "ZSTD"
        sizes = path.stat().st_size, (run / f"{name}.csv").stat().st_size
        print(f"{run.name}, {name}: {file.num_row_groups} row groups, {sizes[0]} bytes, CSV {sizes[1]} bytes")


def drives(runs, tables):
    """The table of drives."""
    rows = {row["drive_id"]: row for row in polars.read_parquet(tables / "drives.parquet").to_dicts()}
    assert set(rows) == {run.name for run in runs}
    for run in runs:
        record, row = json.loads((run / "run.json").read_text()), rows[run.name]
        assert row["frames"] == record["counters"]["frames"] and row["vehicles"] == record["counters"]["vehicles"]
        assert row["length_m"] == record["length_m"] and row["warnings"] == len(record["warnings"])
        assert row["camera_height_m"] == record["camera_height_m"] and row["status"] == "complete"
    joined = duckdb.sql(
        f"SELECT d.drive_id, count(DISTINCT t.id) FROM '{tables}/drives.parquet' d JOIN '{tables}/tracks/*.parquet' t USING (drive_id) GROUP BY 1"
    )
    assert dict(joined.fetchall()) == {name: row["vehicles"] for name, row in rows.items() if row["vehicles"]}
    print(f"drives: {len(rows)} rows as in run.json")


def main():
    tables, *runs = map(pathlib.Path, sys.argv[1:])
    began = time.monotonic()
    for name in ("frames", "tracks"):
        compare(name, runs, tables)
    for run in runs:
        poses(run, tables)
        metadata(run, tables)
    drives(runs, tables)
    print(f"{time.monotonic() - began:.1f} s")


if __name__ == "__main__":
    main()
