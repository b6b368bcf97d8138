"""Vectors of lanes in C: one row for each operation. What the functions do stands in ``runtime/kernel/ensemble``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from msgspec import Struct

from ..graph import operations as ops


class LaneForm(Struct, frozen=True):
    """How to write one operation of operands that are names. ``condition``: the result is a set of lanes; ``conditions``:
    so is every operand marked."""

    template: str
    condition: bool = False
    conditions: tuple[bool, ...] = (False, False, False)


def _call(name: str, arity: int = 1) -> LaneForm:
    return LaneForm(f"lane_{name}({', '.join(['{}'] * arity)})")


_BOTH: Final = (True, True, False)

FORMS: Final[Mapping[int, LaneForm]] = {
    ops.ADD: LaneForm("{} + {}"),
    ops.SUB: LaneForm("{} - {}"),
    ops.MUL: LaneForm("{} * {}"),
    ops.DIV: LaneForm("{} / {}"),
    ops.NEG: LaneForm("-{}"),
    ops.SIN: _call("sin"),
    ops.COS: _call("cos"),
    ops.TAN: _call("tan"),
    ops.ASIN: _call("asin"),
    ops.ACOS: _call("acos"),
    ops.ATAN: _call("atan"),
    ops.SINH: _call("sinh"),
    ops.COSH: _call("cosh"),
    ops.TANH: _call("tanh"),
    ops.ASINH: _call("asinh"),
    ops.ACOSH: _call("acosh"),
    ops.ATANH: _call("atanh"),
    ops.EXP: _call("exp"),
    ops.LOG: _call("log"),
    ops.SQRT: _call("sqrt"),
    ops.ABS: _call("abs"),
    ops.SIGN: _call("sign"),
    ops.FLOOR: _call("floor"),
    ops.ATAN2: _call("atan2", 2),
    ops.MINIMUM: _call("minimum", 2),
    ops.MAXIMUM: _call("maximum", 2),
    ops.MODULO: _call("modulo", 2),
    ops.POW: _call("pow", 2),
    ops.LESS: LaneForm("{} < {}", True),
    ops.LESS_EQUAL: LaneForm("{} <= {}", True),
    ops.EQUAL: LaneForm("{} == {}", True),
    ops.AND: LaneForm("{} & {}", True, _BOTH),
    ops.OR: LaneForm("{} | {}", True, _BOTH),
    ops.NOT: LaneForm("~{}", True, (True, False, False)),
    ops.SELECT: LaneForm("lane_pick({}, {}, {})", False, (True, False, False)),
}


class LaneNumbers(Struct, frozen=True):
    """Vectors of one precision: the type, what the names of functions begin with, how a number is written, and 2; a b + c and
    c - a b, rounded once."""

    vector: str
    prefix: str
    literal: str
    two: str
    fused_sum: str
    fused_difference: str
    forms: Mapping[int, LaneForm]


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
