"""The statements of a program evaluated by Python's floats: a second eye on generated C, which gives the same bits."""

from __future__ import annotations

import keyword
import math
import types
from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from mechc.compiler.program import Program
from mechc.compiler.program.model import identifiers
from mechc.compiler.targets import python_forms
from mechc.compiler.targets.c_tables import used_tables
from mechc.compiler.targets.python_forms import FUNCTIONS, TABLES, table_text
from mechc.compiler.targets.python_text import function_lines
from mechc.runtime.problem import Array, ModelFunction

DIALECT = replace(python_forms.DIALECT, number="", quiet="", branch=None)
"""That of modules, but with the floats of Python, and all statements computed."""

NAMED = {f.name: f for f in (*FUNCTIONS.values(), *TABLES.values())}
PLAIN: dict[str, Any] = {name: f.own or getattr(math, name) for name, f in NAMED.items()}


def _careful(name: str) -> Callable[..., Any]:
    """Return a function by its name; where ``math`` raises, it gives what NumPy does: NaN or infinity."""
    fallback = eval(NAMED[name].array, {"np": np, **PLAIN})

    def evaluate(*arguments: Any) -> Any:
        try:
            value = PLAIN[name](*arguments)
        except (ArithmeticError, ValueError):
            value = fallback(*arguments)
        return np.bool_(value) if NAMED[name].condition else np.float64(value)

    return evaluate


CAREFUL = {name: _careful(name) for name in NAMED}


def _checked(function: Any) -> Callable[..., list[float]]:
    """Return a function that never raises: where Python does, the same text is evaluated with NumPy's numbers."""
    again = types.FunctionType(function.__code__, {**function.__globals__, **CAREFUL})

    def evaluate(*arguments: Any) -> list[float]:
        try:
            return list(function(*arguments))
        except (ArithmeticError, ValueError):
            converted = [[np.float64(v) for v in a] if np.ndim(a) else np.float64(a) for a in arguments]
            with np.errstate(all="ignore"):
                return [float(v) for v in again(*converted)]

    return evaluate


def load_python(
    program: Program,
) -> tuple[dict[str, ModelFunction], Callable[[Array, NDArray[np.uint8]], None]]:
    """Return the functions of a program by name, and the one that completes p in place."""
    reserved = {*keyword.kwlist, *keyword.softkwlist, "abs", "pi", "np", "given", *NAMED}
    names, text = identifiers(program, reserved), ["from math import pi"]
    text += [f"TABLE_{i} = {table_text(table)}" for i, table in used_tables(program)]
    text += function_lines(program.parameters_function, "p, given", DIALECT, names)
    for f in program.functions:
        text += function_lines(f, "t, y, u, z, p", DIALECT, names, program.size("u"), program.size("y"))
    namespace: dict[str, Any] = {**PLAIN}
    exec("\n".join(text), namespace)
    complete = _checked(namespace["parameters"])

    def parameters(p: Array, given: NDArray[np.uint8]) -> None:
        p[:] = complete(p.tolist(), given.tolist())

    def over_lists(function: Callable[..., list[float]]) -> ModelFunction:
        return lambda t, y, u, z, p: np.array(function(t, y.tolist(), u.tolist(), z.tolist(), p.tolist()))

    return {f.name: over_lists(_checked(namespace[f.name])) for f in program.functions}, parameters
