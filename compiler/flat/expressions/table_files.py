"""Tables of the columns of a file: ``table(x, file, column)``."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

from mechc.lang.units import Unit, is_written_unit, parse_written_unit
from mechc.runtime.outcome import SimulationError
from mechc.runtime.sheets import PLAIN, Sheet, read_sheet

from .. import types
from ..model import Apply, Expression, Literal, TableData
from .files import noted, path_of, text_of
from .signature import ElaboratedCall
from .tables import no_period, text

TEXTS = (".csv", ".txt", ".dat")
CODE = "E0823"


def table_of_file(call: ElaboratedCall, kind: str, outside: str, chosen: list[Literal]) -> Expression:
    """Return a table of a column of a file over its first column."""
    scope, span = call.scope, call.nodes[1].span
    name, column = text_of(call, 1, "the name of a file"), text_of(call, 2, "the name of a column")
    path = path_of(scope, call.arguments[1], span, TEXTS, CODE, "a table of text", "'.csv', '.txt' or '.dat'")
    noted(scope, name, path)
    try:
        sheet = read_sheet(path, PLAIN, is_written_unit)
        points, angle = _column(call, sheet, 0)
        found, unit = _column(call, sheet, _place(call, sheet, column))
    except SimulationError as error:
        raise scope.fail(CODE, str(error), span, help=error.help or "") from None
    x = call.arguments[0].type
    wanted = call.dimension(angle.dimension)
    if wanted != x.dimension and not types.is_zero(call.arguments[0]):
        head, written = sheet.heads[0]
        shown = f"is in {written}" if written else "has no unit"
        raise call.wrong(
            0,
            f"what the first column '{head}' of '{path.name}' holds (which {shown})",
            help=f"the head of the column names a unit, as in '{head} [m]'" if not written else "",
        )
    late = next((k for k, (a, b) in enumerate(pairwise(points)) if b <= a), None)
    if late is not None:
        raise scope.fail(
            "E0311",
            f"the points of a table must increase: those in {sheet.place(late + 1)} do not",
            span,
        )
    if len(points) < 2:
        raise scope.fail("E0310", f"a table needs at least two points, '{path.name}' has one", span)
    if outside == "periodic" and kind in ("smooth", "spline") and found[0] != found[-1]:
        raise no_period(call, 2, kind)
    data = TableData(points, found)
    known, key = scope.flattening.data, f"{name}: {column}"
    while known.setdefault(key, data) != data:  # another file of the same name in another folder
        key += "'"
    type = types.real(call.dimension(unit.dimension), angle=unit.angle)
    zero = Literal(type=type, span=call.node.span, value=Fraction(0))
    return Apply(
        type=type,
        span=call.node.span,
        function="table",
        arguments=(call.arguments[0], text(call, key), zero, *chosen),
    )


_PURE = Unit("", types.NUMBER.dimension, Fraction(1))


def _column(call: ElaboratedCall, sheet: Sheet, k: int) -> tuple[tuple[float, ...], Unit]:
    """Return the numbers of a column in SI, and its unit. Raises SimulationError."""
    head, written = sheet.heads[k]
    unit = parse_written_unit(written) if written else _PURE
    factor = float(unit.factor)
    return tuple(factor * x for x in sheet.complete(k, head)), unit


def _place(call: ElaboratedCall, sheet: Sheet, column: str) -> int:
    names = [name for name, _ in sheet.heads]
    if column not in names:
        raise SimulationError(
            f"'{sheet.path.name}' has no column '{column}'", help=f"it has {', '.join(names)}"
        )
    return names.index(column)
