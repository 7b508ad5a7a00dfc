"""The simulator's crops, read from disk."""

import json
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import torch

from motorcade_training.vehicle.layout import BODIES


@dataclass
class Batch:
    """Crops with labels, before augmentation; coordinates are pixels of the stored crop."""

    #: (N, S, S, 3) u8.
    crops: torch.Tensor
    #: (N, 36, 2).
    keypoints: torch.Tensor
    #: (N, 36) states.
    sights: torch.Tensor
    #: (N, 4) x1, y1, x2, y2 edges of the box and of the picture.
    box: torch.Tensor
    picture: torch.Tensor
    #: (N, 2) picture pixels per crop pixel.
    scale: torch.Tensor
    #: (N,).
    focal_px: torch.Tensor
    heading_rad: torch.Tensor
    body: torch.Tensor
    #: (N, 3) length, width, height.
    dimensions_m: torch.Tensor

    def to(self, device: torch.device) -> "Batch":
        """The batch on a device."""
        return Batch(**{field.name: getattr(self, field.name).to(device) for field in fields(self)})


class CropSet:
    """Folders that `motorcade simulate --training vehicle` wrote, one after the other."""

    def __init__(self, folders: list[Path]):
        if not folders:
            raise ValueError("no folder of crops given")
        self.parts = [_Folder(folder) for folder in folders]
        self.starts = np.cumsum([0] + [len(part.crops) for part in self.parts])
        sides = {part.crops.shape[1] for part in self.parts}
        if len(sides) != 1:
            raise ValueError(f"crops of different sizes: {sorted(sides)}")
        self.side_px = sides.pop()

    def __len__(self) -> int:
        return int(self.starts[-1])

    def batch(self, indices: np.ndarray) -> Batch:
        """The crops with these indices."""
        part = np.searchsorted(self.starts, indices, side="right") - 1
        rows = [(self.parts[p], int(i - self.starts[p])) for p, i in zip(part, indices, strict=True)]

        def stack(name: str) -> np.ndarray:
            return np.stack([getattr(folder, name)[i] for folder, i in rows])

        numbers = stack("numbers")
        column = self.parts[0].columns

        def some(*names: str) -> torch.Tensor:
            return torch.from_numpy(numbers[:, [column[n] for n in names]].copy())

        edges = ("x1_px", "y1_px", "x2_px", "y2_px")
        return Batch(
            crops=torch.from_numpy(stack("crops")),
            keypoints=torch.from_numpy(stack("keypoints")),
            sights=torch.from_numpy(stack("sights")),
            box=some(*(f"box_{e}" for e in edges)),
            picture=some(*(f"picture_{e}" for e in edges)),
            scale=some("px_per_crop_x", "px_per_crop_y"),
            focal_px=some("focal_px")[:, 0],
            heading_rad=some("heading_rad")[:, 0],
            body=some("body")[:, 0].long(),
            dimensions_m=some("length_m", "width_m", "height_m"),
        )


class _Folder:
    """Arrays of one folder; the crops stay on disk."""

    def __init__(self, folder: Path):
        description = folder / "crops.json"
        if not description.is_file():
            raise ValueError(f"{folder}: not a folder of crops (no crops.json)")
        told = json.loads(description.read_text())
        if tuple(told["bodies"]) != BODIES:
            raise ValueError(f"{description}: body types {told['bodies']}, expected {list(BODIES)}")
        self.columns = {name: i for i, name in enumerate(told["columns"])}
        self.crops = np.load(folder / "crops.npy", mmap_mode="r")
        self.keypoints = np.load(folder / "keypoints.npy")
        self.sights = np.load(folder / "sights.npy")
        self.numbers = np.load(folder / "numbers.npy")
