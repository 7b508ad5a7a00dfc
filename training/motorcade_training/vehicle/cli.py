"""Subcommands of the vehicle network."""

from motorcade_training.common.stage import Stage
from motorcade_training.vehicle import evaluate, export, make_data, train

STAGES: dict[str, Stage] = {
    "make-data": Stage("render labelled crops", make_data.add_arguments, make_data.run),
    "train": Stage("train on rendered crops", train.add_arguments, train.run),
    "evaluate": Stage("judge headings on KITTI tracking frames", evaluate.add_arguments, evaluate.run),
    "export": Stage("write ONNX", export.add_arguments, export.run),
}
