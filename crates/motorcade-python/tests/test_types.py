"""Types: the package's own, its stub against the native part, and a program that uses it."""

import pathlib
import subprocess
import sys

import pytest

import motorcade

pytest.importorskip("mypy")
PACKAGE = pathlib.Path(motorcade.__file__).parent
CONFIGURATION = pathlib.Path(__file__).resolve().parent.parent / "pyproject.toml"


def run(*words, **more):
    done = subprocess.run([sys.executable, "-m", *map(str, words)], capture_output=True, text=True, **more)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_passes_mypy(tmp_path):
    assert (PACKAGE / "py.typed").exists()
    words = ["--config-file", CONFIGURATION, "--cache-dir", tmp_path / "cache"]
    run("mypy", *words, "-p", "motorcade", cwd=tmp_path)


def test_the_stub_is_that_of_the_native_part(tmp_path):
    run("mypy.stubtest", "motorcade._native", cwd=tmp_path)


def test_programs_that_use_it_are_checked(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "import motorcade\n"
        "drive = motorcade.run('drive.mp4', height_m=1.4, road={'far_heights': 12})\n"
        "reveal_type(drive.poses)\n"
        "speed: float = motorcade.Motorcade(motorcade.Camera(1, 1, 1, 1, 2, 2), 1.4).step(drive.poses, 0).speed_mps\n"
    )
    words = [sys.executable, "-m", "mypy", "--cache-dir", tmp_path / "cache", program]
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, cwd=tmp_path)
    assert "float64" in done.stdout and 'error: Argument 1 to "step"' in done.stdout, done.stdout
