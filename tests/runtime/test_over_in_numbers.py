"""What is followed over a parameter is told in numbers, too: tables against closed forms."""

from __future__ import annotations

import math
from typing import Any

import pytest

import mechc
from mechc.presentation.answers import text
from mechc.runtime.studies.findings import Findings

HOOP = """model Hoop
  dimensionless;
  parameter w = 1;
  coordinate Angle th = 0.1;
  kinetic 1/2*der(th)^2;
  potential -cos(th) - 1/2*w^2*sin(th)^2;
end Hoop;
"""
TOP = """model Governor
  dimensionless;
  coordinate Angle phi = 0;
  coordinate Angle th = 0.5;
  initial der(phi) = 2;
  kinetic 1/2*der(phi)^2 + 1/2*(der(th)^2 + sin(th)^2*der(phi)^2);
  potential -cos(th);
end Governor;
"""
DRIVEN = """model Driven
  dimensionless;
  parameter d = 0.1;
  coordinate x = 0;
  kinetic 1/2*der(x)^2;
  potential 1/2*x^2;
  damping 2*d on x;
  force cos(2*time) on x;
  experiment(stop = 10);
end Driven;
"""


def leans(w: float) -> list[float]:
    """Where cos(th) = 1/w^2, and 0."""
    return [0.0] if w <= 1 else [-math.acos(1 / w**2), 0.0, math.acos(1 / w**2)]


def study(model: str, kind: str, **settings: Any) -> Findings:
    found = mechc.loads(model).study(kind, **settings)
    assert isinstance(found, Findings)
    return found


def rows_of(found: Findings, k: int = 0) -> list[Any]:
    return list(found.tables[k].rows)


def test_one_branch_at_the_values_that_are_asked_for() -> None:
    """k x = f."""
    spring = (
        "model S dimensionless; parameter f = 0; coordinate x(min = -2, max = 2) = 0; kinetic 1/2*der(x)^2; "
    )
    spring += "potential 2*x^2 - f*x; end S;"
    found = study(spring, "equilibria", over="f = -1 .. 2, 4")
    assert len(found.tables) == 1
    rows = sorted(row[1:] for row in rows_of(found))
    assert rows == [(f, pytest.approx(f / 4, rel=1e-12), "stable") for f in (-1, 0, 1, 2)]
    assert "branches at 4 values of f" in text(found) and not found.remarks[1:]


@pytest.mark.slow
def test_branches_of_equilibria() -> None:
    """0 and pi at all values; a fork at w = 1, and its arms from there on."""
    found = study(HOOP, "equilibria", over="w = 0.2 .. 2.2, 5")
    special, table = found.tables
    assert [row[0] for row in special.rows] == ["fork"]
    assert [name for name, _ in table.head] == ["branch", "w", "th", ""]
    rows = sorted((w, th, word) for _, w, th, word in rows_of(found, 1))
    wanted: list[tuple[float, float, str]] = []
    for w in (0.2, 0.7, 1, 1.2, 1.7, 2.2):
        if w == 1:
            wanted.append((1, 0, "fork"))
            continue
        wanted += [(w, th, "stable" if th or w < 1 else "unstable") for th in leans(w)]
        wanted.append((w, math.pi, "unstable"))
    assert [row[2] for row in rows] == [row[2] for row in wanted]
    for row, (w, th, _) in zip(rows, wanted, strict=True):
        assert row[:2] == (pytest.approx(w, abs=1e-10), pytest.approx(th, abs=1e-10))
    assert "branches at 5 values of w" in text(found)
    assert not any("50 values" in remark for remark in found.remarks)
    usual = study(HOOP, "equilibria", over="w = 0.2 .. 0.8")
    assert sorted({row[1] for row in rows_of(usual, 0)}) == pytest.approx([0.2 + 0.06 * k for k in range(11)])
    assert "50 values" in usual.remarks[-1]


@pytest.mark.slow
def test_a_fork_in_the_middle_of_the_range_is_no_line_of_equilibria() -> None:
    """The search begins there, too; a particle that nothing pushes on is still refused."""
    found = study(HOOP, "equilibria", over="w = 0 .. 2, 5")
    assert [(kind, w) for kind, w, _ in rows_of(found, 0)] == [("fork", pytest.approx(1, abs=1e-10))]
    free = "model F dimensionless; parameter f = 1; coordinate x = 0; coordinate y(min = -1, max = 1) = 0; "
    free += "kinetic 1/2*(der(x)^2 + der(y)^2); potential f*(x - y)^2; end F;"
    with pytest.raises(mechc.SimulationError, match="not isolated"):
        study(free, "equilibria", over="f = 1 .. 2")


@pytest.mark.slow
def test_a_branch_with_folds_passes_a_value_several_times() -> None:
    """x^3 - x = f: three equilibria at f = 0, one at -1 and 1, folds at 3 x^2 = 1."""
    cubic = "model C dimensionless; parameter f = 0; coordinate x(min = -2, max = 2) = 0.5; kinetic 1/2*der(x)^2; "
    found = study(cubic + "potential x^4/4 - x^2/2 - f*x; end C;", "equilibria", over="f = -1 .. 1, 3")
    rows = [row[1:] for row in rows_of(found, 1)]
    end = 1.324717957244746  # x^3 - x = 1
    wanted = [
        (-1, -end, "stable"),
        (0, -1, "stable"),
        (2 / 27**0.5, -(3**-0.5), "fold"),
        (0, 0, "unstable"),
        (-2 / 27**0.5, 3**-0.5, "fold"),
        (0, 1, "stable"),
        (1, end, "stable"),
    ]
    rows = rows if rows[0][0] < 0 else rows[::-1]
    assert [row[2] for row in rows] == [row[2] for row in wanted]
    for row, (f, x, _) in zip(rows, wanted, strict=True):
        assert row[:2] == (pytest.approx(f, abs=1e-10), pytest.approx(x, abs=1e-7))


def test_steady_motions() -> None:
    found = study(TOP, "steady", vary="th", over="der(phi) = 0.6 .. 2.1, 4")
    (table,) = found.tables
    assert [name for name, _ in table.head] == ["der(phi)", "th", "error", ""]
    wanted = [(w, th) for w in (0.6, 1.1, 1.6, 2.1) for th in (*leans(w), math.pi)]
    assert [(row[0], row[1]) for row in rows_of(found)] == [
        (pytest.approx(w), pytest.approx(th, abs=1e-10)) for w, th in wanted
    ]
    assert [row[3] for row in rows_of(found)[-4:]] == ["stable", "unstable", "stable", "unstable"]
    change = "the steady motions change from 2 (1 stable) to 4 (2 stable)"
    assert found.remarks == (f"between der(phi) = 0.6 and 1.1 {change}",)


def test_orbits() -> None:
    """The multipliers of x'' + 2 d x' + x = cos(2 t) have the size exp(-d pi)."""
    (table,) = study(DRIVEN, "orbit", period="pi", over="d = 0.1 .. 0.3, 3").tables
    assert [name for name, _ in table.head] == ["d", "period", "largest multiplier"]
    for row, d in zip(table.rows, (0.1, 0.2, 0.3), strict=True):
        assert row == pytest.approx((d, math.pi, math.exp(-d * math.pi)), rel=1e-7)
