"""ONNX files: export, half-precision storage of weights, comparison with PyTorch."""

import inspect
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper

#: Weights smaller than this stay f32: biases and constants gain nothing.
LEAST_HALF_ELEMENTS = 256


def export(
    model: torch.nn.Module,
    inputs: dict[str, torch.Tensor],
    outputs: list[str],
    path: Path,
    half: bool,
    opset: int = 17,
    open_sizes: dict[str, dict[int, str]] | None = None,
) -> None:
    """Writes `model` (in evaluation mode); `half` stores large weights as f16.

    Sizes are those of `inputs` but for `open_sizes`: by input or output, axis and its name.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    more = {"dynamo": False} if "dynamo" in inspect.signature(torch.onnx.export).parameters else {}
    torch.onnx.export(
        model.eval(),
        tuple(inputs.values()),
        str(path),
        input_names=list(inputs),
        output_names=outputs,
        opset_version=opset,
        do_constant_folding=True,
        dynamic_axes=open_sizes,
        **more,
    )
    graph = onnx.load(str(path))
    if half:
        store_half(graph)
    onnx.checker.check_model(graph)
    onnx.save(graph, str(path))


def store_half(model: onnx.ModelProto) -> None:
    """Stores large f32 weights as f16 with a Cast in front of their use; runtimes fold the Cast when they load."""
    casts = []
    for weight in model.graph.initializer:
        values = numpy_helper.to_array(weight)
        if weight.data_type != TensorProto.FLOAT or values.size < LEAST_HALF_ELEMENTS:
            continue
        name, stored = weight.name, weight.name + "_f16"
        weight.CopyFrom(numpy_helper.from_array(values.astype(np.float16), stored))
        casts.append(helper.make_node("Cast", [stored], [name], to=TensorProto.FLOAT))
    nodes = casts + list(model.graph.node)
    del model.graph.node[:]
    model.graph.node.extend(nodes)


def round_weights_to_half(model: torch.nn.Module) -> None:
    """Rounds the weights that `store_half` stores, so that PyTorch computes the same as the file."""
    with torch.no_grad():
        for parameter in model.parameters():
            if parameter.numel() >= LEAST_HALF_ELEMENTS:
                parameter.copy_(parameter.half().float())


def largest_difference(
    path: Path, model: torch.nn.Module, inputs: dict[str, torch.Tensor], relative_to: float = float("inf")
) -> float:
    """Largest difference between ONNX Runtime and PyTorch over all outputs; values over `relative_to` count relatively to it."""
    import onnxruntime

    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    found = session.run(None, {name: value.numpy() for name, value in inputs.items()})
    with torch.no_grad():
        expected = model.eval()(*inputs.values())
    expected = expected if isinstance(expected, (tuple, list)) else (expected,)
    pairs = [(a, b.numpy()) for a, b in zip(found, expected, strict=True)]
    return max(float((np.abs(a - b) / np.maximum(np.abs(b) / relative_to, 1.0)).max()) for a, b in pairs)
