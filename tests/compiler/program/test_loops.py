"""Long functions as loops: the same formulas by replay, the same bits in C as straight lines and Python."""

from __future__ import annotations

import random
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace
from native_code import NativeModel, bits
from random_models.python_functions import load_python
from sample_equations import equations

from mechc.compiler import pipeline
from mechc.compiler.equations.model import Equations, Function
from mechc.compiler.graph import Graph, Node, monotone_table
from mechc.compiler.malformed import Malformed
from mechc.compiler.problem import flags_for
from mechc.compiler.program import Program, lower
from mechc.compiler.program.loops import replay, rolled
from mechc.compiler.program.loops.roll import roll
from mechc.compiler.program.model import Load, Store
from mechc.compiler.program.verify import verify
from mechc.compiler.targets import c_loops
from mechc.compiler.targets.c import emit_c
from mechc.lang.source import SourceFile
from mechc.runtime.interface import Quantity
from mechc.runtime.native.build import model_flags

CHAIN = """
import mech.planar.*;
model Chain
  structural parameter Integer n = 10;
  parameter rho = 2 kg/m;
  parameter Length l[n] = 1 m;
  parameter Mass m[i in 1:n] = rho*l[i];
  gravity {0, -9.81 m/s^2};
  Bar link[i in 1:n](m = m[i], l = l[i]);
  Revolute joint[i in 1:n]((if i == 1 then world else link[i-1].b) -> link[i].a,
                           angle = if i == 1 then -60 deg else 0 deg);
  experiment(stop = 10 s);
end Chain;
"""

PAIRS = """
model Bodies
  dimensionless;
  structural parameter Integer n = 7;
  parameter Real m[n] = 1;
  parameter G = 1;
  coordinate Real r[n, 3] = {{cos(i*1.7)*i, sin(i*1.7)*i, 0.3*i} for i in 1:n};
  for i in 1:n loop
    kinetic 1/2*m[i]*dot(der(r[i]), der(r[i]));
    for j in i+1:n loop
      potential -G*m[i]*m[j]/norm(r[i] - r[j]);
    end for;
  end for;
  experiment(stop = 3);
end Bodies;
"""

ROW = """
import mech.planar.*;
model Row
  structural parameter Integer n = 2;
  gravity {0, -9.81 m/s^2};
  Bar post[n + 1](m = 1 kg, l = 1 m);
  Bar coupler[n](m = 1 kg, l = 1 m);
  Revolute foot[i in 1:n+1](world * trans({(i - 1)*1 m, 0 m}) -> post[i].a, angle ~ 90 deg,
                            der(angle) ~ -1 rad/s);
  Revolute knee[i in 1:n](post[i].b -> coupler[i].a, angle ~ -90 deg, der(angle) ~ 1 rad/s);
  cut Revolute pin[i in 1:n](coupler[i].b -> post[i+1].b);
  experiment(stop = 4 s);
end Row;
"""

MODELS = {"chain": (CHAIN, 24), "pairs": (PAIRS, 12), "closed": (ROW, 12)}


def lowering() -> ModuleType:
    """Return the module, whose name is also that of its function."""
    import sys

    return sys.modules["mechc.compiler.program.lower"]


def compiled(monkeypatch: pytest.MonkeyPatch, name: str) -> Program:
    text, n = MODELS[name]
    monkeypatch.setattr(lowering(), "LONG", 800)
    monkeypatch.setattr(lowering(), "SHORT", 60)
    source = SourceFile("model.mech", text)
    return pipeline.compile_source(source, structural={"n": Fraction(n)}).program


def as_straight_lines(program: Program) -> Program:
    return replace(
        program,
        parameters_function=replace(program.parameters_function, made=()),
        functions=tuple(replace(f, made=()) for f in program.functions),
    )


def size(items: tuple[rolled.Item, ...]) -> int:
    return sum(size(item.body) if isinstance(item, rolled.Loop) else 1 for item in items)


