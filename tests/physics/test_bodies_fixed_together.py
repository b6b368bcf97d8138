"""Bodies that are fixed to each other move as one: the same motion as by Newton's laws for each, at the cost of one."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

import mechc
from mechc.compiler.pipeline import compile_source
from mechc.lang.source import SourceFile
from mechc.runtime.studies.kinds.equilibria import FoundEquilibria

TEXT = """
import mech.spatial.*;

model Carrier
  parameter mass_scale(min = 0) = 1;
  parameter m[3] = {2, 0.5, 0.2} kg;
  gravity {1, -2, -9.81} m/s^2;
  frame turned = world * trans({0.1, 0.2, 0.3} m);
  frame base;
  frame plate;
  frame seat[3] = {plate, plate * trans({0.3, -0.2, 0.5} m) * rotz(40 deg) * rotx(70 deg), plate * roty(-0.9 rad)};
  Revolute first(turned -> base, axis = {1, 0, 0}, angle = 0.3 rad);
  Revolute second(base * trans({0, 0.4, 0.1} m) -> plate, axis = {0, 1, 0}, angle = -0.7 rad);
end Carrier;
"""


def carrier(n: int) -> str:
    bodies = "".join(
        f"  Body part{k}(m = mass_scale*m[{k}], com = {{0.1, {0.2 * k}, -0.3}} m, a = seat[{k}], "
        f"J = {{{{0.3, 0.01, -0.02}}, {{0.01, {0.2 * k}, 0.03}}, {{-0.02, 0.03, 0.25}}}} kg.m^2);\n"
        for k in range(1, n + 1)
    )
    return TEXT.replace("end Carrier", bodies + "end Carrier")


def turn(axis: int, angle: float) -> np.ndarray:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    r = np.eye(3)
    r[i, i] = r[j, j] = np.cos(angle)
    r[j, i] = np.sin(angle)
    r[i, j] = -r[j, i]
    return r


def by_hand(q: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass matrix and the forces of gravity, of each body by itself."""
    a, plate = turn(0, q[0]), turn(0, q[0]) @ turn(1, q[1])
    hinge = a @ [0, 0.4, 0.1]
    axes = np.array([[1.0, 0, 0], a @ [0, 1, 0]]).T
    seats = [
        (np.zeros(3), np.eye(3)),
        (np.array([0.3, -0.2, 0.5]), turn(2, np.radians(40)) @ turn(0, np.radians(70))),
        (np.zeros(3), turn(1, -0.9)),
    ]
    mass, force = np.zeros((2, 2)), np.zeros(2)
    for k, (offset, seat) in enumerate(seats, start=1):
        m = scale * [2, 0.5, 0.2][k - 1]
        inertia = np.array([[0.3, 0.01, -0.02], [0.01, 0.2 * k, 0.03], [-0.02, 0.03, 0.25]])
        r = plate @ seat
        place = hinge + plate @ (offset + seat @ [0.1, 0.2 * k, -0.3])
        moved = np.array([np.cross(axes[:, 0], place), np.cross(axes[:, 1], place - hinge)]).T
        mass += m * moved.T @ moved + axes.T @ r @ inertia @ r.T @ axes
        force += m * moved.T @ [1, -2, -9.81]
    return mass, force


def bias_by_hand(q: np.ndarray, v: np.ndarray, scale: float) -> np.ndarray:
    """Return C v - gravity, the derivatives of the mass matrix as differences (h^2 = 1e-10 of their size)."""
    h = 1e-5
    d = [(by_hand(q + h * e, scale)[0] - by_hand(q - h * e, scale)[0]) / (2 * h) for e in np.eye(2)]
    coriolis = sum(v[i] * d[i] for i in range(2)) @ v - 0.5 * np.array([v @ d[i] @ v for i in range(2)])
    return np.asarray(coriolis - by_hand(q, scale)[1])


@pytest.mark.parametrize("scale", [1.0, 0.0])
def test_they_move_by_the_laws_of_each(scale: float) -> None:
    """Without masses their moments of inertia are left."""
    f = mechc.loads(carrier(3)).with_values({"mass_scale": scale}).functions
    random = np.random.default_rng(3)
    for _ in range(5):
        q, v, a = random.normal(size=(3, 2))
        y = np.concatenate([q, v, np.zeros(len(f.states) - 4)])
        mass, _ = by_hand(q, scale)
        np.testing.assert_allclose(f.mass_matrix(y), mass, rtol=1e-13, atol=1e-13)
        bias = bias_by_hand(q, v, scale)
        np.testing.assert_allclose(f.bias(y), bias, rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(f.inverse_dynamics(y, a), mass @ a + bias, rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(f.accelerations(y), np.linalg.solve(mass, -bias), rtol=1e-8, atol=1e-8)


def test_they_cost_what_one_costs() -> None:
    def operations(n: int) -> Fraction:
        program = compile_source(SourceFile("carrier.mech", carrier(n))).program
        return Fraction(next(f.operations for f in program.functions if f.name == "rhs"))

    assert operations(3) < operations(1) * Fraction(5, 4)


def test_their_equilibria_are_proven() -> None:
    """Balls of numbers hold the mass centre, which is a quotient unless there is no mass."""
    pytest.importorskip("flint")
    found = mechc.loads(carrier(3)).study("equilibria", prove=True)
    assert isinstance(found, FoundEquilibria)
    every = found.details["equilibria"]
    assert found.details["complete"] is True and len(every) == 4
    for one in every:
        q = np.array([one["values"]["first.angle"], one["values"]["second.angle"]])
        assert np.abs(by_hand(q, 1.0)[1]).max() < 1e-12
