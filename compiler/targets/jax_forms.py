"""JAX: how the table of operations is written with the functions of the library."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from msgspec.structs import replace

from ..graph.operation import Form, form_of
from ..graph.operations import LOOKUP, OPERATIONS
from . import python_forms
from .expressions import Dialect

FUNCTIONS: Final[Mapping[int, str]] = {
    row.code: python_forms.FUNCTIONS[row.code].name
    if row.jax is None
    else row.jax or (row.array or f"np.{row.name}").removeprefix("np.")
    for row in OPERATIONS
    if row.arity and not row.form and row.code != LOOKUP
}
"""Functions of the library, of ``jax_module.py``, or own ones of Python. All else is written with the signs of Python."""

COPIED: Final[Mapping[int, python_forms.NamedForm]] = {
    row.code: python_forms.FUNCTIONS[row.code] for row in OPERATIONS if row.jax is None
}
"""Own functions of Python that hold for this library, too."""

FORMS: Final[Mapping[int, Form]] = {
    row.code: form_of(row, FUNCTIONS[row.code].rpartition(".")[2] if row.code in FUNCTIONS else "")
    for row in OPERATIONS
    if row.arity and row.code != LOOKUP
}

DIALECT: Final[Dialect] = replace(python_forms.DIALECT, forms=FORMS, number="jnp.float64", quiet="")
