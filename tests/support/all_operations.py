"""Every operation of the graph as a function of its own, built for each target."""

from __future__ import annotations

import ctypes
import itertools
import math
import random
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from native_code import REPRODUCIBLE, Both, Floats, compile_c
from sample_equations import equations

from mechc.compiler.equations.model import Equations, Function
from mechc.compiler.graph import Graph, Node, monotone_table
from mechc.compiler.graph import operations as ops
from mechc.compiler.graph.evaluate import FLOATS, evaluate, multiprecision
from mechc.compiler.graph.operation import Operation
from mechc.compiler.targets import differentiable, python_forms
from mechc.compiler.targets.c import emit_c
from mechc.compiler.targets.wasm import operations as wasm_operations
from mechc.runtime.interface import Quantity
from mechc.web.kernels import KERNELS, loaded

ROOT = Path(__file__).resolve().parents[2]
ROWS = ops.OPERATIONS[2:]
"""All but constants and symbols."""

TABLE = monotone_table((-2.0, -0.5, 0.125, 3.0), (0.0, 1.5, 1.75, -1.0))
SPECIAL = (
    *(0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 0.25, 2.0, -2.0, 3.0, -2.5, 10.0, math.pi / 2, 1 - 2**-53, 1 + 2**-52),
    *(710.0, -746.0, 1e-8, 1e-300, -5e-324, 1e17, 1e300, -1e308, math.inf, -math.inf, math.nan),
)
"""Zeros, edges of domains, whole numbers, the tiny and the large."""


def file_of(module: ModuleType) -> str:
    """Return where a module stands in the repository, for messages."""
    path = Path(str(module.__file__)).resolve()
    return path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else path.name


@cache
def lane_headers() -> tuple[str, ...]:
    return tuple(p.read_text(encoding="utf-8") for p in (ROOT / "runtime/kernel/ensemble").glob("*.h"))


def missing(row: Operation) -> list[str]:
    """Return what the row of an operation lacks: columns without a value that could be found."""
    lookup, found = row.code == ops.LOOKUP, []

    def lacks(what: str, file: str = "") -> None:
        found.append(f"operation '{row.name}' has no {what}: see its row in {file or file_of(ops)}")

    if row.value is None and not lookup:
        lacks("'value', what it gives for floats")
    elif row.value is not None and row.digits is None and not all(truths(row)):
        given = [bool(k) if k else mpmath.mpf(1) / 3 for k in truths(row)]
        if isinstance(row.value(*given), float):
            lacks("'digits', what it gives for many digits (its 'value' gives floats only)")
    if row.form is None and isinstance(row.lanes, str) and not lookup:
        name = f"lane_{row.lanes or row.name}"
        if not any(re.search(rf"\b{name}\(|\({name[5:]}, ", text) for text in lane_headers()):
            lacks(f"function '{name}' in the headers of lanes; lanes=None takes that of C lane by lane")
    named = python_forms.FUNCTIONS.get(row.code)
    if named is not None and named.own is None and not hasattr(math, named.name):
        lacks(f"function '{named.name}' in Python's math; 'python' may be an own function")
    elif named is not None:
        known = {"np": np, named.name: named.own or getattr(math, named.name)}
        try:
            eval(named.array, known)
        except (AttributeError, NameError):
            lacks(f"function '{named.array}' of arrays; array=None takes that of Python for each element")
    called = "" if lookup else wasm_operations.ROWS[row.code].called
    if called and called not in loaded(KERNELS[0]).functions:
        lacks(
            f"function '{called}' in the kernels of pages; 'wasm' may be an instruction, and `make kernel` adds functions"
        )
    if row.form is None:
        for name, forms in (("casadi", differentiable.CASADI_FORMS), ("jax", differentiable.JAX_FORMS)):
            if row.code in forms.copied and (named is None or named.own is None):
                lacks(f"own function in Python, which {name}=None would copy")
    if isinstance(row.sympy, str) and not hasattr(sympy, row.sympy or row.name) and not lookup:
        lacks("function of SymPy; sympy=None makes an undefined one")
    return found


def truths(row: Operation) -> tuple[bool, ...]:
    """Tell which arguments are truth values."""
    return row.conditions[: row.arity]


def apply(graph: Graph, row: Operation, arguments: Sequence[Node]) -> Node:
    if row.code == ops.LOOKUP:
        return graph.lookup(graph.add_table(TABLE), *arguments)
    return graph.apply(row.code, *arguments)


