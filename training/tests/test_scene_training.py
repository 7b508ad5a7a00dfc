"""The scene network learns, resumes and exports."""

import numpy as np
import onnxruntime
import torch

from motorcade_training.common import checkpoint, log
from motorcade_training.scene.augment import CropOptions
from motorcade_training.scene.dataset import Batch, CropStream
from motorcade_training.scene.export import TOLERANCE, export_scene, load_network
from motorcade_training.scene.loss import scene_loss
from motorcade_training.scene.model import SceneNetwork, Shape
from motorcade_training.scene.replay import replayed, vary
from motorcade_training.scene.source import Source
from motorcade_training.scene.train import TrainOptions, make_optimiser, step, train
from scene_data import make_source

SMALL = Shape(widths=(8, 8, 16, 16, 16), blocks=(0, 1, 1, 1), neck=16, road=8)


def batch_of(folder, size=(64, 96)):
    options = CropOptions(sizes=(size,), heights=(20.0, 0.6))
    return CropStream([(Source(folder, "all"), 1.0)], options, 4, 1, 1)[0]


def test_steps_lower_the_loss(tmp_path):
    torch.manual_seed(1)
    batch = batch_of(make_source(tmp_path / "source"))
    network = SceneNetwork(SMALL).train()
    optimiser = make_optimiser(network, 1e-3, 0.0)
    before = step(network, optimiser, batch).road.item()
    after = step(network, optimiser, batch).road.item()
    assert after < before
    for _ in range(30):
        losses = step(network, optimiser, batch)
    assert losses.box.item() < 1.0 and losses.road.item() < 0.75 * before


def test_ignored_vehicles_give_no_loss_to_scores(tmp_path):
    batch = batch_of(make_source(tmp_path / "source"))
    batch.kinds = [torch.full_like(k, -1) for k in batch.kinds]
    batch.boxes = [torch.tensor([[-1.0, -1.0, 1e4, 1e4]]) for _ in batch.boxes]
    batch.kinds = [torch.tensor([-1]) for _ in batch.kinds]
    heads, road = SceneNetwork(SMALL)(batch.images.float() / 255)
    losses = scene_loss(heads, road, batch)
    assert losses.score.item() == 0.0 and losses.box.item() == 0.0


def test_resuming_gives_the_same_state(tmp_path):
    source = Source(make_source(tmp_path / "source"), "all")
    common = dict(batch=2, seed=5, workers=0, log_every=1, save_every=100, device="cpu")

    def run(out, steps):
        return train([(source, 1.0)], None, TrainOptions(out=out, steps=steps, **common), SMALL)

    run(tmp_path / "one", 4)
    # A training interrupted after two of four steps: the schedule is that of four.
    options = TrainOptions(out=tmp_path / "two", steps=4, **common)
    interrupt_after(options, source, 2)
    assert checkpoint.read(tmp_path / "two" / "last.pt")["step"] == 2
    train([(source, 1.0)], None, options, SMALL)
    one, two = (checkpoint.read(tmp_path / name / "last.pt") for name in ("one", "two"))
    assert one["step"] == two["step"] == 4
    for part in ("model", "ema"):
        assert all(torch.equal(one[part][k], two[part][k]) for k in one[part])
    losses = [[row["score"] for row in log.read(tmp_path / name / "log.csv")] for name in ("one", "two")]
    assert losses[0] == losses[1] and len(losses[0]) == 4


def interrupt_after(options, source, steps):
    """Trains until the stream of crops fails after some steps."""
    import motorcade_training.scene.train as module

    class Interrupted(CropStream):
        def __getitem__(self, number):
            if number == steps:
                raise KeyboardInterrupt
            return super().__getitem__(number)

    original = module.CropStream
    module.CropStream = Interrupted
    try:
        train([(source, 1.0)], None, TrainOptions(**{**vars(options), "save_every": steps}), SMALL)
    except KeyboardInterrupt:
        pass
    finally:
        module.CropStream = original


def test_export_equals_pytorch_at_any_size(tmp_path):
    torch.manual_seed(2)
    network = SceneNetwork(SMALL)
    # Statistics of the normalisations that differ from their start.
    for _ in range(3):
        network.train()(torch.rand(2, 3, 64, 64))
    assert export_scene(network, tmp_path / "scene.onnx", half=True) <= TOLERANCE
    session = onnxruntime.InferenceSession(str(tmp_path / "scene.onnx"))
    shapes = [o.shape for o in session.run(None, {"image": np.zeros((1, 3, 96, 160), np.float32)})]
    assert shapes == [(1, 8, 12, 20), (1, 8, 6, 10), (1, 1, 24, 40)]


def test_small_checkpoints_load(tmp_path):
    source = Source(make_source(tmp_path / "source"), "all")
    options = TrainOptions(out=tmp_path / "run", steps=2, batch=2, workers=0, device="cpu")
    trained = train([(source, 1.0)], None, options, SMALL).eval()
    loaded = load_network(tmp_path / "run" / "scene.pt")
    x = torch.rand(1, 3, 64, 64)
    assert torch.allclose(trained(x)[1], loaded(x)[1], atol=1e-2)


def test_crops_used_again_keep_their_labels():
    random = torch.Generator().manual_seed(3)
    images = torch.zeros(16, 3, 32, 64, dtype=torch.uint8)
    images[:, :, 8:16, 4:20] = 200
    road = torch.zeros(16, 8, 16)
    road[:, :, :4] = 1.0
    batch = Batch(images, [torch.tensor([[4.0, 8.0, 20.0, 16.0]])] * 16, [torch.tensor([0])] * 16, road)
    varied = vary(batch, random)
    sides = {box[0, 0].item() for box in varied.boxes}
    assert sides == {4.0, 44.0}
    for image, box, cells in zip(varied.images, varied.boxes, varied.road):
        x1, y1, x2, y2 = (int(v) for v in box[0])
        assert image[:, y1:y2, x1:x2].float().min() > 90 and image.float().sum() < 1.3 * image[:, y1:y2, x1:x2].float().sum()
        assert cells[:, x1 // 4 - 1 : x2 // 4 - 1].sum() > 0


def test_batches_between_are_of_crops_seen_before(tmp_path):
    source = Source(make_source(tmp_path / "source"), "all")
    options = CropOptions(sizes=((64, 96), (64, 128)), heights=(20.0, 0.6))
    stream = CropStream([(source, 1.0)], options, 2, 1, 4)
    kinds = [batch.images.shape[3] for batch in replayed((stream[k] for k in range(4)), 3, 1)]
    assert kinds == [96] * 3 + [128] * 3 + [96] * 3 + [128] * 3
