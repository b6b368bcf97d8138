"""The text of ``mechc show program``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import assert_never

from ..graph.operations import OPERATIONS
from .model import Literal, Load, Lookup, Operate, Program, ProgramFunction, Statement, Store


def show(program: Program) -> str:
    """Return the program as text, one statement a line."""
    return "\n".join(_lines(program)) + "\n"


def _lines(program: Program) -> Iterator[str]:
    sizes = f"{program.nq} coordinates, {program.nv} velocities, {program.nx} further states"
    yield f"program {program.name}: {sizes}, {program.nh} hoisted constants"
    for array in ("y", "u", "z", "p"):
        for i, entry in enumerate(program.arrays[array]):
            yield f"  {array}[{i}] {entry.name}" + (f" [{entry.unit}]" if entry.unit else "")
    for i, table in enumerate(program.tables):
        yield f"  table {i}: {len(table.values)} points"
    for function in (program.parameters_function, *program.functions):
        yield ""
        yield from _function(program, function)


def _function(program: Program, function: ProgramFunction) -> Iterator[str]:
    parts = [f"{function.operations} operations"]
    if len(function.bodies) > 1:
        parts.append(f"{len(function.bodies)} bodies, workspace of {function.workspace}")
    yield f"function {function.name}: {', '.join(parts)}"
    for k, body in enumerate(function.bodies):
        if k:
            yield "  ----"
        for i, statement in enumerate(body):
            yield "  " + line(program, i, statement)


def line(program: Program, i: int, statement: Statement) -> str:
    """Return one statement of a body as text."""
    match statement:
        case Load(array, index):
            entries = program.arrays.get(array, ())
            name = entries[index].name if index < len(entries) else ""
            return f"v{i} = {array}[{index}]" + (f"  # {name}" if name else "")
        case Literal(number):
            return f"v{i} = {number}"
        case Operate(code, operands):
            name = OPERATIONS[code].name if 0 <= code < len(OPERATIONS) else f"operation {code}"
            return f"v{i} = {name} " + " ".join(f"v{a}" for a in operands)
        case Lookup(table, order, operand):
            return f"v{i} = table {table} order {order} at v{operand}"
        case Store(array, index, value, guarded):
            return f"{array}[{index}] = v{value}" + (" unless set" if guarded else "")
        case _:
            assert_never(statement)
