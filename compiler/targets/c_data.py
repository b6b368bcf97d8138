"""The constant structs of a program (``model_data.py``) as C."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Final

from .c_forms import literal
from .c_header import comment
from .model_data import ArrayPointer, FunctionPointer, NamedNumber, StructArray, StructPointer, Value

CROWD_INCLUDED: Final = '#include "crowd.h"\n'

SERIES_INCLUDED: Final = '#include "series.h"\n'

SHARES_INCLUDED: Final = '#include "shares.h"\n'

MODEL_AHEAD: Final = "static const mech_model model;\n"

CROWD_FUNCTIONS: Final = """\
/* Time derivative of the state, with the forces of all contacts. */
static void rhs_of_all(mech_real t, const mech_real *y, const mech_real *u, const mech_real *z,
                       const mech_real *p, mech_real *restrict out)
{
    mech_crowd_rates(&model, t, y, u, z, p, out);
}

/* Everything reported beside the state, with the forces of all contacts. */
static void outputs_of_all(mech_real t, const mech_real *y, const mech_real *u, const mech_real *z,
                           const mech_real *p, mech_real *restrict out)
{
    mech_crowd_outputs(&model, t, y, u, z, p, out);
}
"""


def record_text(record: StructPointer) -> Iterator[str]:
    """Yield the lines of a struct, after what its pointers point to: rows, arrays, then further structs."""
    pointed = [
        value
        for value in record.fields.values()
        if isinstance(value, StructArray | ArrayPointer | StructPointer)
    ]
    for value in sorted(
        pointed, key=lambda value: (StructArray, ArrayPointer, StructPointer).index(type(value))
    ):
        yield from _pointed(value)
    yield f"static const {record.struct.c_name} {record.name} = {{"
    for name, field in record.fields.items():
        yield f"    .{name} = {_field(field)},"
    yield "};\n"


def _pointed(value: StructArray | ArrayPointer | StructPointer) -> Iterator[str]:
    if isinstance(value, StructPointer):
        yield from record_text(value)
    elif isinstance(value, ArrayPointer):
        if value.values or value.never_null:
            entries = ", ".join(map(_field, value.values)) or "0"
            yield f"static const {value.kind} {value.name}[] = {{{entries}}};\n"
    elif value.rows:
        yield f"static const {value.struct.c_name} {value.name}[] = {{"
        for k, row in enumerate(value.rows):
            note = f" /* {comment(value.notes[k])} */" if value.notes else ""
            yield f"    {{{', '.join(map(_field, row))}}},{note}"
        yield "};\n"


def _field(value: Value | Fraction | float) -> str:
    """Return the text of a field or an entry."""
    match value:
        case None:
            return "NULL"
        case NamedNumber() | FunctionPointer():
            return value.name
        case StructPointer():
            return f"&{value.name}"
        case StructArray():
            return value.name if value.rows else "NULL"
        case ArrayPointer():
            return value.name if value.values or value.never_null else "NULL"
        case Fraction():
            return literal(value)[0]
    return str(value)
