"""Schedule, average, checkpoints, log."""

import torch

from motorcade_training.common import checkpoint, log
from motorcade_training.common.ema import Ema
from motorcade_training.common.schedule import Budget, Cosine
from motorcade_training.common.seeds import generator


def test_cosine_rises_and_falls():
    cosine = Cosine(peak=1.0, warm_up=0.1, last=0.01)
    assert abs(cosine.rate(0.05) - 0.5) < 1e-9
    assert abs(cosine.rate(0.1) - 1.0) < 1e-9
    assert abs(cosine.rate(1.0) - 0.01) < 1e-9


def test_budget_by_steps_and_by_time():
    assert Budget(steps=10, minutes=None).progress(5) == 0.5
    assert Budget(steps=10, minutes=1, spent_s=30).progress(0) >= 0.5


def test_streams_depend_on_name_and_index_alone():
    assert generator(1, "a", 2).random() == generator(1, "a", 2).random()
    assert generator(1, "a", 2).random() != generator(1, "b", 2).random()


def test_average_follows():
    module = torch.nn.Linear(1, 1)
    ema = Ema(module, 0.5)
    with torch.no_grad():
        module.weight.fill_(3.0)
    for step in range(100):
        ema.update(module, step)
    assert abs(ema.module.weight.item() - 3.0) < 1e-4


def test_checkpoint_round_trip(tmp_path):
    module = torch.nn.Linear(2, 2)
    ema, optimiser = Ema(module, 0.9), torch.optim.AdamW(module.parameters())
    module(torch.ones(1, 2)).sum().backward()
    optimiser.step()
    checkpoint.save(tmp_path / "a.pt", module, ema, optimiser, 7)
    other = torch.nn.Linear(2, 2)
    other_ema, other_optimiser = Ema(other, 0.9), torch.optim.AdamW(other.parameters())
    state = checkpoint.load(tmp_path / "a.pt", other, other_ema, other_optimiser)
    assert state["step"] == 7 and torch.equal(other.weight, module.weight)
    assert torch.equal(other_ema.module.weight, ema.module.weight)
    assert other_optimiser.state_dict()["state"][0]["step"] == 1


def test_log_resumes_and_draws(tmp_path):
    path = tmp_path / "log.csv"
    first = log.CsvLog(path)
    for step in (1, 2, 3):
        first.write(step=step, loss=1.0 / step)
    log.CsvLog(path, from_step=2).write(step=3, loss=0.25)
    assert [row["loss"] for row in log.read(path)] == ["1", "0.5", "0.25"]
    log.draw(path, tmp_path / "log.svg", ["loss"])
    assert "polyline" in (tmp_path / "log.svg").read_text()
