"""Makes the training data of the scene network: teacher labels of real images, and renders."""

from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from motorcade_training.scene.cutout import Cutout, cut_out, save
from motorcade_training.scene.fuse import fuse_source
from motorcade_training.scene.label import TeacherOptions, label_images
from motorcade_training.scene.renders import Render, read_drive, render
from motorcade_training.scene.source import collect_renders

SUFFIXES = {".webp", ".png", ".jpg", ".jpeg"}


@dataclass(frozen=True)
class DataOptions:
    """Where data comes from and goes to."""

    #: Folder of images of one size, with `boxes.csv` beside `images/` if there are labels.
    images: Path | None
    #: Folder of the teachers' ONNX files.
    models: Path
    #: `motorcade` binary for renders; none without.
    simulator: Path | None
    #: Folder of the sources `real` and `renders`.
    out: Path
    rows: tuple[int, int]
    mirror: bool
    workers: int
    render_frames: int
    frames_per_drive: int
    seed: int


def make_data(options: DataOptions) -> None:
    """Fills `out/real`, `out/renders` and `out/cutouts.npz`. Images labelled before are not labelled again."""
    if options.images is not None:
        folder = options.out / "real"
        if not (folder / "teacher.npz").is_file():
            inside = options.images / "images"
            images = sorted(p for p in (inside if inside.is_dir() else options.images).iterdir() if p.suffix in SUFFIXES)
            if not images:
                raise ValueError(f"{options.images}: no images")
            teacher = TeacherOptions(rows=options.rows, mirror=options.mirror)
            label_images(images, options.models, folder, teacher, options.workers)
        labels = options.images / "boxes.csv"
        fuse_source(folder, labels if labels.is_file() else None)
    if options.simulator is not None:
        folder = options.out / "drives"
        drives = render(options.simulator, folder, options.render_frames, options.frames_per_drive, options.seed, options.workers)
        with get_context("spawn").Pool(options.workers) as pool:
            collect_renders((one for drive in pool.imap(_renders, drives) for one in drive), options.out / "renders")
            save([one for drive in pool.imap(_cutouts, drives) for one in drive], options.out / "cutouts.npz")


def _renders(drive: Path) -> list[Render]:
    return list(read_drive(drive))


def _cutouts(drive: Path) -> list[Cutout]:
    return list(cut_out(drive))
