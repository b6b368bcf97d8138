"""The part that is the same in every module for CasADi: everything below a marker is copied.

What stands above the first one here is a model of nothing, instead of the generated part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from casadi import SX, Function, fmod, if_else, logic_and, reshape, sumsqr, vertcat, vertsplit

STATES: list[tuple[str, str]] = []
INPUTS: list[tuple[str, str]] = []
PARAMETERS: list[tuple[str, str]] = []
INDEPENDENT: list[str] = []
SETTINGS: dict[str, float] = {}
ENERGIES: list[int] = []
ROTATIONS: list[int] = []
N_CONSTANTS = NQ = NV = 0
FUNCTIONS: dict[str, Any] = {}


def parameters(p: Any, given: list[bool]) -> list[Any]:
    return []


# ---- copied where modulo is called
def modulo(a: Any, b: Any) -> Any:
    """Return a - b floor(a/b), which takes the sign of b."""
    r = fmod(a, b)
    return if_else(logic_and(r != 0, (r < 0) != (b < 0)), r + b, r)


# ---- copied where lookup is called
def lookup(table: tuple[tuple[float, ...], ...], order: int, x: Any) -> Any:
    """Return the value (order 0) or a derivative of the cubic through (points, values, slopes); straight beyond the ends."""
    points, values, slopes = table
    pieces = [(points[0], values[0], slopes[0], 0.0, 0.0)]
    for i in range(len(points) - 1):
        h = points[i + 1] - points[i]
        secant = (values[i + 1] - values[i]) / h
        c2 = (3.0 * secant - 2.0 * slopes[i] - slopes[i + 1]) / h
        c3 = (slopes[i] + slopes[i + 1] - 2.0 * secant) / (h * h)
        pieces.append((points[i], values[i], slopes[i], c2, c3))
    pieces.append((points[-1], values[-1], slopes[-1], 0.0, 0.0))
    begin, c0, c1, c2, c3 = _chosen(x, points, pieces)
    s = x - begin
    if order == 0:
        return c0 + s * (c1 + s * (c2 + s * c3))
    if order == 1:
        return c1 + s * (2.0 * c2 + s * 3.0 * c3)
    return 2.0 * c2 + 6.0 * c3 * s if order == 2 else 6.0 * c3


def _chosen(x: Any, points: Sequence[float], pieces: Sequence[tuple[float, ...]]) -> Any:
    """Return the numbers of the piece in which x lies, by halves."""
    if len(pieces) == 1:
        return pieces[0]
    middle = len(pieces) // 2
    low = _chosen(x, points[: middle - 1], pieces[:middle])
    high = _chosen(x, points[middle:], pieces[middle:])
    return [if_else(x < points[middle - 1], a, b) for a, b in zip(low, high, strict=True)]


# ---- copied where element is called
def element(values: tuple[float, ...], index: Any) -> Any:
    """Return the number with an index, a whole one; the first and last ones beyond the ends. By halves."""
    if len(values) == 1:
        return values[0]
    middle = len(values) // 2
    return if_else(index < middle, element(values[:middle], index), element(values[middle:], index - middle))


# ---- copied where cell is called
def cell(points: tuple[float, ...], x: Any) -> Any:
    """Return the index of the last point but one that is not above x, by halves."""
    if len(points) == 2:
        return 0.0
    middle = len(points) // 2
    return if_else(x < points[middle], cell(points[: middle + 1], x), middle + cell(points[middle:], x))


# ---- copied from here
def all_parameters(values: Mapping[str, Any] | None = None) -> list[Any]:
    """Return p: numbers or symbols by name in SI, defaults for all others, and the constants that are made of them."""
    known = {**SETTINGS, **(values or {})}
    names = [name for name, _ in PARAMETERS]
    if unknown := sorted(known.keys() - set(names)):
        raise KeyError(f"no parameter {', '.join(unknown)}; there are {', '.join(names)}")
    p = [known.get(name, 0.0) for name in names] + [0.0] * N_CONSTANTS
    return parameters(p, [name in known for name in names])


def functions(arguments: Sequence[str] = tuple(INDEPENDENT)) -> dict[str, Function]:
    """Return the functions of (t, y, u, p) by name; p holds the parameters that are named, in this order.

    All other parameters keep their values, or follow from those that are named.
    """
    t, y, u, p = SX.sym("t"), SX.sym("y", len(STATES)), SX.sym("u", len(INPUTS)), SX.sym("p", len(arguments))
    given = dict(zip(arguments, vertsplit(p) if len(arguments) else [], strict=True))
    full = all_parameters(given)
    found = {name: vertcat(*function(t, y, u, full)) for name, function in FUNCTIONS.items()}
    found["accelerations"] = found["rhs"][NQ : NQ + NV]
    if ENERGIES:
        found["energy"] = found["outputs"][ENERGIES]
    if "constraint_jacobian" in found:
        found["constraint_jacobian"] = reshape(found["constraint_jacobian"], NV, -1).T
    if "project_position" in found:
        found["projected"] = projected(t, y, u, full)
    return {
        name: Function(name, [t, y, u, p], [value], ["t", "y", "u", "p"], [name])
        for name, value in found.items()
    }


# ---- copied where there are constraints
def projected(t: Any, y: Any, u: Any, p: Any) -> Any:
    """Return the state after one step of Newton's method onto the constraints: its distance becomes its square."""
    d = vertcat(*FUNCTIONS["project_position"](t, y, u, p)[:NV])
    q = y[:NQ] + vertcat(*FUNCTIONS["displace"](t, vertcat(y[:NQ], d, y[NQ + NV :]), u, p))
    for i in ROTATIONS:
        q[i : i + 4] /= sumsqr(q[i : i + 4]) ** 0.5
    moved = vertcat(q, y[NQ:])
    v = y[NQ : NQ + NV] + vertcat(*FUNCTIONS["project_velocity"](t, moved, u, p)[:NV])
    return vertcat(q, v, y[NQ + NV :])
