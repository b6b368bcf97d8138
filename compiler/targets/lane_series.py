"""Taylor series in lanes: ``series_start`` and ``series_next`` of ``program/series.py``, and which rows the sums of the slots read.

The sides of slots are rows of coefficients; a series that is a side of several slots, or the state itself, is one row. Each order
has a row of rows: the coefficients of the state of the next order, then the sides of the slots. ``lane_orders.h`` of the kernel
adds up the slots and forms the orders.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from msgspec.structs import replace

from mechc.runtime.ensembles.lanes import NoLanes

from ..graph.operations import MUL
from ..program import Program, ProgramFunction
from ..program.model import SERIES_NEXT, SERIES_START, Body, Load, Operate, Statement, Store, Value, moved
from ..program.series import padded
from .c_series import Side, sides_of

GROUP = 8
"""Slots whose sums of two orders are formed at once: as many as registers hold."""

Sides = tuple[int, int]
"""Of a slot: where its series stand, in the row of their order; those that are not states stand in the next one."""


def series_functions(program: Program) -> tuple[ProgramFunction, ProgramFunction, ProgramFunction, str]:
    """Return ``series_start``, ``series_next`` of doubles and of singles, which write each row once, and the text of sizes and
    sides. Of the parameters, the function of singles has those that it reads. Raises NoLanes."""
    start, plan, following = program.function(SERIES_START), program.series, program.function(SERIES_NEXT)
    if start is None or plan is None or following is None:
        raise NoLanes(program.no_series or "it has no Taylor series")
    ny, behind = len(program.arrays["y"]), padded(plan.n_slots)
    (body,) = following.bodies
    stored = {s.index: s.value for s in body if type(s) is Store}
    pairs = [*zip(*sides_of(body, stored, plan.n_slots, ny), strict=True)]
    made = dict.fromkeys(value for pair in pairs for kind, value in pair if kind == "r")
    rows = {value: ny + k for k, value in enumerate(made)}
    n_rows = ny + len(rows)

    def place(side: Side) -> int:
        kind, index = side
        return index if kind == "x" else n_rows + rows[index]

    sides = [(place(a), place(b)) for a, b in pairs]
    order = sorted(range(len(sides)), key=lambda slot: (sides[slot][0] == sides[slot][1], sides[slot]))
    slots = {slot: k for k, slot in enumerate(order)}
    shorter = _body(body, [stored[i] for i in range(ny)], rows, slots, behind + 2)
    read = sorted({s.index for s in shorter if type(s) is Load and s.array == "p"})
    places = {index: k for k, index in enumerate(read)}
    narrow = tuple(Load("p", places[s.index]) if type(s) is Load and s.array == "p" else s for s in shorter)
    doubles = ProgramFunction(f"lane_{SERIES_NEXT}", following.doc, n_rows, (shorter,))
    singles = replace(doubles, name=f"single_{SERIES_NEXT}", bodies=(narrow,))
    sizes = {"N_SERIES_KEPT": plan.n_kept, "N_BEHIND": behind, "N_ROWS": n_rows, "N_TAIL_P": len(read)}
    text = [f"#define {name} {size}" for name, size in sizes.items()]
    text += [*_groups([sides[slot] for slot in order]), _table("tail_p", read)]
    return start, doubles, singles, "\n".join(text) + "\n"


def _body(
    body: Body, rates: Sequence[Value], rows: Mapping[Value, int], slots: Mapping[int, int], over: int
) -> Body:
    """Return a body that reads the sums in another order, and stores other results; what none of them needs is dropped when it
    is written.

    Of the rates it stores the coefficients of the state that follow from them: ``over`` is the place of what they are times.
    """
    places: dict[Value, Value] = {}
    out: list[Statement] = []
    for value, statement in enumerate(body):
        if type(statement) is Load and statement.array == "u":
            statement = Load("u", slots.get(statement.index, statement.index))
        if type(statement) is not Store:
            places[value] = len(out)
            out.append(moved(statement, places))
    out.append(Load("u", over))
    factor = len(out) - 1
    for i, rate in enumerate(rates):
        out += [Operate(MUL, (places[rate], factor)), Store("out", i, len(out))]
    return (*out, *(Store("out", k, places[value]) for value, k in rows.items()))


def _groups(sides: Sequence[Sides]) -> Iterator[str]:
    """Yield the sides of all slots, squares last, and the groups of slots that differ in size by one at most."""
    products = sum(a != b for a, b in sides)
    groups = []
    for kind, begin, end in (("products", 0, products), ("squares", products, len(sides))):
        count = -(-(end - begin) // GROUP)
        cuts = [begin + (end - begin) * i // max(1, count) for i in range(count + 1)]
        groups += [(kind, first, last - first) for first, last in pairwise(cuts)]
    listed = " ".join(f"DO({k}, {kind}, {first}, {count})" for k, (kind, first, count) in enumerate(groups))
    yield f"#define SERIES_GROUPS(DO) {listed}"
    yield _table("first_side", [a for a, _ in sides])
    yield _table("second_side", [b for _, b in sides])


def _table(name: str, numbers: Sequence[int]) -> str:
    return f"static MECH_FIXED int {name}[] = {{{', '.join(map(str, numbers)) or '0'}}};"
