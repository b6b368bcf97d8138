"""Random graphs of all operations: C, split C and Python give the same bits, and the graph's own evaluation agrees."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from native_code import NativeModel, bits, random_states
from random_models.python_functions import load_python
from sample_equations import equations

from mechc.compiler.equations.model import Equations, Function
from mechc.compiler.graph import Graph, Node, Samples, monotone_table
from mechc.compiler.graph.evaluate import evaluate
from mechc.compiler.program import lower
from mechc.compiler.program.chunk import chunk
from mechc.compiler.program.verify import verify
from mechc.runtime.interface import Quantity

CONSTANTS = [
    Fraction(1, 3),
    Fraction(1, 10),
    Fraction(-2),
    Fraction(5, 4),
    Fraction(-7, 11),
    Fraction(3),
    Fraction(10**7),
]


def random_equations(seed: int) -> Equations:
    """Return 150 operations on two states, an input, two parameters and constants; conditions among them."""
    rng = random.Random(seed)
    g = Graph()
    x, y, u, a, b = (g.symbol(n) for n in ("x", "y", "u", "a", "b"))
    table = g.add_table(monotone_table((-1.0, 0.0, 2.0), (3.0, 1.0, 4.0)))
    samples = g.add_table(Samples((-7.0, -0.5, 0.0, 1.0, 40.0, 1e9)))
    unary: list[Callable[[Node], Node]] = [
        *(
            g.sin,
            g.cos,
            g.tan,
            g.asin,
            g.acos,
            g.atan,
            g.sinh,
            g.cosh,
            g.tanh,
            g.asinh,
            g.acosh,
            g.atanh,
            g.exp,
        ),
        *(g.log, g.sqrt, g.abs, g.sign, g.floor, g.neg, g.logical_not, lambda n: g.lookup(table, n)),
        *(lambda n: g.cell(samples, n), lambda n: g.element(samples, g.floor(n))),
    ]
    binary: list[Callable[[Node, Node], Node]] = [
        *(
            g.add,
            g.sub,
            g.mul,
            g.add,
            g.sub,
            g.mul,
            g.atan2,
            g.minimum,
            g.maximum,
            g.pow,
            g.less,
            g.less_equal,
        ),
        *(g.equal, g.logical_and, g.logical_or),
    ]
    nodes: list[Node] = [x, y, u, a, b, *(g.constant(c) for c in CONSTANTS)]
    for _ in range(150):
        p, q, r = (rng.choice(nodes[-40:] if rng.random() < 0.7 else nodes) for _ in range(3))
        match rng.randrange(6):
            case 0 | 1:
                nodes.append(rng.choice(unary)(p))
            case 2 | 3:
                nodes.append(rng.choice(binary)(p, q))
            case 4:
                nodes.append(g.select(p, q, r))
            case _ if not g.is_zero(q):
                nodes.append(rng.choice((g.div, g.modulo))(p, q))
    return equations(
        g,
        [Function("rhs", "", tuple(nodes[-60:]))],
        states=[(x, Quantity("x", "state", "")), (y, Quantity("y", "state", ""))],
        nx=2,
        inputs=[(u, Quantity("u", "input", ""))],
        parameters=[
            (a, Quantity("a", "parameter", ""), g.constant(Fraction(3, 10))),
            (b, Quantity("b", "parameter", ""), g.sin(a)),
        ],
    )


@pytest.mark.parametrize("seed", range(8))
def test_random_programs_agree(seed: int, tmp_path: Path) -> None:
    model = random_equations(seed)
    program = lower(model)
    verify(program)
    verify(chunk(program, 17))
    whole = NativeModel(program, tmp_path, 0, "whole")
    split = NativeModel(program, tmp_path, 17, "split")
    functions, complete = load_python(program)
    p = np.full(program.size("p"), np.nan)
    complete(p, np.zeros(2, np.uint8))
    assert bits(p) == bits(whole.default_parameters()) == bits(split.default_parameters())
    u, z = np.array([0.25]), np.empty(0)
    close = 0
    for state in random_states(40, 2, seed):
        y = np.array(state)
        expected = whole.call("rhs", 0.0, y, u, z, p)
        assert bits(split.call("rhs", 0.0, y, u, z, p)) == bits(expected), state
        assert bits(functions["rhs"](0.0, y, u, z, p)) == bits(expected), state
        arrays = {"y": y, "u": u, "p": p}
        environment = {n: float(arrays[s.array][s.index]) for n, s in model.layout.items()}
        reference = np.array(evaluate(model.graph, model.functions[0].outputs, environment), float)
        # modulo and overflow are computed in other ways there; compare where all is of moderate size
        both = np.isfinite(reference) & np.isfinite(expected) & (np.abs(reference) < 1e3)
        close += int(np.sum(np.isclose(reference[both], expected[both], rtol=1e-9, atol=1e-9)))
    assert close > 1000
