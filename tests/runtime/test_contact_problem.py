"""The contact problem (``kernel/contact/cones.h``) on random bodies, against the laws as they are written, against all combinations
of modes, SciPy's least squares that may not pull, and a search over the directions of a slip."""

from __future__ import annotations

import ctypes
from functools import cache
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from msgspec import Struct
from numpy.typing import NDArray
from scipy.optimize import brentq, linprog, nnls

from mechc.runtime.native.build import build_shared, find_compiler, kernel_flags
from mechc.runtime.native.kernel import kernel_sources

Vector = NDArray[np.float64]
HELD, CONE, DISC = range(3)
SOLVE, SWEEP, CHECK = range(3)
SLACK = 1e-10


class Cone(Struct, frozen=True):
    kind: int
    at: int
    slips: int
    coefficient: float = 0.0

    @property
    def rows(self) -> slice:
        return slice(self.at, self.at + (1 if self.kind == HELD else self.slips + (self.kind == CONE)))


class Answer(Struct, frozen=True):
    solved: bool
    r: Vector
    u: Vector
    residual: float
    sweeps: int


@cache
def library() -> ctypes.CDLL:
    if find_compiler() is None:
        pytest.skip("no C compiler")
    sources = {
        k: v
        for k, v in kernel_sources().items()
        if k.endswith(".h") or k in ("linear.c", "orthogonal.c", "cones.c")
    }
    folder = Path(__file__).parents[1] / "support"
    sources["driver.c"] = (folder / "cones_driver.c").read_text(encoding="utf-8")
    return ctypes.CDLL(str(build_shared(sources, kernel_flags(), name="cones")))


def answer(
    w: Vector, q: Vector, cones: list[Cone], how: int = SOLVE, most: int = 5000, r: Vector | None = None
) -> Answer:
    kinds = np.array([[c.kind, c.at, c.slips] for c in cones], dtype=np.int32)
    numbers = np.array([[c.coefficient, SLACK] for c in cones])
    w, q = np.ascontiguousarray(w), np.ascontiguousarray(q)
    r = np.zeros(len(q)) if r is None else r.copy()
    u, report = np.zeros(len(q)), np.zeros(3)
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (kinds, numbers, w, q)]
    out = [ctypes.c_void_p(a.ctypes.data) for a in (r, u, report)]
    solved = library().cones(len(q), len(cones), *pointers, how, most, *out)
    return Answer(bool(solved), r, u, report[0], int(report[1]))


def cross(a: Vector) -> Vector:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def body(rng: np.random.Generator, places: Vector) -> tuple[Vector, Vector]:
    """W and q of feet at these places of a body that falls onto them."""
    rows = np.vstack([np.hstack([np.eye(3), -cross(place)])[[2, 0, 1]] for place in places])
    inverse = np.diag([0.5, 0.5, 0.5, *(1 / rng.uniform(0.02, 0.3, 3))])
    v = rng.normal(size=6)
    v[2] = -abs(v[2])
    return rows @ inverse @ rows.T, rows @ v


def scattered(rng: np.random.Generator, n: int) -> Vector:
    return np.column_stack([rng.uniform(-1, 1, (n, 2)), -np.ones(n)])


def violation(cones: list[Cone], r: Vector, u: Vector) -> float:
    """By how much the laws are not fulfilled, as they stand in textbooks."""
    worst = 0.0
    for cone in cones:
        force, rate = r[cone.rows], u[cone.rows]
        if cone.kind == HELD:
            worst = max(worst, abs(rate[0]))
            continue
        first = int(cone.kind == CONE)
        limit = cone.coefficient * (force[0] if first else 1.0)
        slip, push = rate[first:], force[first:]
        if first:
            worst = max(worst, -force[0], -rate[0], abs(force[0] * rate[0]))
        size = float(np.linalg.norm(slip))
        worst = max(worst, float(np.linalg.norm(push)) - limit)
        worst = max(worst, float(np.linalg.norm(size * push + limit * slip)))
    return worst


