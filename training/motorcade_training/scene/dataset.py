"""Stream of training crops: crop `i` depends on the seed and `i` alone, whatever the number of workers."""

from dataclasses import dataclass

import cv2
import numpy as np
import torch
from torch.utils.data import Dataset

from motorcade_training.common.seeds import generator
from motorcade_training.scene.augment import Crop, CropOptions, crop
from motorcade_training.scene.cutout import Cutout
from motorcade_training.scene.source import Source
from motorcade_training.scene.texture import Bank


@dataclass
class Batch:
    """Crops of one step."""

    images: torch.Tensor  #: u8 [B, 3, H, W], RGB
    boxes: list[torch.Tensor]  #: f32 [N, 4] px each
    kinds: list[torch.Tensor]  #: i64 [N] each, -1 to ignore
    road: torch.Tensor  #: f32 [B, H/4, W/4], -1 unknown


class CropStream(Dataset):
    """Batches of crops of several sources, each with its share."""

    def __init__(
        self,
        sources: list[tuple[Source, float]],
        options: CropOptions,
        batch: int,
        seed: int,
        length: int,
        first: int = 0,
        cutouts: list[Cutout] | None = None,
    ):
        """`length`: batches; `first`: number of the first one, to go on where another stream ended; `cutouts`: vehicles to park beside roads."""
        self.sources = [source for source, _ in sources]
        shares = np.array([share for _, share in sources])
        self.shares = shares / shares.sum()
        self.options, self.batch, self.seed, self.length, self.first = options, batch, seed, length, first
        self.cutouts = cutouts or []
        self.bank = Bank(seed)
        cv2.setNumThreads(1)

    def __len__(self) -> int:
        return self.length

    def size(self, number: int) -> tuple[int, int]:
        """Height and width of the crops of batch `number`."""
        return self.options.sizes[number % len(self.options.sizes)]

    def crop(self, index: int, size: tuple[int, int]) -> Crop:
        """Crop number `index`."""
        random = generator(self.seed, "crop", index)
        source = self.sources[int(random.choice(len(self.sources), p=self.shares))]
        return crop(source.draw(random), size, self.options, self.bank, self.cutouts, random)

    def __getitem__(self, number: int) -> Batch:
        batch = self.first + number
        return collate([self.crop(batch * self.batch + i, self.size(batch)) for i in range(self.batch)])


def collate(crops: list[Crop]) -> Batch:
    """Crops of one size as a batch."""
    images = np.stack([c.image for c in crops]).transpose(0, 3, 1, 2)
    return Batch(
        torch.from_numpy(np.ascontiguousarray(images)),
        [torch.from_numpy(c.boxes) for c in crops],
        [torch.from_numpy(c.kinds) for c in crops],
        torch.from_numpy(np.stack([c.road for c in crops])),
    )
