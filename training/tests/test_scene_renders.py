"""Labels of rendered drives."""

import cv2
import numpy as np

from motorcade_training.scene.classes import CAR
from motorcade_training.scene.cutout import cut_out
from motorcade_training.scene.renders import read_drive


def make_drive(folder):
    """One frame: a car whose pixels are columns 40 to 79 and rows 30 to 59, in a label box 5 px larger on all sides; another that is hidden."""
    root = folder / "training"
    for name in ("image_02", "road_masks", "instance"):
        (root / name / "0000").mkdir(parents=True)
    (root / "label_02").mkdir()
    line = "0 {} Car 0.0 {} 0.0 {} {} {} {} 1.5 1.6 3.9 0 1.65 10 0\n"
    (root / "label_02" / "0000.txt").write_text(line.format(0, 0, 35, 25, 85, 65) + line.format(1, 2, 100, 25, 150, 65))
    image = np.full((96, 200, 3), 90, np.uint8)
    instance = np.zeros((96, 200), np.uint16)
    instance[30:60, 40:80] = 1
    instance[30:60, 100:104] = 2
    for name, picture in (("image_02", image), ("road_masks", image[..., 0]), ("instance", instance)):
        cv2.imwrite(str(root / name / "0000" / "000000.png"), picture)
    return folder


def test_boxes_enclose_what_shows(tmp_path):
    render = next(read_drive(make_drive(tmp_path)))
    assert render.boxes.tolist() == [[40, 30, 80, 60], [100, 25, 150, 65]]
    assert render.kinds.tolist() == [CAR, -1]


def test_cutouts_end_where_the_vehicle_does(tmp_path):
    (cutout,) = cut_out(make_drive(tmp_path))
    assert cutout.image.shape == (30, 40, 4) and (cutout.image[..., 3] == 255).all()