@pytest.mark.parametrize("n", [1, 2, 4, 9])
@pytest.mark.parametrize("friction", [0.0, 0.3, 1.2, 4.0])
def test_bodies_on_rough_floors(n: int, friction: float) -> None:
    rng = np.random.default_rng(100 + n)
    for _ in range(25):
        w, q = body(rng, scattered(rng, n))
        cones = [Cone(CONE, 3 * k, 2, friction * rng.uniform(0.2, 1)) for k in range(n)]
        found = answer(w, q, cones)
        assert found.solved
        assert np.abs(found.u - (w @ found.r + q)).max() < 1e-12 * (1 + np.abs(q).max())
        # a residual of SLACK leaves products of that size times impulses and rates, both below 20
        assert violation(cones, found.r, found.u) < 50 * SLACK


def test_held_rows_and_frictions_of_joints() -> None:
    """Rows of all kinds on one body: a bolt that holds a direction, brakes, feet."""
    rng = np.random.default_rng(7)
    for _ in range(40):
        rows = rng.normal(size=(11, 6))
        w, q = rows @ rows.T, rows @ rng.normal(size=6)
        cones = [
            Cone(HELD, 0, 0),
            Cone(CONE, 1, 2, 0.5),
            Cone(DISC, 4, 1, 0.2),
            Cone(DISC, 5, 2, 0.3),
            Cone(CONE, 7, 1, 0.8),
            Cone(CONE, 9, 0),
            Cone(CONE, 10, 0),
        ]
        found = answer(w, q, cones)
        assert found.solved
        assert violation(cones, found.r, found.u) < 100 * SLACK


def nearest_in_the_plane(w: Vector, q: Vector, mu: Vector, u: Vector) -> float:
    """How far u is from the rates of a solution: contacts in the plane are open, stick, or slide to one of two sides, and in
    each combination the impulses are those of a linear program."""
    n, rows = len(mu), 2 * len(mu)
    nearest = np.inf
    for modes in product(range(4), repeat=n):
        equal, less = [], []  # rows (a, b): a r = b, a r <= b
        for k, mode in enumerate(modes):
            normal, along, side = np.eye(rows)[2 * k], np.eye(rows)[2 * k + 1], 1 if mode == 2 else -1
            if mode == 0:
                equal += [(normal, 0), (along, 0)]
                less.append((-w[2 * k], q[2 * k]))
                continue
            equal.append((w[2 * k], -q[2 * k]))
            if mode == 1:
                equal.append((w[2 * k + 1], -q[2 * k + 1]))
                less += [(along - mu[k] * normal, 0), (-along - mu[k] * normal, 0)]
            else:
                equal.append((along - side * mu[k] * normal, 0))
                less += [(-normal, 0), (side * w[2 * k + 1], -side * q[2 * k + 1])]
        # the least deviation of the rates
        goal, size = np.eye(rows + 1)[rows], np.hstack([w, -np.ones((rows, 1))])
        wide = [(np.append(a, 0), b) for a, b in less]
        found = linprog(
            goal,
            A_ub=np.array([a for a, _ in wide] + list(size) + list(np.hstack([-w, -np.ones((rows, 1))]))),
            b_ub=np.array([b for _, b in wide] + list(u - q) + list(q - u)),
            A_eq=np.array([np.append(a, 0) for a, _ in equal]),
            b_eq=np.array([b for _, b in equal]),
            bounds=(None, None),
        )
        if found.status == 0:
            nearest = min(nearest, found.fun)
    return nearest


def test_the_plane_against_all_combinations() -> None:
    rng = np.random.default_rng(3)
    for _ in range(12):
        n = int(rng.integers(1, 4))
        rows = np.vstack([[[0, 1, x], [1, 0, 1]] for x in rng.uniform(-1, 1, n)])
        inverse = np.diag([1, 1, 1 / rng.uniform(0.05, 0.5)])
        v = np.array([rng.normal(), -abs(rng.normal()), rng.normal()])
        w, q, mu = rows @ inverse @ rows.T, rows @ v, rng.uniform(0, 1.2, n)
        found = answer(w, q, [Cone(CONE, 2 * k, 1, mu[k]) for k in range(n)])
        assert found.solved
        assert nearest_in_the_plane(w, q, mu, found.u) < 1e-8


