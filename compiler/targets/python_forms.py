"""Python: how the table of operations is written, for numbers and for arrays, constants and statements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any, Final

from msgspec import Struct

from ..graph import scalar_functions
from ..graph.operation import ATOM, COMPARISON, PRODUCT, UNARY, Form, Operation, form_of
from ..graph.operations import LOOKUP, OPERATIONS
from ..graph.table import ELEMENT, Samples, Table, question
from ..program.model import Store
from .expressions import BranchForm, Dialect, multiple_of_pi
from .literal import LiteralForm as LiteralForm
from .literal import constant


class NamedForm(Struct, frozen=True):
    """A function by which an operation is called in the text.

    ``own``: what it is copied from, None if it stands in ``math``. ``array``: the NumPy form. ``condition``:
    it yields a truth value. ``calls``: functions of ``math`` that an own one calls.
    """

    name: str
    array: str
    own: Callable[..., Any] | None = None
    condition: bool = False
    calls: tuple[str, ...] = ()


def _text(row: Operation) -> str | Form:
    return row.python if isinstance(row.python, str | Form) else row.python.__name__


def _named(row: Operation) -> NamedForm:
    own = None if isinstance(row.python, str | Form) else row.python
    name = str(_text(row) or row.name)
    array = f"np.vectorize({name}, otypes=[float])" if row.array is None else row.array or f"np.{row.name}"
    return NamedForm(name, array, own, row.condition, row.calls if own else ())


FUNCTIONS: Final[Mapping[int, NamedForm]] = {
    row.code: _named(row)
    for row in OPERATIONS
    if row.arity and row.code != LOOKUP and not isinstance(row.python, Form) and (row.python or not row.form)
}

FORMS: Final[Mapping[int, Form]] = {
    row.code: form_of(row, _text(row)) for row in OPERATIONS if row.arity and row.code != LOOKUP
}


def literal(number: Fraction) -> tuple[str, int]:
    """Return a constant as Python text, and how strongly it binds."""
    c = constant(number)
    match c.form:
        case LiteralForm.DOUBLE | LiteralForm.DECIMAL:
            text = repr(float(c.text))
        case LiteralForm.RATIO:
            return f"{c.text} / {c.divisor}", PRODUCT
        case LiteralForm.PI:
            return multiple_of_pi(c, "pi")
    return text, UNARY if text[0] == "-" else ATOM


def _declare(name: str, expression: str, condition: bool) -> str:
    return f"{name} = {expression}"


def _store(statement: Store, expression: str) -> str:
    line = f"{statement.array}[{statement.index}] = {expression}"
    return f"if not given[{statement.index}]:\n        {line}" if statement.guarded else line


TABLES: Final[Mapping[str, NamedForm]] = {
    "lookup": NamedForm(
        "lookup", "np.vectorize(lookup, otypes=[float], excluded=[0, 1])", scalar_functions.lookup
    ),
    "element": NamedForm(
        "element", "np.vectorize(element, otypes=[float], excluded=[0])", scalar_functions.element
    ),
    "cell": NamedForm("cell", "np.vectorize(cell, otypes=[float], excluded=[0])", scalar_functions.cell),
}
"""The functions that look into tables, by what is asked."""


def _lookup(table: int, order: int, argument: str) -> str:
    asked = f"{order}, " if order < ELEMENT else ""
    return f"{question(order)}(TABLE_{table}, {asked}{argument})"


def table_text(table: Table | Samples) -> str:
    """Return the numbers of a table, as the functions read them."""
    if isinstance(table, Samples):
        return repr(table.values)
    return f"({table.points!r}, {table.values!r}, {table.slopes!r})"


BRANCH: Final = BranchForm(
    lambda condition, holds: f"if np.any({condition}):" if holds else f"if not np.all({condition}):",
    "",
    lambda name, given, condition: f"{name} = {given}",
    lambda name, expression: f"{name} = {expression}",
    ("0.0", "False"),
    single=False,
)
"""Of arrays a branch is computed where one number of them needs it."""

DIALECT: Final = Dialect(
    FORMS,
    literal,
    _lookup,
    _declare,
    _store,
    as_condition=Form("{} != 0.0", COMPARISON, (COMPARISON + 1,), True),
    as_number=Form("1.0 * {}", PRODUCT, (PRODUCT + 1,)),
    number="np.float64",
    quiet='@np.errstate(all="ignore")',
    branch=BRANCH,
)
