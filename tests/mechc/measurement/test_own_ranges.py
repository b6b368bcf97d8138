"""States whose claimed errors are as large as all that they do: lost, or nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
from slow_params import slow_among

import mechc
from mechc.measurement.extremes import Extreme
from mechc.measurement.own_ranges import lost, uncertain
from mechc.measurement.stress import Subject, worker
from mechc.requests.request import asked
from mechc.runtime.studies.kinds.motion import Simulate
from mechc.session import plan

SMALL = """
coordinate Length x = 0 m;
coordinate Length y = 1e5 m;
initial der(x) = 1e-8 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1/2*40 N/m*x^2 + 1/2*1 N/m*y^2;
{rest}
experiment(stop = 10 s);
"""
COUNTED = "discrete Real n = 0; when y < 0 m then n := n + 1; end when;"


@pytest.mark.parametrize("rest", slow_among([""], ["", COUNTED]))
def test_a_small_state_that_is_lost_is_told(
    rest: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "small.mech"
    file.write_text(SMALL.format(rest=rest), encoding="utf-8")
    row = worker(Subject(str(file), None, {}, None, 5))(Extreme("as stated", "nothing changed"))
    assert row.kind == "right" and row.error is not None and row.error > 1e-12, "measured by its own size"
    simulate = mechc.load(file).simulate
    sound = simulate()
    monkeypatch.setattr(
        "mechc.runtime.studies.runs.simulate.by_own_size", lambda made, main, progress: (made, main, ())
    )
    wrong = simulate()
    assert abs(wrong["x"][-1] - sound["x"][-1]) > 5e-11, "reached"
    row = worker(Subject(str(file), None, {}, None, 5))(Extreme("as stated", "nothing changed"))
    assert row.kind == "rough" and "not known by its own range" in row.reason, row


@pytest.mark.slow
def test_what_is_zero_but_for_errors_is_not_lost() -> None:
    model = mechc.load(Path(__file__).parents[3] / "examples" / "falling_box.mech")
    solution = model.simulate()
    assert "free.position[1]" in uncertain(solution), "nothing is tested otherwise"
    assert lost(plan(model, asked(Simulate, {})), solution) is None
