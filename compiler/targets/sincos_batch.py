"""Sines and cosines four at a time: of angles that are sums of what a function is given, ahead of what reads them.

Their statements are moved, nothing else: each group to where the first of the group before it is read, so that it is formed beside
arithmetic that waits for its own results. A printer that finds sines and cosines of several angles in a row writes them
as one (``turn_groups``).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from msgspec.structs import replace

from ..graph.operations import ADD, COS, MUL, NEG, SIN, SUB
from ..program.branches import branches
from ..program.model import (
    Body,
    Literal,
    Load,
    Operate,
    ProgramFunction,
    Statement,
    Value,
    codes_of,
    moved,
    operands_of,
    places_of,
)

WIDTH = 4
"""Angles at once. Eight at once slow the arithmetic of single numbers beside them."""

FEWEST = 2
"""Angles that are worth it: one alone is as fast by the C library."""

EARLY = frozenset({ADD, SUB, NEG, MUL})
"""Operations that an angle may be made of to be known at the head."""


def with_turns_ahead(function: ProgramFunction) -> ProgramFunction:
    """Return a function with the sines and cosines of each of its bodies in groups."""
    bodies = tuple(map(_gathered, function.bodies))
    changed = any(a is not b for a, b in zip(bodies, function.bodies, strict=True))
    return replace(function, bodies=bodies, made=()) if changed else function


def _gathered(body: Body) -> Body:
    if codes_of(body).isdisjoint((SIN, COS)) or branches(body):  # these form only what they need
        return body
    statements = tuple(body)
    angles = _angles(statements)
    if len(angles) < FEWEST:
        return body
    return _ordered(statements, [angles[k : k + WIDTH] for k in range(0, len(angles), WIDTH)])


def turn_groups(body: Body, apart: Collection[Value] = ()) -> dict[Value, list[Value]]:
    """Return the angles of each group, by the place of its first sine or cosine; none goes beyond a place of ``apart``."""
    found: dict[Value, list[Value]] = {}
    first, angles = 0, list[Value]()
    last = -1
    for value in places_of(body, (SIN, COS)):
        if value > last + 1 or value in apart:
            angles = []
        last = value
        (angle,) = operands_of(body[value])
        if angle in angles:
            continue
        if not angles or len(angles) == WIDTH or angle >= first:
            found[value] = angles = []
            first = value
        angles.append(angle)
    return {value: angles for value, angles in found.items() if len(angles) >= FEWEST}


def turn_places(name: str, angles: Sequence[Value]) -> dict[tuple[int, Value], str]:
    """Return where the array of a group holds the sine and the cosine of each angle."""
    places = {(SIN, angle): f"{name}[{k}]" for k, angle in enumerate(angles)}
    return places | {(COS, angle): f"{name}[{WIDTH + k}]" for k, angle in enumerate(angles)}


def _turns(statement: Statement) -> bool:
    return type(statement) is Operate and (statement.code == SIN or statement.code == COS)


def _angles(body: Body) -> list[Value]:
    """Return the arguments of sines and cosines that are known at the head, in the order in which they are needed."""
    known: dict[Value, bool] = {}

    def early(value: Value) -> bool:
        """Whether a value is made by early operations alone, of what is before it."""
        pending = [value]
        while pending:
            last = pending[-1]
            statement = body[last]
            operands = operands_of(statement)
            if type(statement) is Operate and statement.code in EARLY:
                missing = [a for a in operands if a not in known]
                if missing:
                    pending += missing
                    continue
                known[last] = all(known[a] for a in operands)
            else:
                known[last] = type(statement) is Load or type(statement) is Literal
            pending.pop()
        return known[value]

    angles = dict.fromkeys(
        s.operands[0] for s in body if type(s) is Operate and (s.code == SIN or s.code == COS)
    )
    return [angle for angle in angles if early(angle)]


def _ordered(body: Body, groups: list[list[Value]]) -> Body:
    """Return the statements with the groups in their new places."""
    number = {angle: k for k, group in enumerate(groups) for angle in group}
    turns: dict[Value, list[Value]] = {angle: [] for angle in number}
    for value, statement in enumerate(body):
        if _turns(statement) and (angle := operands_of(statement)[0]) in turns:
            turns[angle].append(value)
    of = {value: number[angle] for angle, values in turns.items() for value in values}
    out: list[Statement] = []
    place: dict[Value, Value] = {}
    formed = 0

    def write(value: Value) -> None:
        """Write a statement, and what it needs before it."""
        pending = [value]
        while pending:
            last = pending[-1]
            missing = [a for a in operands_of(body[last]) if a not in place]
            if missing:
                pending += reversed(missing)
                continue
            pending.pop()
            if last not in place:
                place[last] = len(out)
                out.append(moved(body[last], place))

    def form(group: list[Value]) -> None:
        for angle in group:
            write(angle)
        for angle in group:
            for value in turns[angle]:
                write(value)

    for value in range(len(body)):
        if value in of:
            while formed < len(groups) and formed <= of[value] + 1:
                form(groups[formed])
                formed += 1
        elif value not in place:
            place[value] = len(out)
            out.append(moved(body[value], place))
    return tuple(out)