@pytest.mark.parametrize(
    "name", ["chain", *(pytest.param(n, marks=pytest.mark.slow) for n in ("pairs", "closed"))]
)
def test_models_as_loops(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mechc.compiler.program.loops.roll.MANY", 2)
    monkeypatch.setattr(c_loops, "BLOCK", 8)
    program = compiled(monkeypatch, name)
    verify(program)
    shrunk = 0
    for function in (program.parameters_function, *program.functions):
        found = roll(function)
        if found is not None:
            replay.verify(function, found)
            shrunk += 4 * size(found.items) < len(function.bodies[0])
    assert shrunk >= 1
    text = emit_c(program)
    assert "for (int i" in text
    assert ("    APART\n" in text) == (name == "pairs")
    assert ("before0" in text) == (name != "pairs")
    assert len(text) < 0.8 * len(emit_c(as_straight_lines(program)))
    (tmp_path / "straight").mkdir()
    as_loops = NativeModel(program, tmp_path, flags=model_flags(reproducible=True, loops=True))
    straight = NativeModel(as_straight_lines(program), tmp_path / "straight")
    # by the C library where nothing is fused
    ahead = NativeModel(program, tmp_path, name="ahead", turns=True)
    assert ("mech_turn_row(" in emit_c(program, turns=True)) == (name == "chain")
    rng = np.random.default_rng(1)
    p = np.full(program.size("p"), np.nan)
    given = np.zeros(len(program.arrays["p"]), np.uint8)
    p[1], given[1] = 1.5, 1
    other = p.copy()
    as_loops.parameters(p, given)
    straight.parameters(other, given)
    assert bits(p) == bits(other)
    y, u, z = rng.normal(size=program.nq + program.nv + program.nx), np.empty(0), np.empty(0)
    python, _ = load_python(program)
    for function in program.functions:
        expected = straight.call(function.name, 0.3, y, u, z, p)
        assert bits(as_loops.call(function.name, 0.3, y, u, z, p)) == bits(expected), function.name
        assert bits(ahead.call(function.name, 0.3, y, u, z, p)) == bits(expected), function.name
        if function.name in python:
            assert bits(python[function.name](0.3, y, u, z, p)) == bits(expected), function.name


def random_equations(seed: int, n: int) -> Equations:
    """Return what loops over n elements make: recipes over neighbours, sums that go on, tables, choices, pairs."""
    rng = random.Random(seed)
    g = Graph()
    x = [g.symbol(f"x{i}") for i in range(n)]
    k = [g.symbol(f"k{i}") for i in range(n)]
    table = g.add_table(monotone_table((-1.0, 0.0, 2.0), (3.0, 1.0, 4.0)))
    unary: list[Any] = [g.sin, g.cos, g.atan, g.neg, g.abs, lambda a: g.lookup(table, a)]
    binary: list[Any] = [g.add, g.sub, g.mul, g.minimum, g.less, g.atan2]
    arrays = [x, k]
    for _ in range(4):
        recipe = [(rng.randrange(5), rng.choice(unary), rng.choice(binary), rng.random()) for _ in range(9)]
        reach = [(rng.choice(arrays), rng.choice((1, -1)), rng.randrange(-2, 3)) for _ in range(9)]
        carried = g.constant(Fraction(1, 3))
        made: list[Node] = []
        for i in range(n):
            last = x[i]
            for (kind, one, two, chance), (array, way, off) in zip(recipe, reach, strict=True):
                other = array[((i if way > 0 else n - 1 - i) + off) % n]
                if kind == 0:
                    last = one(last)
                elif kind == 1:
                    last = g.select(g.less(last, other), other, g.add(last, g.constant(Fraction(5, 7))))
                elif kind == 2:
                    last = two(last, other)
                elif kind == 3 and chance < 0.6:
                    carried = g.add(carried, g.mul(last, other))
                else:
                    last = g.add(last, carried if chance < 0.3 else other)
            made.append(last)
        arrays.append(made)
        x_sum = made[0]
        for i in range(n):
            for j in range(i + 1, n, 5):
                x_sum = g.add(x_sum, g.mul(made[i], g.sub(x[j], x[i])))
        arrays.append([g.mul(x_sum, a) for a in made])
    results = [a for array in rng.sample(arrays[2:], 3) for a in array]
    return equations(
        g,
        [Function("rhs", "", tuple(results))],
        states=[(s, Quantity(f"x{i}", "state", "")) for i, s in enumerate(x)],
        nx=n,
        parameters=[
            (s, Quantity(f"k{i}", "parameter", ""), g.constant(Fraction(i, 7)) if i < 3 else g.sin(k[i - 1]))
            for i, s in enumerate(k)
        ],
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 8))])
def test_random_loops(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lowering(), "LONG", 300)
    monkeypatch.setattr(lowering(), "SHORT", 50)
    monkeypatch.setattr(c_loops, "ON_STACK", 16_384 if seed % 2 else 10)
    monkeypatch.setattr(c_loops, "BLOCK", 8)
    program = lower(random_equations(seed, 24))
    verify(program)
    rhs = program.function("rhs")
    assert rhs is not None
    found = roll(rhs)
    assert found is not None
    replay.verify(rhs, found)
    (tmp_path / "straight").mkdir()
    as_loops = NativeModel(program, tmp_path, flags=model_flags(reproducible=True, loops=True))
    ahead = NativeModel(program, tmp_path, name="ahead", turns=True)
    straight = NativeModel(program, tmp_path / "straight", 0)
    p = straight.default_parameters()
    assert bits(as_loops.default_parameters()) == bits(p)
    rng = np.random.default_rng(seed)
    python, _ = load_python(program)
    for _ in range(5):
        arguments = 0.0, rng.normal(size=24), np.empty(0), np.empty(0), p
        expected = bits(straight.call("rhs", *arguments))
        assert bits(as_loops.call("rhs", *arguments)) == expected
        assert bits(ahead.call("rhs", *arguments)) == expected
        assert bits(python["rhs"](*arguments)) == expected


