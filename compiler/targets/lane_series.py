"""Taylor series in lanes: ``series_start`` and ``series_next`` of ``program/series.py``, with the sums of the slots written out.

The sides of slots are rows of coefficients; a series that is a side of several slots, or the state itself, is one row. Each order
has a row of rows: the coefficients of the state of the next order, then the sides of the slots.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from mechc.runtime.ensembles.lanes import NoLanes

from ..graph.operations import MUL
from ..program import Program, ProgramFunction
from ..program.model import Body, Load, Lookup, Operate, Statement, Store, Value
from ..program.series import NEXT, START, padded

GROUP = 8
"""Slots whose sums of two orders are formed at once: as many as registers hold."""


def series_functions(program: Program) -> tuple[tuple[ProgramFunction, ProgramFunction], tuple[str, ...]]:
    """Return both functions, of which the second one writes each row once, and the lines of ``series_sums``, with the sizes
    before them. Raises NoLanes."""
    plan = program.series
    start, following = program.function(START), program.function(NEXT)
    if plan is None or plan.refusal or start is None or following is None:
        raise NoLanes(plan.refusal if plan and plan.refusal else "it has no Taylor series")
    ny, slots = len(program.arrays["y"]), plan.n_slots
    (body,) = following.bodies
    stored = {s.index: s.value for s in body if type(s) is Store}
    rows: dict[Value, int] = {}
    sides = []
    for slot in range(slots):
        side = []
        for first in (padded(ny), padded(ny) + padded(slots)):
            value = stored[first + slot]
            source = body[value]
            if type(source) is Load and source.array == "y":
                side.append(f"x{{}}[{source.index}]")
            else:
                side.append(f"r{{}}[{rows.setdefault(value, ny + len(rows))}]")
        sides.append((side[0], side[1]))
    places = {ny + k: value for k, value in enumerate(rows)}
    behind = padded(slots)
    shorter = _body(body, [stored[i] for i in range(ny)], places, behind + 2)
    sizes = (
        f"#define N_SERIES_KEPT {plan.n_kept}\n#define N_BEHIND {behind}\n#define N_ROWS {ny + len(rows)}\n"
    )
    return (
        start,
        ProgramFunction(NEXT, following.doc, ny + len(rows), (shorter,)),
    ), (sizes, *_sums(sides))


def _body(body: Body, rates: Sequence[Value], rows: Mapping[int, Value], over: int) -> Body:
    """Return a body that stores other results; what none of them needs is dropped when it is written.

    Of the rates it stores the coefficients of the state that follow from them: ``over`` is the place of what they are times.
    """
    moved: dict[Value, Value] = {}
    out: list[Statement] = []
    for value, statement in enumerate(body):
        if type(statement) is not Store:
            moved[value] = len(out)
            out.append(moved_statement(statement, moved))
    out.append(Load("u", over))
    factor = len(out) - 1
    for i, rate in enumerate(rates):
        out += [Operate(MUL, (moved[rate], factor)), Store("out", i, len(out))]
    return (*out, *(Store("out", k, moved[value]) for k, value in rows.items()))


def moved_statement(statement: Statement, moved: dict[Value, Value]) -> Statement:
    """Return a statement whose operands stand elsewhere."""
    match statement:
        case Operate(code, operands):
            return Operate(code, tuple(moved[a] for a in operands))
        case Lookup(table, order, operand):
            return Lookup(table, order, moved[operand])
        case _:
            return statement


def _sums(sides: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield ``series_sums``: of all slots, the sums of A_j B_(k-j) for j from 1 to k - 1.

    For even k those of the next order are begun with them, as each number that is read serves both, and completed by their
    first and last product when that comes. Of squares each product is formed once.
    """
    squares = [slot for slot, (a, b) in enumerate(sides) if a == b]
    others = sorted(set(range(len(sides))) - set(squares), key=lambda slot: sides[slot])
    pieces = [_products(group, sides) for group in _even(others)]
    pieces += [_squares(group, sides) for group in _even(squares)]
    for number, lines in enumerate(pieces):
        yield f"static NOINLINE void series_sums_{number}({_ARGUMENTS})"
        yield "{"
        yield from lines
        yield "}\n"
    yield f"static inline void series_sums({_ARGUMENTS})"
    yield "{"
    yield "    (void)k, (void)x, (void)out, (void)later;"
    for number in range(len(pieces)):
        yield f"    series_sums_{number}(k, x, out, later);"
    yield "}\n"


