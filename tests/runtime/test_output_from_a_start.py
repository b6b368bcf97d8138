"""Experiments whose output begins after the motion: rows begin there, also where events lie before, and FMUs pass their own check."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.compiler.targets.fmu.inspect import run_lines
from mechc.compiler.targets.fmu.reference import read_reference
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.runtime.native.build import find_compiler
from mechc.runtime.results.files import read_results

SAMPLED = """model Sampled "x = t; counts 0, 0.2 s, 0.4 s and so on"
  parameter last = 2 m;
  discrete Integer k = 0;
  coordinate Length x = 0 m;
  initial der(x) = 1 m/s;
  kinetic 1/2*1 kg*der(x)^2;
  when sample(0.2 s) then
    k := k + 1;
  end when;
  when x > last then
    terminate("far");
  end when;
  experiment(stop = 1 s, start = 0.5 s, every = 0.25 s);
  experiment met(stop = 1 s, start = 0.4 s, every = 0.3 s);
end Sampled;
"""


@pytest.mark.parametrize(
    ("experiment", "expected"),
    [
        (None, [(0.5, 3), (0.6, 3), (0.6, 4), (0.75, 4), (0.8, 4), (0.8, 5), (1, 5), (1, 6)]),
        ("met", [(0.4, 2), (0.4, 3), (0.6, 3), (0.6, 4), (0.7, 4), (0.8, 4), (0.8, 5), (1, 5), (1, 6)]),
    ],
)
def test_rows_begin_at_the_start_of_the_output(
    experiment: str | None, expected: list[tuple[float, int]], tmp_path: Path
) -> None:
    """In memory and in a file that is written during the run; all events are listed, those before included."""
    model = mechc.loads(SAMPLED)
    kept = model.simulate(experiment=experiment)
    assert [event.time for event in kept.events][:3] == pytest.approx([0, 0.2, 0.4])
    assert kept.events[1].before["k"] == 1
    assert kept.events[1].after["k"] == 2
    model.simulate(experiment=experiment, to=tmp_path / "rows.csv")
    for rows in (kept, read_results(tmp_path / "rows.csv")):
        times, counts = zip(*expected, strict=True)
        assert rows.time == pytest.approx(times, abs=1e-12)
        assert rows["k"].tolist() == list(counts)
        assert rows["x"] == pytest.approx(times, abs=1e-12)


def test_a_run_that_ends_before_its_output() -> None:
    """At x = 0.3 m: the end of the run alone is told."""
    solution = mechc.loads(SAMPLED).simulate(set={"last": 0.3})
    assert solution.outcome.value == "terminated"
    assert solution.time == pytest.approx(np.full(2, 0.3))


@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
@pytest.mark.parametrize(
    "last",
    [2.0, pytest.param(0.3, id="ended before")],
)
def test_an_fmu(last: float, tmp_path: Path) -> None:
    """The rows of its reference are even from where it begins, so its steps meet them: before, differences of straight lines
    between other times, 2e-2 of a fast oscillation, were found."""
    text = SAMPLED.replace(
        "kinetic",
        "coordinate Angle a = 1 rad; kinetic 1/2*1 kg.m^2*der(a)^2; potential 5e4 N.m/rad*a^2; kinetic",
        1,
    )
    model = mechc.loads(text.replace("start = 0.5 s", "start = 0.377 s")).with_values({"last": last})
    (path,) = export_fmu(model, tmp_path / "sampled.fmu", FmuOptions(check=False, kind="cs"))
    reference = read_reference(path)
    assert (reference is None) == (last < 0.377)
    lines = run_lines(path, "cs", reference)
    assert len(lines) == 1 + (reference is not None)
    assert all(line.passed for line in lines), lines
    if reference is not None:
        assert reference.time[0] >= 0.377
        assert "nothing in common" not in lines[-1].detail
