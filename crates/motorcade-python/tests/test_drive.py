"""Drives of files: arrays, tables, files."""

import json
import re
import subprocess

import numpy as np
import pytest

import motorcade

# As scripts/same_bytes.py: what holds times, the command line and the version.
IGNORED_KEYS = {"timings", "files", "command", "configuration", "version", "fingerprint", "perception"}


def contents(directory):
    """Every file of a run, with run.json and the report freed of what changes from run to run."""
    out = {}
    for path in sorted(directory.rglob("*")):
        if path.is_dir():
            continue
        content = path.read_bytes()
        if path.name == "report.html":
            content, cut = re.subn(rb"<h2>(Timings|Settings)</h2>.*?</section>", b"", content, flags=re.DOTALL)
            assert cut == 2 and len(content) > 10_000
        if path.name == "run.json":
            record = json.loads(content)
            content = {key: value for key, value in record.items() if key not in IGNORED_KEYS}
        out[str(path.relative_to(directory))] = content
    return out


def test_arrays_have_the_documented_shapes(drive):
    n = len(drive)
    assert n == 24
    assert drive.poses.shape == (n, 4, 4) and drive.pose_covariances.shape == (n, 6, 6)
    for array in (drive.times_s, drive.times_ns, drive.frame_numbers, drive.speeds_mps, drive.status):
        assert array.shape == (n,)
    assert drive.positions_m.shape == (n, 3) and drive.poses.dtype == np.float64
    rotations = drive.poses[:, :3, :3]
    np.testing.assert_allclose(rotations @ rotations.transpose(0, 2, 1), np.tile(np.eye(3), (n, 1, 1)), atol=1e-9)
    np.testing.assert_array_equal(drive.poses[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)))
    np.testing.assert_allclose(drive.pose_covariances, drive.pose_covariances.transpose(0, 2, 1), atol=1e-12)
    assert drive.height_m == 1.65 and drive.camera.width == 400 and drive.tracked_share > 0.8
    assert abs(drive.length_m - 18.4) < 2.0


def test_vehicles_have_a_state_a_frame(drive):
    assert drive.vehicles
    for vehicle in drive.vehicles:
        m = len(vehicle)
        assert vehicle.poses.shape == (m, 4, 4) and vehicle.covariances.shape == (m, 6, 6)
        assert vehicle.size_m.shape == vehicle.size_sigma_m.shape == (3,)
        assert vehicle.boxes_px.shape == (m, 4) and vehicle.positions_m.shape == (m, 3)
        for array in (vehicle.speeds_mps, vehicle.speed_sigmas_mps, vehicle.scores, vehicle.sources, vehicle.times_s):
            assert array.shape == (m,)
        np.testing.assert_array_equal(drive.frame_numbers[vehicle.rows], vehicle.frames)
        assert 0.0 <= vehicle.p_moving <= 1.0 and vehicle.moving == (vehicle.p_moving > 0.5)
        assert drive.vehicle(vehicle.id) is vehicle
    with pytest.raises(KeyError):
        drive.vehicle(10_000)


def test_saved_files_are_those_of_the_program(arguments, saved, program, tmp_path):
    command = [program, "run", arguments["input"], "--sequence", arguments["sequence"], "--models", "none"]
    command += ["--detections", arguments["detections"], "--road-masks", arguments["road_masks"]]
    command += ["--set", "run.fixed_regions=false", "--out", tmp_path / "run", "--progress", "none"]
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
    own, programs = contents(saved), contents(tmp_path / "run")
    assert own.keys() == programs.keys() and len(own) >= 10 and "report.html" in own
    for name in own:
        assert own[name] == programs[name], name


def test_a_saved_run_can_be_repeated_by_its_command(saved, program, tmp_path):
    command = json.loads((saved / "run.json").read_text())["command"]
    assert command[:2] == ["motorcade", "run"]
    again = [program, *command[1:], "--out", str(tmp_path / "run"), "--progress", "none"]
    subprocess.run(again, check=True, stdout=subprocess.DEVNULL)
    assert contents(saved) == contents(tmp_path / "run")


def test_a_saved_run_is_read_back(drive, saved, tmp_path):
    loaded = motorcade.load(saved)
    assert loaded.directory == saved and len(loaded) == len(drive) and str(loaded) == str(drive)
    np.testing.assert_allclose(loaded.poses, drive.poses, atol=1e-8)
    np.testing.assert_allclose(loaded.pose_covariances, drive.pose_covariances, rtol=1e-12)
    np.testing.assert_array_equal(loaded.times_ns, drive.times_ns)
    np.testing.assert_array_equal(loaded.speeds_mps, drive.speeds_mps)
    assert loaded.height_m == drive.height_m and loaded.camera == drive.camera and loaded.warnings == drive.warnings
    for one, other in zip(loaded.vehicles, drive.vehicles, strict=True):
        assert (one.id, one.class_name) == (other.id, other.class_name)
        np.testing.assert_allclose(one.poses, other.poses, atol=1e-5)
        np.testing.assert_allclose(one.size_sigma_m, other.size_sigma_m, atol=1e-6)
        known = ~np.isnan(one.covariances)
        assert known.sum() == 4 * len(one)
        np.testing.assert_allclose(one.covariances[known], other.covariances[known], atol=1e-4)
    loaded.save(tmp_path / "copy")
    assert contents(tmp_path / "copy") == contents(saved)
    with pytest.raises(motorcade.SettingsError, match="not empty"):
        loaded.save(tmp_path / "copy")


