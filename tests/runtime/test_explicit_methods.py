"""Explicit Runge-Kutta methods are tables: the coefficients of those in the kernel, and one more that a test adds."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kernel_driver import run
from kernel_models import CARTESIAN_PENDULUM, KEPLER
from scipy.integrate import RK45

from mechc.runtime.native.kernel import kernel_sources
from mechc.runtime.native.status import Status

CIRCLE = (1.0, 0.0, 0.0, 1.0)
TABLES = {"rk4": "rk4.c", "dop853": "dop853_tableau.h", "dopri5": "dopri5.c"}


def tableau(name: str) -> dict[str, Any]:
    """Read TABLEAU: numbers, and lists of a number for each place, as its initialiser says."""
    file = TABLES[name]
    own = Path(__file__).parents[1] / "support" / file
    text = own.read_text(encoding="utf-8") if own.exists() else kernel_sources()[file]
    enums = dict(re.findall(r"\b([A-Z]+) = (\d+)", text))
    body = re.sub(r"/\*.*?\*/", "", text[text.index("TABLEAU = {") + len("TABLEAU = ") :], flags=re.S)
    body = re.sub(r"\bMECH_C\(([^()]*)\)", r"(\1)", body[: body.index("};") + 1])
    body = re.sub(r"\bQ\(([^()]*),([^()]*)\)", r"(\1 / \2)", body)
    body = re.sub(r"\b([A-Z]+)\b", lambda found: enums[found[1]], body)
    tokens = re.findall(r"\.[a-z_]+(?= =)|\[\d+\](?= =)|[{},]|[^\s{},=][^{},=]*", body)
    found = _initialiser(iter(tokens[1:]))
    return {str(key): value for key, value in found.items()}


def _initialiser(tokens: Any) -> dict[Any, Any]:
    found: dict[Any, Any] = {}
    place: Any = 0
    for token in tokens:
        if token == "}":
            return found
        if token == ",":
            continue
        if token.startswith("."):
            place = token[1:]
        elif token.startswith("["):
            place = int(token[1:-1])
        else:
            found[place] = _initialiser(tokens) if token == "{" else eval(token, {"__builtins__": {}})
            place = place + 1 if isinstance(place, int) else place
    raise AssertionError("an initialiser without an end")


def dense_array(weights: Mapping[int, float], n: int) -> Any:
    return np.array([weights.get(stage, 0.0) for stage in range(1, n + 1)])


@pytest.mark.parametrize(("name", "order"), [("rk4", 4), ("dop853", 8), ("dopri5", 5)])
def test_coefficients(name: str, order: int) -> None:
    """Conditions that coefficients of this order meet, to rounding: some of 200 for order 8, of 17 for order 5."""
    t = tableau(name)
    n = t["stages"]
    a = np.array([dense_array(t["a"].get(stage, {}), n) for stage in range(1, n + 1)])
    b, c = dense_array(t["b"], n) / t["over"], dense_array(t["c"], n)
    assert np.abs(a.sum(axis=1) - c).max() < 1e-14
    assert not np.triu(a).any()
    for power in range(order):
        assert b @ c**power == pytest.approx(1 / (power + 1), abs=1e-14)
        if power < order - 1:
            assert b @ a @ c**power == pytest.approx(1 / ((power + 1) * (power + 2)), abs=1e-14)
    further = t.get("further", 0)
    for stage in range(n + 2, n + 2 + further):
        assert sum(t["a"][stage].values()) == pytest.approx(t["c"][stage], abs=1e-14)
    if "error" in t:
        assert sum(t["error"].values()) == pytest.approx(0, abs=1e-14)
    if "embedded" in t:
        assert sum(t["embedded"].values()) == pytest.approx(1, abs=1e-14)
    for row in t.get("dense", {}).values():
        assert sum(row.values()) == pytest.approx(0, abs=1e-12)


def test_a_method_is_a_table() -> None:
    """A step of the one that is added, as scipy takes it: both see the same numbers but for their rounding."""

    def motion(t: float, y: Any) -> Any:
        x, v = y[:2], y[2:]
        return np.concatenate([v, -x / (x @ x) ** 1.5])

    theirs = RK45(motion, 0.0, np.array([0.6, 0.1, 0.2, 1.5]), 1.0, first_step=0.05, rtol=1e-3, atol=1.0)
    theirs.step()
    ours = run(KEPLER, "dopri5", (0.6, 0.1, 0.2, 1.5), 0.05, step=0.05, tolerance=1e30, further="dopri5")
    assert ours.status == Status.REACHED and ours.report["steps"] == 1
    assert theirs.t == 0.05
    assert np.abs(ours.y - theirs.y).max() < 4e-16


@pytest.mark.slow
def test_order_of_the_table() -> None:
    """On a circle, in quadruple precision: 5.09 and 5.05 were measured, and within one step 5.00 for the polynomial."""
    steps = (1 / 32, 1 / 64, 1 / 128)
    errors, inside = [], []
    for step in steps:
        many = run(
            KEPLER,
            "dopri5",
            CIRCLE,
            1.0,
            step=step,
            max_step=step,
            tolerance=1e30,
            quad=True,
            further="dopri5",
        )
        assert many.report["steps"] == round(1 / step)
        errors.append(many.error(np.array([np.cos(1.0), np.sin(1.0)])))
        times = np.linspace(0, step, 12)[1:-1]
        one = run(
            KEPLER, "dopri5", CIRCLE, step, step=step, tolerance=1e30, grid=times, quad=True, further="dopri5"
        )
        inside.append(np.abs(one.rows[:, :2] - np.stack([np.cos(times), np.sin(times)], axis=1)).max())
    assert np.abs(np.log2(np.divide(errors[:-1], errors[1:])) - 5).max() < 0.1, errors
    assert np.abs(np.log2(np.divide(inside[:-1], inside[1:])) - 5).max() < 0.02, inside


def test_steps_of_the_table_follow_the_tolerance() -> None:
    """Errors fall with it; the derivative at the end of a step is evaluated once, and begins the next one."""
    exact = run(KEPLER, "gauss8", (0.6, 0.0, 0.0, 1.5), 6.0, step=1 / 512)
    errors = []
    for tolerance in (1e-5, 1e-7, 1e-9):
        one = run(KEPLER, "dopri5", (0.6, 0.0, 0.0, 1.5), 6.0, tolerance=tolerance, further="dopri5")
        errors.append(one.error(exact.y))
        r = one.report
        assert r["evaluations"] == 6 * (r["steps"] + r["rejected"]) + 2, (
            "2: at the start, and for the first step"
        )
    ratios = np.divide(errors[:-1], errors[1:])
    assert ((ratios > 30) & (ratios < 300)).all(), errors


def test_the_table_stays_on_constraints() -> None:
    """Where a state is projected, the derivative at the end is that of the projected one: one more evaluation."""
    one = run(CARTESIAN_PENDULUM, "dopri5", (0.6, -0.8, 0.0, 0.0), 2.0, tolerance=1e-8, further="dopri5")
    assert one.status == Status.REACHED
    assert abs(np.hypot(*one.y[:2]) - 1) < 4e-16
    r = one.report
    assert r["evaluations"] == 7 * (r["steps"] + r["rejected"]) + 2 - r["rejected"]
    exact = run(CARTESIAN_PENDULUM, "dop853", (0.6, -0.8, 0.0, 0.0), 2.0, tolerance=1e-13)
    assert np.abs(one.y - exact.y).max() < 1e-6
