"""Models that hold what is 1e20 apart: each run and each target is right within its claim, or refused in words."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from extreme_scales import CASES, Scaled

import mechc
from mechc.measurement.stress_targets import TARGETS, NotTried, answer_of
from mechc.runtime.outcome import Outcome

NAMED = {case.name: case for case in CASES}
CLAIMED = 10.0
"""A true error may be larger than the claimed one by this."""
USEFUL = 1e-3
"""Of the size of each quantity: a run that claims no more has told nothing."""
SHARE = 1e-6
"""Of the size of what carries no claim (outputs, and what targets answer, which are asked for 1e-8)."""
SECONDS = 20


class TooLong(Exception):
    """A run takes longer than it may; nothing was answered."""


def run_of(case: Scaled) -> mechc.Solution:
    """Return the run. Raises SimulationError, CompileError, TooLong."""
    model = mechc.loads(case.text, name=case.name)
    with patience(SECONDS):
        return model.simulate(progress=lambda _: None)


@contextmanager
def patience(seconds: int) -> Iterator[None]:
    def late(*_: object) -> None:
        raise TooLong(f"no answer in {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def judged(case: Scaled, ran: mechc.Solution) -> str:
    """Say how a run compares with its reference: right, or refused in words. Fails where it is silently wrong."""
    if ran.outcome not in (Outcome.COMPLETED, Outcome.TERMINATED):
        assert ran.message
        return f"refused: {ran.message}"
    claims = ran.accuracy.error
    assert claims is not None
    for name, (true, size) in case.ends().items():
        found = float(np.asarray(ran.time if name == "time" else ran[name])[-1])
        owed = SHARE * size
        if name in claims.nominal:
            owed = claims.by_state[name] * (claims.nominal[name] + abs(found))
            owed = CLAIMED * max(owed, 4 * np.finfo(float).eps * abs(true))
            assert owed < CLAIMED * USEFUL * size or name in case.unresolved, (
                f"{name} claims {owed / size:.0e}"
            )
        assert abs(found - true) <= owed, f"{name} is {found!r} for {true!r}, {owed:.1e} are owed"
    return "right"


def judged_target(case: Scaled, target: str) -> str:
    model = mechc.loads(case.text, name=case.name)
    ends = case.ends()
    try:
        with patience(10 * SECONDS):
            answer = answer_of(
                target, model, [q.name for q in model.problem().states if q.kind != "account"], 60
            )
    except NotTried as why:
        return f"not tried: {why}"
    except (mechc.SimulationError, mechc.UsageMistake, mechc.CompileError) as error:
        assert str(error)
        return f"refused: {error}"
    ran = model.simulate()
    claims, stop = ran.accuracy.error, ran.time[-1]
    assert claims is not None
    reached = np.flatnonzero(np.isfinite(answer["time"]))[-1]
    if abs(answer["time"][reached] - stop) > 1e-12 * stop:  # ended by an event between its rows
        return "right as far as rows go"
    for name, (true, size) in ends.items():
        if name in answer:
            found = float(answer[name][reached])
            owed = claims.by_state.get(name, 0.0) * (claims.nominal.get(name, 0.0) + abs(true))
            assert abs(found - true) <= max(SHARE * size, CLAIMED * owed), f"{name} is {found!r} for {true!r}"
    return "right"


@pytest.mark.parametrize("name", ["bounce_beside_planet", "lost_pendulum", "micro_four_bar", "tide"])
def test_what_was_wrong_once(name: str) -> None:
    """A ball was laid down by the size of a planet; a constraint was dropped as rounding; a momentum was held for constant."""
    assert judged(NAMED[name], run_of(NAMED[name])) == "right"


def test_python_modules_take_the_implicit_method_where_runs_do() -> None:
    assert judged_target(NAMED["lags_seen_long"], "python") == "right"


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMED)
def test_runs(name: str) -> None:
    case = NAMED[name]
    try:
        outcome = judged(case, run_of(case))
    except (mechc.SimulationError, TooLong) as error:
        outcome = f"refused: {error}"
    print(f"{name}: {outcome}")
    assert outcome.startswith("refused" if "run" in case.refused else "right")


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("name", NAMED)
def test_targets(name: str, target: str) -> None:
    case = NAMED[name]
    if "run" in case.refused:
        pytest.skip("the run itself is refused")
    outcome = judged_target(case, target)
    print(f"{name} {target}: {outcome}")
    switches = target == "python" and "switches" in outcome  # such a module says that it finds no events
    assert outcome.startswith("refused" if switches or target in case.refused else ("right", "not tried"))
