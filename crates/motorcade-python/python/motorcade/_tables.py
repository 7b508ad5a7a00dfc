"""Tables of a run."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Table = dict[str, "NDArray[Any]"]
"""Columns by name, in the order of the file."""

_WHOLE = {"frame", "id", "inliers"}
_TEXT = {"status", "class", "source"}
_TRUTH = {"scale_measured"}


def parsed(content: bytes) -> Table:
    """The columns of a CSV file with a head. Numbers are float64, whole ones int64; empty ones NaN."""
    rows = list(csv.reader(io.StringIO(content.decode())))
    head, body = rows[0], rows[1:]
    return {name: _column(name, [row[k] for row in body]) for k, name in enumerate(head)}


def _column(name: str, texts: list[str]) -> NDArray[Any]:
    import numpy as np

    if name in _TEXT:
        return np.array(texts, dtype=str)
    if name in _TRUTH:
        return np.array([text == "true" for text in texts], dtype=bool)
    if name in _WHOLE:
        return np.array([int(text) for text in texts], dtype=np.int64)
    return np.array([float(text) if text else np.nan for text in texts], dtype=np.float64)


def columns(table: Table) -> dict[str, Any]:
    """Columns as other libraries take them: texts as lists."""
    return {name: column.tolist() if column.dtype.kind == "U" else column for name, column in table.items()}
