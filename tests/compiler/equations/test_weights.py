"""Weights of constraints: given where the mass matrix is singular, and nowhere else; at a cost that grows as the mechanism."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechc
from mechc.compiler.equations.model import SINGULAR_MASS, Equations
from mechc.compiler.equations.rows import weights
from mechc.compiler.equations.rows.constraints import Row
from mechc.compiler.equations.rows.weights import give_weights
from mechc.compiler.mechanics.system import MechanicalSystem


def equations(text: str) -> Equations:
    return mechc.loads(text).compilation.equations


def weighted(found: Equations) -> bool:
    return any(choice.topic == SINGULAR_MASS for choice in found.choices)


def operations(found: Equations) -> int:
    (reason,) = (choice.reason for choice in found.choices if choice.topic == "accelerations")
    return int(reason.split()[0])


def four_bars(count: int, mass: float) -> str:
    """A row of rockers with mass, each coupled with the next by a rod."""
    lines = ["import mech.planar.*;", "gravity {0, -9.81 m/s^2};"]
    for i in range(count + 1):
        lines.append(f"Bar r{i}(m = 1 kg, l = 0.{5 + i % 3} m);")
        lines.append(f"Revolute b{i}(world * trans({{{i} m, 0 m}}) -> r{i}.a, angle ~ 1.2 rad);")
    for i in range(count):
        lines.append(f"Bar c{i}(m = {mass} kg, l = 1.05 m);")
        lines.append(f"Revolute d{i}(r{i}.b -> c{i}.a, angle ~ -1.2 rad);")
        lines.append(f"cut Revolute e{i}(c{i}.b -> r{i + 1}.b);")
    return "\n".join([*lines, "experiment(stop = 1 s);"])


def test_a_regular_mass_matrix_gets_no_weights() -> None:
    assert not weighted(equations(four_bars(2, 0.3)))
    assert not weighted(equations(four_bars(2, 1e-6)))
    assert weighted(equations(four_bars(2, 0)))


def test_what_weights_cost() -> None:
    """Counted: 108 operations more than 199, and 122 where weights multiply gamma, too."""
    massless, massive = (operations(equations(four_bars(1, mass))) for mass in (0, 0.3))
    assert massive < massless <= massive + 112


def test_the_cost_of_many_massless_links_is_linear() -> None:
    """Measured: twice the operations of links with mass, and 1 950 more for every five loops."""
    five, ten, fifteen = (operations(equations(four_bars(n, 0))) for n in (5, 10, 15))
    assert fifteen - ten == pytest.approx(ten - five, rel=0.1)
    assert ten < 2.2 * operations(equations(four_bars(10, 0.3)))


def test_weights_are_formulas_of_the_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    """So they are computed once and not in each evaluation, though the inertia of a bar is a sum of sin^2 and cos^2."""
    rows: list[Row] = []

    def noted(system: MechanicalSystem, *rest: Any, **more: Any) -> tuple[Row, ...]:
        found = give_weights(system, *rest, **more)
        parameters = {s.node for s in system.symbols.parameters}
        for row in found:
            assert row.weight is not None and parameters.issuperset(system.graph.support(row.weight))
            rows.append(row)
        return found

    monkeypatch.setattr(weights, "give_weights", noted)
    mechc.loads(four_bars(1, 0) + "output Length here = 1 m;").compilation  # noqa: B018, no other test forms this text
    assert len(rows) >= 2


LINKS = """
parameter J = 0 kg.m^2;
coordinate Angle a ~ 0.3 rad;
coordinate Angle b ~ 0.5 rad;
coordinate Length x ~ 1 m;
initial der(x) = 1 m/s;
kinetic 1/2*J*(der(a) + der(b))^2 + 1/2*2 kg*der(x)^2;
constraint along: x = 1 m*cos(a) + 0.5 m*cos(b);
constraint across: 1 m*sin(a) = 0.7 m*sin(b);
experiment(stop = 1 s);
"""


def slopes(a: float, b: float, da: float, db: float) -> tuple[Any, list[float]]:
    """Return K and gamma of LINKS."""
    k = np.array([[np.sin(a), 0.5 * np.sin(b), 1.0], [np.cos(a), -0.7 * np.cos(b), 0.0]])
    gamma = [np.cos(a) * da**2 + 0.5 * np.cos(b) * db**2, -np.sin(a) * da**2 + 0.7 * np.sin(b) * db**2]
    return k, gamma


@pytest.mark.parametrize("share", [0.0, 0.4])
def test_multipliers_are_those_of_the_whole_matrix(share: float) -> None:
    """At random states off the constraints, also where a force of the equations is a share of a multiplier."""
    text = LINKS + "output along_it = multiplier(along); output across_it = multiplier(across);"
    if share:
        text += f"force {share}*multiplier(along) on x;"
    model = mechc.loads(text)
    random = np.random.default_rng(2)
    for _ in range(20):
        a, b, x, da, db, dx = random.uniform(0.2, 1.2, 6)
        k, gamma = slopes(a, b, da, db)
        forces = -k.T
        forces[2, 0] -= share
        whole = np.block([[np.diag([0.0, 0.0, 2.0]), forces], [k, np.zeros((2, 2))]])
        exact = np.linalg.solve(whole, [0, 0, 0, -gamma[0], -gamma[1]])
        state = np.zeros(len(model.functions.states))
        state[:6] = a, b, x, da, db, dx
        assert model.functions.accelerations(state) == pytest.approx(exact[:3], rel=1e-10, abs=1e-10)
        found = [model.functions.output[name](state) for name in ("along_it", "across_it")]
        assert found == pytest.approx(exact[3:], rel=1e-10, abs=1e-10)


def test_accelerations_are_those_of_the_whole_matrix() -> None:
    """Against numpy: [[M, -K^T], [K, 0]] (a, lam) = (0, -gamma) at random states off the constraints, M = diag(0, 0, 2)."""
    functions = mechc.loads(LINKS).functions
    random = np.random.default_rng(1)
    for _ in range(20):
        a, b, x, da, db, dx = random.uniform(0.2, 1.2, 6)
        k, gamma = slopes(a, b, da, db)
        whole = np.block([[np.diag([0.0, 0.0, 2.0]), -k.T], [k, np.zeros((2, 2))]])
        exact = np.linalg.solve(whole, [0, 0, 0, -gamma[0], -gamma[1]])[:3]
        found = functions.accelerations(np.array([a, b, x, da, db, dx]))
        assert found == pytest.approx(exact, rel=1e-10, abs=1e-10)
        matrix = functions.mass_matrix(np.array([a, b, x, da, db, dx]))
        assert np.array_equal(matrix, np.diag([0.0, 0.0, 2.0])), "what is offered is the mass matrix itself"
