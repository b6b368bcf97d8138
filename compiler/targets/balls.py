"""A program over balls of numbers that hold every rounding: what proofs evaluate (python-flint, F. Johansson 2017)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mechc.runtime.problem import NotEnclosed

from ..graph.operations import OPERATIONS
from ..program import Program
from ..program.model import Literal, Load, Operate, ProgramFunction, Store

FORMS: Mapping[int, Callable[..., Any]] = {row.code: row.ball for row in OPERATIONS if row.ball is not None}
"""By codes. Other operations choose or jump, which balls can only where they decide."""


def enclosure(program: Program) -> Callable[[str, Mapping[str, Sequence[Any]]], list[Any]]:
    """Return what evaluates a function by its name over balls; arrays t, y, u, z, p, of which p holds all parameters.

    Constants of the text are exact; hoisted ones are enclosed like everything else. Raises NotEnclosed, ImportError.
    """
    functions = {f.name: f for f in program.functions}

    def evaluate(name: str, arrays: Mapping[str, Sequence[Any]]) -> list[Any]:
        p = [*arrays["p"], *([None] * program.nh)]
        _run(program.parameters_function, {**arrays, "p": p}, p)
        out: list[Any] = [None] * functions[name].n_out
        _run(functions[name], {**arrays, "p": p}, out)
        return out

    return evaluate


def _run(function: ProgramFunction, arrays: Mapping[str, Sequence[Any]], out: list[Any]) -> None:
    from flint import arb, fmpq

    work: list[Any] = [None] * function.workspace
    sources = {**arrays, "w": work}
    for body in function.bodies:
        values: list[Any] = []
        for statement in body:
            match statement:
                case Load(array, index):
                    values.append(sources[array][index])
                case Literal(number):
                    values.append(arb(fmpq(number.numerator, number.denominator)))
                case Operate(code, operands):
                    found = FORMS[code](*(values[k] for k in operands)) if code in FORMS else None
                    if found is None:
                        raise NotEnclosed(OPERATIONS[code].name)
                    values.append(found)
                case Store(array, index, value, guarded):
                    values.append(None)
                    if not guarded:  # parameters are all given
                        (work if array == "w" else out)[index] = values[value]
                case _:
                    raise NotEnclosed("lookup")
