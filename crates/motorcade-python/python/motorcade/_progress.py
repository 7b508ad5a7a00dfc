"""Progress of long calls."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Optional, Union

from . import _native

ProgressFunction = Callable[[str, int, Optional[int]], object]
"""Called as `progress(stage, done, total)`; `total` is None where it is not known."""

ProgressArgument = Union[ProgressFunction, bool, None]
"""A function, True for bars by tqdm, None or False for nothing."""


class _Bars:
    """A bar a stage, by tqdm."""

    def __init__(self) -> None:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            raise ImportError("progress=True needs tqdm: pip install 'motorcade[progress]'") from None
        self._make: Any = tqdm
        self._bar: Any = None
        self._stage = ""

    def __call__(self, stage: str, done: int, total: int | None) -> None:
        if self._bar is None or stage != self._stage:
            self.close()
            self._stage = stage
            self._bar = self._make(total=total, desc=stage, leave=False)
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


@contextmanager
def watched(progress: ProgressArgument) -> Iterator[ProgressFunction | None]:
    """The function that is called with progress."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        bars = _Bars()
        try:
            yield bars
        finally:
            bars.close()
    elif callable(progress):
        yield progress
    else:
        raise _native.SettingsError("progress: expected a function, True, False or None")
