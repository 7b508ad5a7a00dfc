"""Detectors of vehicles written in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Union

from ._native import InputError, SettingsError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


class Detection(NamedTuple):
    """One vehicle in one picture."""

    box: ArrayLike
    """x1, y1, x2, y2 of the visible part in pixels, pixel centres at integer coordinates; shape [4]."""
    class_name: str = "Car"
    """Car, Van, Truck, Bus or Motorcycle."""
    score: float = 1.0
    """Confidence, 0 to 1."""


Detections = Union[
    Iterable[Detection],
    "NDArray[Any]",
    "tuple[ArrayLike, Sequence[str], ArrayLike]",
]
"""What a detector gives: a list of `Detection`; an array of shape [k, 4] or, with scores, [k, 5], all of them cars; or a tuple of
boxes [k, 4], names of classes [k] and scores [k]."""


class Detector(Protocol):
    """A detector of vehicles of your own.

    An attribute `description` (a text) stands in the record of a run; the name of the type does otherwise. What `detect` raises
    ends the run and comes back as it was raised.
    """

    def detect(self, image: NDArray[np.uint8]) -> Detections:
        """Vehicles of a picture of shape [h, w] or [h, w, 3] (red, green, blue). Called with every frame once, in order; in
        `run` from another thread."""
        ...


Lists = tuple[list[list[float]], list[str], list[float]]


def adapted(detector: Detector | None) -> tuple[Callable[[NDArray[np.uint8]], Lists], str] | None:
    """The function that the native part calls, and the detector in words."""
    if detector is None:
        return None
    detect = getattr(detector, "detect", None)
    if not callable(detect):
        raise SettingsError(f"detector: {type(detector).__name__} has no method detect(image)")
    description = str(getattr(detector, "description", type(detector).__name__))
    return lambda image: lists(detect(image)), description


def lists(found: Any) -> Lists:
    """Boxes, classes and scores in any of the accepted forms as lists."""
    import numpy as np

    try:
        if isinstance(found, Detection):
            found = [found]
        if isinstance(found, tuple) and len(found) == 3:
            boxes, classes, scores = found
        elif isinstance(found, np.ndarray):
            boxes, classes, scores = _of_array(found)
        else:
            detections = [_detection(one) for one in found]
            boxes = [one.box for one in detections]
            classes = [one.class_name for one in detections]
            scores = [one.score for one in detections]
        edges = np.asarray(boxes, dtype=float).reshape(-1, 4).tolist()
        return edges, [str(name) for name in classes], np.asarray(scores, dtype=float).reshape(-1).tolist()
    except (TypeError, ValueError) as error:
        expected = "a list of Detection, an array [k, 4] or [k, 5], or a tuple (boxes, classes, scores)"
        raise InputError(f"detect returned {type(found).__name__} ({error}); expected {expected}") from error


def _of_array(found: NDArray[Any]) -> tuple[Any, list[str], Any]:
    import numpy as np

    if found.size == 0:
        return np.empty((0, 4)), [], []
    if found.ndim != 2 or found.shape[1] not in (4, 5):
        raise ValueError(f"shape {found.shape}")
    scores = found[:, 4] if found.shape[1] == 5 else np.ones(len(found))
    return found[:, :4], ["Car"] * len(found), scores


def _detection(one: Any) -> Detection:
    import numpy as np

    if isinstance(one, Detection):
        return one
    if np.ndim(one[0]) == 0:
        edges = [float(edge) for edge in one]
        if len(edges) not in (4, 5):
            raise ValueError(f"a box of {len(edges)} numbers")
        return Detection(edges[:4], "Car", edges[4] if len(edges) == 5 else 1.0)
    return Detection(*one)
