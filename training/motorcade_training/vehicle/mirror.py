"""A crop that the network is not sure of, seen in a mirror too; the reference for the product."""

import numpy as np

from motorcade_training.vehicle.decode import decode_heading
from motorcade_training.vehicle.layout import HEADING_BINS, MIRROR

#: Probability of the best heading below which the mirrored crop counts too (`perception.advanced.crops.sure_heading`).
SURE_HEADING = 0.85


def mirrored(outputs: list[np.ndarray]) -> list[np.ndarray]:
    """Heat maps, visibilities and headings of crops as their mirror images would have them; its own inverse."""
    heat, visibility, heading = outputs[:3]
    return [heat[:, MIRROR, :, ::-1], visibility[:, MIRROR], heading[:, -np.arange(HEADING_BINS) % HEADING_BINS]]


def with_mirrored(infer, sure: float = SURE_HEADING):
    """`infer` with the mean of both for crops whose heading is in doubt."""

    def both(crops: np.ndarray) -> list[np.ndarray]:
        first = [np.array(output) for output in infer(crops)]
        doubtful = [k for k, logits in enumerate(first[2]) if decode_heading(logits)[0].share < sure]
        if doubtful:
            seen = mirrored(infer(np.ascontiguousarray(crops[doubtful, :, :, ::-1])))
            for own, other in zip(first, seen, strict=False):
                own[doubtful] = 0.5 * (own[doubtful] + other)
        return first

    return both
