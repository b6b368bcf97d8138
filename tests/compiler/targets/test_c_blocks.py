"""Loops that compilers do in vectors: the same bits where sums are in order, the same sums where they are not."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from fractions import Fraction

import numpy as np
import pytest
from msgspec.structs import replace
from native_code import NativeModel, bits

from mechc.compiler import pipeline
from mechc.compiler.graph.operations import ADD, DIV, SUB
from mechc.compiler.program import Program
from mechc.compiler.program.loops.rolled import Compute, Index, Local, Loop, LoopRegister, Read, Rolled
from mechc.compiler.program.model import Operate
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.c_blocks import are_sums, copies_of
from mechc.lang.source import SourceFile
from mechc.runtime.native.build import model_flags

PAIRS = """
model Bodies
  dimensionless;
  structural parameter Integer n = 7;
  parameter Real m[i in 1:n] = 1 + i/10;
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
N = 20
STATES = 2 * 3 * N


@pytest.fixture(scope="module")
def program() -> Iterator[Program]:
    with pytest.MonkeyPatch.context() as patch:
        lowering = importlib.import_module("mechc.compiler.program.lower")
        patch.setattr(lowering, "LONG", 800)
        patch.setattr(lowering, "SHORT", 700)
        patch.setattr("mechc.compiler.program.loops.roll.MANY", 2)
        source = SourceFile("model.mech", PAIRS)
        yield pipeline.compile_source(source, structural={"n": Fraction(N)}).program


@pytest.fixture(scope="module")
def rates(program: Program, tmp_path_factory: pytest.TempPathFactory) -> dict[str, NativeModel]:
    """Return the model as straight lines, as loops with sums in order, and in parts."""
    straight = replace(program, functions=tuple(replace(f, made=()) for f in program.functions))
    loops = model_flags(reproducible=True, loops=True)
    return {
        "straight": NativeModel(straight, tmp_path_factory.mktemp("straight")),
        "in order": NativeModel(program, tmp_path_factory.mktemp("ordered"), flags=loops),
        "in parts": NativeModel(program, tmp_path_factory.mktemp("parts"), flags=model_flags(loops=True)),
    }


def derivatives(model: NativeModel, y: np.ndarray) -> np.ndarray:
    nothing = np.empty(0)
    return model.call("rhs", 0.3, y, nothing, nothing, model.default_parameters())


def test_what_is_read_with_a_stride_lies_side_by_side(program: Program) -> None:
    text = emit_c(program)
    assert "    APART\n" in text
    assert "c0[k] = y[" in text and " - c0[i" in text
    assert "#pragma omp simd reduction(+:s" in text


def test_sums_in_order_have_the_bits_of_straight_lines(rates: dict[str, NativeModel]) -> None:
    y = np.random.default_rng(2).normal(size=STATES)
    expected = derivatives(rates["straight"], y)
    assert bits(derivatives(rates["in order"], y)) == bits(expected)


def test_sums_in_parts_are_the_same_sums(rates: dict[str, NativeModel]) -> None:
    y = np.random.default_rng(3).normal(size=STATES)
    expected = derivatives(rates["straight"], y)
    found = derivatives(rates["in parts"], y)
    # twenty addends, each off by some roundings; they may cancel, but not those of the largest
    assert np.abs(found - expected).max() < 100 * np.finfo(float).eps * np.abs(expected).max()
    # the bits do not depend on where the numbers lie
    for shift in range(1, 4):
        room = np.empty(STATES + 8)
        room[shift : shift + STATES] = y
        assert bits(derivatives(rates["in parts"], room[shift : shift + STATES])) == bits(found)


FORTY = Index(40)


def one_loop(code: int, *, first: bool, trips: Index = FORTY) -> Loop:
    """Return a loop that adds quotients to a number in a register, or takes them from it."""
    quotient = Compute(1, Operate(DIV, (0, 0)), (Read("y", Index(2, ((1, 3),))), Read("p", Index(0))))
    operands = (LoopRegister(2), Local(1)) if first else (Local(1), LoopRegister(2))
    total = Compute(2, Operate(code, (0, 0)), operands, kept=True)
    return Loop(1, trips, (quotient, total), ((2, Index(0)),), apart=True)


@pytest.mark.parametrize(
    ("code", "first", "held"), [(ADD, True, True), (ADD, False, True), (SUB, True, True), (SUB, False, False)]
)
def test_only_sums_are_taken_in_parts(code: int, first: bool, held: bool) -> None:
    assert are_sums(one_loop(code, first=first)) == held


def test_copies_are_made_for_loops_that_run_again_and_reach_no_further() -> None:
    inside = Loop(0, Index(5), (one_loop(ADD, first=True, trips=Index(7, ((0, 2),))),))
    sizes = {"y": 45, "u": 0, "z": 0}
    (copy,) = copies_of(Rolled((inside,), (), 1), sizes, 100).items()
    assert copy[0] == ("y", 2, 3)
    assert copy[1].count == 15  # 7 + 2*4, so that y[44] is the last
    assert copies_of(Rolled((inside,), (), 1), {**sizes, "y": 44}, 100) == {}
    assert copies_of(Rolled((inside,), (), 1), sizes, 14) == {}
    assert copies_of(Rolled((one_loop(ADD, first=True),), (), 1), {**sizes, "y": 200}, 100) == {}
    both = Rolled((inside, one_loop(ADD, first=True)), (), 1)
    (copy,) = copies_of(both, {**sizes, "y": 200}, 100).items()
    assert copy[1].count == 40
