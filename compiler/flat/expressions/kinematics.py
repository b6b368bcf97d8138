"""Type rules of positions, velocities and components of frames and points."""

from __future__ import annotations

from mechc.lang.units import Dimension

from .. import types
from ..model import Apply, Expression, Kind, Type
from .functions import Rule
from .signature import ElaboratedCall


def _vector(call: ElaboratedCall, dimension: Dimension) -> Type:
    """Return the type of a vector of the model's space."""
    return types.real(call.dimension(dimension), (call.space(),))


def position_argument(call: ElaboratedCall, index: int) -> Expression:
    """Return a frame, a point, or a vector of lengths in world components."""
    argument = call.arguments[index]
    if argument.type.kind in (Kind.FRAME, Kind.POINT):
        return call.place(index)
    type = call.vector(index, (2, 3), "a frame, a point or a vector of lengths")
    if type.dimension != call.dimension(types.LENGTH) and not types.is_zero(argument):
        raise call.wrong(index, "a frame, a point or a vector of lengths")
    call.require_space(type.shape[0], f"a vector of {type.shape[0]} components")
    return argument


def _position(call: ElaboratedCall) -> Expression:
    position_argument(call, 0)
    return call.apply(_vector(call, types.LENGTH), function="pos")


def _velocity(call: ElaboratedCall) -> Expression:
    call.place(0)
    if len(call.arguments) == 2:
        call.frame(1)
    return call.apply(_vector(call, types.VELOCITY))


def _velocity_at(call: ElaboratedCall) -> Expression:
    call.frame(0)
    position_argument(call, 1)
    return call.apply(_vector(call, types.VELOCITY))


def _spin(call: ElaboratedCall) -> Expression:
    for k in range(len(call.arguments)):
        call.frame(k)
    shape = () if call.space() == 2 else (3,)
    return call.apply(types.real(call.dimension(types.RATE), shape, angle=True))


def _heading(call: ElaboratedCall) -> Expression:
    call.frame(0)
    call.require_space(2)
    return call.apply(types.ANGLE)


def _local(call: ElaboratedCall) -> Expression:
    call.frame(0)
    position_argument(call, 1)
    return call.apply(_vector(call, types.LENGTH))


def _turned(call: ElaboratedCall) -> Expression:
    """``components`` and ``direction``: a vector of any dimension in other axes."""
    call.frame(0)
    type = call.vector(1, (2, 3))
    call.require_space(type.shape[0], f"a vector of {type.shape[0]} components")
    return call.apply(type)


KINEMATIC_RULES: dict[str, Rule] = {
    "pos": _position,
    "origin": _position,
    "vel": _velocity,
    "vel_at": _velocity_at,
    "angvel": _spin,
    "heading": _heading,
    "local": _local,
    "components": _turned,
    "direction": _turned,
}


def in_frame(call: ElaboratedCall, vector: Expression, frame: Expression) -> Expression:
    """Return a vector given in world components in those of a frame."""
    return Apply(type=vector.type, span=call.node.span, function="components", arguments=(frame, vector))
