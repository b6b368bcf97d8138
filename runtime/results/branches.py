"""Which of several solutions the outputs follow that equations determine, and what is said of it. What looks for them is
imported where a model has such outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct, to_builtins

from ..case import Case
from ..outcome import time_text
from ..problem import Array, Problem
from .files import json_number

if TYPE_CHECKING:
    from .branch_jumps import Jump
    from .further_solutions import Several
    from .systems import StatesAt


class Branches(Struct, frozen=True):
    """``given_up``: systems that jump too often, by the names of their outputs, with the time until which they were followed."""

    jumps: tuple[Jump, ...] = ()
    several: tuple[Several, ...] = ()
    given_up: tuple[tuple[tuple[str, ...], float], ...] = ()

    def summary(self) -> dict[str, Any]:
        """Give what a report holds as JSON knows it: nothing where there is nothing to say."""
        jumps = [
            to_builtins(j) | {"before": _numbers(j.before), "after": _numbers(j.after)} for j in self.jumps
        ]
        several = to_builtins(self.several)
        return ({"jumps": jumps} if jumps else {}) | ({"further_solutions": several} if several else {})

    def remarks(self, problem: Problem) -> Iterator[str]:
        if not (self.several or self.given_up or self.jumps):
            return
        from .branch_words import jumps_text, named, several_text

        for one in self.several:
            yield several_text(problem, one)
        alike: dict[object, list[Jump]] = {}
        for jump in sorted(self.jumps, key=lambda j: j.time):
            alike.setdefault((jump.names, jump.kind, bool(np.isfinite(jump.after).all())), []).append(jump)
        for jumps in alike.values():
            yield jumps_text(problem, jumps)
        for names, until in self.given_up:
            yield f"{named(names)} jump{'s' * (len(names) == 1)} more often: followed until {time_text(problem, until)}, no further"


def branches_of(
    case: Case,
    rows: tuple[Array, Array, Array | None],
    dense: Callable[[Array], Array] | None,
    states_at: StatesAt,
    failed: bool,
) -> Callable[[], Branches] | None:
    """Give what looks at the outputs that equations determine along the ``rows`` (times, states, discrete variables) of a run;
    None where there are none. Between rows it looks at the steps, so that the spacing of results changes nothing."""
    if not case.problem.sought or not rows[0].size:
        return None

    def look() -> Branches:
        from .branch_search import look_along

        return Branches(*look_along(case, rows, dense, states_at, failed))

    return look


def _numbers(values: Sequence[float]) -> list[float | None]:
    return [json_number(x) for x in values]
