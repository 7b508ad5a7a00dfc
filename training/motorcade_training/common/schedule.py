"""Learning rate: linear warm-up, then half a cosine to `last`."""

import math
import time
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Cosine:
    """Learning rate as a function of progress 0..1."""

    peak: float
    warm_up: float = 0.02
    last: float = 0.01

    def rate(self, progress: float) -> float:
        """Learning rate at `progress`; `last` is the final rate relative to the peak."""
        progress = min(max(progress, 0.0), 1.0)
        if progress < self.warm_up:
            return self.peak * max(progress / self.warm_up, 0.01)
        phase = (progress - self.warm_up) / (1 - self.warm_up)
        return self.peak * (self.last + (1 - self.last) * 0.5 * (1 + math.cos(math.pi * phase)))


@dataclass
class Budget:
    """How long a training lasts: `steps`, or `minutes` of wall clock; the first to end counts.

    With `minutes` the schedule follows the clock, so that a slow machine still reaches the end of the cosine. Only
    trainings by `steps` are repeatable.
    """

    steps: int | None
    minutes: float | None
    #: Seconds used before a resume.
    spent_s: float = 0.0
    _start: float = field(default_factory=time.monotonic)

    def __post_init__(self) -> None:
        if self.steps is None and self.minutes is None:
            raise ValueError("a training needs --steps or --minutes")

    def elapsed_s(self) -> float:
        """Seconds of training so far, those before a resume included."""
        return self.spent_s + time.monotonic() - self._start

    def progress(self, step: int) -> float:
        """Share of the budget used before `step`; 1 at its end."""
        shares = []
        if self.steps is not None:
            shares.append(step / self.steps)
        if self.minutes is not None:
            shares.append(self.elapsed_s() / (60 * self.minutes))
        return min(max(shares), 1.0)