def test_nothing_is_overwritten_without_being_asked(drive, tmp_path):
    report = tmp_path / "report.html"
    drive.report(report)
    assert report.read_text().startswith("<!doctype html>")
    with pytest.raises(motorcade.SettingsError, match="force=True"):
        drive.report(report)
    drive.report(report, force=True)
    drive.save(tmp_path / "run")
    with pytest.raises(motorcade.SettingsError, match="force=True"):
        drive.save(tmp_path / "run")
    drive.save(tmp_path / "run", force=True)
    (tmp_path / "run" / "mine.txt").write_text("mine")
    with pytest.raises(motorcade.SettingsError, match="mine.txt"):
        drive.save(tmp_path / "run", force=True)


@pytest.mark.parametrize("library", ["pandas", "polars", "pyarrow"])
def test_tables_are_those_of_the_files(drive, saved, library):
    pytest.importorskip(library)
    tables = {"pandas": drive.to_pandas, "polars": drive.to_polars, "pyarrow": drive.to_arrow}[library]()
    for name, table in zip(("frames", "tracks"), tables, strict=True):
        head, *rows = (saved / f"{name}.csv").read_text().splitlines()
        names = table.column_names if library == "pyarrow" else list(table.columns)
        assert names == head.split(",") and len(table) == len(rows)
        column = [float(row.split(",")[names.index("speed_mps")]) for row in rows]
        np.testing.assert_array_equal(np.asarray(table["speed_mps"]), column)
    assert tables.tracks is tables[1]


def test_numbers_reach_arrow_without_a_copy(drive):
    pytest.importorskip("pyarrow")
    for columns, table in zip(drive.tables, drive.to_arrow(), strict=True):
        shared = {
            name
            for name, column in columns.items()
            if table[name].num_chunks == 1 and table[name].chunk(0).buffers()[1].address == column.ctypes.data
        }
        # Arrow packs truth values into bits, and texts are lists on the way.
        assert shared == {name for name, column in columns.items() if column.dtype.kind in "fi"} and len(shared) > 5


def test_an_online_run_is_another_one(arguments, drive):
    settings = {**arguments, "online": True}
    online = motorcade.run(**settings)
    assert len(online) == len(drive) and not np.array_equal(online.poses, drive.poses)


def test_runs_do_not_depend_on_threads_and_seeds_do_count(arguments, drive):
    one = motorcade.run(**arguments, threads=1)
    np.testing.assert_array_equal(one.poses, drive.poses)


def test_evaluation(drive, saved, simulation):
    in_memory = motorcade.evaluate(drive, kitti=simulation.training)
    read = motorcade.evaluate(saved, kitti=simulation.training, sequence="0000", camera=2, first=0)
    assert in_memory.data == read.data and str(read).startswith("KITTI tracking 0000")
    assert 0.0 <= read["ego"]["ate_se3_m"] < 1.0 and "ATE" in repr(read)


def test_what_perception_saw_is_kept_on_request(arguments, tmp_path):
    motorcade.run(**arguments, frames=(0, 6), keep_perception=True).save(tmp_path / "run")
    assert (tmp_path / "run" / "perception.jsonl").stat().st_size > 0
    assert len(motorcade.load(tmp_path / "run")) == 6


def test_a_camera_may_be_given_in_any_form(simulation, arguments, drive, tmp_path):
    camera = drive.camera
    toml = tmp_path / "camera.toml"
    toml.write_text(camera.to_toml())
    assert motorcade.Camera.read(toml) == camera
    folder = simulation.training / "image_02" / simulation.sequence
    rest = {key: value for key, value in arguments.items() if key not in ("input", "sequence")}
    fields = {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}
    runs = [motorcade.run(folder, camera=c, height_m=1.65, frames="0..5", **rest) for c in (camera, toml, str(toml), fields)]
    for run in runs:
        np.testing.assert_array_equal(run.poses, runs[0].poses)
    rig = motorcade.run(**arguments, camera=2, frames=(None, 5))
    np.testing.assert_allclose(rig.poses, runs[0].poses, atol=1e-6)


def test_tables_of_many_runs(drive, saved, tmp_path):
    import pandas
    import polars

    drive.save(tmp_path / "second", parquet=True)
    motorcade.tables([saved, tmp_path / "second"], tmp_path / "tables")
    tracks = pandas.read_parquet(tmp_path / "tables" / "tracks")
    assert len(tracks) == 2 * len(drive.tables.tracks["frame"]) and set(tracks["drive_id"]) == {"run", "second"}
    frames = polars.read_parquet(tmp_path / "second" / "frames.parquet")
    np.testing.assert_array_equal(frames["speed_mps"].to_numpy(), drive.speeds_mps)
    np.testing.assert_array_equal(frames["timestamp_ns"].to_numpy(), drive.times_ns)
    np.testing.assert_allclose(frames.select("x_m", "y_m", "z_m").to_numpy(), drive.positions_m, atol=1e-8)
    drives = polars.read_parquet(tmp_path / "tables" / "drives.parquet")
    assert drives["frames"].to_list() == [len(drive)] * 2 and drives["length_m"].to_list() == [drive.length_m] * 2
    with pytest.raises(motorcade.SettingsError, match="same name"):
        motorcade.tables([saved, saved], tmp_path / "other")
    with pytest.raises(motorcade.InputError, match="nowhere"):
        motorcade.tables([tmp_path / "nowhere"], tmp_path / "other")
    with pytest.raises(motorcade.SettingsError, match="force=True"):
        motorcade.tables([saved], tmp_path / "tables")
    with pytest.raises(motorcade.SettingsError, match="motorcade.tables"):
        motorcade.load(saved).save(tmp_path / "copy", parquet=True)
    assert not (tmp_path / "other").exists() and not (tmp_path / "copy").exists()
