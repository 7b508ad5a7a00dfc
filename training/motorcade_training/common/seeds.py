"""Random numbers: one seed, independent streams by name."""

import random
import zlib

import numpy as np
import torch


def seed_everything(seed: int) -> None:
    """Seeds Python, numpy and PyTorch."""
    random.seed(seed)
    np.random.seed(seed % 2**32)
    torch.manual_seed(seed)


def generator(seed: int, name: str, index: int = 0) -> np.random.Generator:
    """A generator that depends on `seed`, `name` and `index` alone: sample `index` is the same in any process and order."""
    return np.random.default_rng([seed, zlib.crc32(name.encode()), index])
