"""Elliptic integrals and functions: at 50 digits, and in motions that they solve."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import product
from typing import Any

import mpmath
import pytest
from msgspec.structs import replace

import mechc
from mechc.compiler.graph import Graph
from mechc.compiler.graph.differentiate import gradient
from mechc.compiler.graph.evaluate import evaluate, multiprecision
from mechc.compiler.mechanics.meaning.elliptic import FORMULAS
from mechc.compiler.targets.literal import with_true_pi

JUDGES: dict[str, Callable[..., Any]] = {
    "ellipk": mpmath.ellipk,
    "ellipf": mpmath.ellipf,
    **{name: lambda u, m, name=name: mpmath.ellipfun(name, u, m=m) for name in ("sn", "cn", "dn")},
}
PLACES = (0.4, 1.7, -2.9, 7.5)
PARAMETERS = (-3.5, -1e-9, 0.0, 0.3, 0.99)


@pytest.mark.parametrize("name", FORMULAS)
def test_values_and_derivatives_are_those_of_mpmath(name: str) -> None:
    """To 30 digits, by central differences over 1e-20 of 60 digits; m = 0 among them."""
    g = Graph()
    judge, step = JUDGES[name], mpmath.mpf("1e-20")
    symbols = [g.symbol(x) for x in ("um" if name != "ellipk" else "m")]
    nodes = [n := FORMULAS[name](g, *symbols), *gradient(g, n, symbols)]
    with mpmath.workdps(60):
        numbers, pi = multiprecision(mpmath.mp), Fraction(mpmath.nstr(mpmath.pi, 60))
        numbers = replace(numbers, constant=lambda c, of=numbers.constant: of(with_true_pi(c, pi)))
        for at in product(*([PLACES, PARAMETERS][-len(symbols) :])):
            given = [mpmath.mpf(x) for x in at]
            found = evaluate(g, nodes, dict(zip(symbols, given, strict=True)), numbers)
            wanted = [judge(*given)]
            for k in range(len(given)):
                ends = [judge(*(x + sign * step * (i == k) for i, x in enumerate(given))) for sign in (1, -1)]
                wanted.append((ends[0] - ends[1]) / (2 * step))
            for one, other in zip(found, wanted, strict=True):
                assert abs(one - other) < mpmath.mpf("1e-28") * (1 + abs(other)), (name, at)


def test_a_pendulum_is_an_elliptic_sine() -> None:
    """sin(theta/2) = k sn(K - w t): beside the motion, as an output of the model; its period is 4 K/w."""
    model = mechc.loads("""
        model Pendulum
          parameter l = 1 m;
          parameter g = 9.81 m/s^2;
          parameter amplitude = 170 deg;
          coordinate Angle theta = amplitude;
          kinetic 1/2*1 kg*l^2*der(theta)^2;
          potential -1 kg*g*l*cos(theta);
          let m = sin(amplitude/2)^2;
          let w = sqrt(g/l);
          output exact = 2*asin(sqrt(m)*sn(ellipk(m) - w*time, m));
          output past = ellipf(asin(sin(theta/2)/sqrt(m)), m) - ellipk(m) + w*time;
          experiment(stop = 1.5 s, tolerance = 1e-12);
        end Pendulum;
    """)
    found = model.simulate()
    assert abs(found["exact"] - found["theta"]).max() < 1e-9
    assert abs(found["past"]).max() < 1e-7  # the slope of asin is large at the start


def test_they_move_what_reads_them() -> None:
    """sn' = cn dn, cn' = -sn dn, dn' = -m sn cn (Euler's top), by all of: rates, der, Taylor series."""
    text = "dimensionless; parameter m = 0.7; state s = 0; equation der(s) = cn(time, m)*dn(time, m);"
    text += "output off = s - sn(time, m); output slope = der(dn(time, m)) + m*sn(time, m)*cn(time, m);"
    for method in ("dop853", "taylor"):
        found = mechc.loads(f"{text} experiment(stop = 9, tolerance = 1e-12);").simulate(method=method)
        assert abs(found["off"]).max() < 1e-10 and abs(found["slope"]).max() < 1e-13
