"""Taylor series in lanes: ``series_start`` and ``series_next`` of ``program/series.py``, with the sums of the slots written out.

The sides of slots are rows of coefficients; a series that is a side of several slots, or the state itself, is one row. Each order
has a row of rows: the coefficients of the state of the next order, then the sides of the slots.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from mechc.runtime.ensembles.lanes import NoLanes

from ..graph.operations import MUL
from ..program import Program, ProgramFunction
from ..program.model import Body, Literal, Load, Lookup, Operate, Statement, Store, Value
from ..program.series import NEXT, START, padded
from .lane_forms import DOUBLES, SINGLES, LaneNumbers

GROUP = 8
"""Slots whose sums of two orders are formed at once: as many as registers hold."""


def series_functions(program: Program) -> tuple[tuple[ProgramFunction, ProgramFunction], tuple[str, ...]]:
    """Return both functions, of which the second one writes each row once, and the lines of ``series_sums``, with the sizes
    before them. Raises NoLanes."""
    start = program.function(START)
    if start is None:
        raise _refusal(program)
    following, sides, behind = _following(program)
    assert program.series is not None
    sizes = f"#define N_SERIES_KEPT {program.series.n_kept}\n#define N_BEHIND {behind}\n"
    sizes += f"#define N_ROWS {following.n_out}\n"
    return (start, following), (sizes, *_sums(sides, DOUBLES))


def single_series(program: Program) -> tuple[str, ProgramFunction | None, tuple[str, ...]]:
    """Return sizes, ``series_next`` and the lines of ``series_sums`` for the high orders, which are of single precision; without
    the functions where orders hold what is written of doubles alone."""
    following, sides, _ = _following(program)
    (body,) = following.bodies
    if not all(
        type(s) in (Load, Literal, Store) or (type(s) is Operate and s.code in SINGLES.forms) for s in body
    ):
        return "#define TAIL 0\n#define N_TAIL_P 0\n", None, ()
    read = sorted({s.index for s in body if type(s) is Load and s.array == "p"})
    places = {index: k for k, index in enumerate(read)}
    narrow = tuple(Load("p", places[s.index]) if type(s) is Load and s.array == "p" else s for s in body)
    sizes = f"#define TAIL 1\n#define N_TAIL_P {len(read)}\n"
    sizes += f"static MECH_FIXED int tail_p[] = {{{', '.join(map(str, read)) or '0'}}};\n"
    function = ProgramFunction(NEXT, following.doc, following.n_out, (narrow,))
    return sizes, function, tuple(_sums(sides, SINGLES))


def _refusal(program: Program) -> NoLanes:
    return NoLanes(program.no_series or "it has no Taylor series")


def _following(program: Program) -> tuple[ProgramFunction, list[tuple[str, str]], int]:
    """Return ``series_next``, which writes each row once, both sides of each slot as the sums read them, and the place behind
    the sums. Raises NoLanes."""
    plan, following = program.series, program.function(NEXT)
    if plan is None or following is None:
        raise _refusal(program)
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
    return ProgramFunction(NEXT, following.doc, ny + len(rows), (shorter,)), sides, behind


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


def _sums(sides: Sequence[tuple[str, str]], numbers: LaneNumbers) -> Iterator[str]:
    """Yield ``series_sums``: of all slots, the sums of A_j B_(k-j) for j from 1 to k - 1.

    For even k those of the next order are begun with them, as each number that is read serves both, and completed by their
    first and last product when that comes. Of squares each product is formed once.
    """
    squares = [slot for slot, (a, b) in enumerate(sides) if a == b]
    others = sorted(set(range(len(sides))) - set(squares), key=lambda slot: sides[slot])
    pieces = [_products(group, sides, numbers) for group in _even(others)]
    pieces += [_squares(group, sides, numbers) for group in _even(squares)]
    arguments = _ARGUMENTS.format(v=numbers.vector)
    for number, lines in enumerate(pieces):
        yield f"static NOINLINE void {numbers.prefix}series_sums_{number}({arguments})"
        yield "{"
        yield from lines
        yield "}\n"
    yield f"static inline void {numbers.prefix}series_sums({arguments})"
    yield "{"
    yield "    (void)k, (void)x, (void)out, (void)later;"
    for number in range(len(pieces)):
        yield f"    {numbers.prefix}series_sums_{number}(k, x, out, later);"
    yield "}\n"


_ARGUMENTS = "int k, const {v} (*x)[N_ROWS], {v} *restrict out, {v} *restrict later"


def _even(slots: Sequence[int]) -> list[Sequence[int]]:
    """Return groups that differ by one at most."""
    count = -(-len(slots) // GROUP)
    return [slots[len(slots) * i // count : len(slots) * (i + 1) // count] for i in range(count)]


def _products(group: Sequence[int], sides: Sequence[tuple[str, str]], numbers: LaneNumbers) -> Iterator[str]:
    v, zero, fused = numbers.vector, numbers.literal.format(0), numbers.fused_sum.format
    yield "    if (k % 2) {"
    yield f"        const {v} *x1 = x[1], *xk = x[k - 1], *r1 = x[2], *rk = x[k];"
    yield "        (void)x1, (void)xk, (void)r1, (void)rk;"
    for slot in group:
        a, b = sides[slot]
        last = fused(a.format("k"), b.format("1"), f"later[{slot}]")
        yield f"        out[{slot}] = k > 1 ? {fused(a.format('1'), b.format('k'), last)} : {zero};"
    yield "        return;"
    yield "    }"
    yield f"    {v} {', '.join(f'm{slot} = {zero}, n{slot} = {zero}' for slot in group)};"
    seconds = list(dict.fromkeys(sides[slot][1] for slot in group))
    yield f"    {v} {', '.join(f'before{i} = {zero}' for i in range(len(seconds)))};"
    yield "    LANE_TWICE"
    yield "    for (int j = 1; j < k; j++) {"
    yield f"        const {v} *xa = x[j], *xb = x[k - j], *ra = x[j + 1], *rb = x[k - j + 1];"
    yield "        (void)xa, (void)xb, (void)ra, (void)rb;"
    for slot in group:
        a, b = sides[slot]
        yield f"        n{slot} = {fused(a.format('a'), f'before{seconds.index(b)}', f'n{slot}')};"
        yield f"        m{slot} = {fused(a.format('a'), b.format('b'), f'm{slot}')};"
    for i, b in enumerate(seconds):
        yield f"        before{i} = {b.format('b')};"
    yield "    }"
    for slot in group:
        yield f"    out[{slot}] = m{slot};"
        yield f"    later[{slot}] = n{slot};"


def _squares(group: Sequence[int], sides: Sequence[tuple[str, str]], numbers: LaneNumbers) -> Iterator[str]:
    """Yield the same for A_j A_(k-j): twice the first half, and for even k the square in the middle."""
    v, zero, fused, two = numbers.vector, numbers.literal.format(0), numbers.fused_sum.format, numbers.two
    yield "    if (k % 2) {"
    yield f"        const {v} *x1 = x[1], *xk = x[k - 1], *r1 = x[2], *rk = x[k];"
    yield "        (void)x1, (void)xk, (void)r1, (void)rk;"
    for slot in group:
        a = sides[slot][0]
        half = fused(a.format("1"), a.format("k"), f"later[{slot}]")
        yield f"        out[{slot}] = k > 1 ? {half} * {two} : {zero};"
    yield "        return;"
    yield "    }"
    yield f"    {v} {', '.join(f'm{slot} = {zero}, n{slot} = {zero}' for slot in group)};"
    yield f"    const {v} *xa = x[1], *ra = x[2];"
    yield "    (void)xa, (void)ra;"
    first = {slot: sides[slot][0].format("a") for slot in group}
    yield f"    {v} {', '.join(f'before{slot} = {side}' for slot, side in first.items())};"
    yield "    for (int j = 2; 2 * j <= k; j++) {"
    yield f"        const {v} *xb = x[k + 1 - j], *rb = x[k + 2 - j];"
    yield "        xa = x[j], ra = x[j + 1];"
    yield "        (void)xb, (void)rb;"
    for slot in group:
        a = sides[slot][0]
        yield f"        m{slot} = {fused(f'before{slot}', a.format('b'), f'm{slot}')};"
        yield f"        before{slot} = {a.format('a')};"
        yield f"        n{slot} = {fused(f'before{slot}', a.format('b'), f'n{slot}')};"
    yield "    }"
    for slot in group:
        yield f"    out[{slot}] = {fused(f'before{slot}', f'before{slot}', f'm{slot} * {two}')};"
        yield f"    later[{slot}] = n{slot};"
