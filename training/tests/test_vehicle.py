"""The vehicle network on a tiny made-up set: seconds, no simulator, no pictures."""

import argparse
import json
import math
from pathlib import Path

import numpy as np
import pytest
import torch

from motorcade_training.common import checkpoint
from motorcade_training.presence import train as presence
from motorcade_training.vehicle import crop, evaluate, export, kitti, train
from motorcade_training.vehicle.augment import NONE, Strength, augment, mirrored
from motorcade_training.vehicle.data import CropSet
from motorcade_training.vehicle.decode import decode_heading, decode_keypoints
from motorcade_training.vehicle.fit import Prior, fit, linearised
from motorcade_training.vehicle.layout import BODIES, HEADING_BINS, MARGIN, MIRROR, OUTSIDE, VISIBLE
from motorcade_training.vehicle.loss import heading_targets, losses
from motorcade_training.vehicle.mirror import with_mirrored
from motorcade_training.vehicle.model import VehicleNet

COLUMNS = [
    *(f"box_{e}_px" for e in ("x1", "y1", "x2", "y2")),
    *(f"picture_{e}_px" for e in ("x1", "y1", "x2", "y2")),
    *("px_per_crop_x", "px_per_crop_y", "focal_px", "heading_rad", "body", "length_m", "width_m", "height_m"),
]
SIDE = 48


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """48 crops whose brightness tells the heading."""
    count, random = 48, np.random.default_rng(1)
    heading = random.uniform(-math.pi, math.pi, count)
    crops = np.zeros((count, SIDE, SIDE, 3), np.uint8)
    crops[:] = (128 + 100 * np.sin(heading))[:, None, None, None]
    keypoints = random.uniform(10, 38, (count, 36, 2)).astype(np.float32)
    numbers = np.zeros((count, len(COLUMNS)), np.float32)
    numbers[:, :4], numbers[:, 4:8] = [8, 8, 40, 40], [-100, -100, 200, 200]
    numbers[:, 8:] = [1.0, 1.0, 700.0, 0.0, 1.0, 4.2, 1.8, 1.5]
    numbers[:, COLUMNS.index("heading_rad")] = heading
    arrays = {"crops": crops, "keypoints": keypoints, "sights": np.zeros((count, 36), np.uint8), "numbers": numbers}
    for name, array in arrays.items():
        np.save(tmp_path / f"{name}.npy", array)
    (tmp_path / "crops.json").write_text(json.dumps({"columns": COLUMNS, "bodies": BODIES}))
    return tmp_path


def random() -> torch.Generator:
    return torch.Generator().manual_seed(3)


def test_one_step_lowers_the_loss(folder: Path):
    torch.manual_seed(1)
    crops, model = CropSet([folder]), VehicleNet()
    sample = augment(crops.batch(np.arange(32)), NONE, random())
    optimiser = train.optimiser_of(model, 1e-3)

    def loss() -> torch.Tensor:
        return sum(losses(model(sample.input), sample).values())

    before = loss()
    before.backward()
    optimiser.step()
    assert loss() < before


def test_training_is_repeatable_and_resumes(folder: Path):
    parser = argparse.ArgumentParser()
    train.add_arguments(parser)

    def run(out: str, steps: int) -> dict:
        arguments = ["--data", str(folder), "--out", str(folder / out), "--steps", str(steps), "--batch", "8"]
        train.run(parser.parse_args([*arguments, "--held-out", "8"]))
        return checkpoint.read(folder / out / "last.pt")

    once, again = run("once", 3), run("again", 3)
    assert all(torch.equal(once["model"][k], again["model"][k]) for k in once["model"])
    further = run("again", 5)
    assert further["step"] == 5 and not torch.equal(further["model"]["heat.weight"], once["model"]["heat.weight"])
    assert (folder / "again" / "small.pt").stat().st_size < 2_000_000


def test_export_equals_pytorch(tmp_path: Path):
    torch.manual_seed(2)
    model = VehicleNet()
    # Batch statistics that are not those of a fresh network: folding has something to fold.
    model.train()
    model(torch.randn(8, 4, 64, 64))
    assert export.export(model, tmp_path / "vehicle.onnx", half=True) < 1e-4
    folded, crop_ = export.fold(model.eval()), torch.randn(2, 4, 64, 64)
    for a, b in zip(model(crop_), folded(crop_), strict=True):
        assert torch.allclose(a, b, atol=1e-4)


