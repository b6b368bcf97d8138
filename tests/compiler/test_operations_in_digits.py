"""Operations and their derivatives at 50 digits: a constant that is only a double would be off in the 17th.

Solutions of higher precision are made of these, and estimate their errors by a second run of the same code: what both share, no
difference between them tells.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import mpmath
import pytest
from all_operations import ROWS, TABLE, apply, file_of, in_digits, is_regular, points
from msgspec.structs import replace

import mechc
from mechc.compiler.graph import Graph, Node
from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.differentiate import gradient, jvp
from mechc.compiler.graph.evaluate import evaluate, multiprecision
from mechc.compiler.graph.operation import Operation, Partial
from mechc.compiler.targets import balls
from mechc.compiler.targets.literal import with_true_pi
from mechc.measurement.benchmark import reference_at
from mechc.runtime.reference.high_precision import best_precision

TABLE_ROW = file_of(ops)
OWN: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "neg": lambda a: -a,
    "div": lambda a, b: a / b,
    "abs": abs,
    "minimum": min,
    "maximum": max,
    "modulo": lambda a, b: a - b * mpmath.floor(a / b),
    "pow": lambda a, b: mpmath.exp(b * mpmath.log(a)),
    "equal": lambda a, b: mpmath.mpf(a == b),
    "select": lambda condition, a, b: a if condition else b,
    "derived": lambda value, formula: value,
}
"""Where mpmath has no function of the same name, or another one."""
CHOICES = {ops.LESS, ops.LESS_EQUAL, ops.EQUAL, ops.AND, ops.OR, ops.NOT, ops.SELECT, ops.LOOKUP, ops.NORMAL}
CHOICES |= {ops.DERIVED}
"""They compute nothing, or are tables of floats, or random ones; ``derived`` has the derivatives of something else."""

DIFFERENTIABLE = [row for row in ROWS if row.code not in CHOICES]
EVERY = pytest.mark.parametrize("row", DIFFERENTIABLE, ids=[row.name for row in DIFFERENTIABLE])

DIGITS = mpmath.mpf("1e-48")


def places(row: Operation) -> list[tuple[float, ...]]:
    found = [at for at in points(row, (), 40) if is_regular(row, at) and max(map(abs, at)) < 50]
    assert len(found) >= 5
    return found


def expected(row: Operation, at: tuple[Any, ...]) -> Any:
    function = OWN.get(row.name) or getattr(mpmath, row.name, None)
    assert function is not None, f"say in this test what '{row.name}' is at 50 digits, without {TABLE_ROW}"
    return function(*at)


@EVERY
def test_values_are_those_of_mpmath(row: Operation) -> None:
    with mpmath.workdps(60):
        for at in places(row):
            found, wanted = in_digits(row, at), expected(row, tuple(map(mpmath.mpf, at)))
            assert mpmath.almosteq(found, wanted, DIGITS, DIGITS), (
                f"'digits' of '{row.name}' in {TABLE_ROW} at {at}"
            )


def with_pi() -> Any:
    """Return numbers of many digits in which pi has all of them; the code of references has 41 of pi."""
    numbers, pi = multiprecision(mpmath.mp), Fraction(mpmath.nstr(mpmath.pi, 60))
    return replace(numbers, constant=lambda number: numbers.constant(with_true_pi(number, pi)))


def check_derivatives(row: Operation) -> None:
    """Compare the rules of a row, and what differentiates by them, with central differences of mpmath's functions.

    Differences over 2e-30 of 130 digits are off by 1e-60 of the third derivative.
    """
    step = mpmath.mpf("1e-30")
    with mpmath.workdps(130):
        for at in places(row):
            g = Graph()
            symbols = [g.symbol(f"x{i}") for i in range(row.arity)]
            n = apply(g, row, symbols)
            given = {s: mpmath.mpf(x) for s, x in zip(symbols, at, strict=True)}
            for which, symbol in enumerate(symbols):

                def shifted(by: Any, which: int = which, at: tuple[float, ...] = at) -> Any:
                    return expected(
                        row, tuple(mpmath.mpf(x) + (by if i == which else 0) for i, x in enumerate(at))
                    )

                wanted = (shifted(step) - shifted(-step)) / (2 * step)
                slopes = [jvp(g, [n], {symbol: g.one})[0], gradient(g, n, [symbol])[0]]
                if row.partials:
                    slopes.append(row.partials[which](g, tuple(symbols), n))
                for found in evaluate(g, slopes, given, with_pi()):
                    assert mpmath.almosteq(found, wanted, DIGITS, DIGITS), (
                        f"derivative {which + 1} of '{row.name}' at {at}: differences give "
                        f"{mpmath.nstr(wanted, 50)}, its rule {mpmath.nstr(found, 50)}: 'partials' in {TABLE_ROW}"
                    )


@EVERY
def test_derivatives_are_those_of_differences(row: Operation) -> None:
    check_derivatives(row)


def rounded(rule: Partial) -> Partial:
    """Return a rule with a constant that is off by half a unit in the last place of a double."""
    return lambda g, x, n: g.mul(g.constant(3 * Fraction(1 / 3)), rule(g, x, n))


@EVERY
def test_a_constant_that_is_a_double_is_found(row: Operation) -> None:
    """Planted in each rule."""
    for which, rule in enumerate(row.partials):
        rules = (*row.partials[:which], rounded(rule), *row.partials[which + 1 :])
        with pytest.raises(AssertionError, match=f"derivative {which + 1} of '{row.name}'"):
            check_derivatives(replace(row, partials=rules))


@pytest.mark.parametrize("row", [row for row in ROWS if row.ball], ids=lambda row: row.name)
def test_balls_hold_the_value(row: Operation) -> None:
    """And are no wider than a proof may use."""
    flint = pytest.importorskip("flint")
    with flint.ctx.workdps(60), mpmath.workdps(60):
        for at in places(row):
            ball = balls.FORMS[row.code](*map(flint.arb, at))
            found = mpmath.mpf(ball.mid().str(60, radius=False))
            wanted = expected(row, tuple(map(mpmath.mpf, at)))
            assert mpmath.almosteq(found, wanted, DIGITS, DIGITS), f"'{row.name}' at {at}"
            assert ball.rad() <= 1e-45 * (1 + abs(ball)), f"'{row.name}' at {at}"


CURVED = [row for row in DIFFERENTIABLE if row.arity == 1 and row.partials and row.name not in ("neg", "abs")]


def test_references_have_the_digits_that_they_claim() -> None:
    """Of s' = f(s), for each function f of one argument: the time that s takes is the integral of ds/f(s)."""
    if best_precision() != "__float128":
        pytest.skip("this C compiler has no __float128")
    starts = {row.name: {"log": 2.2, "acosh": 1.5}.get(row.name, 0.3) for row in CURVED}
    text = "".join(f"state s_{n} = {s}; equation der(s_{n}) = {n}(s_{n});" for n, s in starts.items())
    made = reference_at(mechc.loads(f"dimensionless; {text} experiment(stop = 0.25);"), [0.25])
    assert made.method == "taylor" and len(starts) >= 15 and made.doubt.max() < 1e-28
    with mpmath.workdps(40):
        for k, (name, start) in enumerate(starts.items()):
            function = getattr(mpmath, name)
            end = mpmath.mpf(made.high[0, k]) + mpmath.mpf(made.low[0, k])
            took = mpmath.quad(lambda s, f=function: 1 / f(s), [mpmath.mpf(str(start)), end])
            assert abs(took - mpmath.mpf("0.25")) * abs(function(end)) < 1e-28, name


@pytest.mark.parametrize("derive", ["forward", "gradient"])
def test_choices_and_tables_differentiate(derive: str) -> None:
    """A choice by its branch, exactly; a table of floats as its differences do, to the error of these."""
    g = Graph()
    c, a, b = (g.symbol(name) for name in "cab")
    chosen = g.select(g.less(c, g.half), a, b)
    found = g.lookup(g.add_table(TABLE), a)

    def slopes(n: Node) -> list[Node]:
        return (
            gradient(g, n, [a, b]) if derive == "gradient" else [jvp(g, [n], {s: g.one})[0] for s in (a, b)]
        )

    for side in (0.0, 1.0):
        assert evaluate(g, slopes(chosen), {c: side, a: 3.0, b: 4.0}) == [1 - side, side]
    for at in (-1.7, -0.3, 0.1, 0.9, 2.6):
        (slope, none) = evaluate(g, slopes(found), {a: at, b: 0.0})
        assert slope == pytest.approx((TABLE(at + 1e-6) - TABLE(at - 1e-6)) / 2e-6, abs=1e-8) and none == 0
