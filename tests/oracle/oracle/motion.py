"""Short motions: states over time, and what happened on the way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

State = dict[str, float]


@dataclass(frozen=True)
class Happening:
    time: float
    name: str
    kind: str


@dataclass(frozen=True)
class Motion:
    time: NDArray[np.float64]
    states: list[State]
    events: list[Happening]
    outcome: str
