"""Definite integrals against closed forms: values, and errors that are told where they are not known."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from compiled import compiled, outcome
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator
from slow_params import slow_among

import mechc
from mechc.compiler.graph import operations as ops
from mechc.compiler.mechanics.meaning import integrals
from mechc.compiler.mechanics.meaning.quadrature import BENT, Points, Rule, rules

TEXT = """\
model Integrals
  parameter k = {k};
  parameter c = {c};
  coordinate Length x = {x} m;
  kinetic 1/2*(1 kg)*der(x)^2;
  output I = {integral};
  experiment(stop = 1 s);
end Integrals;
"""


def solved(integral: str, k: float = 3.0, c: float = 0.3, x: float = 0.7, **values: float) -> mechc.Solution:
    model = mechc.loads(TEXT.format(integral=integral, k=k, c=c, x=x))
    return model.simulate(set=values)


def told(solution: mechc.Solution) -> float:
    """The largest estimated error, relative to the integral of |integrand|, as the run has it."""
    names = [q.name for q in solution.problem.outputs if q.kind == "quadrature"]
    return max(float(solution[name].max()) for name in names)


CLOSED: dict[str, Callable[[float, float, float], float]] = {
    "integral(cos(k*s) for s in 0:x/(1 m))": lambda k, c, x: math.sin(k * x) / k,
    "integral(abs(s - c) for s in 0:1)": lambda k, c, x: (c * abs(c) + (1 - c) * abs(1 - c)) / 2,
    "integral(abs(s - c) for s in 1:0)": lambda k, c, x: -(c * abs(c) + (1 - c) * abs(1 - c)) / 2,
    "integral(if s < c then s else k for s in 0:1)": lambda k, c, x: c**2 / 2 + k * (1 - c),
    "integral(max(s, c)*min(s, x/(1 m)) for s in 0:1)": lambda k, c, x: (
        c * c**2 / 2 + (x**3 - c**3) / 3 + x * (1 - x**2) / 2
    ),
    "integral(exp(s)/sqrt(s) for s in 0:1)": lambda k, c, x: 2.9253034918143632,
    "integral(log(s) for s in 0:c)": lambda k, c, x: c * math.log(c) - c,
    "integral(1/sqrt(-s) for s in -x/(1 m):0)": lambda k, c, x: 2 * math.sqrt(x),
    "integral(integral(s*t for t in 0:s) for s in 0:c)": lambda k, c, x: c**4 / 8,
}


LONG = [e for e in CLOSED if "integral(integral" in e or "max(" in e or "sqrt(-s)" in e]


@pytest.mark.parametrize("integral", slow_among(LONG, CLOSED))
def test_integrals_that_are_known(integral: str) -> None:
    """Kinks and jumps at places linear in the variable, ends that are singular, bounds that move and that are turned."""
    source = random.Random(integral)
    for _ in range(3):
        k, c, x = source.uniform(1, 9), source.uniform(0.1, 0.45), source.uniform(0.5, 0.9)
        model = mechc.loads(TEXT.format(integral=integral, k=k, c=c, x=x))
        solution = model.simulate()
        expected = CLOSED[integral](k, c, x)
        assert solution["I"][0] == pytest.approx(expected, rel=2e-10)
        assert told(solution) < 1e-8
        assert "is known to" not in str(solution.remarks)
        assert "W0538" not in [d.code for d in model.diagnostics]


@pytest.mark.parametrize("k", [3.0, 200.0, 700.0])
def test_a_rule_is_chosen_by_what_the_integrand_does(k: float) -> None:
    assert solved("integral(cos(k*s) for s in 0:1)", k=k)["I"][0] == pytest.approx(math.sin(k) / k, abs=1e-12)


def test_a_value_that_outgrows_the_rule_is_told_by_the_run() -> None:
    """The rule was chosen for k = 3; the estimate is at least as large as the error."""
    solution = mechc.loads(TEXT.format(integral="integral(cos(k*s) for s in 0:1)", k=3, c=0, x=1)).simulate(
        set={"k": 300.0}
    )
    error = abs(solution["I"][0] - math.sin(300) / 300)
    assert error > 1e-3
    assert told(solution) * 0.64 >= 0.1 * error  # the integral of |cos| is about 2/pi
    assert any("is known to about" in remark for remark in solution.remarks)


def test_an_integral_inside_of_another_tells_its_error() -> None:
    """The outer one is exact: all that is wrong comes from within."""
    inner = "integral(cos(k*r*s) for r in 0:1)"
    text = TEXT.format(integral=f"integral(s*{inner} for s in 1:2)", k=3, c=0, x=1)
    solution = mechc.loads(text).simulate(set={"k": 400.0})
    error = abs(solution["I"][0] - (math.cos(400) - math.cos(800)) / 400**2)
    assert told(solution) * 0.64 >= 0.1 * error > 1e-4
    assert any(inner in remark and "is known to about" in remark for remark in solution.remarks)


def test_integrals_inside_of_each_other_take_no_more_places_than_can_be_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(integrals, "PLACES", 2000)
    text = TEXT.format(integral="integral(integral(exp(s*r) for r in 0:1) for s in 0:9)", k=1, c=0, x=1)
    solution = mechc.loads(text).simulate()
    exact = quad(lambda s: math.expm1(s) / s, 0, 9)[0]
    assert 1e-9 < abs(solution["I"][0] / exact - 1) < told(solution) < 0.1


@pytest.mark.parametrize(
    ("integral", "value", "words"),
    [
        ("integral(1/sqrt(1 - s^2) for s in 0:1)", math.pi / 2, "known to"),
        ("integral(1/sqrt(s - c) for s in c:2)", 2 * math.sqrt(1.7), "known to"),
        ("integral(exp(-((s - 0.4)/0.0005)^2) for s in 0:1)", None, "not known"),
        ("integral(1/s for s in 0:1)", None, "not known"),
    ],
)
def test_what_no_rule_gives_is_told_when_compiling(integral: str, value: float | None, words: str) -> None:
    model = mechc.loads(TEXT.format(integral=integral, k=3, c=0.3, x=1))
    (warning,) = (d for d in model.diagnostics if d.code == "W0538")
    assert words in warning.message
    solution = model.simulate()
    if value is not None:
        assert abs(solution["I"][0] - value) <= told(solution) * value < 1e-6


@pytest.mark.parametrize(
    ("integral", "bends"),
    [
        ("integral(abs(sin(4.58*(s - c))) for s in 0:0.72)", lambda c: [c]),
        pytest.param("integral(max(s^2, c) for s in 0:1)", lambda c: [math.sqrt(c)], marks=pytest.mark.slow),
        pytest.param(
            "integral(if s^2 < c then 1 else s for s in 0:1)",
            lambda c: [math.sqrt(c)],
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "integral(s*floor(3*s + c) for s in 0:1)",
            lambda c: [(k - c) / 3 for k in (1, 2, 3)],
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_bends_elsewhere_is_known_as_well_as_is_told(
    integral: str, bends: Callable[[float], list[float]]
) -> None:
    """Kinks and jumps that are not split, wherever they lie; of 60 one may hide beside an end of a piece."""
    model = mechc.loads(TEXT.format(integral=integral, k=1, c=0.3, x=1))
    end = float(re.search(r"0:(\S+?)\)", integral)[1])  # type: ignore[index]
    body = eval(
        "lambda s, c: "
        + re.sub(r"if (.*?) then (.*?) else", r"(\2) if \1 else", integral[9:].split(" for ")[0]).replace(
            "^", "**"
        ),
        {"abs": abs, "sin": math.sin, "max": max, "floor": math.floor},
    )
    shares = []
    for c in random.Random(integral).sample(range(100, 500), 60):
        solution = model.simulate(stop=0.0, set={"c": c / 1000})
        places = [0.0, *bends(c / 1000), end]
        parts = [quad(body, a, b, (c / 1000,), epsabs=1e-13)[0] for a, b in pairwise(places)]
        shares.append(abs(solution["I"][0] - math.fsum(parts)) / (told(solution) * math.fsum(parts)))
    assert sorted(shares)[-2] < 1
    assert sorted(shares)[30] > 0.01  # and not far better


@pytest.mark.parametrize("rule", rules(pieces=True)[:-3], ids=lambda rule: rule.words)
def test_companions_tell_a_bend_wherever_it_lies(rule: Rule) -> None:
    """The integral of the power p of s - x from x to 1; next to an end no place may see it, where it is small."""
    x = np.random.default_rng(1).uniform(0, 1, 1500)

    def off(points: Points, p: int) -> Any:
        places, weights = np.array(points, float).T
        return np.maximum(0, places - x[:, None]) ** p @ weights - (1 - x) ** (p + 1) / (p + 1)

    for p in (1, 2):
        error = off(rule.points, p)
        largest = np.max([abs(error - off(points, p)) for points in rule.companions], axis=0)
        shares = abs(error) / (largest + 1e-15)
        assert max(shares[abs(error) > 0.02 * abs(error).max()]) < BENT
        assert np.quantile(shares, 0.97) < BENT


def test_a_potential_by_an_integral_moves_as_its_closed_form() -> None:
    """V = int_0^x k|s - c| ds has the force -k|x - c|."""
    text = """