def recurrence(n: int) -> Equations:
    """Return two numbers that follow from each other n times."""
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    k = [g.symbol(f"k{i}") for i in range(n)]
    a, b = x, y
    for factor in k:
        a, b = g.mul(factor, g.sin(b)), g.add(g.mul(factor, a), g.cos(b))
    return equations(
        g,
        [Function("rhs", "", (a, b))],
        states=[(s, Quantity(name, "state", "")) for s, name in ((x, "x"), (y, "y"))],
        nx=2,
        parameters=[
            (s, Quantity(f"k{i}", "parameter", ""), g.constant(Fraction(1))) for i, s in enumerate(k)
        ],
    )


def test_what_the_next_iteration_reads_stays_in_registers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lowering(), "LONG", 100)
    program = lower(recurrence(200))
    rhs = program.function("rhs")
    assert rhs is not None
    found = roll(rhs)
    assert found is not None
    replay.verify(rhs, found)
    assert found.workspace < 10
    (at,) = [k for k, item in enumerate(found.items) if isinstance(item, rolled.Loop)]
    loop = found.items[at]
    assert isinstance(loop, rolled.Loop)
    one, *others = loop.carried
    assert any(other.source != one.source for other in others)
    crossed = replace(loop, carried=tuple(replace(carry, source=one.source) for carry in loop.carried))
    with pytest.raises(Malformed, match="stores another value in out"):
        replay.verify(rhs, replace(found, items=(*found.items[:at], crossed, *found.items[at + 1 :])))
    assert "mech_turn_row(" not in emit_c(program, turns=True)  # each angle waits for the one before it


