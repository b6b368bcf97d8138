"""Vectors of lanes in C. What the functions of the table of operations do stands in ``runtime/kernel/ensemble``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from msgspec import Struct

from ..graph.operation import Form, form_of
from ..graph.operations import LOOKUP, OPERATIONS
from . import c_forms

_LANE_BY_LANE: Final = {1: "LANE_BY_LANE", 2: "LANE_BY_LANE_OF_TWO"}


FORMS: Final[Mapping[int, Form]] = {
    row.code: form_of(
        row, (row.lanes or "") if isinstance(row.lanes, Form) or row.form else f"lane_{row.lanes or row.name}"
    )
    for row in OPERATIONS
    if row.arity and row.code != LOOKUP
}
"""Of operands that are names."""

BY_LANE: Final[Mapping[int, str]] = {
    row.code: f"{_LANE_BY_LANE[row.arity]}({row.name}, {c_forms.CALLED[row.code]})"
    for row in OPERATIONS
    if row.lanes is None
}
"""What defines functions of vectors by those of numbers."""


class LaneNumbers(Struct, frozen=True):
    """Vectors of one precision: the types of numbers and of conditions, the function that makes one of a number; the names of all
    others begin as it."""

    vector: str
    mask: str
    name: str


DOUBLES: Final = LaneNumbers("V", "M", "lane")
SINGLES: Final = LaneNumbers("S", "SM", "single")
"""Of the high orders of a series, of all rooms at once."""