def points(row: Operation, numbers: Sequence[float], count: int = 0) -> list[tuple[float, ...]]:
    """Return all combinations of some numbers as arguments, and ``count`` random points besides."""
    rng = random.Random(row.code)

    def some() -> float:
        return rng.choice((rng.uniform(-1, 1), rng.uniform(0, 4), rng.gauss(0, 30), rng.uniform(1, 3)))

    kinds = truths(row)
    grid = itertools.product(*((0.0, 1.0) if kind else numbers for kind in kinds))
    extra = ([float(rng.random() < 0.5) if kind else some() for kind in kinds] for _ in range(count))
    return [*grid, *map(tuple, extra)]


def value(row: Operation, arguments: tuple[float, ...]) -> float:
    """Return what the graph's own floats give."""
    return float(evaluated(row, arguments, FLOATS.constant, None))


def in_digits(row: Operation, arguments: tuple[float, ...]) -> Any:
    """Return the value with many digits."""
    return mpmath.mpf(evaluated(row, arguments, mpmath.mpf, multiprecision(mpmath.mp)))


def evaluated(row: Operation, arguments: tuple[float, ...], number: Callable[..., Any], numbers: Any) -> Any:
    g = Graph()
    symbols = [g.symbol(name) for name in "abc"[: row.arity]]
    given = [bool(x) if truth else number(x) for x, truth in zip(arguments, truths(row), strict=True)]
    return evaluate(g, [apply(g, row, symbols)], dict(zip(symbols, given, strict=True)), numbers)[0]


def is_regular(row: Operation, arguments: tuple[float, ...]) -> bool:
    return row.regular is None or bool(row.regular(*arguments))


def program_of(rows: Sequence[Operation]) -> Equations:
    """Return equations with a function ``op_NAME`` for each operation, of the states a, b, c."""
    g = Graph()
    states = [g.symbol(name) for name in "abc"]
    functions = []
    for row in rows:
        arguments = [g.less(g.half, x) if truth else x for x, truth in zip(states, truths(row), strict=False)]
        functions.append(Function(f"op_{row.name}", row.name, (apply(g, row, arguments),)))
    entries = [(x, Quantity(g.name(x), "state", "")) for x in states]
    return equations(g, functions, name="operations", states=entries, nx=3)


def build(rows: Sequence[Operation], folder: Path) -> tuple[dict[int, Both], dict[int, str]]:
    """Return programs by code, in C and Python; and why there are none."""
    whole = [row for row in rows if not missing(row)]
    try:
        both = Both(program_of(whole), folder)
        return dict.fromkeys((row.code for row in whole), both), {}
    except Exception:
        found, failed = {}, {}
        for row in whole:
            (inner := folder / row.name).mkdir()
            try:
                found[row.code] = Both(program_of([row]), inner)
            except Exception as error:
                failed[row.code] = str(error)
        return found, failed


DRIVER = """
typedef void function(mech_real, const mech_real *, const mech_real *, const mech_real *, const mech_real *, mech_real *);
EXPORT void in_full(function *f, const double *y, double *parts);
void in_full(function *f, const double *y, double *parts)
{
    mech_real state[3] = {y[0], y[1], y[2]}, out[1];
    f(0, state, state, state, state, out);
    for (int i = 0; i < 3; i++) {
        parts[i] = (double)out[0];
        out[0] -= (mech_real)parts[i];
    }
}
"""


class Quad:
    """The functions of a program with numbers of 113 bits."""

    def __init__(self, both: Both, folder: Path) -> None:
        text = emit_c(both.program) + DRIVER
        flags = (*REPRODUCIBLE, "-Wno-pedantic", "-DMECH_REAL=__float128", "-DMECH_QUAD")
        try:
            path = compile_c(text, folder, flags, "quad", ("-lquadmath", "-lm"))
        except AssertionError as error:
            if "quadmath.h" in str(error):
                pytest.skip("no libquadmath")
            raise
        self.library = ctypes.CDLL(str(path))

    def __call__(self, row: Operation, arguments: Sequence[float]) -> Any:
        """Return the value as an mpmath number."""
        y, parts = padded(arguments), np.zeros(3)
        address = ctypes.cast(getattr(self.library, f"op_{row.name}"), ctypes.c_void_p)
        self.library.in_full(address, *(ctypes.c_void_p(a.ctypes.data) for a in (y, parts)))
        if not math.isfinite(parts[0]):
            return mpmath.mpf(parts[0])
        return sum((mpmath.mpf(float(x)) for x in parts), mpmath.mpf(0))


def padded(arguments: Sequence[float]) -> Floats:
    return np.array([*arguments, 0.0, 0.0, 0.0][:3])


def rational(value: Any) -> Fraction | None:
    """Return the rational with a small denominator that a number of 50 digits is, if it is one."""
    if not mpmath.isfinite(value) or abs(value) > 1e6:
        return None
    near = Fraction(int(mpmath.nint(value * 720720)), 720720)
    exact = mpmath.mpf(near.numerator) / near.denominator
    return near if abs(value - exact) < mpmath.mpf(10) ** -45 else None
