"""Rainflow counts: the example of ASTM E1049, another program where it is installed, and motions of known extrema."""

from __future__ import annotations

import itertools
import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.cli.main import run as run_command
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.findings import Findings
from mechc.runtime.studies.kinds.rainflow import cycles, turning_points

ASTM = (-2, 1, -3, 5, -1, 3, -4, 4, -2)
"""Figure 6 of ASTM E1049-85, and its counts."""
COUNTS = {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}

DAMPED = """\
model Damped
  dimensionless;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  damping 0.2 on x;
  experiment(stop = 20, tolerance = 1e-10);
end Damped;
"""

STEPS = """\
model Steps "the loads of a table, one after the other"
  dimensionless;
  state Real s = 0;
  equation der(s) = -s;
  discrete Real load = -2;
  discrete Real k = 0;
  when sample(1, 1) then
    k := k + 1;
    load := VALUES;
  end when;
  output seen = load;
  experiment(stop = 8.5);
end Steps;
"""


def counts(found: Any) -> dict[float, float]:
    total: Counter[float] = Counter()
    for one in found:
        total[round(one.range, 9)] += one.count
    return dict(total)


def rainflow(text: str, **settings: Any) -> Findings:
    found = mechc.loads(text).study("rainflow", **settings)
    assert isinstance(found, Findings)
    return found


def test_the_example_of_astm() -> None:
    assert counts(cycles(np.array(ASTM, dtype=float))) == COUNTS
    one = next(c for c in cycles(np.array(ASTM, dtype=float)) if c.count == 1.0 and c.range == 4)
    assert (one.mean, one.begin, one.end) == (1.0, 4, 5)


def test_turns_of_a_series_with_levels() -> None:
    assert turning_points(np.array([0.0, 0, 1, 1, 2, 2, 1, 1, 0, 0, 3, 3])) == [0, 4, 8, 10]
    assert turning_points(np.array([1.0, 1.0])) == [] and cycles(np.zeros(0)) == []
    assert counts(cycles(np.array([0.0, 1.0]))) == {1: 0.5}


@pytest.mark.parametrize("seed", range(5))
def test_against_another_program(seed: int) -> None:
    """``rainflow`` 3.2 on random series with repeated values and levels."""
    other = pytest.importorskip("rainflow")
    x = np.random.default_rng(seed).integers(-9, 10, 400).astype(float)
    mine = sorted((c.range, c.mean, c.count) for c in cycles(x))
    assert mine == sorted((r, m, c) for r, m, c, _, _ in other.extract_cycles(x))


def test_loads_that_jump_at_events() -> None:
    values = str(float(ASTM[-1]))
    for k, value in reversed(list(enumerate(ASTM[1:-1], start=1))):
        values = f"(if k < {k}.5 then {float(value)} else {values})"
    found = rainflow(STEPS.replace("VALUES", values), of="seen")
    assert {c["range"] for c in found.details["cycles"]} == set(COUNTS)
    total: Counter[float] = Counter()
    for c in found.details["cycles"]:
        total[c["range"]] += c["count"]
    assert total == COUNTS and found["cycles"] == sum(COUNTS.values())


def test_both_sides_of_an_event_count() -> None:
    """A ramp from -0.1 that falls back to zero three times: cycles of 1 and halves that the record does not close.

    Rounding decides which of three equal peaks is the highest, and so which of the cycles of 1 are closed; their sum is not.
    """
    text = (
        "model Saw dimensionless; state Real r = -0.1; equation der(r) = 1; when r > 1 then reinit(r, 0); end when; "
        "experiment(stop = 3.6); end Saw;"
    )
    found = rainflow(text)
    ranges, count = found.arrays["range"], found.arrays["count"]
    exact = {1.1: 0.5, 1: 2.5, 0.5: 0.5}
    assert {r: count[np.abs(ranges - r) < 1e-9].sum() for r in exact} == exact
    assert count.sum() == found["cycles"] == 3.5


def test_extrema_of_a_damped_oscillation() -> None:
    """Turns at every half period: half cycles of A (exp(-d k) + exp(-d (k + 1))); the last range ends with the record."""
    found = rainflow(DAMPED, least=0)
    w, rate = math.sqrt(1 - 0.01), 0.1
    sizes = [math.exp(-rate * k * math.pi / w) for k in range(7)]
    wanted = [a + b for a, b in itertools.pairwise(sizes)]
    ranges = np.sort(found.arrays["range"])[::-1]
    assert len(ranges) == 7 and (found.arrays["count"] == 0.5).all()
    assert ranges[:6] == pytest.approx(wanted, rel=1e-9)
    (largest,) = (value for value in found.values if value.name == "largest range")
    assert largest.error is not None and abs(largest.value - wanted[0]) <= largest.error + 1e-11
    assert found.arrays["begin"][0] == 0 and found.arrays["end"][0] == pytest.approx(math.pi / w, rel=1e-6)


def test_what_is_faint_or_settles_is_left_out_and_said() -> None:
    found = rainflow(DAMPED, least=0.5)
    assert found["cycles"] == 1.5 and found.remarks[0] == "4 below 0.5 of the largest range are not counted"
    later = rainflow(DAMPED, settling=10)
    assert later["largest range"] < 0.7 and later.arrays["begin"].min() == 10


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"least": 1}, "'least' is a share from 0 to 1, not 1"),
        ({"settling": 600}, "600 are left out of a run over 20: nothing remains"),
    ],
)
def test_what_has_no_cycles_is_refused(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(SimulationError, match=says):
        rainflow(DAMPED, **settings)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "model.mech").write_text(DAMPED)
    assert run_command(["study", "rainflow", str(tmp_path / "model.mech"), "--classes", "3", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["values"]["cycles"] == 3.5 and len(told["cycles"]) == 7