def turning(n: int, kind: str) -> Equations:
    """Return what is made of sines and cosines of n angles, which are products or go on as a sum: of the former angle, of the
    angle, or of neither, but then angles are read again afterwards."""
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    k = [g.symbol(f"k{i}") for i in range(n)]
    angle, made = x, y
    angles = []
    for factor in k:
        before = angle
        angle = g.mul(x, factor) if kind == "product" else g.add(angle, factor)
        used = {"product": before, "sum": angle, "stored sum": x}[kind]
        sine, cosine = g.sin(angle), g.cos(angle)
        made = g.add(g.mul(made, cosine), g.mul(used, sine))
        angles.append(angle)
    stored = [g.mul(a, made) for a in reversed(angles)] if kind == "stored sum" else []
    return equations(
        g,
        [Function("rhs", "", (made, *stored))],
        states=[(s, Quantity(name, "state", "")) for s, name in ((x, "x"), (y, "y"))],
        nx=2,
        parameters=[
            (s, Quantity(f"k{i}", "parameter", ""), g.constant(Fraction(i, 7))) for i, s in enumerate(k)
        ],
    )


@pytest.mark.parametrize("kind", ["product", "sum", "stored sum"])
def test_angles_are_formed_ahead(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lowering(), "LONG", 100)
    monkeypatch.setattr(c_loops, "BLOCK", 8)
    program = lower(turning(200, kind))
    assert "mech_turn_row(" in emit_c(program, turns=True)
    ahead = NativeModel(program, tmp_path, name="ahead", turns=True)
    straight = NativeModel(program, tmp_path, 0, name="straight")
    p, y, nothing = straight.default_parameters(), np.array([0.3, -0.7]), np.empty(0)
    expected = straight.call("rhs", 0.0, y, nothing, nothing, p)
    assert bits(ahead.call("rhs", 0.0, y, nothing, nothing, p)) == bits(expected)


def test_replay_notices(monkeypatch: pytest.MonkeyPatch) -> None:
    program = compiled(monkeypatch, "chain")
    rhs = program.function("rhs")
    assert rhs is not None
    found = roll(rhs)
    assert found is not None
    (body,) = rhs.bodies
    load = next(k for k, s in enumerate(body) if type(s) is Load and s.array == "y")
    with pytest.raises(Malformed, match="stores another value in out"):
        replay.verify(replace(rhs, bodies=((*body[:load], Load("y", 1), *body[load + 1 :]),)), found)
    first, other = [k for k, s in enumerate(body) if type(s) is Store][-2:]
    twice = [*body]
    one, two = body[first], body[other]
    assert isinstance(one, Store)
    assert isinstance(two, Store)
    twice[other] = replace(two, value=one.value)
    with pytest.raises(Malformed, match="stores another value in out"):
        replay.verify(replace(rhs, bodies=(tuple(twice),)), found)


def test_small_models_stay_as_they_are() -> None:
    program = pipeline.compile_source(SourceFile("model.mech", CHAIN), structural={"n": Fraction(12)}).program
    assert not program.long
    assert "for (" not in emit_c(program)


def test_what_does_not_repeat_itself_stays_straight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lowering(), "LONG", 1000)
    rng = random.Random(3)
    g = Graph()
    x = [g.symbol(f"x{i}") for i in range(4)]
    nodes = list(x)
    for _ in range(3000):
        nodes.append(rng.choice((g.add, g.sub, g.mul, g.atan2))(rng.choice(nodes[-60:]), rng.choice(nodes)))
    made = equations(
        g,
        [Function("rhs", "", tuple(nodes[-300:]))],
        states=[(s, Quantity(f"x{i}", "state", "")) for i, s in enumerate(x)],
        nx=4,
    )
    rhs = lower(made).function("rhs")
    assert rhs is not None
    assert rhs.made
    assert roll(rhs) is None


def test_long_texts_without_loops_are_not_optimised_for_loops() -> None:
    """At -O3 the derivatives of two crates took 200 s to compile, at -O1 40."""
    assert "-O3" in flags_for("for (;;);\n" * 7000, False, True)
    assert "-O1" in flags_for("x = 1;\n" * 100_000, False, True)
    assert "-O1" in flags_for("x = 1;\n", False, False)
