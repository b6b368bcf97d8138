"""Taylor series in lanes: ``series_start`` and ``series_next`` of ``program/series.py``, with the sums of the slots written out.

The sides of slots are rows of coefficients; a series that is a side of several slots, or the state itself, is one row.
``series_sums`` goes through the orders with the sums of many slots in registers.
"""

from __future__ import annotations

from collections.abc import Iterator

from mechc.runtime.ensembles.lanes import NoLanes

from ..program import Program, ProgramFunction
from ..program.model import Body, Load, Lookup, Operate, Statement, Store, Value
from ..program.series import NEXT, START, padded

GROUP = 20
"""Sums that are formed at once: as many as registers hold beside what they read."""


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


def _sums(sides: list[tuple[str, str]]) -> Iterator[str]:
    """Yield ``series_sums``: of all slots, the sum of A_j B_(k-j) for j from 1 to k - 1."""
    groups = [sides[first : first + GROUP] for first in range(0, len(sides), GROUP)]
    arguments = "int k, const V (*x)[NY], const V (*rows)[N_ROWS], V *restrict out"
    for number, group in enumerate(groups):
        yield f"static void series_sums_{number}({arguments})"
        yield "{"
        yield f"    V {', '.join(f'm{i} = lane(0)' for i in range(len(group)))};"
        yield "#define TERMS(j) \\"
        yield "    { \\"
        yield "        const V *xa = x[j], *xb = x[k - (j)], *ra = rows[j], *rb = rows[k - (j)]; \\"
        yield "        (void)xa, (void)xb, (void)ra, (void)rb; \\"
        for i, (a, b) in enumerate(group):
            yield f"        m{i} = lane_fma({a.format('a')}, {b.format('b')}, m{i}); \\"
        yield "    }"
        # the coefficients of the order before are just being computed: what needs them comes last
        yield "    for (int j = 2; j < k - 1; j++) TERMS(j)"
        yield "    if (k > 1) TERMS(1)"
        yield "    if (k > 2) TERMS(k - 1)"
        yield "#undef TERMS"
        for i in range(len(group)):
            yield f"    out[{number * GROUP + i}] = m{i};"
        yield "}\n"
    yield f"static inline void series_sums({arguments})"
    yield "{"
    yield "    (void)k, (void)x, (void)rows, (void)out;"
    for number in range(len(groups)):
        yield f"    series_sums_{number}(k, x, rows, out);"
    yield "}\n"
