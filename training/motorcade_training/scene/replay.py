"""Crops used more than once: where a GPU trains, it learns several times faster than processes make crops."""

from collections.abc import Iterable, Iterator

import torch

from motorcade_training.scene.dataset import Batch

#: Crops kept; a new one takes the place of the oldest.
KEPT = 60_000
#: Largest logarithms of a gain of a crop and of its contrast.
GAIN, CONTRAST = 0.25, 0.2


class Replay:
    """Crops by their size, on the device of the training."""

    def __init__(self, seed: int, kept: int = KEPT):
        self.seed, self.kept = seed, kept
        self.pools: dict[torch.Size, list[tuple[torch.Tensor, ...]]] = {}
        self.places: dict[torch.Size, int] = {}

    def add(self, batch: Batch) -> None:
        """Keeps the crops of a batch."""
        size = batch.images.shape[2:]
        pool, place = self.pools.setdefault(size, []), self.places.get(size, 0)
        for crop in zip(batch.images.unbind(), batch.boxes, batch.kinds, batch.road.unbind()):
            if len(pool) < self.kept:
                pool.append(crop)
            else:
                pool[place % self.kept] = crop
            place += 1
        self.places[size] = place

    def draw(self, size: torch.Size, count: int, number: int) -> Batch:
        """Batch `number`: crops of one size that were added before, varied."""
        random = torch.Generator().manual_seed(self.seed * 1_000_003 + number)
        pool = self.pools[size]
        chosen = [pool[i] for i in torch.randint(len(pool), (count,), generator=random).tolist()]
        images, boxes, kinds, road = (list(column) for column in zip(*chosen))
        return vary(Batch(torch.stack(images), boxes, kinds, torch.stack(road)), random)


def vary(batch: Batch, random: torch.Generator) -> Batch:
    """Half of the crops mirrored; another gain and contrast for each."""
    count, width, device = len(batch.boxes), batch.images.shape[3], batch.images.device
    mirrored = torch.rand(count, generator=random) < 0.5
    chosen = mirrored.to(device)[:, None, None]
    boxes = [torch.stack([width - b[:, 2], b[:, 1], width - b[:, 0], b[:, 3]], 1) if m else b for b, m in zip(batch.boxes, mirrored.tolist())]
    images = torch.where(chosen[..., None], batch.images.flip(3), batch.images).float()
    light = torch.exp((2 * torch.rand(count, 2, 1, 1, 1, generator=random) - 1) * torch.tensor([GAIN, CONTRAST]).view(2, 1, 1, 1)).to(device)
    mean = images.mean(dim=(1, 2, 3), keepdim=True)
    images = ((images - mean) * light[:, 1] + mean) * light[:, 0]
    return Batch(images.round().clamp(0, 255).byte(), boxes, batch.kinds, torch.where(chosen, batch.road.flip(2), batch.road))


def replayed(batches: Iterable[Batch], reuse: int, seed: int, first: int = 0) -> Iterator[Batch]:
    """Each batch, and after it `reuse` - 1 of crops seen before. `first`: number of the first batch that is new."""
    replay = Replay(seed)
    for number, batch in enumerate(batches, first):
        yield batch
        if reuse > 1:
            replay.add(batch)
        for again in range(1, reuse):
            yield replay.draw(batch.images.shape[2:], len(batch.boxes), number * reuse + again)
