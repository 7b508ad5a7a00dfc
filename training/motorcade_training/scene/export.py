"""ONNX file of a trained scene network."""

from pathlib import Path

import torch

from motorcade_training.common import checkpoint
from motorcade_training.common.export import export, largest_difference, round_weights_to_half
from motorcade_training.scene.model import Exported, SceneNetwork, Shape

OUTPUTS = ["boxes8", "boxes16", "road"]
#: Largest difference between the file and PyTorch in scores and probabilities, and in distances relative to 100 px.
TOLERANCE = 1e-4


def load_network(path: Path) -> SceneNetwork:
    """The averaged network of a checkpoint, small or whole, ready to run."""
    state = checkpoint.read(path)
    network = SceneNetwork(Shape.from_dict(state["shape"]))
    network.load_state_dict({k: v.float() if v.dtype == torch.float16 else v for k, v in state["ema"].items()})
    return network.eval()


def export_scene(network: SceneNetwork, path: Path, half: bool = True) -> float:
    """Writes the file with open height and width; the largest difference to PyTorch."""
    network.eval().fuse()
    if half:
        round_weights_to_half(network)
    model = Exported(network)
    inputs = {"image": torch.rand(1, 3, 128, 160, generator=torch.Generator().manual_seed(1))}
    open_sizes = {"image": {2: "height", 3: "width"}}
    for name, stride in zip(OUTPUTS, (8, 16, 4)):
        open_sizes[name] = {2: f"height/{stride}", 3: f"width/{stride}"}
    export(model, inputs, OUTPUTS, path, half, open_sizes=open_sizes)
    other = {"image": torch.rand(1, 3, 64, 96, generator=torch.Generator().manual_seed(2))}
    return max(largest_difference(path, model, x, relative_to=100.0) for x in (inputs, other))
