"""Painted footpaths are no road, begin at a kerb and leave vehicles alone."""

import numpy as np
import pytest

from motorcade_training.scene import footpath, verge
from motorcade_training.scene.ground import Ground
from motorcade_training.scene.texture import Bank

SHAPE = (96, 176)
VANISHING = (88.0, 30.0)


def street() -> tuple[np.ndarray, np.ndarray]:
    """A grey road three camera heights wide to each side, and its probability."""
    ground = Ground.below(VANISHING, *SHAPE)
    road = np.where((ground.rows > 0) & (np.abs(ground.across) < 3), 255, 0).astype(np.uint8)
    image = np.full((*SHAPE, 3), 60, np.uint8)
    image[road > 0] = 110
    return image, road


def test_ground_is_measured_in_camera_heights():
    ground = Ground.below(VANISHING, *SHAPE)
    # 20 px below the vanishing point and 20 px aside: as far aside as the camera is high.
    assert ground.across[50, 108] == pytest.approx(1)
    assert ground.rows[50, 0] == 20 and ground.rows[29, 0] == 0


def test_a_footpath_lies_beyond_its_edge():
    image, _ = street()
    ground = Ground.below(VANISHING, *SHAPE)
    stone = np.full(3, 110, np.float32)
    for seed in range(20):
        random = np.random.default_rng(seed)
        path = footpath.lay(ground, ground.across - 1.5, ground.rows > 0, random)
        assert not path.where[ground.across < 1.5].any()
        picture = image.astype(np.float32)
        footpath.pave(picture, ground, path, np.ones(SHAPE, bool), stone, random)
        # The gutter before the kerb, and the blur of a pixel, alone reach into the road.
        untouched = (ground.across < 1.0) & (ground.rows > 8)
        assert (picture == image)[untouched].all()
        if path.where.sum() > 200:
            assert (picture != image)[path.where].any()


def test_what_is_painted_is_no_road_and_vehicles_stay(monkeypatch):
    monkeypatch.setattr(verge, "FOOTPATH", 1.0)
    monkeypatch.setattr(verge, "NARROWED", 1.0)
    image, road = street()
    boxes, bank = np.array([[120, 40, 150, 60]], np.float32), Bank(3, 4)
    narrower = 0
    for seed in range(12):
        picture, rest = verge.paint(image, road, boxes, VANISHING, bank, np.random.default_rng(seed))
        assert (rest <= road).all()
        hidden = np.zeros(SHAPE, bool)
        hidden[43:58, 123:148] = True
        assert (picture[hidden] == image[hidden]).all() and (rest[hidden] == road[hidden]).all()
        narrower += rest.sum() < 0.95 * road.sum()
        again, _ = verge.paint(image, road, boxes, VANISHING, bank, np.random.default_rng(seed))
        assert (picture == again).all()
    assert narrower >= 6
