"""The triangles of an STL file, text or binary."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def triangles(path: str | Path) -> NDArray[np.float64]:
    """Return the corners [n, 3, 3]. Raises OSError, and ValueError for a file that is no STL."""
    data = Path(path).read_bytes()
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if len(data) == 84 + 50 * count:
        return np.frombuffer(data, _RECORD, count, 84)["corners"].astype(float)
    words = data.decode("ascii", errors="replace").split()
    numbers = [words[k + 1 : k + 4] for k, word in enumerate(words) if word == "vertex"]
    try:
        corners = np.array(numbers, dtype=float)
    except ValueError:
        raise ValueError(f"'{Path(path).name}' is no STL file: a corner is no three numbers") from None
    if not words or words[0] != "solid" or len(corners) == 0 or len(corners) % 3:
        raise ValueError(f"'{Path(path).name}' is no STL file")
    return corners.reshape(-1, 3, 3)
