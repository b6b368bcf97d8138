"""C: how the table of operations is written, constants and statements."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Final

from msgspec.structs import replace

from ..graph.operation import ATOM, COMPARISON, UNARY, Form, form_of
from ..graph.operations import LOOKUP, OPERATIONS
from ..program.model import Store
from .c_tables import lookup
from .expressions import BranchForm, Dialect, multiple_of_pi
from .literal import LiteralForm as LiteralForm
from .literal import constant
from .sincos_batch import WIDTH

FORMS: Final[Mapping[int, Form]] = {
    row.code: form_of(row, row.c) for row in OPERATIONS if row.arity and row.code != LOOKUP
}

OWN: Final[Mapping[int, str]] = {row.code: row.c_text for row in OPERATIONS if row.c_text}
"""Functions to be written into a file that uses them."""

CALLED: Final[Mapping[int, str]] = {
    code: form.template.split("(")[0] for code, form in FORMS.items() if form.binds == ATOM
}
"""The functions that operations are written as."""

LIBRARY: Final[Mapping[int, str]] = {code: name for code, name in CALLED.items() if code not in OWN}
"""Functions of the C library, which have other names in higher precision."""

NEEDED_BY_OWN: Final[Mapping[int, tuple[str, ...]]] = {code: OPERATIONS[code].calls for code in OWN}


_VARIABLE: Final = re.compile(r"\b(?!PI\b)[A-Za-z_]\w*\b(?!\()")


def literal(number: Fraction) -> tuple[str, int]:
    """Return a constant as C text, and how strongly it binds."""
    c = constant(number)
    match c.form:
        case LiteralForm.DOUBLE:
            text = c.text
        case LiteralForm.DECIMAL:
            text = f"-real({c.text[1:]})" if c.text[0] == "-" else f"real({c.text})"
        case LiteralForm.RATIO:
            text = f"ratio({c.text}, {c.divisor})"
        case LiteralForm.PI:
            return multiple_of_pi(c, "PI")
    return text, UNARY if text[0] == "-" else ATOM


def _declare(name: str, expression: str, condition: bool) -> str:
    """Return a declaration: a variable where the value is one of constants alone.

    gcc puts the initial value of a constant in its place and, with -frounding-math, leaves it unevaluated: a chain of such values grew
    without bound.
    """
    constant = "const " if _VARIABLE.search(expression) else ""
    return f"{constant}{'int' if condition else 'mech_real'} {name} = {expression};"


def _store(statement: Store, expression: str) -> str:
    line = f"{statement.array}[{statement.index}] = {expression};"
    return f"if (!set[{statement.index}]) {line}" if statement.guarded else line


def _room(name: str, given: str, condition: bool) -> str:
    return f"{'int' if condition else 'mech_real'} {name} = {given};"


BRANCH: Final = BranchForm(
    lambda condition, holds: f"if ({condition}) {{" if holds else f"if (!{condition}) {{",
    "}",
    _room,
    lambda name, expression: f"{name} = {expression};",
    ("0", "0"),
    single=True,
)

DIALECT: Final = Dialect(
    FORMS,
    literal,
    lookup,
    _declare,
    _store,
    as_condition=Form("{} != 0", COMPARISON, (COMPARISON + 1,), True),
    as_number=Form("(mech_real){}", UNARY, (UNARY + 1,)),
    branch=BRANCH,
)


def _turns(name: str, angles: Sequence[str]) -> Iterator[str]:
    """Yield the call of ``sincos_batch.h``; a group that is not full repeats its last angle."""
    yield f"mech_real {name}[{2 * WIDTH}];"
    filled = [*angles, *[angles[-1]] * (WIDTH - len(angles))]
    yield f"mech_turns({name}, {', '.join(filled)});"


TURNING: Final = replace(DIALECT, turns=_turns)
"""With sines and cosines of several angles at once."""

TURNS_INCLUDED: Final = '#include "sincos_batch.h"\n'
