"""Subcommands of the scene network."""

import argparse
from pathlib import Path

from motorcade_training.common.stage import Stage

WORK = Path("work/scene")


def _data_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--images", type=Path, help="folder of images of one size, or of images/ and boxes.csv")
    parser.add_argument("--models", type=Path, help="folder of the teachers' ONNX files; needed with --images")
    parser.add_argument("--rows", type=int, nargs=2, default=(64, 320), help="rows searched for vehicles by the teacher [px]")
    parser.add_argument("--no-mirror", action="store_true", help="teachers do not look at mirror images: half the time")
    parser.add_argument("--simulator", type=Path, help="motorcade binary; renders need it")
    parser.add_argument("--render-frames", type=int, default=480, help="rendered pictures")
    parser.add_argument("--frames-per-drive", type=int, default=6, help="pictures of one simulated drive")
    parser.add_argument("--workers", type=int, default=1, help="processes of the teachers and of the simulator")
    parser.add_argument("--seed", type=int, default=1, help="seed of the renders")
    parser.add_argument("--out", type=Path, default=WORK / "data", help="folder of the sources")


def _make_data(options: argparse.Namespace) -> None:
    from motorcade_training.scene.make_data import DataOptions, make_data

    if options.images and not options.models:
        raise ValueError("--images needs --models")
    make_data(
        DataOptions(
            images=options.images,
            models=options.models,
            simulator=options.simulator,
            out=options.out,
            rows=tuple(options.rows),
            mirror=not options.no_mirror,
            workers=options.workers,
            render_frames=options.render_frames,
            frames_per_drive=options.frames_per_drive,
            seed=options.seed,
        )
    )


def _train_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--data", type=Path, default=WORK / "data", help="folder that make-data has filled")
    parser.add_argument("--out", type=Path, default=WORK / "run", help="folder of log, curve and checkpoint; resumes from it")
    parser.add_argument("--start", type=Path, help="checkpoint whose weights a new training starts from")
    parser.add_argument("--steps", type=int, help="length in steps")
    parser.add_argument("--minutes", type=float, help="length in minutes of wall clock; the learning rate follows the clock")
    parser.add_argument("--batch", type=int, default=16, help="crops a step")
    parser.add_argument("--rate", type=float, default=2.5e-3, help="largest learning rate")
    parser.add_argument("--renders", type=float, default=0.25, help="share of rendered crops")
    parser.add_argument("--seed", type=int, default=1, help="seed of weights and crops")
    parser.add_argument("--device", default="auto", help="auto, cpu, cuda")
    parser.add_argument("--threads", type=int, default=1, help="threads of PyTorch on the CPU")
    parser.add_argument("--workers", type=int, default=1, help="processes that make crops; 0 for none")
    parser.add_argument("--validate-every", type=int, default=400, help="steps between validations")
    parser.add_argument("--reuse", type=int, default=1, help="steps to each batch of new crops; for a GPU, which learns faster than crops are made")


def _train(options: argparse.Namespace) -> None:
    from motorcade_training.scene import cutout
    from motorcade_training.scene.source import Source
    from motorcade_training.scene.train import TrainOptions, train

    sources, validation = [], None
    if (options.data / "real").is_dir():
        sources.append((Source(options.data / "real", "train"), 1 - options.renders))
        validation = Source(options.data / "real", "validate")
    if (options.data / "renders").is_dir() and options.renders > 0:
        sources.append((Source(options.data / "renders", "all"), options.renders))
    if not sources:
        raise ValueError(f"{options.data}: holds neither real/ nor renders/; run make-data first")
    cutouts = options.data / "cutouts.npz"
    train(
        sources,
        validation,
        TrainOptions(
            out=options.out,
            steps=options.steps,
            minutes=options.minutes,
            batch=options.batch,
            rate=options.rate,
            seed=options.seed,
            device=options.device,
            threads=options.threads,
            workers=options.workers,
            reuse=options.reuse,
            validate_every=options.validate_every,
            start=options.start,
        ),
        cutouts=cutout.load(cutouts) if cutouts.is_file() else None,
    )


def _evaluate_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--network", type=Path, required=True, help="ONNX file of the network")
    parser.add_argument("--frames", type=Path, required=True, help="folder of pictures named by frame number")
    parser.add_argument("--first", type=int, default=0, help="first frame")
    parser.add_argument("--last", type=int, default=10**9, help="last frame")
    parser.add_argument("--size", type=int, nargs=2, default=(256, 832), help="height and width of the network's input [px]")
    parser.add_argument("--detections", type=Path, help="CSV of the boxes: frame,x1,y1,x2,y2,score")
    parser.add_argument("--models", type=Path, help="folder of the teachers: the road is compared with theirs")
    parser.add_argument("--teacher-detections", type=Path, help="CSV of YOLOX-Nano's boxes at the pictures' own size")
    parser.add_argument("--camera", type=float, nargs=4, metavar=("F", "CX", "CY", "H"), help="focal length, centre [px], height [m]: own lane")
    parser.add_argument("--every", type=int, default=1, help="of so many frames one is compared with the road's teacher")


def _evaluate(options: argparse.Namespace) -> None:
    from motorcade_training.scene.evaluate import Camera, EvaluateOptions, evaluate

    evaluate(
        EvaluateOptions(
            network=options.network,
            frames=options.frames,
            first=options.first,
            last=options.last,
            size=tuple(options.size),
            detections=options.detections,
            models=options.models,
            teacher_detections=options.teacher_detections,
            camera=Camera(*options.camera) if options.camera else None,
            every=options.every,
        )
    )


def _export_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--checkpoint", type=Path, default=WORK / "run" / "last.pt", help="checkpoint, small or whole")
    parser.add_argument("--out", type=Path, required=True, help="ONNX file")
    parser.add_argument("--full", action="store_true", help="store weights as f32 instead of f16")


def _export(options: argparse.Namespace) -> None:
    from motorcade_training.scene.export import TOLERANCE, export_scene, load_network

    difference = export_scene(load_network(options.checkpoint), options.out, not options.full)
    print(f"{options.out}: {options.out.stat().st_size} bytes, largest difference to PyTorch {difference:.1e}")
    if difference > TOLERANCE:
        raise ValueError(f"the file differs from PyTorch by more than {TOLERANCE}")


STAGES: dict[str, Stage] = {
    "make-data": Stage("label images with the teachers, render and label drives", _data_arguments, _make_data),
    "train": Stage("train the scene network; resumes from --out", _train_arguments, _train),
    "evaluate": Stage("write detections and compare the road with the teacher's", _evaluate_arguments, _evaluate),
    "export": Stage("write the averaged network as ONNX", _export_arguments, _export),
}