def test_without_friction_against_least_squares_that_may_not_pull() -> None:
    """min |J v + ...|: the rates are those of the nearest velocity, which is unique."""
    rng = np.random.default_rng(5)
    for _ in range(30):
        n = int(rng.integers(1, 12))
        rows, v = rng.normal(size=(n, 6)), rng.normal(size=6)
        push, _ = nnls(rows.T, -v)
        found = answer(rows @ rows.T, rows @ v, [Cone(CONE, k, 0) for k in range(n)])
        assert found.solved
        assert np.abs(found.u - rows @ (v + rows.T @ push)).max() < 1e-8


def test_one_contact_against_a_search_over_directions() -> None:
    rng = np.random.default_rng(11)
    for _ in range(40):
        half = rng.normal(size=(3, 3))
        w, q, mu = half @ half.T, rng.normal(size=3), rng.uniform(0.05, 0.6)
        q[0] = -abs(q[0])
        found = answer(w, q, [Cone(CONE, 0, 2, mu)])
        assert found.solved
        stuck = np.linalg.solve(w, -q)
        if stuck[0] > 0 and np.hypot(stuck[1], stuck[2]) < mu * stuck[0]:
            assert np.abs(found.r - stuck).max() < 1e-8 * (1 + np.abs(stuck).max())
            continue

        def slips(angle: float, mu: float = mu, w: Vector = w, q: Vector = q) -> tuple[Vector, Vector]:
            push = np.array([1.0, mu * np.cos(angle), mu * np.sin(angle)])
            size = -q[0] / (w[0] @ push)
            return size * push, q + size * (w @ push)

        def across(angle: float) -> float:
            _, u = slips(angle)
            return float(np.cos(angle) * u[2] - np.sin(angle) * u[1])

        angles, candidates = np.linspace(0, 2 * np.pi, 721), []
        for a, b in pairwise(angles):
            if across(a) * across(b) > 0:
                continue
            angle = brentq(across, a, b, xtol=1e-14)
            r, u = slips(angle)
            if (
                r[0] > 0
                and abs(across(angle)) < 1e-9
                and np.cos(angle) * u[1] + np.sin(angle) * u[2] <= 1e-12
            ):
                candidates.append(r)
        assert min(np.abs(found.r - r).max() for r in candidates) < 1e-8


def test_the_order_of_contacts_says_nothing() -> None:
    rng = np.random.default_rng(2)
    for _ in range(10):
        w, q = body(rng, scattered(rng, 5))
        cones = [Cone(CONE, 3 * k, 2, 0.7) for k in range(5)]
        found, order = answer(w, q, cones), rng.permutation(5)
        rows = np.concatenate([np.arange(3 * k, 3 * k + 3) for k in order])
        other = answer(w[np.ix_(rows, rows)], q[rows], cones)
        assert np.abs(other.u - found.u[rows]).max() < 1e-8


def test_sweeps_from_a_guess_find_what_is_found_from_zero() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        w, q = body(rng, scattered(rng, 2))
        w += 0.05 * np.eye(6)  # compliance: one solution
        cones = [Cone(CONE, 3 * k, 2, 0.4) for k in range(2)]
        exact, swept = answer(w, q, cones), answer(w, q, cones, SWEEP)
        assert swept.solved
        assert np.abs(exact.u - swept.u).max() < 1e-8
        again = answer(w, q, cones, SWEEP, r=swept.r)
        assert again.solved and again.sweeps == 0


def test_what_is_not_solved_is_said_with_its_residual() -> None:
    """A rod that slides on a floor with a friction at which no force holds it (Painleve): -1 = 0.5 r - 1, r >= 0 pushes away."""
    found = answer(np.array([[-0.5]]), np.array([-1.0]), [Cone(CONE, 0, 0)])
    assert not found.solved
    assert found.residual > 0.1
    w, q = body(np.random.default_rng(1), scattered(np.random.default_rng(1), 4))
    cones = [Cone(CONE, 3 * k, 2, 0.5) for k in range(4)]
    rough = answer(w, q, cones, SWEEP, most=1)
    assert not rough.solved
    checked = answer(w, q, cones, CHECK, r=rough.r)
    assert checked.residual == rough.residual > SLACK
