"""What only one side of a choice needs is left out where the other side is taken, and nothing else changes."""

from __future__ import annotations

import ctypes
import inspect
import random
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from differentiable_modules import plain_module
from native_code import NativeModel, bits, random_states
from random_models.python_functions import load_python
from sample_equations import equations
from wasm_module import WasmModel, needs_wasmtime

from mechc.compiler.equations.model import Equations, Function
from mechc.compiler.graph import Graph
from mechc.compiler.graph.elimination.newton import newton
from mechc.compiler.graph.operations import OPERATIONS, SELECT
from mechc.compiler.lanes import lane_sources
from mechc.compiler.program import Program, lower
from mechc.compiler.program import branches as module
from mechc.compiler.program.branches import GuardedParts, branches, gathered
from mechc.compiler.program.model import Body, Literal, Load, Operate, Store
from mechc.compiler.program.verify import verify
from mechc.compiler.targets.lanes import function_lines
from mechc.runtime.interface import Quantity
from mechc.runtime.native.build import build_shared, lane_flags
from mechc.web.kernels import kernel_for


class NotComputed:
    """What a value is that was left out: nothing may use it."""


def played(body: Body, y: list[float], *, whole: bool = False) -> tuple[list[float], int]:
    """Return the results, and how many operations were left out, which none is read of; of the ``whole`` body none is."""
    found = GuardedParts({}, {}) if whole else GuardedParts.of(body)
    values: list[Any] = []
    out: dict[int, float] = {}
    skipped: list[bool] = []
    left_out = 0
    arrays = {"y": y, "p": [0.5, 0.5]}
    for k, statement in enumerate(body):
        for _ in range(found.ends.get(k, 0)):
            skipped.pop()
        for branch in found.begins.get(k, ()):
            asked = values[branch.condition]
            skipped.append(any(skipped) or bool(asked) is not branch.holds)
        if any(skipped):
            values.append(NotComputed)
            left_out += 1
            continue
        match statement:
            case Load(array, index):
                values.append(arrays[array][index])
            case Literal(number):
                values.append(float(number))
            case Operate(code, (condition, a, b)) if code == SELECT:
                values.append(values[a] if values[condition] else values[b])
            case Operate(code, operands):
                function = OPERATIONS[code].value
                assert function is not None
                given = [values[a] for a in operands]
                assert NotComputed not in given
                values.append(function(*given))
            case Store("out", index, value):
                assert values[value] is not NotComputed
                out[index] = values[value]
                values.append(None)
            case _:
                pytest.skip("a table")
    return [out[k] for k in sorted(out)], left_out


