"""Lists of equilibria that are proven complete, against closed forms and a search that shares no code."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize
import sympy as sp

import mechc
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.kinds.equilibria import FoundEquilibria

pytest.importorskip("flint")
ROOT = Path(__file__).resolve().parents[2]


def proven(text: str) -> FoundEquilibria:
    model = mechc.load(ROOT / "examples" / text) if text.endswith(".mech") else mechc.loads(text)
    found = model.study("equilibria", prove=True)
    assert isinstance(found, FoundEquilibria)
    return found


@pytest.mark.parametrize(
    ("example", "count"),
    [("henon_heiles", 4), ("double_pendulum_points", 4), ("rotating_hoop", 4), ("pendulum", 2)],
)
def test_the_examples_have_these_and_no_others(example: str, count: int) -> None:
    found = proven(f"{example}.mech")
    assert found.details["complete"] is True and len(found.equilibria) == count
    assert "complete" in found.message


@pytest.mark.parametrize(("strength", "count"), [(1.0, 3), (7.9, 3), (8.1, 1)])
def test_a_charged_bead(strength: float, count: int) -> None:
    """U72: two more equilibria below lambda = 8."""
    found = proven(f"""\
model Bead
  dimensionless;
  coordinate th(min = 0.1, max = 6.2) = 1;
  kinetic 1/2*der(th)^2;
  potential -cos(th) + {strength}/(2*sin(th/2));
end Bead;
""")
    assert found.details["complete"] is True and len(found.equilibria) == count


DOUBLE = """\
model Double
  dimensionless;
  coordinate a(min = -4, max = 4) = 0.1; coordinate b(min = -4, max = 4) = 0.2;
  kinetic der(a)^2 + 1/2*der(b)^2 + cos(a - b)*der(a)*der(b);
  potential -2*cos(a) - cos(b) + 0.15*(b - a)^2 - 0.2*b;
end Double;
"""
BARS = """\
model Bars "three bars, springs at their joints, pressed together"
  dimensionless;
  coordinate x(min = -0.45, max = 0.45) = 0; coordinate y(min = -0.45, max = 0.45) = 0;
  let Real s = asin(x); let Real t = asin(y - x); let Real u = asin(-y);
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential 1/2*((s - t)^2 + (t - u)^2) + {load}*(cos(s) + cos(t) + cos(u));
end Bars;
"""


def elsewhere(potential: sp.Expr, names: tuple[sp.Symbol, ...], reach: float) -> set[tuple[float, ...]]:
    """Find critical points by SciPy from a grid of guesses, with SymPy's gradient."""
    gradient = sp.lambdify([names], [potential.diff(n) for n in names])
    grid = np.linspace(-reach, reach, 13)
    found = set()
    with np.errstate(all="ignore"):
        for first in grid:
            for second in grid:
                x, details, good, _ = scipy.optimize.fsolve(
                    gradient, (first, second), full_output=True, xtol=1e-13
                )
                if good == 1 and np.abs(details["fvec"]).max() < 1e-11 and np.abs(x).max() <= reach:
                    found.add(tuple(float(v) + 0.0 for v in np.round(x, 6)))
    return found


def places(found: FoundEquilibria) -> set[tuple[float, ...]]:
    return {tuple(round(v, 6) + 0.0 for v in e["values"].values()) for e in found.equilibria}


def test_a_double_pendulum_with_spring_and_force() -> None:
    a, b = sp.symbols("a b")
    potential = -2 * sp.cos(a) - sp.cos(b) + sp.Rational(15, 100) * (b - a) ** 2 - b / 5
    found = proven(DOUBLE)
    assert found.details["complete"] is True
    assert places(found) == elsewhere(potential, (a, b), 4.0) and len(found.equilibria) >= 5


@pytest.mark.parametrize(("load", "count"), [(0.9, 1), (1.02, 3)])
def test_buckling_of_three_bars(load: float, count: int) -> None:
    """The straight state is alone below the load 1, at which the first fork is."""
    x, y = sp.symbols("x y")
    s, t, u = sp.asin(x), sp.asin(y - x), sp.asin(-y)
    potential = ((s - t) ** 2 + (t - u) ** 2) / 2 + load * (sp.cos(s) + sp.cos(t) + sp.cos(u))
    found = proven(BARS.format(load=load))
    assert found.details["complete"] is True and len(found.equilibria) == count
    assert elsewhere(potential, (x, y), 0.45) == places(found)
    straight = next(e for e in found.equilibria if abs(e["values"]["x"]) < 1e-9)
    assert straight["stable"] is (load < 1)


def test_what_cannot_be_proven_says_so() -> None:
    """A zero of higher order is in no box of its own; what balls cannot hold is refused."""
    well = "model W dimensionless; coordinate x(min = -1, max = 2) = 0.3; kinetic 1/2*der(x)^2; potential {v}; end W;"
    found = proven(well.format(v="x^4"))
    assert found.details["complete"] is False and "not proven" in " ".join(found.remarks)
    none = proven(well.format(v="exp(x)"))
    assert none.details["complete"] is True and none.equilibria == ()
    with pytest.raises(SimulationError, match="constraints and rotations have none"):
        proven("pendulum_cartesian.mech")
    with pytest.raises(SimulationError, match=r"no form over balls|what switches has none"):
        proven(well.format(v="abs(x - 0.2)^3 + max(x, 0.1*x)"))
    with pytest.raises(SimulationError, match="one value of the parameters"):
        mechc.load(ROOT / "examples" / "pendulum.mech").study("equilibria", prove=True, over="l = 1 .. 2")
    assert math.isclose(max(e["values"]["theta"] for e in proven("pendulum.mech").equilibria), math.pi)


def test_proof_where_one_coordinate_is_known_exactly() -> None:
    """The enclosure of y is 0 itself at once, that of x is not: x^3 - x + 1/10 = 0 has three roots."""
    model = mechc.loads(
        "model Well\n  coordinate Length x = 0.7 m;\n  coordinate Length y = 0.2 m;\n"
        "  kinetic 0.5*1 kg*(der(x)^2 + der(y)^2);\n"
        "  potential -0.5 N/m*x^2 + 0.25 N/m^3*x^4 + 0.1 N*x + 1 N/m*y^2;\nend Well;\n"
    )
    found = model.study("equilibria", prove=True).summary()
    assert found["complete"]
    places = sorted(one["values"]["x"] for one in found["equilibria"])
    assert np.allclose(places, np.sort(np.roots([1, 0, -1, 0.1]).real), rtol=0, atol=1e-12)
