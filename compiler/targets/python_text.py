"""Python text that several targets write: functions of a program, names with their units, strings."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence

from msgspec.structs import replace

from mechc.runtime.interface import Quantity

from ..graph.operations import PARTIAL
from ..program import ProgramFunction
from ..program.model import Body, Load, Operate, Store
from .c import sentence
from .expressions import Dialect, lines


def function_lines(
    function: ProgramFunction,
    arguments: str,
    dialect: Dialect,
    identifiers: Mapping[tuple[str, int], str],
    inputs: int = 0,
    states: int = 0,
    solved: str = "",
) -> Iterator[str]:
    """Yield one function; it reads sequences and returns a list. One of ``p, given`` completes p. ``inputs``: how many there
    are, after which lies what some functions are given; ``states``: how many there are;
    ``solved``: what finds the solutions that it reads."""
    (body,) = function.bodies
    results: dict[int, str] = {}
    completes = arguments == "p, given"
    number = dialect.number if partial(body) else ""
    if number and dialect.quiet:
        yield dialect.quiet
    yield f"def {function.name}({arguments}):"
    yield f'    """{quoted(sentence(function.doc))}"""'
    if completes:
        yield f"    p = [{number}(x) for x in p]" if number else "    p = list(p)"
        names = {(a, i): f"{a}[{i}]" for a, i in _loads(body)}
    else:
        if solved:
            yield f"    s = {solved}"
        names = {load: identifiers[load] for load in _loads(body)}
        for load in sorted(names, key=lambda load: ("tyuzpgs".index(load[0]), load[1])):
            array, index = load
            if array != "t":
                place = f"u[{inputs + index}]" if array == "g" else f"{array}[{index}]"
                yield f"    {names[load]} = {made(place, number)}"
            elif number:
                yield f"    {names[load]} = {made(names[load], number)}"

    def store(statement: Store, expression: str) -> str:
        if statement.array != "out":
            return dialect.store(statement, made(expression, number if statement.guarded else ""))
        results[statement.index] = expression
        return ""

    for line in lines(body, replace(dialect, store=store), names):
        if line:
            yield f"    {line}"
    if completes:
        yield "    return p\n\n"
    else:
        stays = (
            f"y[{i}]" if i < states else f"z[{i - states}]" for i in range(function.n_out)
        )  # in an event
        yield from returned([results.get(i, place) for i, place in enumerate(stays)])


def partial(body: Body) -> bool:
    """Return whether a function has operations without a value for some numbers, such as quotients: Python would raise there, also
    for a branch that is not taken."""
    return any(type(s) is Operate and s.code in PARTIAL for s in body)


def made(expression: str, number: str) -> str:
    return f"{number}({expression})" if number else expression


def returned(values: Sequence[str]) -> Iterator[str]:
    """Yield the statement that returns a list, and empty lines."""
    line = f"    return [{', '.join(values)}]"
    if len(line) <= 110:
        yield line
    else:
        yield "    return ["
        yield from (f"        {value}," for value in values)
        yield "    ]"
    yield "\n"


def _loads(body: Body) -> set[tuple[str, int]]:
    return {(s.array, s.index) for s in body if type(s) is Load}


def quantities(name: str, entries: Sequence[Quantity]) -> Iterator[str]:
    listed = ", ".join(f"({string(entry.name)}, {string(entry.unit)})" for entry in entries)
    if len(listed) < 100 and not any(entry.doc.strip() for entry in entries):
        yield f"{name} = [{listed}]"
        return
    yield f"{name} = ["
    for entry in entries:
        doc = entry.doc.strip().splitlines()
        yield f"    ({string(entry.name)}, {string(entry.unit)})," + (f"  # {doc[0]}" if doc else "")
    yield "]"


def strings(name: str, texts: Sequence[str]) -> Iterator[str]:
    yield f"{name} = [{', '.join(map(string, texts))}]"


def string(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def quoted(text: str) -> str:
    """Return text that can stand in a docstring."""
    return text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