_ARGUMENTS = "int k, const V (*x)[N_ROWS], V *restrict out, V *restrict later"


def _even(slots: Sequence[int]) -> list[Sequence[int]]:
    """Return groups that differ by one at most."""
    count = -(-len(slots) // GROUP)
    return [slots[len(slots) * i // count : len(slots) * (i + 1) // count] for i in range(count)]


def _products(group: Sequence[int], sides: Sequence[tuple[str, str]]) -> Iterator[str]:
    yield "    if (k % 2) {"
    yield "        const V *x1 = x[1], *xk = x[k - 1], *r1 = x[2], *rk = x[k];"
    yield "        (void)x1, (void)xk, (void)r1, (void)rk;"
    for slot in group:
        a, b = sides[slot]
        last = f"lane_fma({a.format('k')}, {b.format('1')}, later[{slot}])"
        yield f"        out[{slot}] = k > 1 ? lane_fma({a.format('1')}, {b.format('k')}, {last}) : lane(0);"
    yield "        return;"
    yield "    }"
    yield f"    V {', '.join(f'm{slot} = lane(0), n{slot} = lane(0)' for slot in group)};"
    seconds = list(dict.fromkeys(sides[slot][1] for slot in group))
    yield f"    V {', '.join(f'before{i} = lane(0)' for i in range(len(seconds)))};"
    yield "    LANE_TWICE"
    yield "    for (int j = 1; j < k; j++) {"
    yield "        const V *xa = x[j], *xb = x[k - j], *ra = x[j + 1], *rb = x[k - j + 1];"
    yield "        (void)xa, (void)xb, (void)ra, (void)rb;"
    for slot in group:
        a, b = sides[slot]
        yield f"        n{slot} = lane_fma({a.format('a')}, before{seconds.index(b)}, n{slot});"
        yield f"        m{slot} = lane_fma({a.format('a')}, {b.format('b')}, m{slot});"
    for i, b in enumerate(seconds):
        yield f"        before{i} = {b.format('b')};"
    yield "    }"
    for slot in group:
        yield f"    out[{slot}] = m{slot};"
        yield f"    later[{slot}] = n{slot};"


def _squares(group: Sequence[int], sides: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield the same for A_j A_(k-j): twice the first half, and for even k the square in the middle."""
    yield "    if (k % 2) {"
    yield "        const V *x1 = x[1], *xk = x[k - 1], *r1 = x[2], *rk = x[k];"
    yield "        (void)x1, (void)xk, (void)r1, (void)rk;"
    for slot in group:
        a = sides[slot][0]
        half = f"lane_fma({a.format('1')}, {a.format('k')}, later[{slot}])"
        yield f"        out[{slot}] = k > 1 ? {half} * 2.0 : lane(0);"
    yield "        return;"
    yield "    }"
    yield f"    V {', '.join(f'm{slot} = lane(0), n{slot} = lane(0)' for slot in group)};"
    yield "    const V *xa = x[1], *ra = x[2];"
    yield "    (void)xa, (void)ra;"
    first = {slot: sides[slot][0].format("a") for slot in group}
    yield f"    V {', '.join(f'before{slot} = {side}' for slot, side in first.items())};"
    yield "    for (int j = 2; 2 * j <= k; j++) {"
    yield "        const V *xb = x[k + 1 - j], *rb = x[k + 2 - j];"
    yield "        xa = x[j], ra = x[j + 1];"
    yield "        (void)xb, (void)rb;"
    for slot in group:
        a = sides[slot][0]
        yield f"        m{slot} = lane_fma(before{slot}, {a.format('b')}, m{slot});"
        yield f"        before{slot} = {a.format('a')};"
        yield f"        n{slot} = lane_fma(before{slot}, {a.format('b')}, n{slot});"
    yield "    }"
    for slot in group:
        yield f"    out[{slot}] = lane_fma(before{slot}, before{slot}, m{slot} * 2.0);"
        yield f"    later[{slot}] = n{slot};"
