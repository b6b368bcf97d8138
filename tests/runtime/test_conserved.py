"""Symmetries and first integrals against what is known of twenty systems; formulas against SymPy's own derivation."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import mechc
from mechc.runtime.studies.findings import Findings

ROOT = Path(__file__).resolve().parents[2]

PLANE = "coordinate x = 1; coordinate y = 0.2; initial der(x) = 0.1; initial der(y) = 0.9; "
SPACE = PLANE + "coordinate z = 0.3; initial der(z) = 0.2; "
PLANE_T, SPACE_T = "1/2*(der(x)^2 + der(y)^2)", "1/2*(der(x)^2 + der(y)^2 + der(z)^2)"
LINE3 = "coordinate a = 0; coordinate b = 1; coordinate c = 2.5; initial der(a) = 0.5; initial der(c) = 0.3; "
LINE3_T = "1/2*(der(a)^2 + der(b)^2 + der(c)^2)"
TWO = (
    "parameter m = 2; parameter M = 3; coordinate x = 0; coordinate y = 0; coordinate X = 1; coordinate Y = 0.2; "
    "initial der(y) = 0.5; initial der(X) = 0.1; initial der(Y) = 1; "
)
TWO_T = "1/2*m*(der(x)^2 + der(y)^2) + 1/2*M*(der(X)^2 + der(Y)^2)"
TOP = (
    "coordinate Rotation R = rotx(0.7); initial der(R) = {0.5, 1, 2}; frame body = world * R; "
    "parameter A = 0.4; parameter B = 0.4; parameter C = 0.2; parameter k = 3; "
)
TOP_T = "1/2*(A*der(R)[1]^2 + B*der(R)[2]^2 + C*der(R)[3]^2)"

SYSTEMS: dict[str, tuple[str, str, str, int, int, int]] = {
    # declarations, T, V, symmetries, degree, independent integrals of that degree
    "free on a line": ("coordinate x = 1; initial der(x) = 1;", "1/2*der(x)^2", "0", 5, 1, 1),
    "free in the plane": (PLANE, PLANE_T, "0", 8, 2, 3),
    "oscillator": ("coordinate x = 1;", "1/2*der(x)^2", "1/2*x^2", 1, 2, 1),
    "isotropic oscillator": (PLANE, PLANE_T, "1/2*(x^2 + y^2)", 2, 2, 3),
    "anisotropic oscillator": (PLANE, PLANE_T, "1/2*(x^2 + 2.3*y^2)", 1, 2, 2),
    "Fradkin's tensor": (SPACE, SPACE_T, "1/2*(x^2 + y^2 + z^2)", 4, 2, 5),
    "Kepler in the plane": (PLANE, PLANE_T, "-1/sqrt(x^2 + y^2)", 2, 2, 3),
    "Kepler in space": (SPACE, SPACE_T, "-1/sqrt(x^2 + y^2 + z^2)", 4, 2, 5),
    "inverse square": (PLANE, PLANE_T, "1/(x^2 + y^2)", 4, 2, 2),
    "uniform field": (PLANE, PLANE_T, "9.81*y", 5, 2, 3),
    "magnetic field": (PLANE, PLANE_T, "-0.7*(x*der(y) - y*der(x))", 4, 2, 3),
    "two bodies": (TWO, TWO_T, "-1/sqrt((x - X)^2 + (y - Y)^2)", 7, 2, 6),
    "two bodies on a line": (
        "parameter m = 2; parameter M = 3; coordinate x = 0; coordinate X = 1; initial der(x) = 1;",
        "1/2*m*der(x)^2 + 1/2*M*der(X)^2",
        "(x - X)^4",
        3,
        2,
        2,
    ),
    "Henon and Heiles": (PLANE, PLANE_T, "1/2*(x^2 + y^2) + x^2*y - y^3/3", 1, 4, 1),
    "Toda": (LINE3, LINE3_T, "exp(a - b) + exp(b - c) + exp(c - a)", 3, 3, 3),
    "Calogero and Moser": (
        LINE3 + "parameter g = 0.7; ",
        LINE3_T,
        "g^2/(a - b)^2 + g^2/(b - c)^2 + g^2/(c - a)^2",
        5,
        3,
        5,
    ),
    "pendulum": ("coordinate q = 1;", "1/2*der(q)^2", "-cos(q)", 1, 2, 1),
    "free symmetric top": (TOP, TOP_T, "0", 5, 2, 4),
    "heavy symmetric top": (TOP, TOP_T, "k*direction(body, {0, 0, 1})[3]", 3, 2, 3),
    "Kovalevskaya": (TOP, TOP_T, "k*direction(body, {1, 0, 0})[3]", 2, 4, 3),
    "Euler": (TOP.replace("B = 0.4", "B = 0.3"), TOP_T, "0", 4, 2, 4),
    "asymmetric heavy top": (
        TOP.replace("B = 0.4", "B = 0.3"),
        TOP_T,
        "k*direction(body, {1, 2, 3})[3]",
        2,
        4,
        2,
    ),
}


def model(name: str) -> mechc.Model:
    declared, kinetic, potential, *_ = SYSTEMS[name]
    return mechc.loads(
        f"model M dimensionless; {declared} kinetic {kinetic}; potential {potential}; "
        "experiment(stop = 3, tolerance = 1e-10); end M;"
    )


@pytest.mark.parametrize("name", SYSTEMS)
def test_symmetries_of_known_systems(name: str) -> None:
    found = model(name).symmetries()
    assert isinstance(found, Findings)
    listed = found.details["symmetries"]
    assert len(listed) == SYSTEMS[name][3], [one["generator"] for one in listed]
    assert max(one["drift"] for one in listed) < 1e-7
    gap = found.details["accuracy"]["gap"]
    assert gap["next"] > 1e3 * gap["largest_zero"]


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.slow
def test_integrals_of_known_systems(name: str) -> None:
    *_, degree, count = SYSTEMS[name]
    found = model(name).invariants(degree=degree)
    assert found.details["independent"] == count, [one["formula"] for one in found.details["invariants"]]
    assert max(one["drift"] for one in found.details["invariants"]) < 1e-7


# ---------------------------------------------------------------- formulas


def parsed(text: str) -> sp.Expr:
    """Read a formula with SymPy: der(x) is the symbol der_x."""
    return sp.sympify(
        re.sub(r"der\((\w+)\)", r"der_\1", text).replace("^", "**"), locals={"time": sp.Symbol("t")}
    )


def worst_rate(name: str, formulas: list[str]) -> float:
    """Return the largest rate of formulas along the motion as SymPy derives it from T and V, at random states."""
    declared, kinetic, potential, *_ = SYSTEMS[name]
    values = {n: float(v) for n, v in re.findall(r"parameter (\w+) = ([\d.]+)", declared)}
    names = re.findall(r"coordinate (\w+) ", declared)
    q, v = sp.symbols(names), sp.symbols([f"der_{n}" for n in names])
    q, v = list(np.atleast_1d(q)), list(np.atleast_1d(v))
    lagrangian = (parsed(kinetic) - parsed(potential)).subs(values)
    mass = sp.hessian(lagrangian, v)
    forces = [
        sp.diff(lagrangian, q[i]) - sum(sp.diff(lagrangian, v[i], q[j]) * v[j] for j in range(len(q)))
        for i in range(len(q))
    ]
    accelerations = mass.LUsolve(sp.Matrix(forces))
    t = sp.Symbol("t")
    random = np.random.default_rng(3)
    worst = 0.0
    for text in formulas:
        formula = parsed(text).subs(values)
        rate = sp.diff(formula, t) + sum(
            sp.diff(formula, a) * b + sp.diff(formula, b) * c
            for a, b, c in zip(q, v, accelerations, strict=True)
        )
        call = sp.lambdify([t, *q, *v], rate)
        for _ in range(4):
            worst = max(worst, abs(float(call(*random.uniform(0.4, 1.6, 1 + 2 * len(q))))))
    return worst


CARTESIAN = ("inverse square", "uniform field", "magnetic field", "two bodies", "free in the plane")


@pytest.mark.parametrize("name", CARTESIAN)
def test_formulas_of_symmetries_are_constant_by_another_derivation(name: str) -> None:
    found = model(name).symmetries()
    assert worst_rate(name, [one["conserved"] for one in found.details["symmetries"]]) < 1e-9


@pytest.mark.parametrize(("name", "degree"), [("Kepler in space", 2), ("Toda", 3)])
@pytest.mark.slow
def test_formulas_of_integrals_are_constant_by_another_derivation(name: str, degree: int) -> None:
    found = model(name).invariants(degree=degree)
    listed = [*found.details["invariants"], *found.details["dependent"]]
    assert worst_rate(name, [one["formula"] for one in listed]) < 1e-8


def test_runge_lenz() -> None:
    found = mechc.load(ROOT / "examples" / "kepler.mech").invariants()
    formulas = {one["formula"] for one in found.details["invariants"]}
    assert "x/sqrt(x^2 + y^2) + y*der(x)*der(y) - x*der(y)^2" in formulas
    assert found.details["independent"] == 3


def test_names_of_generators() -> None:
    names = {one["name"]: one for one in model("inverse square").symmetries().details["symmetries"]}
    assert names.keys() == {
        "translation in time",
        "rotation in y, x",
        "dilation",
        "conformal transformation",
    }
    assert names["rotation in y, x"]["generator"] == "x*d/dy - y*d/dx"
    assert names["dilation"]["generator"] == "x*d/dx + y*d/dy + 2*time*d/dt"
    magnetic = model("magnetic field").symmetries().details["symmetries"]
    assert sum(one["name"].startswith("magnetic translation") for one in magnetic) == 2
    two = {one["name"]: one["conserved"] for one in model("two bodies").symmetries().details["symmetries"]}
    assert two["translation along x, X"] == "m*der(x) + M*der(X)"
    assert two["boost along x, X"] == "m*time*der(x) + M*time*der(X) - m*x - M*X"


def test_what_holds_for_some_values_alone() -> None:
    """x and y may be exchanged by turning where masses and springs are equal."""
    text = """\
