"""CasADi and JAX: how the table of operations is written with the functions of each library."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from msgspec import Struct
from msgspec.structs import replace

from ..graph.operation import Operation, form_of
from ..graph.operations import LOOKUP, OPERATIONS
from . import python_forms
from .expressions import Dialect


class LibraryForms(Struct, frozen=True):
    """``functions``: by operation, those of the library, of the common part of its modules, or own ones of Python; all else is written
    with the signs of Python. ``copied``: own functions of Python that hold for this library, too."""

    dialect: Dialect
    functions: Mapping[int, str]
    copied: Mapping[int, python_forms.NamedForm]


def _forms(number: str, named: Callable[[Operation], str | None]) -> LibraryForms:
    """Return the forms of a library. ``number``: what makes a number of it; ``named``: its function for an operation, None where that
    of Python holds."""
    rows = [row for row in OPERATIONS if row.arity and row.code != LOOKUP]
    copied = {row.code: python_forms.FUNCTIONS[row.code] for row in OPERATIONS if named(row) is None}
    functions = {row.code: named(row) or copied[row.code].name for row in rows if not row.form}
    forms = {row.code: form_of(row, functions.get(row.code, "").rpartition(".")[2]) for row in rows}
    dialect = replace(python_forms.DIALECT, forms=forms, number=number, quiet="")
    return LibraryForms(dialect, functions, copied)


def _casadi(row: Operation) -> str | None:
    return None if row.casadi is None else row.casadi or row.name


def _jax(row: Operation) -> str | None:
    return None if row.jax is None else row.jax or (row.array or f"np.{row.name}").removeprefix("np.")


CASADI: Final = _forms("SX", _casadi)
JAX: Final = _forms("jnp.float64", _jax)
