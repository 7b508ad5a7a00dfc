"""Training of the vehicle network."""

import argparse
import math
import time
from pathlib import Path

import numpy as np
import torch

from motorcade_training.common import checkpoint, log
from motorcade_training.common.device import has_fast_bf16, pick_device
from motorcade_training.common.ema import Ema
from motorcade_training.common.schedule import Budget, Cosine
from motorcade_training.common.seeds import generator, seed_everything
from motorcade_training.vehicle.augment import NONE, Strength, augment
from motorcade_training.vehicle.data import CropSet
from motorcade_training.vehicle.layout import HEAT_CELLS, VISIBLE
from motorcade_training.vehicle.loss import losses
from motorcade_training.vehicle.model import VehicleNet, parameters


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of `train vehicle`."""
    parser.add_argument("--data", type=Path, nargs="+", required=True, help="folders of crops")
    parser.add_argument("--out", type=Path, default=Path("work/vehicle"), help="checkpoint, log and curve go here")
    parser.add_argument("--resume", type=Path, help="checkpoint to start from; last.pt of --out when it exists")
    parser.add_argument("--minutes", type=float, help="budget of wall clock")
    parser.add_argument("--steps", type=int, help="budget of steps")
    parser.add_argument("--batch", type=int, default=64)
    parser.add_argument("--rate", type=float, default=2e-3, help="peak learning rate")
    parser.add_argument("--ema", type=float, default=0.998)
    parser.add_argument("--held-out", type=int, default=1024, help="crops at the end that are not trained on")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--device", default="auto")
    parser.add_argument("--log-seconds", type=float, default=60.0)


def optimiser_of(model: torch.nn.Module, rate: float) -> torch.optim.AdamW:
    """AdamW with weight decay on matrices alone."""
    matrices = [p for p in model.parameters() if p.dim() > 1]
    others = [p for p in model.parameters() if p.dim() <= 1]
    groups = [{"params": matrices, "weight_decay": 0.02}, {"params": others, "weight_decay": 0.0}]
    return torch.optim.AdamW(groups, lr=rate)


def run(options: argparse.Namespace) -> None:
    """Trains and writes `last.pt`, `small.pt`, `log.csv`, `curve.svg`."""
    seed_everything(options.seed)
    device = pick_device(options.device, options.threads)
    crops = CropSet(options.data)
    trained = len(crops) - options.held_out
    if trained < options.batch:
        raise ValueError(f"{len(crops)} crops are too few for --held-out {options.held_out} and --batch {options.batch}")
    model = VehicleNet().to(device)
    if device.type == "cpu":
        model = model.to(memory_format=torch.channels_last)
    ema, optimiser = Ema(model, options.ema), optimiser_of(model, options.rate)
    step, spent_s = 0, 0.0
    last = options.out / "last.pt"
    source = options.resume or (last if last.is_file() else None)
    if source:
        state = checkpoint.load(source, model, ema, optimiser)
        step, spent_s = state["step"], state.get("spent_s", 0.0)
    budget = Budget(options.steps, options.minutes, spent_s)
    bf16 = has_fast_bf16(device)
    cosine = Cosine(options.rate)
    rows = log.CsvLog(options.out / "log.csv", step)
    sums, since, told = {}, 0, time.monotonic()
    print(f"{trained} crops, {parameters(model)} weights, step {step}", flush=True)
    while (progress := budget.progress(step)) < 1.0:
        for group in optimiser.param_groups:
            group["lr"] = cosine.rate(progress)
        indices = shuffled(options.seed, step, options.batch, trained)
        random = torch.Generator(device).manual_seed(options.seed * 1_000_003 + step)
        parts = train_step(model, optimiser, crops, indices, random, device, bf16)
        step += 1
        ema.update(model, step)
        for name, value in parts.items():
            sums[name] = sums.get(name, 0.0) + value
        since += 1
        if time.monotonic() - told > options.log_seconds:
            speed = since * options.batch / (time.monotonic() - told)
            held = held_out(ema.module, crops, trained, options.held_out, device)
            means = {name: value / since for name, value in sums.items()}
            rows.write(step=step, rate=cosine.rate(progress), crops_per_s=speed, **means, **held)
            print(f"{progress:.3f} step {step} {speed:.0f}/s {means} {held}", flush=True)
            sums, since = {}, 0
            checkpoint.save(last, model, ema, optimiser, step, spent_s=budget.elapsed_s())
            told = time.monotonic()
    checkpoint.save(last, model, ema, optimiser, step, spent_s=budget.elapsed_s())
    checkpoint.save_small(options.out / "small.pt", ema)
    print(f"done after {step} steps: {held_out(ema.module, crops, trained, options.held_out, device)}", flush=True)
    if (options.out / "log.csv").read_text():
        log.draw(options.out / "log.csv", options.out / "curve.svg", ["heat", "heading", "held_point", "held_heading_deg"])


def shuffled(seed: int, step: int, batch: int, count: int) -> np.ndarray:
    """Indices of a step: every crop once an epoch, in an order of the epoch's own."""
    first = step * batch
    epoch = first // count
    order = generator(seed, "epoch", epoch).permutation(count)
    indices = order[first - epoch * count : first - epoch * count + batch]
    if len(indices) < batch:
        following = generator(seed, "epoch", epoch + 1).permutation(count)
        indices = np.concatenate([indices, following[: batch - len(indices)]])
    return np.sort(indices)


