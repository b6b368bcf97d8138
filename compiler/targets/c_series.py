"""The C text of Taylor series of few slots: ``series_next`` of ``program/series.py`` and the sums of the slots in one loop over orders.

The coefficients of a state stay in registers from order to order, those of both sides of the slots are written in vectors that the
next sums read as such. Of very few slots, each sum ends with the products of the latest coefficients one by one, as they are
wanted sooner than vectors are filled; what goes before is added up while processors wait for them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Final

from msgspec.structs import replace

from ..program.model import SERIES_NEXT, Body, Literal, Load, Program, Store, Value
from ..program.series import LANES, padded
from .expressions import Dialect, lines
from .model_data import EXPAND

_HEAD: Final = f"""\
/* Coefficients of the state from order 2 up to a given one. */
static void {EXPAND}(int order, const mech_real *kept, const mech_real *p, mech_real *restrict x,
                          mech_real *restrict rows)
{{"""

Side = tuple[str, int]
"""A series that is a side of slots: x and which state it is, or r and which value of the function."""


def expansion(program: Program, dialect: Dialect) -> Iterator[str]:
    """Yield the lines of the function that takes the place of ``series_next``."""
    plan, function = program.series, program.function(SERIES_NEXT)
    assert plan is not None and function is not None
    (body,) = function.bodies
    ny, slots = len(program.arrays["y"]), padded(plan.n_slots)
    stored = {s.index: s.value for s in body if type(s) is Store}
    a, b = sides_of(body, stored, plan.n_slots, ny)
    yield _HEAD
    yield f"    enum {{ STATES = {padded(ny)}, SLOTS = {slots} }};"
    unused = {"kept": "z", "p": "p"}
    unused = {name: array for name, array in unused.items() if not any(loaded(body, array))}
    if unused or not slots:
        yield f"    {' '.join(f'(void){name};' for name in (*unused, *(() if slots else ('rows',))))}"
    yield f"    mech_real {', '.join(f'x{i} = x[STATES + {i}]' for i in range(ny))};"
    names = {("t", 0): "(mech_real)k", ("u", slots): "mech_series_over[k]", ("u", slots + 1): "(k == 1)"}
    names |= {("y", i): f"x{i}" for i in range(ny)}
    names |= {("z", i): f"kept[{i}]" for i in loaded(body, "z")} | {
        ("p", i): f"p[{i}]" for i in loaded(body, "p")
    }
    names |= {("u", k): f"sum{k}" if slots == LANES else f"rows[{k}]" for k in range(plan.n_slots)}
    sides = [name_of(side) for side in dict.fromkeys((*a, *b))]
    ends = slots == LANES
    if ends:
        yield f"    mech_real {', '.join(f'{name}_1 = 0, {name}_k = 0' for name in sides)};"
        yield "    for (int i = 0; i < SLOTS; i++) rows[SLOTS + i] = 0;"
    yield "    for (int k = 1;; k++) {"
    inner = (
        _with_ends(a, b)
        if ends
        else ["mech_series_sums(1, k, rows, SLOTS, 2 * SLOTS, rows);"]
        if slots
        else []
    )
    yield from (f"        {line}" for line in inner)
    written = replace(dialect, store=_store)
    for line in lines(results(body, stored, ny, {*a, *b}), written, names):
        yield f"        {line}"
    for offset, row in ((0, a), (slots, b)):
        for at in range(0, len(row), LANES):
            values = [name_of(side) for side in row[at : at + LANES]]
            values += ["0"] * (LANES - len(values))
            yield f"        MECH_SERIES_PUT(rows + 2 * SLOTS * k + {offset + at}, {', '.join(values)});"
    if ends:
        yield f"        {' '.join(f'{name}_k = {name};' for name in sides)}"
        yield f"        if (k == 1) {{ {' '.join(f'{name}_1 = {name};' for name in sides)} }}"
    yield "        const mech_real share = mech_series_over[k + 1];"
    for i in range(ny):
        yield f"        x[STATES * (k + 1) + {i}] = x{i} = rate{i} * share;"
    yield "        if (k + 1 == order) return;"
    yield "    }"
    yield "}\n"


def _with_ends(a: Sequence[Side], b: Sequence[Side]) -> Iterator[str]:
    """Yield the lines that complete the sums of this order, and begin those of the next one."""
    yield "const mech_real *begun = rows + k % 2 * SLOTS;"
    yield "mech_series_sums(2, k + 1, rows, SLOTS, 2 * SLOTS, rows + (k + 1) % 2 * SLOTS);"
    pairs = [(name_of(first), name_of(second)) for first, second in zip(a, b, strict=True)]
    sums = (f"sum{k} = begun[{k}] + {first}_1 * {second}_k" for k, (first, second) in enumerate(pairs))
    yield f"mech_real {', '.join(sums)};"
    sums = (f"sum{k} += {first}_k * {second}_1;" for k, (first, second) in enumerate(pairs))
    yield f"if (k > 2) {{ {' '.join(sums)} }}"


def loaded(body: Body, array: str) -> list[int]:
    """Return the places of an array that a function reads."""
    return sorted({s.index for s in body if type(s) is Load and s.array == array})


def sides_of(body: Body, stored: Mapping[int, Value], n_slots: int, ny: int) -> tuple[list[Side], list[Side]]:
    """Return the series that are the first sides of the slots, and those that are the second ones."""
    first, second = padded(ny), padded(ny) + padded(n_slots)
    return (
        [_side(body, stored[first + k]) for k in range(n_slots)],
        [_side(body, stored[second + k]) for k in range(n_slots)],
    )


def _side(body: Body, value: Value) -> Side:
    source = body[value]
    return ("x", source.index) if type(source) is Load and source.array == "y" else ("r", value)


def name_of(side: Side) -> str:
    """Return the name that a series has in the loop."""
    return f"{side[0]}{side[1]}"


def results(body: Body, stored: Mapping[int, Value], ny: int, sides: Collection[Side]) -> Body:
    """Return a body that gives the rates and, once each, those sides of slots that are not states."""
    nothing = Literal(Fraction(0))
    return (
        *(nothing if type(s) is Store else s for s in body),
        *(Store("r", value, value) for name, value in sorted(sides) if name == "r"),
        *(Store("rate", i, stored[i]) for i in range(ny)),
    )


def _store(statement: Store, expression: str) -> str:
    return f"const mech_real {statement.array}{statement.index} = {expression};"
