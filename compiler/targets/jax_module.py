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
