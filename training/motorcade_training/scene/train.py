"""Training of the scene network."""

import math
import time
from dataclasses import dataclass
from pathlib import Path

import torch
from torch.utils.data import DataLoader

from motorcade_training.common import checkpoint, log
from motorcade_training.common.device import has_fast_bf16, pick_device
from motorcade_training.common.ema import Ema
from motorcade_training.common.schedule import Budget, Cosine
from motorcade_training.common.seeds import seed_everything
from motorcade_training.scene.augment import CropOptions
from motorcade_training.scene.cutout import Cutout
from motorcade_training.scene.dataset import Batch, CropStream
from motorcade_training.scene.loss import Losses, scene_loss
from motorcade_training.scene.model import SceneNetwork, Shape
from motorcade_training.scene.replay import replayed
from motorcade_training.scene.source import Source
from motorcade_training.scene.validate import validate


@dataclass(frozen=True)
class TrainOptions:
    """Settings of a training."""

    #: Folder of the log, the curve and the checkpoint `last.pt`, from which it resumes.
    out: Path
    steps: int | None = None
    minutes: float | None = None
    batch: int = 16
    rate: float = 2.5e-3
    weight_decay: float = 0.05
    #: Decay of the averaged weights a step.
    ema: float = 0.998
    seed: int = 1
    device: str = "auto"
    threads: int = 1
    #: Processes that make crops beside the training; 0 for none.
    workers: int = 1
    #: Steps to each batch of new crops; those between learn crops seen before, varied.
    reuse: int = 1
    #: Steps between rows of the log, between checkpoints, and between validations.
    log_every: int = 20
    save_every: int = 200
    validate_every: int = 400
    #: Weights to start from: a checkpoint, small or whole.
    start: Path | None = None


def on_device(batch: Batch, device: torch.device) -> Batch:
    """The batch on a device, pixels still u8."""
    move = lambda x: x.to(device, non_blocking=True)  # noqa: E731
    return Batch(move(batch.images), [move(b) for b in batch.boxes], [move(k) for k in batch.kinds], move(batch.road))


def step(network: SceneNetwork, optimiser: torch.optim.Optimizer, batch: Batch, bf16: bool = False) -> Losses:
    """One step of the optimiser; the losses before it."""
    device = batch.images.device.type
    images = batch.images.float().div_(255).contiguous(memory_format=torch.channels_last)
    with torch.autocast(device, dtype=torch.bfloat16, enabled=bf16):
        heads, road = network(images)
    losses = scene_loss(heads, road, batch)
    optimiser.zero_grad(set_to_none=True)
    losses.total().backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), 10.0)
    optimiser.step()
    return losses


def make_optimiser(network: SceneNetwork, rate: float, weight_decay: float) -> torch.optim.Optimizer:
    """AdamW; biases and normalisations do not decay."""
    decay = [p for p in network.parameters() if p.dim() > 1]
    free = [p for p in network.parameters() if p.dim() <= 1]
    return torch.optim.AdamW([{"params": decay, "weight_decay": weight_decay}, {"params": free, "weight_decay": 0.0}], lr=rate)


def train(
    sources: list[tuple[Source, float]], validation: Source | None, options: TrainOptions, shape: Shape = Shape(), cutouts: list[Cutout] | None = None
) -> SceneNetwork:
    """Trains until the budget ends; the averaged network. `cutouts`: vehicles to park beside roads."""
    seed_everything(options.seed)
    torch.set_flush_denormal(True)
    device = pick_device(options.device, options.threads)
    network = SceneNetwork(shape).to(device, memory_format=torch.channels_last).train()
    if options.start is not None:
        state = checkpoint.read(options.start)
        shape = Shape.from_dict(state["shape"])
        network = SceneNetwork(shape).to(device, memory_format=torch.channels_last).train()
        network.load_state_dict(state["ema"])
    ema = Ema(network, options.ema)
    optimiser = make_optimiser(network, options.rate, options.weight_decay)
    last = options.out / "last.pt"
    first, spent_s = 0, 0.0
    if last.is_file():
        state = checkpoint.load(last, network, ema, optimiser)
        first, spent_s = state["step"], state["spent_s"]
        print(f"resumed at step {first}", flush=True)
    budget = Budget(options.steps, options.minutes, spent_s)
    cosine = Cosine(options.rate)
    stream = CropStream(sources, CropOptions(), options.batch, options.seed, 1 << 30, first // options.reuse, cutouts)
    ahead = {"prefetch_factor": 4} if options.workers else {}
    loader = DataLoader(stream, batch_size=None, shuffle=False, num_workers=options.workers, **ahead)
    rows = log.CsvLog(options.out / "log.csv", first)
    bf16 = has_fast_bf16(device)
    save = lambda number: checkpoint.save(  # noqa: E731
        last, network, ema, optimiser, number, spent_s=budget.elapsed_s(), shape=shape.to_dict(), seed=options.seed
    )
    sums, count, since = [0.0, 0.0, 0.0], 0, time.monotonic()
    quality: dict[str, float] = {"iou": math.nan, "ap50": math.nan}
    number = first
    new = (on_device(batch, device) for batch in loader)
    for number, batch in enumerate(replayed(new, options.reuse, options.seed, first // options.reuse), first):
        progress = budget.progress(number)
        if progress >= 1.0:
            break
        for group in optimiser.param_groups:
            group["lr"] = cosine.rate(progress)
        losses = step(network, optimiser, batch, bf16)
        ema.update(network, number)
        sums = [total + float(part.detach()) for total, part in zip(sums, (losses.score, losses.box, losses.road))]
        count += 1
        done = number + 1
        if validation is not None and done % options.validate_every == 0:
            quality = validate(ema.module, validation, device)
        if done % options.log_every == 0:
            means = dict(zip(("score", "box", "road"), (total / count for total in sums)))
            crops = count * options.batch / (time.monotonic() - since)
            rows.write(step=done, minutes=budget.elapsed_s() / 60, rate=cosine.rate(progress), **means, crops_per_s=crops, **quality)
            print(f"step {done}, {100 * progress:.1f} %, {crops:.1f} crops/s, {means} {quality}", flush=True)
            log.draw(rows.path, options.out / "curve.svg", ["score", "box", "road", "iou", "ap50"])
            sums, count, since, quality = [0.0] * 3, 0, time.monotonic(), dict.fromkeys(quality, math.nan)
        if done % options.save_every == 0:
            save(done)
    save(number)
    checkpoint.save_small(options.out / "scene.pt", ema, shape=shape.to_dict(), seed=options.seed, trained_steps=number)
    return ema.module


