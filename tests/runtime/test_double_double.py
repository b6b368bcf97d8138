"""References by Taylor series in numbers of 106 bits, against closed solutions to fifty digits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mpmath
import numpy as np
import pytest
from gallery import EXAMPLES
from slow_params import slow_but

import mechc
from mechc.compiler.targets import c_double_double
from mechc.measurement import references, truth
from mechc.measurement.benchmark import reference_at
from mechc.measurement.references import compile_for_reference
from mechc.requests.request import asked
from mechc.runtime.reference.high_precision import PrecisionReference, ReferenceFailed, best_precision
from mechc.runtime.studies.kinds.motion import Simulate
from mechc.session import plan

ENOUGH = 1e-28
"""Largest relative error: 2^-104 is 5e-32, and the looser one of two runs is made at 1e-28. Measured 1e-31 at most."""

Closed = Callable[[mpmath.mpf], mpmath.mpf]

CASES: dict[str, tuple[str, float, Closed]] = {
    "oscillator": ("state x = 0; state v = 2; equation der(x) = v; equation der(v) = -4*x;", 8.0, lambda t: mpmath.sin(2 * t)),
    "saturating growth": ("state x = 0.25; equation der(x) = x*(1 - x);", 8.0, lambda t: 1 / (1 + 3 * mpmath.exp(-t))),
    "tangent": ("state x = 0; equation der(x) = 1 + x^2;", 1.5, mpmath.tan),
    "root": ("state x = 1; equation der(x) = sqrt(x);", 4.0, lambda t: (1 + t / 2) ** 2),
    "power": ("state x = 1; equation der(x) = x^(-5/2);", 4.0, lambda t: (1 + t * 7 / 2) ** (mpmath.mpf(2) / 7)),
    "quotient": ("state x = 1; equation der(x) = 1/(x + 1/x);", 2.0, lambda t: _implicit(t)),
    "function of time": ("state x = 0; equation der(x) = exp(sin(3*time))*cos(3*time);", 4.0, lambda t: (mpmath.exp(mpmath.sin(3 * t)) - 1) / 3),
    "pi": ("state x = 1; equation der(x) = -x*pi/3;", 3.0, lambda t: mpmath.exp(-t * mpmath.pi / 3)),
    "pi squared": (
        "state x = 1; equation der(x) = -x*(pi/3)^2;",
        3.0,
        lambda t: mpmath.exp(-t * mpmath.pi**2 / 9),
    ),
    "thirds": ("parameter a = 1/3; state x = 1; equation der(x) = -a*x/7;", 8.0, lambda t: mpmath.exp(-t / 21)),
    "arc": ("state x = 0; equation der(x) = cos(x);", 3.0, lambda t: 2 * mpmath.atan(mpmath.tanh(t / 2))),
    "choice": ("state x = 1; equation der(x) = if time < 9 then -x else x;", 3.0, lambda t: mpmath.exp(-t)),
}  # fmt: skip


def _implicit(t: mpmath.mpf) -> mpmath.mpf:
    """x + 1/x as a rate: x^2/2 + ln x = t + 1/2"""
    return mpmath.findroot(lambda x: x * x / 2 + mpmath.log(x) - t - mpmath.mpf(1) / 2, 1 + t / 2)


@pytest.fixture(autouse=True)
def wide_numbers() -> None:
    if best_precision() != "__float128":
        pytest.skip("this C compiler has no __float128")


def model_of(statements: str, stop: float = 8.0) -> mechc.Model:
    return mechc.loads(f"dimensionless;\n{statements}\nexperiment(stop = {stop});")


def exactly(made: PrecisionReference, row: int, state: int) -> mpmath.mpf:
    return mpmath.mpf(made.high[row, state]) + mpmath.mpf(made.low[row, state])


@pytest.mark.parametrize("name", slow_but(list(CASES)[::3], CASES))
def test_closed_solutions_to_thirty_digits(name: str) -> None:
    statements, stop, closed = CASES[name]
    with mpmath.workdps(50):
        made = reference_at(model_of(statements, stop), [stop / 4, stop])
        assert made.method == "taylor"
        for row, t in enumerate(made.t):
            expected = closed(mpmath.mpf(float(t)))
            error = abs(exactly(made, row, 0) - expected) / (1 + abs(expected))
            assert error < ENOUGH, (name, t, float(error))
            assert made.doubt[row] < ENOUGH


@pytest.mark.parametrize("rate", slow_but(["1e12"], ["1e-9", "1e-3", "1e6", "1e12"]))
def test_time_is_scaled_where_coefficients_leave_the_range_of_doubles(rate: str) -> None:
    """A rate of 1e12 has a coefficient of 1e840/70! at order 70."""
    stop = 8 / float(rate)
    made = reference_at(
        model_of(
            f"state x = 0; state v = 2; equation der(x) = {rate}*v; equation der(v) = -4*{rate}*x;", stop
        ),
        [stop],
    )
    assert made.method == "taylor"
    with mpmath.workdps(50):
        expected = mpmath.sin(2 * mpmath.mpf(rate) * mpmath.mpf(stop))
        assert abs(exactly(made, 0, 0) - expected) < ENOUGH


def test_second_run_steps_elsewhere() -> None:
    """Where both runs step from output to output, their difference would be zero, whatever rounding has done."""
    made = reference_at(model_of(CASES["oscillator"][0]), [float(t) for t in np.linspace(0.05, 8, 160)])
    assert 0 < made.doubt.max() < ENOUGH


@pytest.mark.slow
def test_start_on_constraints_to_all_digits() -> None:
    """A start in doubles is off its constraints by 1e-17, and what a step makes of that would depend on its length."""
    model = mechc.load(EXAMPLES / "universal_joint_shaft.mech")
    made = reference_at(model, [0.5, 1.25])
    assert made.method == "taylor" and made.doubt.max() < 1e-25


def test_other_methods_where_there_is_no_series_or_it_is_long(monkeypatch: pytest.MonkeyPatch) -> None:
    driven = mechc.loads(
        "dimensionless; input u = 1; state x = 0; equation der(x) = u - x; experiment(stop = 1);"
    )
    assert compile_for_reference(driven).explicit == "dop853"
    long = model_of(CASES["arc"][0])
    assert compile_for_reference(long).explicit == "taylor"
    assert compile_for_reference(long, "long double").explicit == "dop853"
    monkeypatch.setattr(c_double_double, "MOST_OPERATIONS", 1)
    assert compile_for_reference(long).explicit == "dop853"


def test_another_method_goes_on_where_a_series_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []

    def fail(*arguments: object, method: str, **options: object) -> PrecisionReference:
        tried.append(method)
        raise ReferenceFailed("no")

    monkeypatch.setattr(references, "reference", fail)
    with pytest.raises(ReferenceFailed):
        reference_at(model_of(CASES["oscillator"][0]), [1.0])
    assert tried == ["taylor", "dop853"]


def test_many_operations_are_calls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both forms of the arithmetic give the same bits."""
    model = model_of(CASES["saturating growth"][0])
    usual = reference_at(model, [8.0])
    monkeypatch.setattr(c_double_double, "MANY_OPERATIONS", 0)
    called = reference_at(model, [8.0])
    assert usual.high == called.high and usual.low == called.low


def test_run_by_series_is_judged_by_another_method(monkeypatch: pytest.MonkeyPatch) -> None:
    judges: list[str] = []

    def judge(*arguments: object, **options: object) -> PrecisionReference:
        judges.append(str(arguments[4]))
        raise ReferenceFailed("asked for its method only")

    monkeypatch.setattr(truth, "solve", judge)
    model = model_of(CASES["oscillator"][0])
    code = compile_for_reference(model)
    for method in ("dop853", "taylor", "radau5"):
        solution = model.simulate(method=method)
        with pytest.raises(ReferenceFailed):
            truth.true_errors(code, plan(model, asked(Simulate, {"method": method})), solution, 1.0)
    assert judges == ["taylor", "dop853", "radau5"]
