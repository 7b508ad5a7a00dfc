"""Quality on held-out pictures of the training set: only this may choose a checkpoint."""

import numpy as np
import torch

from motorcade_training.scene.average_precision import AveragePrecision
from motorcade_training.scene.decode import decode_boxes
from motorcade_training.scene.model import INPUT_MULTIPLE, Exported, SceneNetwork
from motorcade_training.scene.source import Source

#: Lower vehicles do not count [px of the picture].
LEAST_HEIGHT = 16.0


@torch.no_grad()
def validate(network: SceneNetwork, source: Source, device: torch.device, most: int = 60) -> dict[str, float]:
    """AP at IoU 0.5 and IoU of the road over at most `most` pictures, at their own size."""
    exported = Exported(network).eval()
    precision, common, either = AveragePrecision(), 0, 0
    for number in np.linspace(0, len(source) - 1, min(most, len(source))).astype(int):
        sample = source.sample(int(number))
        height, width = (side // INPUT_MULTIPLE * INPUT_MULTIPLE for side in sample.image.shape[:2])
        pixels = np.array(sample.image[:height, :width].transpose(2, 0, 1)[None])
        outputs = [o.float().cpu().numpy() for o in exported(torch.from_numpy(pixels).to(device).float() / 255)]
        boxes, scores, _ = decode_boxes(outputs[:2])
        tall = sample.boxes[:, 3] - sample.boxes[:, 1] >= LEAST_HEIGHT
        real = (sample.kinds >= 0) & tall & (sample.boxes[:, 3] < height)
        high = boxes[:, 3] - boxes[:, 1] >= LEAST_HEIGHT
        precision.add(boxes[high], scores[high], sample.boxes[real], sample.boxes[~real])
        road = outputs[2][0, 0] > 0.5
        wanted = np.array(sample.road[: height // 2 : 2, : width // 2 : 2]) > 127
        common += int((road & wanted).sum())
        either += int((road | wanted).sum())
    return {"iou": common / max(either, 1), "ap50": precision.value()}
