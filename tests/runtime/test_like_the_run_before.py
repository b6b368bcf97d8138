"""A companion goes by the solver of the run before it: the same numbers as one that is made again."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable

import numpy as np
import pytest
from msgspec.structs import replace

import mechc
from mechc.runtime.case import Case
from mechc.runtime.integrate.kernel_run import run_kernel
from mechc.runtime.integrate.solver import SolverOptions
from mechc.runtime.integrate.trajectory import Trajectory
from mechc.runtime.native.build import find_compiler
from mechc.runtime.outcome import Outcome
from mechc.runtime.results import branches
from mechc.runtime.studies.runs import companion, simulate

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

PENDULUM = """model Pendulum
  parameter l = 1 m;
  coordinate Angle theta = 2 rad;
  kinetic 1/2*1 kg*l^2*der(theta)^2;
  potential -1 kg*9.81 m/s^2*l*cos(theta);
  experiment(stop = 5 s);
end Pendulum;
"""
BALL = """model Ball
  input Force push = 0.3 N*sin(2 rad/s*time);
  coordinate Length y = 1 m;
  kinetic 1/2*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  force push on y;
  contact floor: y restitution 0.9;
  experiment(stop = 2 s);
end Ball;
"""


@pytest.mark.parametrize("text", [PENDULUM, BALL], ids=["smooth", "bouncing"])
@pytest.mark.parametrize("method", ["dop853", "rk4"])
def test_goes_as_one_that_is_made_anew(text: str, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit, at another tolerance or step, with another longest step."""
    taken: list[tuple[Case, SolverOptions, Trajectory]] = []

    def noted(case: Case, options: SolverOptions, reader: object = None) -> Trajectory:
        taken.append((case, options, run_kernel(case, options)))
        return run_kernel(case, options, reader)  # type: ignore[arg-type]

    monkeypatch.setattr(companion, "run_kernel", noted)
    step = {"step": 1e-3} if method == "rk4" else {}
    model = mechc.loads(text)
    assert model.simulate(method=method, **step).outcome is Outcome.COMPLETED  # type: ignore[arg-type]
    (_, first, _), (case, options, again) = taken[-2:]
    assert first.like is None and options.like is not None
    anew = run_kernel(case, replace(options, like=None))
    assert np.array_equal(again.t, anew.t) and np.array_equal(again.y, anew.y)
    assert replace(again.statistics, run_time=0.0) == replace(anew.statistics, run_time=0.0)
    main = run_kernel(case, replace(options, like=None, tolerance=first.tolerance, step=first.step))
    assert not np.array_equal(main.y, again.y), "the errors are others"
    if again.happened is not None and anew.happened is not None:
        assert np.array_equal(again.happened.times, anew.happened.times) and len(again.happened)


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_an_interruption_between_a_run_and_its_companion_keeps_the_run(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = mechc.loads(PENDULUM)
    whole = model.simulate()
    pressed = _before(companion.estimate, lambda: signal.raise_signal(signal.SIGINT))
    monkeypatch.setattr(simulate, "estimate", pressed)
    kept = model.simulate()
    assert kept.outcome is Outcome.INTERRUPTED and "during the error estimate" in kept.message
    assert np.array_equal(kept["theta"], whole["theta"])
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    monkeypatch.undo()
    assert model.simulate().outcome is Outcome.COMPLETED, "which nobody presses again"


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_an_interruption_behind_both_ends_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    pressed = _before(branches.branches_of, lambda: signal.raise_signal(signal.SIGINT))
    monkeypatch.setattr(simulate, "branches_of", pressed)
    model = mechc.loads(PENDULUM)
    with pytest.raises(KeyboardInterrupt):
        model.simulate(estimate_error=False)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def _before(function: Callable[..., object], first: Callable[[], object]) -> Callable[..., object]:
    def called(*given: object, **options: object) -> object:
        first()
        return function(*given, **options)

    return called
