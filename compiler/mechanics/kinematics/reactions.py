"""Virtual displacements at joints: how reactions are found (read in ``equations/solve/queries.py``).

A joint whose reaction is asked for gets, on its ``to`` side, a displacement that is always zero but has a rate of
its own. The row of the residual that belongs to this rate is the force (or moment) that the joint exerts there:
inverse dynamics for a joint of the tree; for one that closes a loop -(dc'/dw)^T lam and what acts on its coordinates,
which are computed from the displaced frame. One mechanism for both. Energies and dissipation written as formulas take
part like everything else, by Lagrange's operator for the displacement.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from fractions import Fraction
from functools import cache
from typing import Any

from msgspec import Struct

from ...flat import types
from ...flat.model import FlatModel, Joint, Query
from ...graph import DivisionByZero, Graph, Node
from ...graph.rewrite import substitute
from ...graph.vector import Vector
from .frames import Frame, displaced
from .pose import Rotate, Translate
from .rates import TotalDerivative

REACTIONS = ("reaction", "moment")
PREFIX = "#virtual "
"""Of the names of all symbols of virtual displacements and of their rates."""


class VirtualDisplacement(Struct, frozen=True):
    """``frame``: the displaced ``to`` frame; ``force_rates``, ``moment_rates``: components in its own axes."""

    frame: Frame
    values: tuple[Node, ...]
    force_rates: Vector
    moment_rates: Vector


def reactions_formed(model: FlatModel) -> frozenset[str]:
    """Return the names of all joints if the model uses the reaction of any: together they are balanced on each body."""
    return frozenset(joint.name for joint in model.joints) if reactions_asked(model) else frozenset()


def reactions_asked(model: FlatModel) -> frozenset[str]:
    """Return the names of the joints whose reaction or moment the model uses."""
    joints = {joint.name for joint in model.joints}
    if not joints:
        return frozenset()
    return frozenset(q.target for q in _queries(model) if q.function in REACTIONS and q.target in joints)


_PLAIN = (str, int, float, bool, Fraction, type(None))
"""What holds nothing."""


def _queries(root: object) -> Iterator[Query]:
    """Yield every query inside a tree of flat-model values."""
    pending: list[Any] = [root]
    while pending:
        at = pending.pop()
        kind = at.__class__
        if kind is tuple:
            pending += at
        elif kind is Query:
            yield at
            pending += [getattr(at, name) for name in _branches(kind)]
        elif branches := _branches(kind):
            pending += [getattr(at, name) for name in branches]
        elif kind not in _PLAIN and isinstance(at, Mapping):
            pending += at.values()


@cache
def _branches(kind: Hashable) -> tuple[str, ...]:
    """Return the fields of a type of the flat model in which a query may stand."""
    if (
        not isinstance(kind, type)
        or not issubclass(kind, Struct)
        or not kind.__module__.endswith("flat.model")
    ):
        return ()
    return tuple(
        name for name in kind.__struct_fields__ if name not in ("type", "span", "origin", "name", "doc")
    )


def only_virtual(graph: Graph, rate: Node) -> bool:
    """Tell whether a rate is zero but for virtual displacements, of which no motion has any."""
    support = graph.support(rate)
    return graph.is_zero(rate) or (bool(support) and all(graph.name(n).startswith(PREFIX) for n in support))


def virtual_rates(graph: Graph, node: Node) -> list[Node]:
    """Return the rates of virtual displacements on which a formula depends."""
    return [n for n in graph.support(node) if graph.name(n).startswith(f"{PREFIX}rate ")]


def undisplaced(graph: Graph, node: Node) -> Node:
    """Return a formula where all virtual displacements and their rates are zero, as in every motion.

    One that divides by them stays as it is: the equations tell.
    """
    virtual = [n for n in graph.support(node) if graph.name(n).startswith(PREFIX)]
    try:
        return substitute(graph, [node], dict.fromkeys(virtual, graph.zero))[0]
    except DivisionByZero:
        return node


def displace(
    graph: Graph, rate: TotalDerivative, frame: Frame, size: int, name: str, *, opposite: bool = False
) -> VirtualDisplacement:
    """Return ``frame`` with a virtual displacement: a translation, then rotations about its axes.

    ``opposite``: what hangs on the frame is the ``from`` side of the joint, on which minus the reaction acts.
    """
    count = 3 if size == 2 else 6
    values = tuple(graph.symbol(f"{PREFIX}{name} {k}") for k in range(count))
    rates = tuple(graph.symbol(f"{PREFIX}rate {name} {k}") for k in range(count))
    for value, speed in zip(values, rates, strict=True):
        rate.define(value, speed)
        rate.define(speed, graph.zero)
    axes = (2,) if size == 2 else (0, 1, 2)
    steps = tuple(graph.neg(value) for value in values) if opposite else values
    turns = tuple(Rotate(axis, angle) for axis, angle in zip(axes, steps[size:], strict=True))
    moved = displaced(graph, frame, (Translate(steps[:size]), *turns))
    return VirtualDisplacement(moved, (*values, *rates), rates[:size], rates[size:])


def whole_reaction(joint: Joint, size: int) -> tuple[Query, Query]:
    """Return the questions about the force and the moment of a joint."""
    force, moment = types.real(types.FORCE, (size,)), types.real(types.ENERGY, () if size == 2 else (3,))
    span = joint.origin.span
    return (
        Query(span=span, type=force, function="reaction", target=joint.name),
        Query(span=span, type=moment, function="moment", target=joint.name),
    )