def of_choices(seed: int) -> Equations:
    """Return a random program half of which are choices, chains of them among these."""
    rng = random.Random(seed)
    g = Graph()
    x, y, a, b = (g.symbol(n) for n in ("x", "y", "a", "b"))
    nodes = [x, y, a, b, g.one]
    for _ in range(200):
        p, q, r, s = (rng.choice(nodes[-30:]) for _ in range(4))
        match rng.randrange(4):
            case 0:
                nodes.append(rng.choice((g.add, g.sub, g.mul, g.minimum))(p, q))
            case 1:
                nodes.append(rng.choice((g.sin, g.cos, g.neg, g.exp))(p))
            case _:
                nodes.append(g.select(g.less(p, q), g.sub(r, s), g.mul(s, p)))
    return equations(
        g,
        [Function("rhs", "", tuple(nodes[-6:]))],
        states=[(x, Quantity("x", "state", "")), (y, Quantity("y", "state", ""))],
        nx=2,
        parameters=[(n, Quantity(name, "parameter", ""), g.half) for n, name in ((a, "a"), (b, "b"))],
    )


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two operations are worth a branch."""
    monkeypatch.setattr(module, "LEAST", 2)


@pytest.mark.parametrize("seed", range(12))
def test_what_is_left_out_is_not_read(few: None, seed: int) -> None:
    """Seen red with results of a branch that a value outside reads too, and with branches before their condition."""
    program = lower(of_choices(seed), hoist=False)
    verify(program)
    (body,) = next(f for f in program.functions if f.name == "rhs").bodies
    inside = 0
    for state in random_states(20, 2, seed):
        plain, _ = played(body, state, whole=True)
        found, left_out = played(body, state)
        assert bits(np.array(found)) == bits(np.array(plain))
        inside += left_out
    assert inside > 20


def test_branches_stand_inside_each_other(few: None) -> None:
    for seed in range(12):
        (body,) = next(f for f in lower(of_choices(seed)).functions if f.name == "rhs").bodies
        assert gathered(body) == body
        ends: list[int] = []
        for branch in branches(body):
            while ends and ends[-1] <= branch.begin:
                ends.pop()
            assert branch.condition < branch.begin < branch.end <= (ends[-1] if ends else len(body))
            ends.append(branch.end)


@pytest.mark.parametrize("seed", range(4))
def test_c_and_python_give_equal_bits(few: None, seed: int, tmp_path: Path) -> None:
    """All statements in Python, branches in C."""
    program = lower(of_choices(seed))
    native = NativeModel(program, tmp_path)
    functions, _ = load_python(program)
    p, empty = native.default_parameters(), np.empty(0)
    for state in random_states(50, 2, seed):
        y = np.array(state)
        expected = native.call("rhs", 0.0, y, empty, empty, p)
        assert bits(functions["rhs"](0.0, y, empty, empty, p)) == bits(expected), state


@pytest.fixture(scope="module")
def solving() -> Program:
    """x + exp(x) = s, from a guess."""
    g = Graph()
    s, guess, x = (g.symbol(n) for n in ("s", "guess", "x"))
    found = newton(g, [g.sub(g.add(x, g.exp(x)), s)], [x], [guess])
    states = [(n, Quantity(g.name(n), "state", "")) for n in (s, guess)]
    return lower(equations(g, [Function("rhs", "", (*found, g.zero))], states=states, nx=2))


def test_steps_after_the_solution_are_left_out(solving: Program) -> None:
    """Counted in Python: an exponential for each step, where all were computed once. s = 1 has the solution 0."""
    module = plain_module(solving)
    forms = inspect.unwrap(module.rhs).__globals__
    formed, exp = [], forms["exp"]

    def count(x: Any) -> Any:
        formed.append(x)
        return exp(x)

    forms["exp"] = count
    for s in (2.0, 5.0, 0.3):
        exact = float(mpmath.findroot(lambda x, s=s: x + mpmath.exp(x) - s, 0.5))
        for off, most in ((0.0, 1), (1e-6, 2), (0.1, 4), (3.0, 40)):
            formed.clear()
            assert module.rhs(0.0, [s, exact + off], [], [])[0] == pytest.approx(exact, rel=4e-16)
            assert len(formed) <= most, (s, off)


def test_arrays_take_steps_until_all_are_found(solving: Program) -> None:
    module = plain_module(solving)
    s, guess = np.linspace(-3, 9, 200), np.linspace(4, -2, 200)
    together = module.rhs(0.0, [s, guess], [], [])[0]
    single = [module.rhs(0.0, [a, b], [], [])[0] for a, b in zip(s, guess, strict=True)]
    # NumPy's exponential of arrays is another one than that of single numbers
    assert together == pytest.approx(np.array(single), rel=1e-15, abs=1e-15)


@needs_wasmtime
def test_pages_give_the_same_bits(few: None, solving: Program, monkeypatch: pytest.MonkeyPatch) -> None:
    """With branches and without."""
    programs = [solving, *(lower(of_choices(seed)) for seed in range(4))]
    kernel = kernel_for("dop853", events=False)
    branching = [WasmModel(program, kernel) for program in programs]
    monkeypatch.setattr(module, "LEAST", 10**9)
    for one, program in zip(branching, programs, strict=True):
        whole, empty = WasmModel(program, kernel), np.empty(0)
        for state in random_states(30, 2):
            found, expected = (
                each.call("rhs", 0.0, state, empty, empty, each.default_parameters()) for each in (one, whole)
            )
            assert bits(found) == bits(expected)


def test_lanes_take_steps_until_all_are_found(solving: Program, tmp_path: Path) -> None:
    """Eight members whose guesses are near and far: each has what it has alone."""
    function = next(f for f in solving.functions if f.name == "rhs")
    text = "\n".join(function_lines(solving, [function]))
    assert "if (lane_bits(" in text
    text = f"#include <string.h>\n{text}{WRAPPER}"
    library = ctypes.CDLL(str(build_shared(lane_sources(text), (*lane_flags(), "-DMECH_LANE_WIDTH=8"))))
    native = NativeModel(solving, tmp_path)
    s, guess = np.linspace(-3, 9, 8), np.array([0.0, 9.0, -4.0, 0.5, 1.0, 1.5, 30.0, 1.8])
    y, found = np.ascontiguousarray([s, guess]), np.empty((2, 8))
    library.all_lanes(y.ctypes.data_as(ctypes.c_void_p), found.ctypes.data_as(ctypes.c_void_p))
    empty = np.empty(0)
    alone = [
        native.call("rhs", 0.0, np.array(pair), empty, empty, np.empty(8))[0]
        for pair in zip(s, guess, strict=True)
    ]
    assert found[0] == pytest.approx(np.array(alone), rel=1e-15)


WRAPPER = """
__attribute__((visibility("default"))) void all_lanes(const double *y, double *out)
{
    V a[2], found[2];
    memcpy(a, y, sizeof(a));
    rhs(a[0], a, a, a, a, found);
    memcpy(out, found, sizeof(found));
}
"""