model M
  coordinate Length x = 1 m;
  kinetic 1/2*(1 kg)*der(x)^2;
  potential {};
  experiment(stop = 1 s, tolerance = 1e-10);
end M;
"""
    by_integral = mechc.loads(text.format("integral((3 N/m)*abs(s - 0.2 m) for s in 0 m:x)")).simulate()
    closed = "(3 N/m)*((0.2 m)^2/2 + (x - 0.2 m)*abs(x - 0.2 m)/2)"
    assert by_integral["x"][-1] == pytest.approx(
        mechc.loads(text.format(closed)).simulate()["x"][-1], abs=1e-9
    )


@pytest.mark.parametrize(
    "integral",
    [
        "integral(cos(s) for s in 0:0)",
        "integral(0*cos(s) for s in 0:1)",
        "integral(cos(s) for s in x/(1 m):x/(1 m))",
        "integral(s - s for s in 0:x/(1 m))",
        "integral(integral(0*r for r in 0:s) for s in 0:1)",
        "integral(abs(s - s) for s in 0:1)",
    ],
)
def test_integral_of_nothing(integral: str) -> None:
    text = f"coordinate Length x = 0.3 m; kinetic 1/2*1 kg*der(x)^2; force 1 N + 1 N*{integral} on x; output found = {integral};"
    model = compiled(text)
    assert outcome(model, "rhs", {})["der(x)"] == 1
    assert outcome(model, "outputs", {})["found"] == 0


def test_an_integral_of_a_table_bends_at_its_points() -> None:
    """V = c integral of table(s - x) for s in 0:1 m pulls with c (table(1 m - x) - table(-x)), wherever its points lie."""
    model = mechc.loads(
        """coordinate Length x = 0.21 m;
        kinetic 1/2*1 kg*der(x)^2;
        potential 1 N/m*integral(table(s/(1 m) - x/(1 m), {-0.5, 0.1, 0.9}, {-0.95, -0.57, 0.1}) for s in 0 m:1 m)*1 m;
        output a = der(x, 2);
        experiment(stop = 1 us);"""
    )
    curve = PchipInterpolator([-0.5, 0.1, 0.9], [-0.95, -0.57, 0.1])
    for x in (0.21, 0.33, 0.45):
        solution = model.simulate(set={"x": x}, estimate_error=False)
        assert solution["a"][0] == pytest.approx(float(curve(1 - x) - curve(-x)), rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "most"), [("cos(x/(1 m)*s)", 3 * 24), ("cos(40*s)", 3 * 100)])
def test_pieces_between_points_of_a_table_are_short(factor: str, most: int) -> None:
    """Three pieces lie within the bounds. They take what they need, and the value keeps its digits as the points move."""
    table = f"table(s + 0.1*x/(1 m), {{-0.3, 0.5, 1.2}}, {{-0.57, -0.47, 0.44}})*{factor}"
    text = TEXT.format(integral=f"integral({table} for s in 0:1.5)", k=1, c=1, x=0.7)
    equations = compiled(text).equations
    (outputs,) = (f.outputs for f in equations.functions if f.name == "outputs")
    assert sum(equations.graph.op(n) == ops.LOOKUP for n in equations.graph.reach(outputs)) <= most
    inside = PchipInterpolator([-0.3, 0.5, 1.2], [-0.57, -0.47, 0.44])
    slope = inside.derivative()(1.2)

    def curve(u: float) -> float:
        """Goes straight on after its last point."""
        return float(inside(min(u, 1.2)) + slope * max(u - 1.2, 0.0))

    for x in (0.7, -1.4, 2.9):
        w = x if "x" in factor else 40.0
        ends = [0.0, *(sorted(min(max(p - 0.1 * x, 0.0), 1.5) for p in (-0.3, 0.5, 1.2))), 1.5]
        exact = sum(
            quad(lambda s, x=x, w=w: curve(s + 0.1 * x) * math.cos(w * s), a, b, epsabs=1e-14, limit=200)[0]
            for a, b in pairwise(ends)
        )
        found = mechc.loads(text).simulate(stop=0.01, set={"x": x})["I"][0]
        assert found == pytest.approx(exact, rel=1e-11, abs=1e-12)


@pytest.mark.slow
def test_energies_tell_the_error_of_what_the_motion_follows() -> None:
    """The slope of an integral whose integrand bends is one whose integrand jumps: it is off by far more."""
    what = "integral(abs(sin(7*(s - q/1 m))) for s in 0:1)"
    text = (
        "coordinate q = 0.1 m; initial der(q) = 1 m/s; kinetic 1/2*1 kg*der(q)^2; {} output a = der(der(q));"
    )
    run = mechc.loads(text.format(f"potential 1 J*{what};")).simulate(stop=0.5, every=0.01)
    (known,) = [float(r.split("about ")[1].split()[0]) for r in run.remarks if "known to about" in r]
    q = run["q"]
    force = np.abs(np.sin(7 * (1 - q))) - np.abs(np.sin(7 * q))  # - d/dq of the integral, by its ends
    size = [quad(lambda s, c=c: abs(7 * np.cos(7 * (s - c))), 0, 1, limit=200)[0] for c in q]
    off = np.max(np.abs(run["a"] - force) / size)
    assert 1e-3 < off < known < 50 * off
    for statement, sloping in (
        (f"force 1 N*{what} on q;", False),
        (f"output y = {what};", False),
        (f"output y = der({what});", True),
        (f"coordinate w ~ 0.5 m; kinetic 1/2*1 kg*der(w)^2; constraint c: w = 1 m*{what};", True),
    ):
        run = mechc.loads(text.format(statement)).simulate(stop=0.5, every=0.05)
        (here,) = [float(r.split("about ")[1].split()[0]) for r in run.remarks if "known to about" in r]
        assert (here > known / 20) == sloping


@pytest.mark.slow
def test_what_is_differentiated_tells_the_error_of_its_slope() -> None:
    text = "coordinate q = 0.1 m; initial der(q) = 1 m/s; kinetic 1 kg*der(q)^2;"
    what = "integral(abs(sin(7*(s - q/(1 m)))) for s in 0:1)"
    run = mechc.loads(f"{text} output d = der({what});").simulate(stop=0.5, every=0.01)
    (known,) = [float(r.split("about ")[1].split()[0]) for r in run.remarks if "known to about" in r]
    q = run["q"]
    slope = np.abs(np.sin(7 * q)) - np.abs(np.sin(7 * (1 - q)))  # by the ends of the integral
    size = [quad(lambda s, c=c: abs(7 * np.cos(7 * (s - c))), 0, 1, limit=200)[0] for c in q]
    off = np.max(np.abs(run["d"] / run["der(q)"] - slope) / size)
    assert 1e-3 < off < known < 50 * off


@pytest.mark.slow
def test_an_integral_in_the_equation_of_an_output_tells_its_error() -> None:
    what = "integral(abs(sin(7*s + x/1 m)) + 1 for s in 0:y)"
    text = f"coordinate x = 0.5 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2; output y ~ 0.5; equation {what} = 0.8;"
    run = mechc.loads(text).simulate(stop=0.5, every=0.05)
    (known,) = [float(r.split("about ")[1].split()[0]) for r in run.remarks if "known to about" in r]
    off = [
        abs(quad(lambda s, x=x: abs(math.sin(7 * s + x)) + 1, 0, y, limit=400)[0] / 0.8 - 1)
        for x, y in zip(run["x"], run["y"], strict=True)
    ]
    assert 1e-7 < max(off) < known < 100 * max(off)
