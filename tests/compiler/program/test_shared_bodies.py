"""What several functions compute alike, in bodies that they have in common."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from native_code import NativeModel, bits, random_states
from sample_equations import equations

from mechc.compiler.equations.model import Equations, Function
from mechc.compiler.graph import Graph, Node
from mechc.compiler.graph.operations import CONST, SYMBOL
from mechc.compiler.program import Program, lower, shared_bodies
from mechc.compiler.program.model import Load, Store, operands_of
from mechc.compiler.program.shared_bodies import in_common
from mechc.compiler.program.verify import verify
from mechc.runtime.interface import Quantity

SIZE = 25


def overlapping(seed: int) -> Equations:
    """Return functions of random nodes that have much in common: all of them the first nodes, the first one with each other more."""
    rng, g = random.Random(seed), Graph()
    x, y, a = (g.symbol(name) for name in "xya")

    def more(nodes: list[Node], count: int) -> list[Node]:
        found = [*nodes]
        for _ in range(count):
            p, q = rng.choice(found[-30:]), rng.choice(found)
            found.append(rng.choice((g.add, g.sub, g.mul, g.div, g.atan2, g.minimum))(p, q))
        return found

    first = more([x, y, a, g.constant(3)], 60)
    second, third = more(first, 200), more(first, 150)
    outputs = {
        "rhs": more(third + second[-20:], 100),
        "initial": more(second, 60),
        "constraints": more(third, 60),
    }
    return equations(
        g,
        [Function(name, "", tuple(nodes[-40:])) for name, nodes in outputs.items()],
        states=[(x, Quantity("x", "state", "")), (y, Quantity("y", "state", ""))],
        nx=2,
        parameters=[(a, Quantity("a", "parameter", ""), g.one)],
    )


def computed(program: Program) -> int:
    """Return the operations of all bodies, each counted once."""
    bodies = {body for f in program.functions for body in f.bodies}
    return sum(bool(operands_of(s)) and hasattr(s, "code") for body in bodies for s in body)


@pytest.mark.parametrize("seed", range(4))
def test_every_value_is_computed_in_one_body_and_has_its_bits(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However small groups may be, and not at all where none is large enough."""
    model = overlapping(seed)
    program = lower(model, hoist=False)
    monkeypatch.setattr(shared_bodies, "WORTH", 1)
    done = in_common(program, SIZE)
    verify(done)
    g = model.graph
    wanted = g.depth_first([n for f in model.functions for n in f.outputs], ())
    assert computed(done) == sum(g.op(n) not in (CONST, SYMBOL) for n in wanted) < computed(program)
    assert all(len(f.bodies) > 2 for f in done.functions)
    w = {
        kind: {
            s.index for f in done.functions for b in f.bodies for s in b if type(s) is kind and s.array == "w"
        }
        for kind in (Load, Store)
    }
    assert w[Load] == w[Store]
    kept = [
        [s.value for s in body if isinstance(s, Store) and s.array == "w"]
        for f in done.functions
        for body in f.bodies
    ]
    assert all(len({*values}) == len(values) for values in kept)
    monkeypatch.setattr(shared_bodies, "WORTH", 1000)
    assert in_common(program, SIZE) == program

    ours, plain = NativeModel(done, tmp_path, 0, "common"), NativeModel(program, tmp_path, 0, "plain")
    p = plain.default_parameters()
    for state in random_states(10, 2, seed):
        for f in program.functions:
            given = (f.name, 0.0, np.array(state), np.empty(0), np.empty(0), p)
            assert bits(ours.call(*given)) == bits(plain.call(*given)), f.name


def test_a_function_that_shares_little_computes_it_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """What pairs of functions have in common is much, and rests on a little that three have: the shortest one has none of it."""
    model = overlapping(1)
    program = lower(model, hoist=False)
    needed = [{*model.graph.depth_first(f.outputs, ())} for f in model.functions]
    monkeypatch.setattr(shared_bodies, "WORTH", 70)
    assert len(needed[0] & needed[1] & needed[2]) < 70
    assert all(len((needed[0] & needed[k]) - needed[3 - k]) > 70 for k in (1, 2))
    done = in_common(program, SIZE)
    verify(done)
    rhs, initial, constraints = (f.bodies for f in done.functions)
    assert {*rhs} & {*initial}
    assert constraints == program.functions[2].bodies
    assert in_common(program, SIZE, {"rhs"}) == program
