"""Vectors of lanes in C. What the functions of the table of operations do stands in ``runtime/kernel/ensemble``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from msgspec import Struct

from ..graph import operations as ops
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
    """Vectors of one precision: the type, what the names of functions begin with, how a number is written, and 2; a b + c and
    c - a b, rounded once."""

    vector: str
    prefix: str
    literal: str
    two: str
    fused_sum: str
    fused_difference: str
    forms: Mapping[int, Form]


DOUBLES: Final = LaneNumbers(
    "V", "", "lane({})", "2.0", "lane_fma({}, {}, {})", "lane_fnma({}, {}, {})", FORMS
)
SINGLES: Final = LaneNumbers(
    "S",
    "single_",
    "single({})",
    "2.0f",
    "single_fma({}, {}, {})",
    "single_fnma({}, {}, {})",
    {code: FORMS[code] for code in (ops.ADD, ops.SUB, ops.MUL, ops.NEG)},
)
"""Of the high orders of a series, of all rooms at once."""
AS_CONDITION: Final = "{} != 0.0"
AS_NUMBER: Final = "lane_number({})"
