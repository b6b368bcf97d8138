"""Taylor series in lanes: ``series_start`` and ``series_next`` of ``program/series.py``, with the sums of the slots written out.

The sides of slots are rows of coefficients; a series that is a side of several slots, or the state itself, is one row.
``series_sums`` goes through the orders with the sums of many slots in registers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mechc.runtime.ensembles.lanes import NoLanes

from ..program import Program, ProgramFunction
from ..program.model import Body, Load, Lookup, Operate, Statement, Store, Value
from ..program.series import NEXT, START, padded

GROUP = 6
"""Sums of two orders that are formed at once: as many as registers hold beside what they read."""


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
    shorter = _body(body, {**{i: stored[i] for i in range(ny)}, **places})
    sizes = f"#define N_SERIES_KEPT {plan.n_kept}\n#define N_SLOTS {slots}\n#define N_ROWS {ny + len(rows)}\n"
    return (
        start,
        ProgramFunction(NEXT, following.doc, ny + len(rows), (shorter,)),
    ), (sizes, *_sums(sides))


def _body(body: Body, results: dict[int, Value]) -> Body:
    """Return a body that stores other results; what none of them needs is dropped when it is written."""
    kept = tuple(s for s in body if type(s) is not Store)
    moved: dict[Value, Value] = {}
    for value, statement in enumerate(body):
        if type(statement) is not Store:
            moved[value] = len(moved)
    return (
        *(moved_statement(s, moved) for s in kept),
        *(Store("out", k, moved[v]) for k, v in results.items()),
    )


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

    For even k those of the next order are begun with them, as each number that is read serves both, and completed when
    that comes. What needs the coefficients of order k - 1, which are just being computed, comes last.
    """
    order = sorted(range(len(sides)), key=lambda slot: sides[slot])
    groups = [order[first : first + GROUP] for first in range(0, len(order), GROUP)]
    arguments = "int k, const V (*x)[NY], const V (*rows)[N_ROWS], V *restrict out, V *restrict later"
    for number, group in enumerate(groups):
        yield f"static void series_sums_{number}({arguments})"
        yield "{"
        yield "    const V *x1 = x[1], *r1 = rows[1], *xl = x[k - 1], *rl = rows[k - 1];"
        yield "    (void)x1, (void)r1, (void)xl, (void)rl;"
        yield "    if (k % 2) {"
        for slot in group:
            a, b = sides[slot]
            ends = f"lane_fma({a.format('1')}, {b.format('l')}, later[{slot}])"
            ends = f"lane_fma({a.format('l')}, {b.format('1')}, {ends})"
            yield f"        out[{slot}] = k > 1 ? {ends} : lane(0);"
        yield "        return;"
        yield "    }"
        yield f"    V {', '.join(f'm{slot} = lane(0), n{slot} = lane(0)' for slot in group)};"
        seconds = list(dict.fromkeys(sides[slot][1] for slot in group))
        yield f"    V {', '.join(f'before{i} = lane(0)' for i in range(len(seconds)))};"
        yield "    for (int j = 2; j < k - 1; j++) {"
        yield "        const V *xa = x[j], *xb = x[k - j], *ra = rows[j], *rb = rows[k - j];"
        yield "        (void)xa, (void)xb, (void)ra, (void)rb;"
        for slot in group:
            a, b = sides[slot]
            yield f"        m{slot} = lane_fma({a.format('a')}, {b.format('b')}, m{slot});"
            yield f"        n{slot} = lane_fma({a.format('a')}, before{seconds.index(b)}, n{slot});"
        for i, b in enumerate(seconds):
            yield f"        before{i} = {b.format('b')};"
        yield "    }"
        yield "    if (k > 2) {"
        yield "        const V *x2 = x[2], *r2 = rows[2];"
        yield "        (void)x2, (void)r2;"
        for slot in group:
            a, b = sides[slot]
            yield f"        m{slot} = lane_fma({a.format('l')}, {b.format('1')}, m{slot});"
            yield f"        n{slot} = lane_fma({a.format('2')}, {b.format('l')}, n{slot});"
            yield f"        n{slot} = lane_fma({a.format('l')}, {b.format('2')}, n{slot});"
        yield "    }"
        for slot in group:
            a, b = sides[slot]
            yield f"    out[{slot}] = lane_fma({a.format('1')}, {b.format('l')}, m{slot});"
            yield f"    later[{slot}] = n{slot};"
        yield "}\n"
    yield f"static inline void series_sums({arguments})"
    yield "{"
    yield "    (void)k, (void)x, (void)rows, (void)out, (void)later;"
    for number in range(len(groups)):
        yield f"    series_sums_{number}(k, x, rows, out, later);"
    yield "}\n"
