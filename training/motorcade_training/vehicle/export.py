"""The network as ONNX."""

import argparse
from pathlib import Path

import torch

from motorcade_training.common import checkpoint
from motorcade_training.common import export as onnx_file
from motorcade_training.vehicle.layout import INPUT_PX
from motorcade_training.vehicle.model import OUTPUTS, VehicleNet


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of `export vehicle`."""
    parser.add_argument("--checkpoint", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True, help="the ONNX file")
    parser.add_argument("--full", action="store_true", help="store f32 instead of f16")


def run(options: argparse.Namespace) -> None:
    """Writes the file and prints its largest difference to PyTorch."""
    model = VehicleNet()
    model.load_state_dict({k: v.float() for k, v in checkpoint.read(options.checkpoint)["ema"].items()})
    print(f"largest difference to PyTorch: {export(model, options.out, not options.full):.2e}")


def export(model: VehicleNet, path: Path, half: bool) -> float:
    """Batch normalisation is folded into the convolutions; the batch size is free. Returns the largest difference of
    ONNX Runtime's outputs to PyTorch's with the same (rounded) weights."""
    folded = fold(model.eval())
    if half:
        onnx_file.round_weights_to_half(folded)
    crop = torch.randn(3, 4, INPUT_PX, INPUT_PX, generator=torch.Generator().manual_seed(1))
    axes = {name: {0: "batch"} for name in ["crop", *OUTPUTS]}
    onnx_file.export(folded, {"crop": crop}, OUTPUTS, path, half, open_sizes=axes)
    return onnx_file.largest_difference(path, folded, {"crop": crop})


def fold(model: VehicleNet) -> VehicleNet:
    """A copy whose convolutions hold their batch normalisation; identities take its place."""
    copy = VehicleNet()
    copy.load_state_dict(model.state_dict())
    copy.eval()
    for block in copy.modules():
        children = list(block.children())
        if len(children) == 3 and isinstance(children[1], torch.nn.BatchNorm2d):
            block[0] = torch.nn.utils.fuse_conv_bn_eval(block[0], block[1])
            block[1] = torch.nn.Identity()
    return copy
