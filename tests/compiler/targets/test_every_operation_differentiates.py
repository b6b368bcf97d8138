"""CasADi and JAX: each operation has the values and derivatives of the graph."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from all_operations import ROWS as ALL
from all_operations import apply, padded, points, program_of, truths
from differentiable_modules import module_of, wanted
from msgspec.structs import replace

from mechc.compiler.graph import Graph
from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.differentiate import gradient
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.graph.operation import Operation
from mechc.compiler.program import lower

ROWS = [row for row in ALL if row.code not in (ops.NORMAL, ops.DERIVED)]
"""Modules for both refuse noise, and hold formulas where a value has their derivatives."""
EVERY = pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
MODERATE = (0.25, -0.5, 1.5, 2.0, -2.5)
NAMES = [f"op_{row.name}" for row in ROWS]

CLOSE = 1e-13
"""Some units in the last place: the libraries have functions of their own, and other forms of derivatives."""


def places(row: Operation) -> list[tuple[float, ...]]:
    """Return where value and derivatives are defined, apart from edges on which a derivative may be either side's."""
    found = [at for at in points(row, MODERATE, 20) if row.regular is None or row.regular(*at)]
    numbers = [[x for x, truth in zip(at, truths(row), strict=True) if not truth] for at in found]
    apart = [0.0 not in x and len(set(x)) == len(x) and max(map(abs, x), default=0) < 50 for x in numbers]
    return [at for at, keep in zip(found, apart, strict=True) if keep]


def expected(row: Operation, at: tuple[float, ...]) -> Any:
    """Return value and gradient from the graph, by the states a, b, c; a truth value is 1/2 < x."""
    g = Graph()
    states = [g.symbol(name) for name in "abc"]
    arguments = [g.less(g.half, x) if truth else x for x, truth in zip(states, truths(row), strict=False)]
    n = apply(g, row, arguments)
    given = dict(zip(states, padded(at).tolist(), strict=True))
    return np.array([float(x) for x in evaluate(g, [n, *gradient(g, n, states)], given)])


@pytest.fixture(scope="module", params=["casadi", "jax"])
def library(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, ModuleType]:
    wanted(request.param)
    folder: Path = tmp_path_factory.mktemp(request.param)
    return request.param, module_of(lower(program_of(ROWS)), request.param, folder, NAMES)


def values(library: tuple[str, ModuleType], name: str, states: list[Any]) -> list[Any]:
    """Return value and gradient of a function at each state."""
    kind, module = library
    if kind == "casadi":
        import casadi

        y = casadi.SX.sym("y", 3)
        value = casadi.vertcat(*module.FUNCTIONS[name](0.7, y, [], []))
        f = casadi.Function("f", [y], [value, casadi.jacobian(value, y)])
        return [np.concatenate([np.array(x).ravel() for x in f(state)]) for state in states]
    import jax

    def one(y: Any) -> Any:
        return getattr(module, name)(0.7, y, np.zeros(0), np.zeros(0))[0]

    found, slopes = jax.vmap(jax.value_and_grad(one))(np.array(states))
    return list(np.column_stack([np.array(found), np.array(slopes)]))


def test_jax_has_the_derivatives_of_formulas(tmp_path: Path) -> None:
    """derived(sin a, 0) b counts as b times a constant, where its equations are not known."""
    wanted("jax")
    import jax

    equations = program_of([row for row in ALL if row.name == "sin"])
    g = equations.graph
    (function,) = [f for f in equations.functions if f.name == "op_sin"]
    n = g.mul(g.derived(function.outputs[0], g.zero), g.symbol("b"))
    changed = replace(equations, functions=(replace(function, outputs=(n,)),))
    made = module_of(lower(changed, formulas=True, loops=True), "jax", tmp_path, ["op_sin"])
    value, slopes = jax.value_and_grad(lambda y: made.op_sin(0.0, y, np.zeros(0), np.zeros(0))[0])(
        np.array([0.5, 2, 0])
    )
    np.testing.assert_allclose([value, *slopes], [2 * np.sin(0.5), 0, np.sin(0.5), 0], 1e-15)


@EVERY
def test_values_and_derivatives(row: Operation, library: tuple[str, ModuleType]) -> None:
    at = places(row) if row.code != ops.EQUAL else [(0.25, 0.25), (0.25, 2.0)]
    found = values(library, f"op_{row.name}", [padded(x) for x in at])
    assert len(at) >= 2
    for place, value in zip(at, found, strict=True):
        np.testing.assert_allclose(value, expected(row, place), CLOSE, CLOSE, err_msg=f"{row.name}{place}")
