"""Families of contacts (flat/model.py): what their rows and columns are, in nodes."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from ..flat.model import ContactFamily, Expression, FlatModel, Kind, Unlike
from ..graph import Node
from .kinematics.frames import Point
from .meaning.lower import Lowering

_NUMBERS = (Kind.REAL, Kind.INTEGER, Kind.BOOLEAN)

Read = tuple[Node, ...]


class FamilyRows(Struct, frozen=True):
    """What the rows and the columns of a family are: the numbers of all that its formula reads of them; ``common``: of both."""

    family: ContactFamily
    rows: tuple[Read, ...]
    columns: tuple[Read, ...]
    common: Read


def families(lowering: Lowering, model: FlatModel) -> tuple[FamilyRows, ...]:
    """Return the families of a model. Raises Unlike where something that is read is neither a number nor a place."""
    known: dict[int, Read] = {}

    def read(side: Sequence[tuple[Expression, ...]]) -> tuple[Read, ...]:
        for told in side:
            if id(told) not in known:
                known[id(told)] = tuple(n for e in told for n in _numbers(lowering, e))
        return tuple(known[id(told)] for told in side)

    with lowering.aside():
        return tuple(
            FamilyRows(one, read(one.rows), read(one.columns), *read((one.common,))) for one in model.families
        )


def _numbers(lowering: Lowering, expression: Expression) -> Read:
    """Return the numbers that determine a value; of a frame its position and its axes."""
    kind = expression.type.kind
    if kind is Kind.FRAME and not expression.type.shape:
        kinematics, frame = lowering.kinematics, lowering.frame(expression)
        zero = (lowering.graph.zero,) * kinematics.size
        axes = [
            tuple(lowering.graph.one if i == k else lowering.graph.zero for i in range(kinematics.size))
            for k in range(kinematics.size)
        ]
        turned = [n for axis in axes for n in kinematics.to_world(frame, axis)]
        return (*kinematics.position(Point(frame, zero)), *turned)
    if kind is Kind.POINT and not expression.type.shape:
        return tuple(lowering.kinematics.position(lowering.point(expression)))
    if kind in _NUMBERS:
        return lowering.numbers(expression)
    raise Unlike
