"""Answers of the sources that files print beside a motion: formulas against what moves, and equations of motion against SymPy."""

from __future__ import annotations

import contextlib
import io
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from gallery import load

from mechc.cli.main import run

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


# ---------------------------------------------------------------- equations


def printed(example: str) -> str:
    """Return what ``mechc equations`` prints."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert run(["equations", str(EXAMPLES / f"{example}.mech")]) == 0
    return out.getvalue()


def formula(text: str) -> sympy.Expr:
    """Read ``l^2*m*theta''``: each name, with its primes and dots, is a symbol."""
    names: dict[str, sympy.Symbol] = {}

    def symbol(match: re.Match[str]) -> str:
        name = match[0].replace(".", "_").replace("'", "_dot")
        names[f"v_{name}"] = sympy.Symbol(name)
        return f"v_{name}"

    text = re.sub(r"\b(?!(?:sin|cos|tan)\b)[A-Za-z_][\w.]*'*", symbol, text)
    return sympy.sympify(text.replace("^", "**"), locals=names)


EQUATIONS = [
    ("U43", "pendulum", "0", ["m*l^2*(theta'' + g/l*sin(theta))"]),
    (
        "U45",
        "elastic_pendulum",
        "0",
        [
            "m*(r'' - r*theta'^2 - g*cos(theta) + k/m*(r - l0))",
            "m*r*(r*theta'' + 2*r'*theta' + g*sin(theta))",
        ],
    ),
    ("U46", "pendulum_accelerating_support", "0", ["m*r^2*(theta'' + (g + a)/r*sin(theta))"]),
    ("U51", "shaken_incline", "0", ["m*(x'' - (g - a*w^2*sin(w*t))*sin(slope))"]),
    (
        "U52",
        "double_pendulum_momenta",
        "p[",
        [
            "(m1 + m2)*l1^2*th1' + m2*l1*l2*th2'*cos(th1 - th2)",
            "m2*l2^2*th2' + m2*l1*l2*th1'*cos(th1 - th2)",
        ],
    ),
    (
        "U54",
        "varying_length",
        "0",
        ["m*(r0 + a*sin(w*t))*((r0 + a*sin(w*t))*theta'' + 2*a*w*cos(w*t)*theta' + g*sin(theta))"],
    ),
    ("U56", "bead_on_oscillating_hoop", "0", ["m*r^2*(theta'' + a*w^2/r*sin(w*t)*sin(theta))"]),
    (
        "U58",
        "pendulum_driven_support",
        "0",
        ["m*r^2*(theta'' - a/r*w^2*sin(w*t)*cos(theta) + g/r*sin(theta))"],
    ),
    ("U62, V9", "lagrangian_with_acceleration", "0", ["m*q'' + k*q"]),
    ("U66", "sliding_support", "p[", ["(M + m)*X' + m*r*theta'*cos(theta)"]),
    (
        "T16",
        "paraboloid",
        "L",
        ["m/2*(x'^2 + y'^2 + 4*a^2*(x*x' + y*y')^2) - m*g*a*(x^2 + y^2)"],
    ),
    (
        "V3",
        "double_pendulum_points",
        "0",
        [
            "(m1 + m2)*l1^2*th1'' + m2*l1*l2*(th2''*cos(th1 - th2) + th2'^2*sin(th1 - th2)) + (m1 + m2)*g*l1*sin(th1)",
            "m2*l2^2*th2'' + m2*l1*l2*(th1''*cos(th1 - th2) - th1'^2*sin(th1 - th2)) + m2*g*l2*sin(th2)",
        ],
    ),
    (
        "V4",
        "cone",
        "L",
        ["m/2*(rho'^2/sin(alpha)^2 + rho^2*phi'^2) - m*g*rho*cos(alpha)/sin(alpha)"],
    ),
    (
        "V11",
        "bar_pendulum",
        "0",
        ["bar.m*bar.l^2/3*(hinge.angle'' + 3*g/(2*bar.l)*sin(hinge.angle))"],
    ),
    ("P5", "curves/two_variables", "0", ["y'' - z", "z'' - y"]),
]


@pytest.mark.parametrize(
    ("name", "example", "left", "expected"),
    [
        pytest.param(*case, id=case[0], marks=() if case[0] in ("U43", "P5") else pytest.mark.slow)
        for case in EQUATIONS
    ],
)
def test_equations_that_are_asked(name: str, example: str, left: str, expected: list[str]) -> None:
    """U43, U45, U46, U51, U52, U54, U56, U58, U62, U66, T16, V3, V4, V9, V11, P5."""
    lines = [line.strip().partition(" = ") for line in printed(example).splitlines()]
    found = [right for before, equals, right in lines if equals and before.startswith(left)]
    assert len(found) >= len(expected), found
    for one, other in zip(found, expected, strict=False):
        difference = formula(one) - formula(other)
        rng = np.random.default_rng(1)
        for _ in range(3):
            values = {s: sympy.Rational(int(rng.integers(1, 99)), 100) for s in difference.free_symbols}
            assert abs(difference.evalf(30, subs=values)) < 1e-25, one


# ---------------------------------------------------------------- formulas beside motions

ALONG: list[tuple[str, str, str, str | float, float]] = [
    # rows U11, U30, U44, U77, U67, U110, U116, U122, U128, U134, U137, U145, U154, U101, U88, T5, T11, T15, T25, K3, P7, T13: the errors
    # are those of motions at the tolerance of the file
    ("exponential_force", "", "der(x)", "speed", 1e-9),
    ("horizontal_drag", "", "x", "way", 1e-8),
    ("horizontal_drag", "longer", "x", "way", 1e-8),
    ("bead_on_hyperbola", "", "off", 0.0, 2e-5),  # x y = c holds to 1e-9 between steps, times 1/y^5
    ("isotropic_oscillator", "least", "E", "least_energy", 1e-12),
    ("string_pendulum", "swings", "tension", "taut", 1e-5),
    ("string_pendulum", "turns", "tension", "taut", 1e-4),
    ("gravitating_pair", "", "off", 0.0, 1e-9),
    ("orbit_equation", "", "p", 1.0, 1e-12),
    ("orbit_equation", "", "eccentricity", 0.5, 1e-8),
    ("orbit_equation", "hyperbola", "eccentricity", 1.5, 1e-8),
    ("orbit_equation", "hyperbola", "runge_lenz[1]", 1.5, 1e-8),
    ("orbit_equation", "", "runge_lenz[2]", 0.0, 1e-8),
    ("cylinder_and_shell", "", "spin[1]", "expected[1]", 1e-8),
    ("cylinder_and_shell", "", "spin[2]", "expected[2]", 1e-8),
    ("rod_in_circle", "", "length", 1.0, 1e-4),  # 0/0 in the middle
    ("hinge_reaction", "", "F[1]", "expected[1]", 1e-7),
    ("hinge_reaction", "", "F[2]", "expected[2]", 1e-7),
    ("euler_equations", "", "torques[1]", "N[1]", 1e-12),
    ("euler_equations", "", "torques[2]", "N[2]", 1e-12),
    ("euler_equations", "", "torques[3]", 0.0, 1e-12),
    ("heavy_symmetric_top", "", "der(phi)", "precession", 1e-7),
    ("heavy_symmetric_top", "free", "theta", 0.5, 1e-9),
    ("heavy_symmetric_top", "free", "der(phi)", 6.0, 1e-9),
    ("schwarzschild", "", "off", 0.0, 1e-10),
    ("moving_frame", "", "gain", 0.0, 1e-12),
    ("forced_pendulum", "undamped", "theta", "growth", 1e-9),
    ("free_symmetric_top", "", "precession[1]", math.sqrt(148) / 2, 1e-8),
    ("free_symmetric_top", "", "precession[2]", math.sqrt(148) / 2, 1e-8),
    ("free_symmetric_top", "", "in_the_body[1]", 2.0, 1e-8),
    ("free_symmetric_top", "", "in_the_body[2]", 2.0, 1e-12),
    ("uniform_force", "", "S", "expected", 1e-9),
    ("uniform_force", "", "p", "dS_dx", 1e-9),
    ("kepler_four_orbits", "", "on_the_ellipse", 1.0, 1e-6),
    ("ladder", "", "share", 1.0, 1e-7),
    ("free_lamina", "square", "w[3]", 3.0, 1e-12),
]


@pytest.mark.parametrize(
    ("example", "experiment", "found", "expected", "within"),
    [
        pytest.param(*case, id="-".join(map(str, case[:3])), marks=() if k < 2 else pytest.mark.slow)
        for k, case in enumerate(ALONG)
    ],
)
def test_a_formula_beside_the_motion(
    example: str, experiment: str, found: str, expected: str | float, within: float
) -> None:
    solution: Any = load(example).simulate(experiment=experiment or None, estimate_error=False)
    wanted = np.asarray(solution[expected] if isinstance(expected, str) else expected)
    behind = solution.time > 0
    gap = np.abs(solution[found] - wanted)[behind]
    assert gap.max() < within * max(1.0, float(np.abs(wanted).max()))


def test_capture_falls_and_misses() -> None:
    """U116: r^2 = E (t - t0)^2 + ((l^2/(2 m)) - alpha)/E with 2 E/m = E for m = 2."""
    model = load("capture")
    misses = model.simulate(estimate_error=False).final()
    E = 1 - 0.5 / 26
    assert misses["nearest"] == pytest.approx(math.sqrt((1 - 0.5) / E), rel=1e-7)
    assert misses["least"] == pytest.approx(math.sqrt((1 - 0.5) / E), rel=1e-9)
    falls = model.simulate(experiment="falls")
    E = 1 - 0.5 / 25.36
    lowest = (0.36 - 0.5) / E
    ends = 5 / E - math.sqrt((1e-8 - lowest) / E)
    assert falls.time[-1] == pytest.approx(ends, abs=1e-7) and falls.final()["least"] == 0


@pytest.mark.parametrize(
    ("orbit", "a", "b", "h"),
    [
        (None, 1.4698, 0.9401, -1.1298),
        ("orbit2", 2.5510, 1.3714, -2.1510),
        ("orbit3", 0.4545, 0.4523, 0.0455),
        ("orbit4", 2.3656, 0.9520, -2.1656),
    ],
)
def test_ellipses_of_the_planet(orbit: str | None, a: float, b: float, h: float) -> None:
    """K3, with the digits of the thesis."""
    found = load("kepler_four_orbits").simulate(experiment=orbit, estimate_error=False).final()
    assert [found[name] for name in ("a", "b", "h")] == pytest.approx([a, b, h], abs=6e-5)
    assert found["period"] == pytest.approx(2 * math.pi * math.sqrt(a**3 / 125), rel=3e-4)  # of a to 5e-5


def test_frequencies_about_the_axes() -> None:
    """U139: sqrt(2 1/(2 3)) about the first axis of J = (1, 2, 3), sqrt(2 1/(1 2)) about the last, for a rate of 1."""
    model = load("tennis_racket")
    first = model.simulate(experiment="smallest", estimate_error=False).final()["first"]
    last = model.simulate(experiment="largest", estimate_error=False).final()["last"]
    assert (first, last) == pytest.approx((1 / math.sqrt(3), 1.0), rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["CavityPendulum", "AboutCavity"])
def test_frequency_of_the_hollow_ball(name: str) -> None:
    """T21: the frequency by the formula is that of the modes."""
    model = load("cavity_pendulum", name)
    (mode,) = model.modes().frequencies
    assert model.simulate(estimate_error=False).final()["w"] == pytest.approx(mode, rel=1e-12)