model Springs
  dimensionless;
  parameter m1 = 2; parameter m2 = {m2}; parameter k1 = 5; parameter k2 = 5;
  coordinate x = 1; coordinate y = 0; initial der(y) = 0.5;
  kinetic 1/2*m1*der(x)^2 + 1/2*m2*der(y)^2;
  potential 1/2*k1*x^2 + 1/2*k2*y^2;
  experiment(stop = 1);
end Springs;
"""
    equal = mechc.loads(text.format(m2=2)).symmetries().details["symmetries"]
    assert [one["holds"] for one in equal if one["name"].startswith("rotation")] == [
        "because m2 = m1 and k2 = k1"
    ]
    assert len(mechc.loads(text.format(m2=2.5)).symmetries().details["symmetries"]) == 1


BODIES = """\
import mech.{space}.*;
model M
  {gravity}
  {parts}
  experiment(stop = 1 s, tolerance = 1e-10);
end M;
"""


@pytest.mark.parametrize(
    ("space", "gravity", "parts", "count"),
    [
        ("planar", "", "Bar a; Bar b; Revolute s(world -> a.a); Revolute e(a.b -> b.a, angle = 1 rad);", 2),
        (
            "planar",
            "gravity {0, -9.81} m/s^2;",
            "Bar a; Bar b; Revolute s(world -> a.a); Revolute e(a.b -> b.a, angle = 1 rad);",
            1,
        ),
    ],
    ids=["pendulum without gravity", "pendulum"],
)
def test_models_of_bodies(space: str, gravity: str, parts: str, count: int) -> None:
    found = mechc.loads(BODIES.format(space=space, gravity=gravity, parts=parts)).symmetries()
    assert len(found.details["symmetries"]) == count


def test_rotations_of_the_world_in_angles() -> None:
    """A particle on a sphere without weight, in two angles: three rotations of the world and time."""
    text = """\