def train_step(
    model: VehicleNet,
    optimiser: torch.optim.Optimizer,
    crops: CropSet,
    indices: np.ndarray,
    random: torch.Generator,
    device: torch.device,
    bf16: bool = False,
) -> dict[str, float]:
    """One step; the parts of the loss before it."""
    model.train()
    sample = augment(crops.batch(indices).to(device), Strength(), random)
    image = sample.input
    if device.type == "cpu":
        image = image.contiguous(memory_format=torch.channels_last)
    with torch.autocast(device.type, dtype=torch.bfloat16, enabled=bf16):
        outputs = model(image)
    parts = losses(tuple(o.float() for o in outputs), sample)
    optimiser.zero_grad(set_to_none=True)
    sum(parts.values()).backward()
    torch.nn.utils.clip_grad_norm_(model.parameters(), 5.0)
    optimiser.step()
    return {name: float(value.detach()) for name, value in parts.items()}


@torch.no_grad()
def held_out(model: VehicleNet, crops: CropSet, first: int, count: int, device: torch.device) -> dict[str, float]:
    """On crops that are not trained on, unvaried: median distance of visible keypoints [share of the crop], median error
    of the heading and the share of reversed ones, accuracy of the body type."""
    points, turns, bodies = [], [], []
    for start in range(first, first + count, 128):
        indices = np.arange(start, min(start + 128, first + count))
        sample = augment(crops.batch(indices), NONE, torch.Generator().manual_seed(0))
        heat, _, heading, body, _, _ = (o.cpu() for o in model(sample.input.to(device)))
        share = torch.softmax(heat.flatten(2), dim=2).view(heat.shape)
        centres = (torch.arange(HEAT_CELLS) + 0.5) / HEAT_CELLS
        x, y = (share.sum(dim=2) * centres).sum(dim=2), (share.sum(dim=3) * centres).sum(dim=2)
        off = torch.hypot(x - sample.keypoints[..., 0], y - sample.keypoints[..., 1])
        points.append(off[sample.sights == VISIBLE])
        angle = torch.softmax(heading, dim=1).argmax(dim=1) * (2 * math.pi / heading.shape[1])
        turn = torch.remainder(angle - sample.heading_rad + math.pi, 2 * math.pi) - math.pi
        turns.append(turn.abs())
        bodies.append((body.argmax(dim=1) == sample.body).float())
    turn = torch.cat(turns)
    return {
        "held_point": float(torch.cat(points).median()),
        "held_heading_deg": math.degrees(float(turn.median())),
        "held_reversed": float((turn > math.pi / 2).float().mean()),
        "held_body": float(torch.cat(bodies).mean()),
    }
