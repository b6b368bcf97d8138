"""The part that is the same in every module for JAX: everything below a marker is copied.

What stands above the first one here is a model of nothing, instead of the generated part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from importlib import import_module
from typing import Any

jax: Any = import_module("jax")
jnp: Any = import_module("jax.numpy")

PARAMETERS: list[tuple[str, str]] = []
SETTINGS: dict[str, float] = {}
ENERGIES: list[int] = []
ROTATIONS: list[int] = []
SOLUTIONS: list[Any] = []
N_CONSTANTS = NQ = NV = 0


def parameters(p: Any, given: list[bool]) -> list[Any]:
    return []


def nothing(t: Any, y: Any, u: Any, p: Any) -> Any:
    return []


rhs = outputs = constraint_jacobian = project_position = project_velocity = displace = nothing


# ---- copied before the functions
jax.config.update("jax_enable_x64", True)


def compiled(function: Callable[..., list[Any]]) -> Any:
    """Return a function of this module that is compiled, and gives an array of 64-bit numbers."""

    @wraps(function)
    def evaluate(t: Any, y: Any, u: Any, p: Any) -> Any:
        return jnp.stack([jnp.asarray(x, jnp.float64) for x in function(t, y, u, p)])

    return jax.jit(evaluate)


# ---- copied where lookup is called
def lookup(table: tuple[tuple[float, ...], ...], order: int, x: Any) -> Any:
    """Return the value (order 0) or a derivative of the cubic through (points, values, slopes); straight beyond the ends."""
    points, values, slopes = (jnp.array(row) for row in table)
    i = jnp.clip(jnp.searchsorted(points, x, side="right") - 1, 0, len(points) - 2)
    h = points[i + 1] - points[i]
    secant = (values[i + 1] - values[i]) / h
    outside = (x < points[0]) | (x >= points[-1])
    begin = jnp.where(x >= points[-1], i + 1, i)
    c2 = jnp.where(outside, 0.0, (3.0 * secant - 2.0 * slopes[i] - slopes[i + 1]) / h)
    c3 = jnp.where(outside, 0.0, (slopes[i] + slopes[i + 1] - 2.0 * secant) / (h * h))
    s = x - points[begin]
    if order == 0:
        return values[begin] + s * (slopes[begin] + s * (c2 + s * c3))
    if order == 1:
        return slopes[begin] + s * (2.0 * c2 + s * 3.0 * c3)
    return 2.0 * c2 + 6.0 * c3 * s if order == 2 else 6.0 * c3


# ---- copied where element is called
def element(values: tuple[float, ...], index: Any) -> Any:
    """Return the number with an index, a whole one; the first and last ones beyond the ends."""
    return jnp.array(values)[jnp.clip(jnp.asarray(index, int), 0, len(values) - 1)]


# ---- copied where cell is called
def cell(points: tuple[float, ...], x: Any) -> Any:
    """Return the index of the last point but one that is not above x."""
    return jnp.clip(jnp.searchsorted(jnp.array(points), x, side="right") - 1, 0, len(points) - 2) * 1.0


# ---- copied where derived is called
def derived(value: Any, formula: Any) -> Any:
    """Return a value that counts as a constant; programs hold no other formula than zero."""
    return jax.lax.stop_gradient(value)


# ---- copied where there are solutions
def solutions(wanted: list[int], t: Any, y: Any, u: Any, p: Any, known: Any = None) -> dict[int, Any]:
    """Return what is found by steps, by index, beside what is known of it; with the derivatives of implicit functions."""
    s: dict[int, Any] = dict(known or {})
    for k in wanted:
        guess, rows, count, places, begin = SOLUTIONS[k]
        given, others = (t, y, u, p, s), dict(s)

        def asked(given: Any, x: Any, rows: Any = rows, begin: int = begin) -> Any:
            *first, s = given
            return numbers(rows(*first, {**s, **{begin + i: x[i] for i in range(len(x))}}))

        found = solution(numbers(guess(*given)), asked, (t, y, u, p, others), count, places)
        s.update((begin + i, found[i]) for i in range(len(found)))
    return s


def numbers(values: list[Any]) -> Any:
    """Return an array of 64-bit numbers."""
    return jnp.stack([jnp.asarray(x, jnp.float64) for x in values])


def solution(guess: Any, rows: Any, given: Any, count: int, places: list[tuple[int, int]]) -> Any:
    """Return what makes rows vanish, by Newton's method with steps that are shortened where the next one would not be shorter; not numbers
    where none is found (P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2004, section 3.3)."""
    fixed = jax.lax.stop_gradient(given)
    i, j = (jnp.array(k) for k in zip(*places, strict=True))
    unknowns = len(guess)
    alone = count == unknowns == 1

    def at(x: Any, largest: Any) -> Any:
        found, largest = rows(fixed, x), jnp.maximum(largest, abs(x))
        slopes = found[2 * count :]
        sizes = found[count : 2 * count].at[i].add(abs(slopes) * largest[j])
        return x, found[:count], slopes, sizes, largest

    def scaled(point: Any) -> Any:
        _, _, slopes, sizes, _ = point
        size = jnp.where(sizes > 0.0, sizes, 1.0)
        return jnp.zeros((count, unknowns)).at[i, j].set(slopes / size[i]), size

    def solved(point: Any, rest: Any) -> Any:
        if alone:
            return -rest / point[2]
        matrix, size = scaled(point)
        right = -rest / size
        if count > unknowns:
            matrix, right = matrix.T @ matrix, matrix.T @ right
        return jnp.linalg.solve(matrix, right)

    def nearer(tried: Any, point: Any, step: Any) -> Any:
        if alone:
            return abs(tried[1][0]) < abs(point[1][0])
        size = jnp.where(tried[4] > 0.0, tried[4], 1.0)
        return ((solved(point, tried[1]) / size) ** 2).sum() < ((step / size) ** 2).sum()

    def ended(point: Any, step: Any, scale: Any) -> Any:
        x, rest, _, sizes, largest = point
        small = (abs(step) <= 1e-9 * jnp.maximum(abs(x), 1e-5 * largest)).all()
        if count > unknowns:
            return small & (abs(rest) <= 1e-9 * sizes).all()
        still = (abs(step) <= 1e-13 * scale).all()
        return small | still & (abs(rest) <= 1e-15 * sizes).all()

    def find(_: Any, guess: Any) -> Any:
        begin = at(guess, abs(guess))
        scale = jnp.full(unknowns, jnp.inf).at[j].min(begin[3][i] / abs(begin[2]))

        def going(state: Any) -> Any:
            k, _, _, _, end = state
            return (k < 30) & ~end

        def go(state: Any) -> Any:
            k, point, fraction, _, _ = state
            step = solved(point, point[1])
            tried = at(point[0] + fraction * step, point[4])
            better = nearer(tried, point, step)
            kept = tuple(jnp.where(better, a, b) for a, b in zip(tried, point, strict=True))
            fraction = jnp.where(better, jnp.minimum(1.0, 2.0 * fraction), 0.25 * fraction)
            return k + 1, kept, fraction, point[0] + step, ended(point, step, scale)

        _, _, _, found, end = jax.lax.while_loop(going, go, (0, begin, 1.0, guess, False))
        return jnp.where(end, found, jnp.nan)

    def vanishing(x: Any) -> Any:
        end = at(jax.lax.stop_gradient(x), jax.lax.stop_gradient(abs(x)))
        matrix, size = jax.lax.stop_gradient(scaled(end))
        rest = rows(given, x)[:count] / size
        return matrix.T @ rest if count > unknowns else rest

    def solve(linear: Any, right: Any) -> Any:
        return jnp.linalg.solve(jax.jacobian(linear)(right), right)

    return jax.lax.custom_root(vanishing, jax.lax.stop_gradient(guess), find, solve)


# ---- copied from here
def all_parameters(values: Mapping[str, Any] | None = None) -> Any:
    """Return p: values by name in SI, defaults for all others, and the constants that are made of them."""
    known = {**SETTINGS, **(values or {})}
    names = [name for name, _ in PARAMETERS]
    if unknown := sorted(known.keys() - set(names)):
        raise KeyError(f"no parameter {', '.join(unknown)}; there are {', '.join(names)}")
    p = [known.get(name, 0.0) for name in names] + [0.0] * N_CONSTANTS
    completed = parameters(p, [name in known for name in names])
    return jnp.stack([jnp.asarray(x, jnp.float64) for x in completed]) if completed else jnp.zeros(0)


def accelerations(t: Any, y: Any, u: Any, p: Any) -> Any:
    """Return the rates of the velocities."""
    return rhs(t, y, u, p)[NQ : NQ + NV]


# ---- copied where there are energies
def energy(t: Any, y: Any, u: Any, p: Any) -> Any:
    """Return the energies among the outputs."""
    return outputs(t, y, u, p)[jnp.array(ENERGIES)]


# ---- copied where there are constraints
def jacobian_of_constraints(t: Any, y: Any, u: Any, p: Any) -> Any:
    """Return K as a matrix: rows of the constraints, columns of the velocities."""
    return constraint_jacobian(t, y, u, p).reshape(-1, NV)


def projected(t: Any, y: Any, u: Any, p: Any) -> Any:
    """Return the state after one step of Newton's method onto the constraints: its distance becomes its square."""
    d = project_position(t, y, u, p)[:NV]
    q = y[:NQ] + displace(t, jnp.concatenate([y[:NQ], d, y[NQ + NV :]]), u, p)
    for i in ROTATIONS:
        q = q.at[i : i + 4].divide(jnp.linalg.norm(q[i : i + 4]))
    moved = jnp.concatenate([q, y[NQ:]])
    v = y[NQ : NQ + NV] + project_velocity(t, moved, u, p)[:NV]
    return jnp.concatenate([q, v, y[NQ + NV :]])
