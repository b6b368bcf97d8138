"""Whether lists of equilibria are complete: counts from closed forms, and what is said where one may be missing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from slow_params import slow_but

import mechc
from mechc.runtime.studies.kinds.equilibria import FoundEquilibria

RESTRICTED = """\
model Restricted "circular restricted three-body problem, in the rotating frame"
  dimensionless;
  parameter mu = 0.012150585609624;
  coordinate x = 0.487849414390376;
  coordinate y = 0.866025403784439;
  kinetic 1/2*((der(x) - y)^2 + (der(y) + x)^2);
  potential -(1 - mu)/sqrt((x + mu)^2 + y^2) - mu/sqrt((x - 1 + mu)^2 + y^2);
end Restricted;
"""


def found(text: str, **settings: Any) -> FoundEquilibria:
    answer = mechc.loads(text).study("equilibria", **settings)
    assert isinstance(answer, FoundEquilibria)
    return answer


def points(coordinates: str, potential: str, kinetic: str = "") -> str:
    names = [part.split()[-3] for part in coordinates.split(";")[:-1]]
    squares = kinetic or "1/2*(" + " + ".join(f"der({name})^2" for name in names) + ")"
    return f"model M dimensionless; {coordinates} kinetic {squares}; potential {potential}; end M;"


def collinear(mu: float) -> list[float]:
    """Roots of Euler's quintics."""
    places = []
    for s0, s1 in ((1, 1), (1, -1), (-1, -1)):  # signs of x + mu and x - 1 + mu
        # x - s0 (1-mu)/(x+mu)^2 - s1 mu/(x-1+mu)^2 = 0
        a, b = np.poly1d([1, mu]) ** 2, np.poly1d([1, mu - 1]) ** 2
        quintic = np.poly1d([1, 0]) * a * b - s0 * (1 - mu) * b - s1 * mu * a
        real = [r.real for r in quintic.roots if abs(r.imag) < 1e-9]
        places += [x for x in real if np.sign(x + mu) == s0 and np.sign(x - 1 + mu) == s1]
    return sorted(places)


@pytest.mark.parametrize("mu", slow_but([0.012150585609624], [0.012150585609624, 0.5, 0.1, 0.001, 1e-5]))
def test_five_lagrange_points(mu: float) -> None:
    """The directions of the force turn once round on a wide circle, and once about each of both bodies: -1 is left for the zeros."""
    answer = found(RESTRICTED.replace("0.012150585609624", repr(mu)))
    line = sorted(e["values"]["x"] for e in answer.equilibria if abs(e["values"]["y"]) < 1e-9)
    assert line == pytest.approx(collinear(mu), abs=1e-12)
    sides = [
        (e["values"]["x"], abs(e["values"]["y"])) for e in answer.equilibria if abs(e["values"]["y"]) > 0.5
    ]
    assert len(sides) == 2
    assert all(p == pytest.approx((0.5 - mu, math.sqrt(0.75)), abs=1e-9) for p in sides)
    told = answer.summary()
    assert answer.message == "5 equilibria" and told["may_be_incomplete"] is False
    assert told["signs"] == told["signs_expected"] == -1 and len(told["singular_points"]) == 2


