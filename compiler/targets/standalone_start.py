"""How a generated Python module begins: one of these two functions is copied, as ``start_state``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mechc.runtime.start.facts import StartFacts
from mechc.runtime.start.stages import make_task, moving, placed, undirected_row

from .standalone import ROTATIONS, nothing

START = StartFacts(0, 0, (), (), (), (), (), (), ())
START_ROWS: list[str] = []
assembly = assembly_jacobian = initial_of_others = found = nothing
FOUND: tuple[int, ...] = ()
PARAMETERS: list[tuple[str, str]] = []
parameters = nothing
before_parameters: Callable[..., Any] = nothing


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    return function


def stated(t: float, y: Any, known: Mapping[int, bool], u: Any, z: Any, p: Any) -> tuple[Any, Any]:
    """Return the initial state, and once more what nominal values are made from."""
    y = np.array(y, float)
    for i in ROTATIONS:
        y[i : i + 4] /= math.sqrt(sum(y[i : i + 4] ** 2))
    return y, y


def assembled(t: float, y: Any, known: Mapping[int, bool], u: Any, z: Any, p: Any) -> tuple[Any, Any]:
    """Return the initial state, moved onto the constraints, and once more with what was stated where that is rounding.

    ``known``: the entries that were set, and whether they stay.
    """
    for _ in START.dependent:  # one of them may be stated with another
        for i, value in zip(START.dependent, checked(initial_of_others)(t, y, u, z, p), strict=True):
            if i not in known:
                y[i] = value
    y = np.array(y, float)
    for i in ROTATIONS:
        y[i : i + 4] /= math.sqrt(sum(y[i : i + 4] ** 2))
    if not START.rows:
        return y, y

    def listed(function: Any) -> Any:
        return lambda t, y, u, z, p: np.array(checked(function)(t, y.tolist(), u, z, p))

    stays = np.array([known.get(i, stated) for i, stated in enumerate(START.known)], bool)
    task = make_task(START, listed(assembly), listed(assembly_jacobian), t, stays, u, z, p)
    found = placed(task, y)
    row = (
        undirected_row(task, found) if found.fulfilled else task.rows(1, True)[int(found.violations.argmax())]
    )
    if row is None:
        found = moving(task, found.x, task.free(2))
        row = None if found.fulfilled else task.rows(2, True)[int(found.violations.argmax())]
    if row is not None:
        raise RuntimeError(f"the initial state cannot be assembled: {START_ROWS[row]}")
    plain = found.x.copy()
    for i, weight in zip(START.partner, task.weights, strict=True):
        if i in ROTATIONS:
            continue
        if abs(plain[i] - y[i]) * weight < 1e-12:
            plain[i] = y[i]
        elif abs(plain[i]) * weight < 1e-12:
            plain[i] = 0.0
    return found.x, plain


def followed(t: float, y: Any, known: Mapping[int, bool], u: Any, z: Any, p: Any) -> tuple[Any, Any]:
    """Return the same where initial values are stated with those of others, which the assembly moves."""
    given = dict(known)
    follow = [i for i in START.dependent if i not in known]
    for _ in range(20):
        state, plain = assembled(t, list(y), given, u, z, p)
        later = state.copy()
        for _ in START.dependent:
            values = dict(
                zip(START.dependent, checked(initial_of_others)(t, later.tolist(), u, z, p), strict=True)
            )
            later[follow] = [values[i] for i in follow]
        plain[follow] = later[follow]
        first = [i for i in follow if i < START.nq + START.nv]
        if np.all(
            np.abs(later[first] - state[first]) <= 1e-14 * (np.abs(later[first]) + np.abs(state[first]))
        ):
            return later, plain
        y = [later[i] if i in follow else value for i, value in enumerate(y)]
        given = {**known, **{i: START.known[i] for i in follow}}
    raise RuntimeError(
        "the initial state cannot be assembled: values that are stated with others do not settle"
    )


def with_parameters(t: float, y: Any, known: Mapping[int, bool], u: Any, z: Any, p: Any) -> tuple[Any, Any]:
    """Return the same, and put the parameters that the start finds into p."""
    state, plain = before_parameters(t, y, known, u, z, p)
    for k, value in zip(FOUND, checked(found)(t, state.tolist(), u, z, p), strict=True):
        if not math.isfinite(value):
            raise RuntimeError(f"no value is found for the parameter {PARAMETERS[k][0]}")
        p[k] = value
    p[:] = checked(parameters)(p, [True] * len(PARAMETERS))
    return state, plain
