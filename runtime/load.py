"""A problem as plain data for JSON, and back: all of it but its functions."""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from .problem import Array, ModelFunction, Problem

CODE = ("functions", "parameters_function", "library")


def describe(problem: Problem) -> dict[str, Any]:
    """Give all fields of a problem but its code; JSON keeps them exactly."""
    data = asdict(problem)
    for name in CODE:
        del data[name]
    return data


def problem_from(
    description: Mapping[str, Any],
    *,
    library: Path | None = None,
    functions: Mapping[str, ModelFunction] | None = None,
    parameters_function: Callable[[Array, NDArray[np.uint8]], None] | None = None,
) -> Problem:
    """Build the problem that was described, with a library or with Python functions.

    Raises ``ValueError`` if the description has other fields than a problem, as from another version.
    """
    hints = get_type_hints(Problem)
    known = {field.name for field in fields(Problem)} - set(CODE)
    if set(description) != known:
        raise ValueError(f"not the description of a problem: {sorted(known ^ set(description))}")
    data = {name: _decode(hints[name], value) for name, value in description.items()}
    return Problem(
        **data, functions=functions or {}, parameters_function=parameters_function, library=library
    )


def _decode(kind: Any, value: Any) -> Any:
    """Undo what JSON makes of a value of this type: tuples and dataclasses."""
    origin, parts = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{name: _decode(hints[name], item) for name, item in value.items()})  # type: ignore[operator]
    if origin in (types.UnionType, Union):
        return None if value is None else _decode(next(p for p in parts if p is not type(None)), value)
    if origin is tuple:
        kinds = parts[:1] * len(value) if parts[-1] is Ellipsis else parts
        return tuple(_decode(k, item) for k, item in zip(kinds, value, strict=True))
    return value