TURN = "1/2*{m}*der(a)^2 + 1/2*der(b)^2 + der(a)*der(b)*cos(a - b)"
KNOWN = {
    "pendulum": (points("coordinate Angle a = 0.3;", "-cos(a)"), 2),
    "hoop, slow": (points("coordinate Angle a = 0.3;", "-cos(a) - 1/4*sin(a)^2"), 2),
    "hoop, fast": (points("coordinate Angle a = 0.3;", "-cos(a) - 2*sin(a)^2"), 4),
    "shaken pivot": (points("coordinate Angle a = 0.3;", "-cos(a) + 0.9*sin(a)^2"), 4),
    "double pendulum": (
        points("coordinate Angle a = 0.3; coordinate Angle b = 1;", "-2*cos(a) - cos(b)", TURN.format(m=2)),
        4,
    ),
    "snap-through": (points("coordinate y = 0.8;", "5*(sqrt(1 + y^2) - sqrt(2))^2 + 0.1*y"), 3),
    "snapped": (points("coordinate y = 0.8;", "5*(sqrt(1 + y^2) - sqrt(2))^2 + 3*y"), 1),
    "a charge at the bottom": (points("coordinate Angle a = 1;", "-cos(a) + 1/(2*abs(sin(a/2)))"), 3),
    "two wells": (points("coordinate x = 0.3;", "x^4/4 - x^2/2"), 3),
    "wells close to each other": (points("coordinate x = 0.1;", "(x - 0.5)^2*(x - 0.51)^2"), 3),
    "a narrow pair": (points("coordinate x = 0.1;", "x^2/2 - 1.2*exp(-(x - 2.5)^2/0.02)"), 3),
    "a quartic": (points("coordinate x = 0.1;", "x^4"), 1),
    "Henon and Heiles": (points("coordinate x = 0.3; coordinate y = 0;", "1/2*(x^2 + y^2) + x^2*y - y^3/3"), 4),
    "four wells": (points("coordinate x = 0.3; coordinate y = 0;", "(x^2 - 1)^2 + (y^2 - 1)^2 + 0.1*x*y"), 9),
    "Himmelblau": (
        points("coordinate x(min = -6, max = 6) = 1; coordinate y(min = -6, max = 6) = 1;",
               "(x^2 + y - 11)^2 + (x + y^2 - 7)^2", "1/2*(der(x)^2 + der(y)^2)"),
        9,
    ),
    "on an elastic string": (points("coordinate x = 0.3; coordinate y = 0;", "1/2*(sqrt(x^2 + y^2) - 1)^2 + 0.3*y"), 2),
    "three pairs of wells": (
        points("coordinate x = 0.3; coordinate y = 0; coordinate z = 0.1;",
               "(x^2 - 1)^2 + (y^2 - 1)^2 + (z^2 - 1)^2 + 0.1*(x*y + y*z)"),
        27,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", slow_but(["hoop, fast", "snap-through"], list(KNOWN)))
def test_known_counts(name: str) -> None:
    text, count = KNOWN[name]
    answer = found(text)
    assert len(answer.equilibria) == count and answer.message.split(",")[0].split()[0] == str(count)
    assert answer.summary()["may_be_incomplete"] is False


def test_states_alone_are_counted() -> None:
    """Two species that displace each other rest at four places, where the determinants of their slopes are 6, 2, -1 and 3."""
    answer = found("""\
model Species
  dimensionless;
  state x(min = -1, max = 4) = 1;
  state y(min = -1, max = 4) = 2;
  equation der(x) = x*(3 - x - 2*y);
  equation der(y) = y*(2 - x - y);
end Species;
""")
    places = sorted(
        tuple(round(v, 9) for v in one["values"].values()) for one in answer.details["equilibria"]
    )
    assert places == [(0, 0), (0, 2), (1, 1), (3, 0)]
    stable = {
        tuple(np.round(list(one["values"].values()), 9)): one["stable"]
        for one in answer.details["equilibria"]
    }
    assert stable == {(0, 0): False, (0, 2): True, (1, 1): False, (3, 0): True}
    assert answer.details["signs"] == answer.details["signs_expected"] == 2


def test_what_may_be_missing_is_told() -> None:
    """Zeros at 1, -1, 9 and two between: two lie beyond -4 .. 4, where nobody said to look. The signs within do add up to 1."""
    answer = found(points("coordinate x = 0.1;", "(x^2 - 1)^2*(x - 9)^2/81"))
    assert len(answer.equilibria) == 3 and answer.message == "3 equilibria, may be incomplete"
    assert any("others lie beyond the bounds: x = " in remark for remark in answer.remarks)
    held = points("coordinate x = 0.6; coordinate y = 0.8;", "x").replace(
        "end M", "constraint x^2 + y^2 = 1; end M"
    )
    assert found(held).message == "2 equilibria, may be incomplete"


@pytest.mark.slow
def test_in_space_bodies_without_extent_make_it_unknown() -> None:
    text = RESTRICTED.replace("y^2)", "y^2 + z^2)").replace(
        "  kinetic 1/2*(", "  coordinate z = 0.1;\n  kinetic 1/2*(der(z)^2 + "
    )
    answer = found(text)
    assert len(answer.equilibria) == 5 and answer.message == "5 equilibria, may be incomplete"
    assert any("forces grow without bound" in remark for remark in answer.remarks)


@pytest.mark.slow
def test_routh_s_value() -> None:
    """L4 and L5 are linearly stable up to 27 mu (1 - mu) = 1, where two pairs of opposite Krein signature meet."""
    answer = found(RESTRICTED, over="mu = 0.001 .. 0.05")
    critical = (1 - math.sqrt(23 / 27)) / 2
    assert [s["kind"] for s in answer.special] == 2 * ["hamiltonian hopf"]
    assert [s["parameter"]["mu"] for s in answer.special] == pytest.approx(2 * [critical], abs=1e-12)
    assert answer.message.startswith("5 branches; hamiltonian hopf at mu = 0.0385208965")
    for e in answer.equilibria:
        if abs(e["values"]["y"]) > 0.5 and abs(e["parameter"]["mu"] - critical) > 1e-9:
            assert e["stable"] is (None if e["parameter"]["mu"] < critical else False)
    named = {c.name: c.style for c in answer.panels[0].curves if c.name}
    assert named == {"unstable": "dashed", "stability cannot be told": "dotted", "special points": "points"}


ZIEGLER = """\
model Ziegler "two bars with springs under a force that follows the last one"
  dimensionless;
  parameter P = 1;
  coordinate Angle a(min = -0.5, max = 0.5) = 0;
  coordinate Angle b(min = -0.5, max = 0.5) = 0;
  kinetic 3/2*der(a)^2 + der(a)*der(b)*cos(a - b) + 1/2*der(b)^2;
  potential 1/2*a^2 + 1/2*(b - a)^2;
  force P*sin(a - b) on a;
end Ziegler;
"""


def test_flutter_of_ziegler_s_column() -> None:
    """Without damping it flutters from P = 7/2 - sqrt(2) on (H. Ziegler 1952)."""
    answer = found(ZIEGLER, over="P = 1 .. 3")
    (point,) = answer.special
    assert point["kind"] == "hamiltonian hopf"
    assert point["parameter"]["P"] == pytest.approx(3.5 - math.sqrt(2), abs=1e-12)


@pytest.mark.slow
def test_crossing_frequencies_are_no_collision() -> None:
    """Two oscillators without gyroscopic forces, and two of one signature with them, pass through each other."""
    text = points("coordinate x(min = -1, max = 1) = 0; coordinate y(min = -1, max = 1) = 0;", "1/2*k*x^2 + 1/2*y^2",
                  "1/2*(der(x)^2 + der(y)^2)")  # fmt: skip
    text = text.replace("coordinate x(", "parameter k = 2; coordinate x(", 1)
    assert found(text, over="k = 0.5 .. 2").special == ()


def test_a_pole_keeps_no_other_from_being_told() -> None:
    """A bob in angles hangs where its azimuth means nothing and derivatives divide zero by zero; it also stands, and falls from there."""
    answer = found("""\
model Bob
  coordinate Angle phi = 0 rad;
  coordinate Angle a = 20 deg;
  kinetic 1/2*1 kg*(0.3 m)^2*(der(a)^2 + sin(a)^2*der(phi)^2);
  potential -1 kg*9.81 m/s^2*0.3 m*cos(a);
end Bob;
""")
    hangs, stands = answer.details["equilibria"]
    assert hangs["values"]["a"] == pytest.approx(0, abs=1e-12) and hangs["stable"] is None
    assert stands["values"]["a"] == pytest.approx(math.pi) and stands["stable"] is False
    assert max(stands["eigenvalues"])[0] == pytest.approx(math.sqrt(9.81 / 0.3))
    assert any("of one cannot be told: a derivative is undefined" in remark for remark in answer.remarks)
