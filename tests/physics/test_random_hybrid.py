"""Random hybrid models: nothing hangs, nothing penetrates, and no event is missed that tiny steps find."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st
from random_hybrid import FAMILIES, HybridModel
from slow_params import slow_but

import mechc
from mechc.runtime.integrate.events import Event
from mechc.runtime.outcome import Outcome
from mechc.solution import Solution

LOOSE, TIGHT = 1e-7, 1e-9
"""Two runs tell how long the motion can be foretold."""

STEPS = 4000
"""Of the run by tiny steps: half a millisecond or a few of them, another method than that of the others."""

SAME = 1e-3
"""[s] Events of two runs that are this close are the same event, where they have agreed to a hundredth of it."""

NOTABLE = 1e-2
"""[m/s] Slower impacts end a sequence of bounces, where one run may leave out what another does not."""


def events(solution: Solution, least: float) -> list[Event]:
    return [e for e in solution.events if (e.kind == "impact" and e.value > least) or e.kind in KINDS]


KINDS = ("when", "crossing", "reflection")


def foretold(a: Solution, b: Solution, stop: float) -> float:
    """Give the time until which two runs meet the same events."""
    first, second = events(a, NOTABLE / 10), events(b, NOTABLE / 10)
    until = 0.0
    for x, y in zip(first, second, strict=False):
        if (x.kind, x.name) != (y.kind, y.name) or abs(x.time - y.time) > SAME / 100:
            return until
        until = y.time
    return stop if len(first) == len(second) else until


def lacking(found: Sequence[Event], among: Sequence[Event], until: float) -> list[Event]:
    """Give the notable events of one run that the other one does not have."""
    return [
        x
        for x in found
        if x.time < until - 20 * SAME
        and not any((x.kind, x.name) == (y.kind, y.name) and abs(x.time - y.time) < SAME for y in among)
    ]


def check(drawn: HybridModel) -> None:
    note(drawn.text)
    model = mechc.loads(drawn.text)
    loose = model.simulate(stop=drawn.stop, tolerance=LOOSE, estimate_error=False)
    tight = model.simulate(stop=drawn.stop, tolerance=TIGHT, estimate_error=False)
    tiny = model.simulate(stop=drawn.stop, method="rk4", step=drawn.stop / STEPS, estimate_error=False)
    for solution, tolerance in zip((loose, tight, tiny), (LOOSE, TIGHT, TIGHT), strict=True):
        assert solution.outcome is Outcome.COMPLETED, solution.message
        for gap in drawn.gaps:  # lengths and angles are about 1
            assert np.min(solution[gap]) > -100 * tolerance
    until = foretold(loose, tight, drawn.stop)
    note(f"foretold until {until} s")
    assert not lacking(events(tiny, NOTABLE), events(tight, NOTABLE / 10), until)
    assert not lacking(events(tight, NOTABLE), events(tiny, NOTABLE / 10), until)


Family = Callable[[st.DrawFn], HybridModel]


def explore(family: Family, count: int) -> None:
    """Draw models of a family and check each of them: the same ones each time, or new ones with MECHC_NEW_MODELS=1."""

    @settings(
        max_examples=count,
        derandomize="MECHC_NEW_MODELS" not in os.environ,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.composite(family)())
    def every(drawn: HybridModel) -> None:
        check(drawn)

    every()


@pytest.mark.parametrize("family", slow_but(FAMILIES[1:], FAMILIES), ids=lambda family: family.__name__)
def test_random_models(family: Family) -> None:
    explore(family, 2)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_many_random_models(family: Family) -> None:
    explore(family, 25)