def test_a_flip_exchanges_left_and_right(folder: Path):
    batch = CropSet([folder]).batch(np.arange(8))
    batch.sights[:, 3] = OUTSIDE
    plain = augment(batch, NONE, random())
    flipped = augment(batch, Strength(0, 0, 0, 1.0, 0, 0, 0), random())
    for i in range(36):
        mirror = MIRROR[i]
        assert torch.allclose(flipped.keypoints[:, i, 0], 1 - plain.keypoints[:, mirror, 0], atol=1e-6)
        assert torch.allclose(flipped.keypoints[:, i, 1], plain.keypoints[:, mirror, 1])
    assert (flipped.sights[:, 21] == OUTSIDE).all() and (flipped.sights[:, 3] == VISIBLE).all()
    assert torch.allclose(flipped.heading_rad, -plain.heading_rad)
    assert torch.allclose(flipped.input[:, :3], plain.input[:, :3].flip(3), atol=1e-5)
    twice = mirrored(*mirrored(plain.keypoints, plain.sights, plain.heading_rad, torch.ones(8) > 0), torch.ones(8) > 0)
    assert torch.allclose(twice[0], plain.keypoints)


def test_a_border_cuts_box_and_keypoints(folder: Path):
    batch = CropSet([folder]).batch(np.arange(32))
    sample = augment(batch, Strength(0, 0, 1.0, 0, 0, 0, 0), random())
    outside = sample.sights == OUTSIDE
    assert outside.any(dim=1).all()
    # What is cut off is filled, and never holds a keypoint that counts as seen.
    filled = (sample.input[:, :3] == 0).all(dim=1)
    for i in range(32):
        for x, y in sample.keypoints[i][~outside[i]]:
            assert not filled[i, min(int(y * 64), 63), min(int(x * 64), 63)]


def test_the_products_cut_is_the_trainings_cut(folder: Path):
    random_ = np.random.default_rng(5)
    crops = CropSet([folder])
    batch = crops.batch(np.arange(1))
    picture = random_.integers(0, 255, (SIDE, SIDE, 3), np.uint8)
    # 40 px of box give 0.78 px an input pixel: linear interpolation in both.
    batch.crops[0], batch.box[0] = torch.from_numpy(picture), torch.tensor([4.0, 4.0, 44.0, 44.0])
    batch.picture[0] = torch.tensor([-0.5, -0.5, 47.5, 47.5])
    sample = augment(batch, NONE, random())
    product, frame = crop.cut(picture, (4.0, 4.0, 44.0, 44.0))
    assert np.allclose(sample.input[0].numpy(), product, atol=2e-5)
    assert np.allclose(frame.pixels(sample.keypoints[0].numpy()), batch.keypoints[0].numpy(), atol=1e-3)
    assert math.isclose(frame.width, 40 * MARGIN)


def test_decoding_finds_peaks_and_the_heading_between_bins():
    y, x = np.mgrid[:16, :16]
    heat = np.stack([-((x - 4.3 - 0.2 * k) ** 2 + (y - 9.1) ** 2) / (2 * 0.8**2) for k in range(36)])
    keypoints = decode_keypoints(heat, np.zeros(36))
    assert np.allclose(keypoints.place[0], [(4.3 + 0.5) / 16, (9.1 + 0.5) / 16], atol=2e-3)
    assert np.allclose(keypoints.covariance[5], np.eye(2) * (0.8 / 16) ** 2, rtol=0.1, atol=1e-4)
    for angle in (-3.1, -0.4, 0.0, 1.23, 3.14):
        logits = heading_targets(torch.tensor([angle])).clamp(min=1e-9).log().numpy()[0]
        best, rival = decode_heading(logits)
        assert abs(math.remainder(best.angle_rad - angle, 2 * math.pi)) < 0.02 and rival.share < 0.01
    two = np.full(HEADING_BINS, -9.0)
    two[0], two[12] = 1.0, 0.5
    best, rival = decode_heading(two)
    assert abs(best.angle_rad) < 0.01 and abs(abs(rival.angle_rad) - math.pi) < 0.01 and rival.share > 0.3


def test_a_crop_in_doubt_and_its_mirror_image_mean_the_same():
    model = VehicleNet().eval()

    @torch.no_grad()
    def infer(crops: np.ndarray) -> list[np.ndarray]:
        return [output.numpy() for output in model(torch.from_numpy(crops))]

    crops = np.random.default_rng(1).standard_normal((2, 4, 64, 64)).astype(np.float32)
    reversed_crops = np.ascontiguousarray(crops[..., ::-1])
    # An untrained network is sure of nothing.
    heat, visibility, heading, *_ = with_mirrored(infer)(crops)
    seen_heat, seen_visibility, seen_heading, *_ = with_mirrored(infer)(reversed_crops)
    assert np.allclose(heat, seen_heat[:, MIRROR, :, ::-1], atol=1e-5)
    assert np.allclose(visibility, seen_visibility[:, MIRROR], atol=1e-5)
    assert np.allclose(heading[:, 1], seen_heading[:, -1], atol=1e-5)
    # One that is sure is seen once.
    alone, *_ = with_mirrored(infer, sure=0.0)(crops)
    assert np.array_equal(alone, infer(crops)[0]) and not np.allclose(alone, heat, atol=1e-5)


