"""What is told of a short run is found when somebody asks, and is the same whatever happened to its numbers before."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import Outcome

BALL = """model Ball
  coordinate Length y = 1 m;
  parameter k = 0.2 N.s/m;
  kinetic 1/2*1 kg*der(y)^2;
  potential 9.81 N*y;
  damping k on y;
  contact floor: y restitution 0.8;
  output Length twice = 2*y;
  experiment(stop = 2 s);
end Ball;
"""


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(BALL)


def told(solution: mechc.Solution) -> Mapping[str, Any]:
    """Give all that a run says of itself, without what no two runs share."""
    summary = solution.summary()
    return summary | {"statistics": {n: v for n, v in summary["statistics"].items() if n != "run_time"}}


def test_numbers_that_were_changed_in_place_change_nothing_of_what_is_told(model: mechc.Model) -> None:
    at_once, later = model.simulate(), model.simulate()
    expected = told(at_once)
    numbers = {name: later[name] for name in ("time", *later)}
    assert later.motion.judged.pending
    for values in numbers.values():
        values *= 57.3
    assert told(later) == expected
    assert later.outcome is Outcome.COMPLETED and not later.motion.judged.pending
    assert np.array_equal(later["twice"], 57.3 * at_once["twice"])  # what is somebody's stays so


def test_numbers_of_a_run_that_was_judged_are_no_copies(model: mechc.Model) -> None:
    solution = model.simulate()
    assert solution.accuracy.error is not None
    assert np.shares_memory(solution["y"], solution.motion.columns.y)
    assert solution.time is solution.motion.time


def test_what_may_run_again_is_judged_at_once() -> None:
    without_events = mechc.loads(BALL.replace("  contact floor: y restitution 0.8;\n", ""))
    assert not without_events.simulate(method="gauss4", step=1e-2).motion.judged.pending
    assert without_events.simulate().motion.judged.pending


def test_what_is_written_while_it_runs_is_judged_at_once(model: mechc.Model, tmp_path: Path) -> None:
    assert not model.simulate(to=tmp_path / "y.npz").motion.judged.pending


def test_a_remark_that_is_added_asks(model: mechc.Model) -> None:
    solution = model.simulate()
    solution.add_remark("seen")
    assert not solution.motion.judged.pending and solution.remarks[0] == "seen"
