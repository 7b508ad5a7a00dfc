"""Errors, interruption, progress, settings, simulated drives."""

import logging
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

import motorcade


@pytest.mark.parametrize(
    ("change", "kind", "said"),
    [
        ({"input": "nowhere"}, motorcade.InputError, "nowhere"),
        ({"roads": {"far_heights": 9}}, motorcade.SettingsError, "did you mean `road`"),
        ({"road": {"far_height": 9}}, motorcade.SettingsError, "did you mean `far_heights`"),
        ({"road": {"far_heights": 1}}, motorcade.SettingsError, "more than 4"),
        ({"road": {"far_heights": object()}}, motorcade.SettingsError, "object"),
        ({"preset": "best"}, motorcade.SettingsError, "default, paper"),
        ({"config": "nowhere.toml"}, motorcade.InputError, "nowhere.toml"),
        ({"height_m": "high"}, motorcade.SettingsError, "height_m"),
        ({"height_m": 1e9}, motorcade.SettingsError, "height"),
        ({"height_m": "auto", "online": True}, motorcade.SettingsError, "online"),
        ({"frames": "5..2"}, motorcade.SettingsError, "frames"),
        ({"frames": (9000, 9100)}, motorcade.Error, "9000"),
        ({"stride": 0}, motorcade.SettingsError, "stride"),
        ({"threads": -1}, motorcade.SettingsError, "threads"),
        ({"format": "film"}, motorcade.SettingsError, "film"),
        ({"sequence": "0077"}, motorcade.InputError, "0077"),
        ({"models": "nowhere"}, motorcade.InputError, "nowhere"),
        ({"detections": "nowhere.txt"}, motorcade.InputError, "nowhere.txt"),
        ({"trajectory": "nowhere.txt"}, motorcade.InputError, "nowhere.txt"),
        ({"trajectory_scale": "feet"}, motorcade.SettingsError, "metric"),
        ({"progress": 3}, motorcade.SettingsError, "progress"),
        ({"camera": 3.5}, motorcade.SettingsError, "path"),
    ],
)
def test_errors_say_what_is_wrong(arguments, change, kind, said):
    with pytest.raises(kind, match=said) as error:
        motorcade.run(**{**arguments, **change})
    assert isinstance(error.value, motorcade.Error) and "--" not in str(error.value)


def test_errors_of_other_calls(tmp_path, simulation):
    for call, kind in [
        (lambda: motorcade.load(tmp_path), motorcade.InputError),
        (lambda: motorcade.evaluate(tmp_path, kitti=tmp_path), motorcade.SettingsError),
        (lambda: motorcade.evaluate(tmp_path, kitti=tmp_path, sequence="0000"), motorcade.InputError),
        (lambda: motorcade.Camera.read(tmp_path / "none.toml"), motorcade.InputError),
        (lambda: motorcade.simulate("moon", tmp_path / "x"), motorcade.SettingsError),
        (lambda: motorcade.simulate("demo", tmp_path / "x", width=3), motorcade.SettingsError),
        (lambda: motorcade.simulate("demo", tmp_path / "x", weather="hail"), motorcade.SettingsError),
        (lambda: motorcade.simulate("demo", simulation.training, frames=2), motorcade.SettingsError),
    ]:
        with pytest.raises(kind):
            call()
    assert not (tmp_path / "x").exists()


def test_progress_is_reported_and_may_raise(arguments):
    events = []
    motorcade.run(**arguments, progress=lambda *what: events.append(what))
    assert ("odometry", 24, 24) in events and ("graph", 0, None) in events

    class Enough(Exception):
        pass

    def stop(stage, done, total):
        if done >= 3:
            raise Enough

    start = time.monotonic()
    with pytest.raises(Enough):
        motorcade.run(**arguments, progress=stop)
    assert time.monotonic() - start < 30
    pytest.importorskip("tqdm")
    assert len(motorcade.run(**arguments, frames=(0, 4), progress=True)) == 4


def test_warnings_are_logged(arguments, caplog):
    with caplog.at_level(logging.WARNING, logger="motorcade"):
        drive = motorcade.run(**{**arguments, "height_m": 8.0}, frames=(0, 5))
    assert drive.warnings and caplog.records


def interrupted(call, after_s):
    """Seconds from Ctrl-C to the exception."""
    sent = []
    # A shell that starts this in the background leaves Ctrl-C ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)

    def send():
        time.sleep(after_s)
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=send)
    thread.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            call()
    finally:
        thread.join()
    return time.monotonic() - sent[0]


def test_ctrl_c_stops_a_run_within_a_frame(simulation, arguments):
    class Slow:
        def detect(self, image):
            time.sleep(0.2)
            return []

    rest = {key: value for key, value in arguments.items() if key != "detections"}
    for threads in (1, 2):
        assert interrupted(lambda: motorcade.run(**rest, detector=Slow(), threads=threads), 1.0) < 2.0


def test_ctrl_c_stops_a_simulation_and_leaves_nothing(tmp_path):
    out = tmp_path / "drive"
    assert interrupted(lambda: motorcade.simulate("dense", out, frames=600, width=640), 1.0) < 5.0
    assert not out.exists() and not list(tmp_path.iterdir())


def test_a_simulation_is_the_same_for_the_same_seed(simulation, tmp_path):
    again = motorcade.simulate("demo", tmp_path / "again", frames=24, width=400, seed=3)
    name = f"image_02/{again.sequence}/000007.png"
    assert (again.training / name).read_bytes() == (simulation.training / name).read_bytes()
    assert "demo" in motorcade.scenarios() and simulation.labels > 0


def test_settings_are_printed_with_their_documentation(tmp_path):
    text = motorcade.settings_text(preset="paper", road={"far_heights": 12})
    assert "far_heights = 12" in text and text.count("#") > 100
    path = tmp_path / "settings.toml"
    path.write_text(text)
    assert motorcade.settings_text(config=path) == text


def test_help_says_what_there_is():
    assert "run(" not in motorcade.__doc__.splitlines()[0] and len(motorcade.__doc__) > 1500
    for name in motorcade.__all__:
        thing = getattr(motorcade, name)
        assert thing.__doc__ and len(thing.__doc__) > 20, name
        for member in vars(thing) if isinstance(thing, type) and not issubclass(thing, tuple) else []:
            if not member.startswith("_") and callable(getattr(thing, member)) and name not in ("Detector",):
                assert getattr(thing, member).__doc__, f"{name}.{member}"


def test_importing_is_quick_and_loads_no_table_library():
    code = "import sys, motorcade; print([m for m in ('pandas', 'polars', 'pyarrow', 'tqdm') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_messages_name_arguments_but_leave_names_of_files(tmp_path):
    odd = tmp_path / "a--out--force.mp4"
    with pytest.raises(motorcade.InputError) as raised:
        motorcade.run(odd, camera=tmp_path / "x--height.toml", height_m=1.5, models="none")
    assert "a--out--force.mp4" in str(raised.value) or "x--height.toml" in str(raised.value)
    used = tmp_path / "used"
    used.mkdir()
    (used / "something").write_text("of the user")
    with pytest.raises(motorcade.SettingsError) as raised:
        motorcade.simulate("demo", used, frames=2, width=200)
    assert "--" not in str(raised.value)
