import numpy as np

from motorcade_training.scene import clutter
from motorcade_training.scene.texture import Bank


def test_clutter_leaves_vehicles_alone_and_is_no_road(monkeypatch):
    monkeypatch.setattr(clutter, "SHARE", 1.0)
    image = np.random.default_rng(0).integers(100, 140, (96, 160, 3), np.uint8)
    road = np.full((96, 160), 255, np.uint8)
    boxes = np.array([[60, 40, 110, 80]], np.float32)
    bank, changed = Bank(1), 0
    for seed in range(40):
        painted, left = clutter.scatter(image, boxes, road, bank, np.random.default_rng(seed))
        assert np.array_equal(painted[40:80, 60:110], image[40:80, 60:110])
        different = (painted != image).any(2)
        changed += different.sum()
        assert (left[~different] == 255).mean() > 0.98  # equal by chance or at a soft rim
    assert changed > 40 * 100


def test_every_kind_has_its_size(monkeypatch):
    bank = Bank(1)
    for make, *_ in clutter.KINDS:
        for seed in range(20):
            random = np.random.default_rng(seed)
            h, w = int(random.integers(6, 60)), int(random.integers(3, 90))
            picture, cover = make(random, bank, h, w)
            assert picture.shape == (h, w, 3) and cover.shape == (h, w), make.__name__
            assert np.isfinite(picture).all() and cover.max() <= 1 and cover.max() > 0, make.__name__


def test_leaves_hide_a_part_of_a_house():
    bank, hidden = Bank(1), []
    for seed in range(20):
        piece = clutter.house(np.random.default_rng(seed), bank, 60, 90)
        picture, cover = clutter.behind_leaves(np.random.default_rng(seed + 100), bank, piece)
        assert np.array_equal(cover, piece[1])
        hidden.append((picture != piece[0]).any(2).mean())
    assert 0.1 < np.mean(hidden) < 0.9