def test_the_fit_finds_heading_and_place():
    # A box with points at its corners and axles.
    side = np.array([[-1.3, 0.8, 0.3], [1.3, 0.8, 0.3], [-2.0, 0.7, 0.9], [2.0, 0.7, 0.7], [0.5, 0.6, 1.4], [-1, 0.6, 1.4]])
    mean = np.concatenate([side, side * [1, -1, 1]])
    prior = Prior(mean, np.zeros((1, 12, 3)) + mean * [0.1, 0, 0], np.array([1.0]))
    camera = kitti.Camera(720.0, 600.0, 180.0, np.zeros(3))
    truth = np.array([0.6, -3.0, 1.65, 14.0, 0.3])
    zero = np.zeros((12, 2))
    pixels = linearised(prior, camera, zero, truth)[0]
    found = fit(prior, camera, pixels, np.ones(12), np.ones(12), 0.9)
    assert abs(found.heading_rad - 0.6) < 0.02 and np.linalg.norm(found.place_m - truth[1:4]) < 0.5
    # The Jacobian against differences.
    residual, jacobian = linearised(prior, camera, zero, truth)
    for k in range(5):
        moved = truth + 1e-6 * (np.arange(5) == k)
        numeric = (linearised(prior, camera, zero, moved)[0] - residual) / 1e-6
        assert np.allclose(jacobian[..., k], numeric, rtol=1e-3, atol=1e-2)


def test_the_head_tells_what_is_a_vehicle(tmp_path: Path):
    torch.manual_seed(4)
    checkpoint.write(tmp_path / "start.pt", {"ema": VehicleNet().state_dict(), "step": 0})
    present = np.arange(400) % 2
    crops = np.random.default_rng(5).normal(0, 0.1, (400, 4, 64, 64)) + present[:, None, None, None]
    score = np.full(400, 0.5, np.float32)
    np.savez(tmp_path / "candidates.npz", crops=crops.astype(np.float16), present=present.astype(np.uint8), score=score)
    parser = argparse.ArgumentParser()
    presence.add_arguments(parser)
    paths = ["--candidates", tmp_path / "candidates.npz", "--start", tmp_path / "start.pt", "--out", tmp_path / "out.pt"]
    presence.run(parser.parse_args([*map(str, paths), "--batch", "32", "--epochs", "8"]))
    model = VehicleNet()
    model.load_state_dict({name: value.float() for name, value in checkpoint.read(tmp_path / "out.pt")["ema"].items()})
    with torch.no_grad():
        logit = model.eval()(torch.from_numpy(crops).float())[5][:, 0]
    assert ((logit > 0).numpy() == (present > 0)).mean() > 0.95
    # The rest of the network is as it was, but for the rounding to half precision.
    start = checkpoint.read(tmp_path / "start.pt")["ema"]
    assert torch.equal(model.heat.weight, start["heat.weight"].half().float())


def test_every_labelled_box_of_a_drive_is_judged(tmp_path):
    pytest.importorskip("cv2")
    import cv2

    for name in ("calib", "label_02", "image_02/0000"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "calib" / "0000.txt").write_text("P2: 700 0 160 0 0 700 60 0 0 0 1 0\n")
    line = "0 {} Car 0 0 0 {} 50 {} 90 1.5 1.6 3.9 1 1.65 20 -1.57\n"
    (tmp_path / "label_02" / "0000.txt").write_text(line.format(1, 100, 160) + line.format(2, 200, 260))
    cv2.imwrite(str(tmp_path / "image_02" / "0000" / "000000.png"), np.full((120, 320, 3), 90, np.uint8))
    options = argparse.Namespace(onnx=None, checkpoint=tmp_path / "small.pt")
    checkpoint.write(options.checkpoint, {"ema": VehicleNet().state_dict()})
    points = np.random.default_rng(2).uniform(-1, 1, (36, 3))
    prior = Prior(points, np.zeros((1, 36, 3)), np.ones(1))
    tiles = []
    judged = evaluate.judge_drive(tmp_path, "0000", 2, 1, prior, evaluate.network(options), tiles)
    assert [box.track for box in judged] == [1, 2] and len(tiles) == 2
    assert all(0 <= box.bins_off_rad <= math.pi and 0 <= box.fit_off_rad <= math.pi for box in judged)
