"""Training of the head. The rest of the vehicle network is held: its keypoints stay as they are."""

import argparse
from pathlib import Path

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from motorcade_training.common import checkpoint
from motorcade_training.common.device import pick_device
from motorcade_training.common.seeds import seed_everything
from motorcade_training.presence.candidates import Candidates
from motorcade_training.vehicle.model import PRESENCE_FEATURES, VehicleNet

#: Share of the candidates, the last ones, that are not trained on.
HELD_OUT = 0.15
#: Share of the inputs and of the hidden units left out in a step of training.
INPUT_DROPOUT, HIDDEN_DROPOUT = 0.1, 0.4
#: Scores nearer to 0 and 1 count as this near.
SCORE_MARGIN = 0.02


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of `train presence`."""
    parser.add_argument("--candidates", type=Path, nargs="+", default=[Path("work/presence/candidates.npz")])
    parser.add_argument("--start", type=Path, default=Path("checkpoints/vehicle.pt"), help="checkpoint of the vehicle network")
    parser.add_argument("--out", type=Path, default=Path("work/presence/small.pt"), help="the same with the head")
    parser.add_argument("--epochs", type=int, default=10)
    parser.add_argument("--batch", type=int, default=256)
    parser.add_argument("--rate", type=float, default=1e-3, help="first learning rate; falls to zero in a straight line")
    parser.add_argument("--decay", type=float, default=0.1, help="weight decay")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--device", default="auto")


def run(options: argparse.Namespace) -> None:
    """Trains, prints how well candidates that were not trained on are told, and writes the network."""
    seed_everything(options.seed)
    device = pick_device(options.device, options.threads)
    model = VehicleNet()
    weights = {name: value.float() for name, value in checkpoint.read(options.start)["ema"].items()}
    missing = model.load_state_dict(weights, strict=False)
    if missing.unexpected_keys or any(not name.startswith("presence.") for name in missing.missing_keys):
        raise ValueError(f"{options.start}: not a checkpoint of this vehicle network")
    model.eval().to(device)
    candidates = Candidates.load(options.candidates)
    features = features_of(model, candidates.crops, device)
    present = torch.from_numpy(candidates.present).float()
    trained = round(len(present) * (1 - HELD_OUT))
    if trained < options.batch:
        raise ValueError(f"{len(present)} candidates are too few for --batch {options.batch}")
    fit(model.presence, features[:trained], present[:trained], options)
    with torch.no_grad():
        logit = model.presence(features[trained:])[:, 0]
    held, score = present[trained:], torch.from_numpy(candidates.score)[trained:]
    print(f"{trained} candidates trained on; of the {len(held)} others {float(held.mean()):.3f} are vehicles")
    print(f"area under the ROC curve {roc_area(logit, held):.4f}, by the score alone {roc_area(score, held):.4f}")
    weights_of = calibrated(logit, score, held)
    both = weights_of["logit"] * logit + weights_of["score"] * score_logit(score) + weights_of["bias"]
    print(f"both together {roc_area(both, held):.4f}: log odds = " + ", ".join(f"{name} {value:.3f}" for name, value in weights_of.items()))
    state = {name: value.half() if value.dtype.is_floating_point else value for name, value in model.cpu().state_dict().items()}
    options.out.parent.mkdir(parents=True, exist_ok=True)
    checkpoint.write(options.out, {"ema": state, "step": 0})


@torch.no_grad()
def features_of(model: VehicleNet, crops: np.ndarray, device: torch.device) -> torch.Tensor:
    """(N, PRESENCE_FEATURES), f32."""
    parts = [torch.zeros(0, PRESENCE_FEATURES)]
    for start in range(0, len(crops), 512):
        crop = torch.from_numpy(crops[start : start + 512].astype(np.float32)).to(device)
        parts.append(model.presence_features(*model.encode(crop)).cpu())
    return torch.cat(parts)


def fit(head: nn.Sequential, features: torch.Tensor, present: torch.Tensor, options: argparse.Namespace) -> None:
    """Trains on features of mean 0 and deviation 1; that scaling ends up in the weights of the first layer."""
    mean, deviation = features.mean(dim=0), features.std(dim=0) + 1e-3
    hidden, last = head[0], head[2]
    nn.init.kaiming_uniform_(hidden.weight, a=5**0.5)
    optimiser = torch.optim.AdamW(head.parameters(), lr=options.rate, weight_decay=options.decay)
    for epoch in range(options.epochs):
        for group in optimiser.param_groups:
            group["lr"] = options.rate * (1 - epoch / options.epochs)
        for batch in torch.randperm(len(present)).split(options.batch):
            scaled = functional.dropout((features[batch] - mean) / deviation, INPUT_DROPOUT)
            logit = last(functional.dropout(functional.relu(hidden(scaled)), HIDDEN_DROPOUT))[:, 0]
            loss = functional.binary_cross_entropy_with_logits(logit, present[batch])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
    with torch.no_grad():
        hidden.weight /= deviation
        hidden.bias -= hidden.weight @ mean


def score_logit(score: torch.Tensor) -> torch.Tensor:
    """Log odds of a detector's score."""
    return torch.logit(score.clamp(SCORE_MARGIN, 1 - SCORE_MARGIN))


def calibrated(logit: torch.Tensor, score: torch.Tensor, present: torch.Tensor) -> dict[str, float]:
    """Weights of the head's logit, of the score's log odds, and a constant: logistic regression."""
    columns = torch.stack([logit, score_logit(score), torch.ones_like(logit)], dim=1)
    weights = torch.zeros(3, requires_grad=True)
    optimiser = torch.optim.LBFGS([weights], max_iter=100, line_search_fn="strong_wolfe")

    def closure() -> torch.Tensor:
        optimiser.zero_grad()
        loss = functional.binary_cross_entropy_with_logits(columns @ weights, present)
        loss.backward()
        return loss

    optimiser.step(closure)
    return dict(zip(("logit", "score", "bias"), weights.detach().tolist()))


def roc_area(value: torch.Tensor, present: torch.Tensor) -> float:
    """Probability that a vehicle has a larger value than something that is none."""
    rank = torch.empty(len(value))
    rank[torch.argsort(value)] = torch.arange(len(value), dtype=torch.float32)
    of_vehicles = present > 0.5
    count, others = int(of_vehicles.sum()), int((~of_vehicles).sum())
    return float((rank[of_vehicles].mean() - (count - 1) / 2) / max(others, 1))
