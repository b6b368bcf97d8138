"""Tables in C: the numbers as data, and the functions that look into them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from fractions import Fraction
from typing import Final

from ..graph.operations import LOOKUP
from ..graph.table import ELEMENT, Samples, Table, question
from ..program import Program
from ..program.model import Lookup, codes_of

IN_A_LINE: Final = 8
"""Samples in one line."""

LARGE: Final = 1000
"""From here on numbers are written as hexadecimals, which compilers read in half the time."""

FUNCTIONS: Final = {
    "lookup": """\
/* Value (order 0) or derivative of the cubic through points {x, value, slope}; straight beyond the ends. */
static mech_real lookup(const mech_real (*points)[3], int n, int order, mech_real x)
{
    int low = 0, high = n - 1;
    if (x != x)
        return x;
    if (x < points[0][0] || x >= points[high][0]) {
        const mech_real *end = points[x < points[0][0] ? 0 : high];
        return order == 0 ? end[1] + end[2] * (x - end[0]) : order == 1 ? end[2] : 0;
    }
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (points[middle][0] <= x)
            low = middle;
        else
            high = middle;
    }
    const mech_real *a = points[low], *b = points[high];
    const mech_real h = b[0] - a[0], s = x - a[0];
    const mech_real secant = (b[1] - a[1]) / h;
    const mech_real c2 = (3 * secant - 2 * a[2] - b[2]) / h;
    const mech_real c3 = (a[2] + b[2] - 2 * secant) / (h * h);
    switch (order) {
    case 0:
        return a[1] + s * (a[2] + s * (c2 + s * c3));
    case 1:
        return a[2] + s * (2 * c2 + s * 3 * c3);
    case 2:
        return 2 * c2 + 6 * c3 * s;
    default:
        return 6 * c3;
    }
}
""",
    "element": """\
/* The number with an index, a whole one; the first and last ones beyond the ends. */
static inline mech_real element(const mech_real *values, int n, mech_real index)
{
    const mech_real above = index > 0 ? index : 0;
    return values[(int)(above < n - 1 ? above : n - 1)];
}
""",
    "cell": """\
/* The index of the last point but one that is not above x, sought from an interval on. */
static NOINLINE int last_not_above(const mech_real *points, int n, mech_real x, int low)
{
    int high = low + 1;
    for (int step = 1; points[low] > x; step *= 2)
        high = low, low = low > step ? low - step : 0;
    for (int step = 1; points[high] <= x; step *= 2)
        low = high, high = n - 1 - high > step ? high + step : n - 1;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (points[middle] <= x)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* The same. The search begins where evenly spaced points would have it, and mostly ends there. */
static inline mech_real cell(const mech_real *points, int n, mech_real x)
{
    if (!(x >= points[1]))
        return 0;
    if (x >= points[n - 2])
        return n - 2;
    const mech_real even = (x - points[0]) * ((n - 1) / (points[n - 1] - points[0]));
    const int low = (int)(even < n - 3 ? even : n - 3);
    return points[low] <= x && x < points[low + 1] ? low : last_not_above(points, n, x, low);
}
""",
}
"""By what is asked, in the order in which files hold them."""


def lookup(table: int, order: int, argument: str) -> str:
    """Return the call that answers a question about a table."""
    asked = f"{order}, " if order < ELEMENT else ""
    return f"{question(order)}(table_{table}, n_table_{table}, {asked}{argument})"


def used_tables(program: Program) -> list[tuple[int, Table | Samples]]:
    """Return the tables that some function reads, with their index."""
    return [(i, program.tables[i]) for i in sorted({table for table, _ in asked_of(program)})]


def asked_of(program: Program) -> set[tuple[int, int]]:
    """Return which tables functions read, and what they ask of them."""
    functions = (program.parameters_function, *program.functions)
    bodies = [body for f in functions for body in f.bodies if LOOKUP in codes_of(body)]
    return {(s.table, s.order) for body in bodies for s in body if type(s) is Lookup}


def questions(asked: Collection[tuple[int, int]]) -> list[str]:
    """Return the names of the functions that answer all that is asked."""
    names = {question(order) for _, order in asked}
    return [name for name in FUNCTIONS if name in names]


def rows(table: Table | Samples, literal: Callable[[Fraction], tuple[str, int]]) -> Iterator[str]:
    """Yield the lines of the numbers of a table."""
    large = len(table.values) >= LARGE

    def text(x: float) -> str:
        return x.hex() if large else literal(Fraction(x))[0]

    if isinstance(table, Samples):
        for k in range(0, len(table.values), IN_A_LINE):
            yield f"    {', '.join(map(text, table.values[k : k + IN_A_LINE]))},"
        return
    for row in zip(table.points, table.values, table.slopes, strict=True):
        yield f"    {{{', '.join(map(text, row))}}},"


def width(table: Table | Samples) -> str:
    """Return what follows the length in the declaration of a table."""
    return "" if isinstance(table, Samples) else "[3]"
