"""The examples and the README's snippets run."""

import pathlib
import re
import subprocess
import sys

import pytest

CRATE = pathlib.Path(__file__).resolve().parent.parent
REPOSITORY = CRATE.parents[1]


def example(name, *words):
    command = [sys.executable, CRATE / "examples" / name, *words]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_example_is_here():
    names = {path.name for path in (CRATE / "examples").glob("*.py")}
    assert names == {"drive.py", "evaluate.py", "frames.py", "own_detector.py", "pose_graph.py", "tables.py"}


def test_drive_and_tables(simulation, tmp_path):
    said = example("drive.py", simulation.training, tmp_path / "run", "--sequence", simulation.sequence)
    assert "Drive(24 frames" in said
    pytest.importorskip("pandas")
    assert "m/s on average" in example("tables.py", tmp_path / "run")


def test_frames(simulation):
    pictures = simulation.training / "image_02" / simulation.sequence
    assert "Drive(24 frames" in example("frames.py", pictures, 232.4, 1.65, 10)


def test_own_detector(simulation):
    assert "Drive(24 frames" in example("own_detector.py", simulation.training, simulation.sequence)


def test_evaluate(tmp_path):
    assert "ATE" in example("evaluate.py", tmp_path, 12, 320)


def test_pose_graph():
    assert "converged" in example("pose_graph.py")


@pytest.mark.parametrize("readme", [CRATE / "README.md", REPOSITORY / "README.md"])
def test_the_snippets_of_the_readme_run(readme, simulation, drive, frames, tmp_path, monkeypatch):
    """With the simulated drive in place of `drive.mp4`."""
    import motorcade

    snippets = re.findall(r"```python\n(.*?)```", readme.read_text(encoding="utf-8"), flags=re.S)
    assert snippets
    real = motorcade.run

    def run(input, camera, height_m, **settings):
        assert (input, camera, height_m) == ("drive.mp4", "camera.toml", 1.4)
        return real(simulation.training, sequence=simulation.sequence, frames=(0, 8), **settings)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(motorcade, "run", run)
    (tmp_path / "camera.toml").write_text(frames[0].to_toml())
    names = {"video": [(k, picture) for k, (_, picture) in enumerate(frames[1][:3])], "my_network": lambda image: []}
    for snippet in snippets:
        exec(compile(snippet, str(readme), "exec"), names)
