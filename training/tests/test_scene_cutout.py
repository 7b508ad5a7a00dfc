import numpy as np

from motorcade_training.scene import cutout
from motorcade_training.scene.classes import CAR
from motorcade_training.scene.cutout import Cutout, Scene, load, park, put, save


def red_car(height: int = 40, width: int = 60) -> Cutout:
    image = np.zeros((height, width, 4), np.uint8)
    image[4:, 3:-3] = (230, 20, 20, 255)
    return Cutout(image, CAR, 1.5)


def grey_scene(boxes=()) -> Scene:
    boxes = np.array(boxes, np.float32).reshape(-1, 4)
    return Scene(np.full((192, 352, 3), 120, np.uint8), np.full((192, 352), 255, np.uint8), boxes, np.full(len(boxes), CAR))


def test_cutouts_survive_the_file(tmp_path):
    cutouts = [red_car(), red_car(30, 70)]
    save(cutouts, tmp_path / "cutouts.npz")
    for given, found in zip(cutouts, load(tmp_path / "cutouts.npz"), strict=True):
        assert np.array_equal(given.image, found.image)
        assert (given.kind, given.height_m) == (found.kind, found.height_m)


def test_a_vehicle_fills_its_box_and_is_no_road():
    scene = grey_scene()
    put(scene, red_car(), np.array([100, 60, 160, 100], np.float32), 1.0, np.random.default_rng(1))
    assert scene.kinds.tolist() == [CAR]
    red = (scene.image[..., 0] > 200) & (scene.image[..., 1] < 60)
    rows, columns = np.flatnonzero(red.any(1)), np.flatnonzero(red.any(0))
    assert 100 <= columns[0] <= 105 and 155 <= columns[-1] < 160 and rows[-1] == 99
    assert (scene.road[red] == 0).all() and (scene.road[:50] == 255).all()


def test_nearer_vehicles_stay_in_front_and_covered_ones_are_ignored():
    near = grey_scene([[90, 50, 170, 120]])
    put(near, red_car(), np.array([100, 60, 160, 100], np.float32), 1.0, np.random.default_rng(1))
    assert len(near.kinds) == 1 and (near.image == 120).all()
    far = grey_scene([[120, 70, 140, 90]])
    put(far, red_car(), np.array([100, 60, 160, 100], np.float32), 1.0, np.random.default_rng(1))
    assert far.kinds.tolist() == [-1, CAR]


def test_rows_stand_on_the_ground_and_grow_towards_the_camera():
    drawn = 0
    for seed in range(30):
        scene = grey_scene()
        park(scene, (176.0, 60.0), [red_car()], np.random.default_rng(seed))
        inside = scene.boxes[(scene.boxes[:, 0] > 0) & (scene.boxes[:, 2] < 352) & (scene.boxes[:, 3] < 192)]
        drawn += len(inside)
        # A lower edge that is lower in the picture belongs to a nearer, larger vehicle.
        heights, depths = inside[:, 3] - inside[:, 1], inside[:, 3] - 60.0
        scale = heights.sum() / depths.sum() if len(inside) else 1.0
        # Boxes end at whole pixels.
        assert scale > 0.5 and (np.abs(heights - scale * depths) < 2.0).all()
        assert len(inside) <= cutout.MOST
    assert drawn > 20
