"""Split long functions, because the time of a C compiler grows faster than the length of a function."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Container

from msgspec.structs import replace

from ..graph.operations import COS, SIN
from .model import (
    Body,
    Literal,
    Load,
    Lookup,
    Operate,
    Program,
    ProgramFunction,
    Statement,
    Store,
    Value,
    operands_of,
)

CHUNK = 300
"""Operations in one body. Between 200 and 600 neither run time nor compile time changes by more than a tenth."""


def chunk(program: Program, size: int = CHUNK, whole: Collection[str] = ()) -> Program:
    """Return the program with all functions of more than 1.5 ``size`` operations split, but those that stay ``whole``."""
    return replace(
        program,
        parameters_function=program.parameters_function
        if program.parameters_function.name in whole
        else split(program.parameters_function, size),
        functions=tuple(f if f.name in whole else split(f, size) for f in program.functions),
    )


def is_long(function: ProgramFunction, size: int) -> bool:
    """Whether a function is in one body, of more than 1.5 ``size`` operations."""
    return 2 * function.operations > 3 * size and len(function.bodies) == 1


def split(function: ProgramFunction, size: int, first: int = 0) -> ProgramFunction:
    """Return the function in bodies of about ``size`` operations; one that is not long (``is_long``) as it is.

    Loads and literals are repeated in each body that uses them; results that later bodies use pass through
    the workspace from its place ``first`` on, whose places are used again once the last reader has run. What the function stores
    there itself stays, in places before these.
    """
    if not is_long(function, size):
        return function
    (body,) = map(tuple, function.bodies)
    home, last = _homes(body, size)
    n_bodies = home[-1] + 1
    kept = {s.value: s.index for s in body if type(s) is Store and s.array == "w"}
    crossing, workspace = _places(body, home, last, first, kept)
    places = crossing | kept
    bodies: list[list[Statement]] = [[] for _ in range(n_bodies)]
    # where a value of the long body is found in the body under construction
    here: dict[Value, Value] = {}
    current = 0

    def local(value: Value) -> Value:
        found = here.get(value)
        if found is None:
            source = body[value]
            out = bodies[current]
            here[value] = found = len(out)
            out.append(
                source if type(source) is Load or type(source) is Literal else Load("w", places[value])
            )
        return found

    for value, statement in enumerate(body):
        if home[value] != current:
            current = home[value]
            here = {}
        out = bodies[current]
        moved: Statement
        if type(statement) is Operate:
            moved = Operate(
                statement.code, tuple([here[a] if a in here else local(a) for a in statement.operands])
            )
        else:
            match statement:
                case Store(array, index, operand, guarded):
                    out.append(Store(array, index, local(operand), guarded))
                    continue
                case Lookup(table, order, operand):
                    moved = Lookup(table, order, local(operand))
                case _:
                    continue
        here[value] = len(out)
        out.append(moved)
        if value in crossing:
            out.append(Store("w", crossing[value], here[value]))
    return replace(function, bodies=tuple(tuple(b) for b in bodies), workspace=workspace, made=())


def _homes(body: Body, size: int) -> tuple[list[int], list[int]]:
    """Return the body each statement goes to, and the last body that reads its value."""
    home: list[int] = []
    last = [0] * len(body)
    current = count = 0
    previous: Statement | None = None
    for statement in body:
        if type(statement) is Operate or type(statement) is Lookup:
            if count >= size and not _belong_together(previous, statement):
                current, count = current + 1, 0
            count += 1
            previous = statement
        home.append(current)
        for operand in statement.operands if type(statement) is Operate else operands_of(statement):
            last[operand] = current
    return home, last


def _belong_together(a: Statement | None, b: Statement) -> bool:
    """Tell whether two statements are sine and cosine of one argument."""
    return (
        type(a) is Operate
        and type(b) is Operate
        and a.code in (SIN, COS)
        and b.code in (SIN, COS)
        and a.operands == b.operands
    )


def _places(
    body: Body, home: list[int], last: list[int], n: int, kept: Container[Value]
) -> tuple[dict[Value, int], int]:
    """Return the place in the workspace, after the first ``n``, of each value that crosses bodies and is not ``kept`` in one, and how
    many places there are."""
    places: dict[Value, int] = {}
    free: list[int] = []
    released: list[list[int]] = [[] for _ in range(home[-1] + 2)]
    current = 0
    for value, statement in enumerate(body):
        if home[value] != current:
            current = home[value]
            # what was read last in the body before may be overwritten from this one on
            for place in released[current - 1]:
                heapq.heappush(free, place)
        crosses = last[value] > home[value] and value not in kept
        if crosses and (type(statement) is Operate or type(statement) is Lookup):
            if free:
                place = heapq.heappop(free)
            else:
                place, n = n, n + 1
            places[value] = place
            released[last[value]].append(place)
    return places, n