model Sphere
  parameter m = 2 kg; parameter l = 0.7 m;
  coordinate theta = 1 rad; coordinate phi = 0.3 rad; initial der(phi) = 2 rad/s; initial der(theta) = 0.5 rad/s;
  frame b = world * trans(l*{sin(theta)*cos(phi), sin(theta)*sin(phi), cos(theta)});
  mass m at b;
  experiment(stop = 1 s, tolerance = 1e-10);
end Sphere;
"""
    found = mechc.loads(text).symmetries().details["symmetries"]
    assert [one["name"] for one in found] == [
        "rotation by phi",
        "translation in time",
        "rotation of the world about x",
        "rotation of the world about y",
    ]
    assert max(one["drift"] for one in found) < 1e-8


def test_what_remains_of_a_damped_motion() -> None:
    """m v + c x is constant under linear drag, though energy is not."""
    text = """\
model Drag
  parameter m = 2 kg; parameter c = 0.3 N.s/m;
  coordinate x = 1 m; initial der(x) = 3 m/s;
  kinetic 1/2*m*der(x)^2;
  damping c on x;
  experiment(stop = 3 s);
end Drag;
"""
    found = mechc.loads(text).symmetries()
    assert "m*der(x) + c*x" in [one["conserved"] for one in found.details["symmetries"]]
    assert not any(one["name"] == "translation in time" for one in found.details["symmetries"])
    assert any("dissipates" in remark for remark in found.remarks)


def test_constraints_and_events() -> None:
    """A pendulum in x and y on a rod keeps its energy; so does a bouncing ball between its impacts, where p_y changes."""
    rod = """\
model Rod
  dimensionless;
  coordinate x = 0.6; coordinate y = -0.8; initial der(x) = 0.8; initial der(y) = 0.6;
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential {potential};
  constraint x^2 + y^2 = 1;
  experiment(stop = 3, tolerance = 1e-10);
end Rod;
"""
    assert len(mechc.loads(rod.format(potential="9.81*y")).symmetries().details["symmetries"]) == 1
    free = mechc.loads(rod.format(potential="0")).symmetries().details["symmetries"]
    assert {"translation in time", "rotation in y, x"} <= {one["name"] for one in free}
    ball = mechc.load(ROOT / "examples" / "bouncing_ball.mech").symmetries()
    assert any("between events" in remark for remark in ball.remarks)
    assert max(one["drift"] for one in ball.details["symmetries"]) < 1e-9


def test_nothing_that_moves_is_refused_in_words() -> None:
    text = "model Still dimensionless; output a = 2; experiment(stop = 1); end Still;"
    with pytest.raises(mechc.SimulationError, match="has no velocities"):
        mechc.loads(text).symmetries()
