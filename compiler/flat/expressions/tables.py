"""``table``: of one variable, of two, and of the columns of a file."""

from __future__ import annotations

from .. import types
from ..model import Expression, Kind, Literal, Type
from ..names.scope import Poisoned
from ..values.evaluate import constant
from .files import text_of
from .signature import ElaboratedCall

KINDS = ("smooth", "spline", "linear", "step")
"""How a table runs between its points."""

OUTSIDE = ("extend", "hold", "periodic", "error")
"""What it does beyond its ends."""

_FORMS = (
    "table(x, xs, ys), table(x, y, xs, ys, Z) or table(x, file, column), "
    'then perhaps "smooth", "spline", "linear" or "step", then "extend", "hold", "periodic" or "error"'
)


def _table(call: ElaboratedCall) -> Expression:
    """Return ``table`` with kind and what is outside, where they are not those of always."""
    of_file = call.arguments[1].type.kind is Kind.STRING
    count = 3 if of_file or call.arguments[1].type.shape else 5
    if not count <= len(call.arguments) <= count + 2:
        of = "of a file" if of_file else "of one variable" if count == 3 else "of two variables"
        wanted = f"{count} to {count + 2} arguments, not {len(call.arguments)}"
        raise call.scope.fail("E0309", f"a table {of} has {wanted}", call.node.span, help=_FORMS)
    words = [text_of(call, k, "the kind of a table") for k in range(count, len(call.arguments))]
    kind, outside = (*words, *("smooth", "extend")[len(words) :])
    if kind not in KINDS:
        help = f'the kind comes first: "smooth", "{kind}"' if kind in OUTSIDE else ""
        raise _unknown(call, count, "kind of table", kind, KINDS, help)
    if outside not in OUTSIDE:
        raise _unknown(call, count + 1, "way to go on outside", outside, OUTSIDE, "")
    call.scalar(0)
    chosen = [text(call, kind), text(call, outside)]
    if of_file:
        from .table_files import table_of_file

        return table_of_file(call, kind, outside, chosen)
    axes = (1,) if count == 3 else (2, 3)
    for at, k in enumerate(axes):
        points = call.vector(k)
        call.scalar(at)
        if points.dimension != call.arguments[at].type.dimension and not types.is_zero(call.arguments[at]):
            call.same(at, k)
    values = call.vector(2) if count == 3 else types.numeric(call.arguments[4].type)
    shape = tuple(call.arguments[k].type.shape[0] for k in axes)
    if values.shape != shape:
        wanted = f"as many values as points, which are {shape[0]}"
        if count == 5:
            wanted = f"values in {shape[0]} rows of {shape[1]}, one for each pair of points"
        raise call.wrong(count - 1, wanted, "E0305")
    _check_period(call, kind, outside, values, count)
    result = types.real(values.dimension, angle=values.angle)
    if count == 3 and (kind, outside) == ("smooth", "extend"):
        return call.apply(result, *call.arguments[:3])
    return call.apply(result, *call.arguments[:count], *chosen)


def text(call: ElaboratedCall, word: str) -> Literal:
    return Literal(type=types.STRING, span=call.node.span, value=word)


def _unknown(
    call: ElaboratedCall, k: int, what: str, word: str, known: tuple[str, ...], help: str
) -> Poisoned:
    listed = f"{', '.join(known[:-1])} and {known[-1]}"
    return call.scope.fail(
        "E0340", f"there is no {what} '{word}'", call.nodes[k].span, help=help or f"there are {listed}"
    )


def _check_period(call: ElaboratedCall, kind: str, outside: str, values: Type, count: int) -> None:
    """Report a smooth periodic table whose last value is another one than its first."""
    if outside != "periodic" or kind not in ("smooth", "spline"):
        return
    given = constant(call.arguments[count - 1])
    if not isinstance(given, tuple):
        return
    lines = [given] if count == 3 else [given, *(zip(*given, strict=True))]
    if all(line[0] == line[-1] for line in lines if isinstance(line, tuple)) and all(
        row[0] == row[-1] for row in given if isinstance(row, tuple)
    ):
        return
    raise no_period(call, count - 1, kind)


def no_period(call: ElaboratedCall, k: int, kind: str) -> Poisoned:
    return call.scope.fail(
        "E0340",
        f"a {kind} periodic table ends with the value that it begins with",
        call.nodes[k].span,
        help='"linear" and "step" may jump there',
    )


TABLE_RULES = {"table": _table}
