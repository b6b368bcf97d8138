"""Sines and cosines four at a time: their errors against mpmath, and that nothing but their place in the text changes."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator
from pathlib import Path

import mpmath
import numpy as np
import pytest
from msgspec.structs import replace
from native_code import STRICT, Floats, NativeModel, bits
from sample_equations import chain, pendulum

from mechc.compiler.graph.operations import COS, SIN
from mechc.compiler.problem import TURNS, header
from mechc.compiler.program import lower
from mechc.compiler.program.model import Load, Operate, Store
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.sincos_batch import turn_groups, with_turns_ahead
from mechc.runtime.native.build import build_shared, model_flags

ULPS = 1.5
"""The largest error that sincos.h states, in units of the last place."""

CALL = """
#include "sincos_batch.h"
__attribute__((visibility("default"))) void many(long n, const double *x, double *s, double *c);
void many(long n, const double *x, double *s, double *c)
{
    for (long k = 0; k < n; k += 4) {
        double turns[8];
        mech_turns(turns, x[k], x[k + 1], x[k + 2], x[k + 3]);
        for (int i = 0; i < 4; i++) s[k + i] = turns[i], c[k + i] = turns[4 + i];
    }
}
__attribute__((visibility("default"))) void row(int n, double *x, double *s, double *c);
void row(int n, double *x, double *s, double *c)
{
    mech_turn_row(n, x, s, c);
}
"""


@pytest.fixture(scope="module")
def library() -> ctypes.CDLL:
    sources = {"turning.c": CALL, **{name: header(name) for name in TURNS}}
    return ctypes.CDLL(str(build_shared(sources, (*model_flags(), *STRICT), name="turning")))


def turned(library: ctypes.CDLL, x: Floats) -> tuple[Floats, Floats]:
    given = np.concatenate([x, np.zeros(-x.size % 4)])
    s, c = np.empty_like(given), np.empty_like(given)
    library.many(ctypes.c_long(given.size), *(ctypes.c_void_p(a.ctypes.data) for a in (given, s, c)))
    return s[: x.size], c[: x.size]


def test_a_row_has_the_bits_of_its_fours(library: ctypes.CDLL) -> None:
    x = np.random.default_rng(4).uniform(-100, 100, 12)
    x[2], x[5] = 3e9, math.nan
    for n in range(1, 10):
        given, s, c = x.copy(), np.empty(12), np.empty(12)
        library.row(n, *(ctypes.c_void_p(a.ctypes.data) for a in (given, s, c)))
        for found, expected in zip((s, c), turned(library, x), strict=True):
            assert bits(found[:n]) == bits(expected[:n])


def nearest_to_quarters() -> Iterator[float]:
    """Yield the doubles up to 2^30 that come nearest to multiples of pi/2, by continued fractions (W. Kahan, 1983)."""
    for exponent in range(30):
        rest = mpmath.pi / 2 * mpmath.mpf(2) ** (52 - exponent)
        before, here = (1, 0), (int(rest), 1)
        while here[0] < 2**53:
            if here[0] >= 2**52:
                yield math.ldexp(here[0], exponent - 52)
            rest = 1 / (rest - int(rest))
            whole = int(rest)
            before, here = here, (whole * here[0] + before[0], whole * here[1] + before[1])


def quarters(n: int) -> list[float]:
    """Return the doubles beside multiples of pi/2: the first ones, and others up to the limit."""
    random = np.random.default_rng(2)
    return [float(k * mpmath.pi / 2) for k in [*range(1, n), *map(int, random.integers(1, 636_000_000, n))]]


@pytest.mark.parametrize("size", [1e-300, 1e-8, 0.8, 3.2, 100.0, 1e5, 1e9, 1e15, 1e300])
def test_the_error_is_as_stated_at_random_angles(library: ctypes.CDLL, size: float) -> None:
    check(library, np.random.default_rng(1).uniform(-size, size, 1500))


def test_the_error_is_as_stated_beside_multiples_of_a_quarter(library: ctypes.CDLL) -> None:
    with mpmath.workprec(400):
        near = [*nearest_to_quarters(), *quarters(1000)]
    assert len(near) > 2000
    check(library, np.array([*near, *(-x for x in near[:40])]))


def check(library: ctypes.CDLL, x: Floats) -> None:
    for found, function in zip(turned(library, x), (mpmath.sin, mpmath.cos), strict=True):
        with mpmath.workprec(200):
            exact = [function(mpmath.mpf(float(a))) for a in x]
            off = [abs(float(mpmath.mpf(float(f)) - e)) for f, e in zip(found, exact, strict=True)]
            last = np.spacing(np.abs(np.array([float(e) for e in exact])))
        assert (np.array(off) / last).max() <= ULPS


def test_special_values(library: ctypes.CDLL) -> None:
    """Not-a-number beside others, and infinities, concern no angle but their own."""
    x = np.array([math.nan, 0.0, -0.0, math.inf, 5e-324, -math.inf, 1e9, 2e9])
    s, c = turned(library, x)
    assert list(s[1:3]) == [0.0, 0.0]
    assert list(c[1:3]) == [1.0, 1.0]
    assert np.isnan(s[[0, 3, 5]]).all()
    assert np.isnan(c[[0, 3, 5]]).all()
    assert s[4] == 5e-324
    assert (s[7], c[7]) == (math.sin(2e9), math.cos(2e9))


@pytest.mark.parametrize("pieces", [None, 20])
def test_moved_statements_give_the_same_bits(tmp_path: Path, pieces: int | None) -> None:
    """By the C library both texts do the same arithmetic; twenty operations a piece cut through groups."""
    program = lower(chain(5))
    plain = NativeModel(program, tmp_path, pieces, "plain")
    moved = NativeModel(program, tmp_path, pieces, "moved", turns=True)
    p, empty = plain.default_parameters(), np.empty(0)
    assert "mech_turns(" in emit_c(program, pieces, turns=True)
    for y in np.random.default_rng(3).uniform(-2, 2, (20, len(program.arrays["y"]))):
        for function in program.functions:
            given = (function.name, 0.3, y, empty, empty, p)
            assert bits(moved.call(*given)) == bits(plain.call(*given)), function.name


def test_one_angle_stays_as_it_is() -> None:
    program = lower(pendulum())
    assert emit_c(program, turns=True) == emit_c(program)


def test_groups_end_where_something_else_stands() -> None:
    """Four angles to a group; a statement between, and an angle that is made within a group, begin another one."""
    loads = tuple(Load("y", k) for k in range(6))
    turns = tuple(Operate(code, (k,)) for k in range(6) for code in (SIN, COS))
    stores = tuple(Store("out", k, 6 + k) for k in range(12))
    assert turn_groups((*loads, *turns, *stores)) == {6: [0, 1, 2, 3], 14: [4, 5]}
    nested = (Load("y", 0), Load("y", 1), Operate(SIN, (0,)), Operate(SIN, (1,)), Operate(SIN, (2,)))
    assert turn_groups(nested) == {2: [0, 1]}
    apart = (Load("y", 0), Operate(SIN, (0,)), Load("y", 1), Operate(SIN, (2,)))
    assert turn_groups(apart) == {}


def test_an_angle_of_an_angle_waits() -> None:
    """sin(sin(y0)), sin(y1) and cos(y0): the two that are known at the head are one group, in front."""
    program = lower(chain(3))
    body = (
        Load("y", 0),
        Operate(SIN, (0,)),
        Operate(SIN, (1,)),
        Load("y", 1),
        Operate(SIN, (3,)),
        Operate(COS, (0,)),
        *(Store("out", k, v) for k, v in enumerate((2, 4, 5))),
    )
    (moved,) = with_turns_ahead(replace(program.functions[0], bodies=(body,))).bodies
    assert moved[:5] == (
        Load("y", 0),
        Load("y", 1),
        Operate(SIN, (0,)),
        Operate(COS, (0,)),
        Operate(SIN, (1,)),
    )
    assert turn_groups(moved) == {2: [0, 1]}
    assert len(moved) == len(body)
