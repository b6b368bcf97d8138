"""How a case is to be solved: what the kernel and the peers are asked for."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from msgspec import Struct

from ..case import Progress
from ..problem import Array
from ..rows import Follower

if TYPE_CHECKING:
    from .solver import Solver


class SolverOptions(Struct, frozen=True, eq=False):
    """``nominal`` [ny]: sizes of the states; the absolute tolerance is ``tolerance`` times these. ``step`` is that of a
    method of fixed step, and the first one of others. ``dense`` keeps the polynomials of all steps, those
    of more than ``dense_kept`` bytes by running again where somebody asks for them. A run of more than
    ``max_steps`` accepted steps or ``seconds`` is given up, and one that is stiff after ``stiff_after`` steps. ``reproducible``:
    by the kernel that gives the same bits on every machine. Between slices it is looked whether a run was interrupted, first after ``first_slice`` steps;
    by ``interrupted``, where somebody listens already. ``like``: a solver of the same case by the same method, which has
    come to its end. ``halves``: the way to a known time is taken in two steps where one would do."""

    method: str
    tolerance: float
    nominal: Array
    step: float | None = None
    dense: bool = False
    max_steps: int | None = None
    stiff_after: int | None = None
    seconds: float = math.inf
    reproducible: bool = False
    progress: Progress | None = None
    dense_kept: float = math.inf
    follower: Follower | None = None
    first_slice: int | None = None
    interrupted: Callable[[], bool] | None = None
    like: Solver | None = None
    halves: bool = False

    @property
    def atol(self) -> Array:
        return self.tolerance * self.nominal
