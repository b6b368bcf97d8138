"""The symbols of a model: one node for each number of each variable, and their rates."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from msgspec import Struct

from mechc.lang.units import Dimension

from ...flat.model import Expression, FlatModel, Kind, Role, Variable
from ...flat.subscripts import element_name, subscripts
from ...graph import Graph, Node
from ...graph.operations import ACCELERATION, OTHER, PARAMETER, POSITION, TIME, VELOCITY
from ...graph.vector import quaternion_rate
from .values import Value, filled


class Scalar(Struct, frozen=True):
    """One number of a variable: its node, its name in results and the variable it belongs to."""

    node: Node
    name: str
    variable: Variable
    indices: tuple[int, ...]

    @property
    def of(self) -> str:
        """The name without ``der``: ``x[1]`` of ``der(x[1])``, ``R[1]`` of ``der(R)[1]``, about the first axis."""
        return element_name(self.variable.name, self.indices)


class CoordinateSymbols(Struct, frozen=True):
    """One coordinate variable: positions ``q``, velocities ``v``, accelerations ``a`` (4, 3, 3 for a Rotation)."""

    variable: Variable
    q: tuple[Scalar, ...]
    v: tuple[Scalar, ...]
    a: tuple[Node, ...]
    qdot: tuple[Node, ...]

    @property
    def is_rotation(self) -> bool:
        return self.variable.type.kind is Kind.ROTATION


class Symbols(Struct, frozen=True, dict=True):
    """All symbols of a model. ``values`` maps a variable to its value (nested tuples of nodes)."""

    time: Node
    coordinates: tuple[CoordinateSymbols, ...]
    states: tuple[Scalar, ...]
    inputs: tuple[Scalar, ...]
    discretes: tuple[Scalar, ...]
    parameters: tuple[Scalar, ...]
    values: Mapping[str, Value]
    rates: Mapping[str, Value]

    @cached_property
    def positions(self) -> frozenset[Node]:
        return frozenset(s.node for c in self.coordinates for s in c.q)

    @cached_property
    def velocities(self) -> frozenset[Node]:
        return frozenset(s.node for c in self.coordinates for s in c.v)

    @cached_property
    def accelerations(self) -> frozenset[Node]:
        return frozenset(a for c in self.coordinates for a in c.a)

    @cached_property
    def moving(self) -> frozenset[Node]:
        """Positions, velocities and accelerations."""
        return self.positions | self.velocities | self.accelerations


def rate_name(name: str, indices: tuple[int, ...]) -> str:
    """Return the name of a rate in results: ``der(theta)``, ``der(x[1])``; rotations have others."""
    return f"der({element_name(name, indices)})"


def base_unit(expression: Expression) -> str:
    """Return the unit of an expression in base units, as text; empty for a pure number."""
    return unit_text(expression.type.dimension)


def unit_text(dimension: Dimension) -> str:
    """Return a dimension in base units, as text; empty for a pure number."""
    return "" if dimension.is_none else str(dimension)


def declare(graph: Graph, model: FlatModel, dropped: frozenset[str] = frozenset()) -> Symbols:
    """Make the symbols of every variable of a model; ``dropped`` coordinates are not unknowns and get none."""
    values: dict[str, Value] = {}
    rates: dict[str, Value] = {}
    scalars: dict[Role, list[Scalar]] = {role: [] for role in Role}
    coordinates: list[CoordinateSymbols] = []
    for variable in model.variables:
        if variable.name in dropped:
            continue
        if variable.role is Role.COORDINATE:
            coordinate = _coordinate(graph, variable)
            coordinates.append(coordinate)
            values[variable.name] = _arranged(variable, tuple(s.node for s in coordinate.q))
            rates[variable.name] = _arranged(variable, tuple(s.node for s in coordinate.v))
            continue
        made = _scalars(graph, variable)
        scalars[variable.role].extend(made)
        values[variable.name] = _arranged(variable, tuple(s.node for s in made))
    return Symbols(
        graph.symbol("time", TIME),
        tuple(coordinates),
        tuple(scalars[Role.STATE]),
        tuple(scalars[Role.INPUT]),
        tuple(scalars[Role.DISCRETE]),
        tuple(scalars[Role.PARAMETER]),
        values,
        rates,
    )


KINDS = {Role.COORDINATE: POSITION, Role.PARAMETER: PARAMETER}
"""Of symbols (graph/operations.py)."""


def _scalars(graph: Graph, variable: Variable) -> tuple[Scalar, ...]:
    kind = KINDS.get(variable.role, OTHER)
    return tuple(
        Scalar(graph.symbol(name := element_name(variable.name, i), kind), name, variable, i)
        for i in subscripts(variable.type.shape)
    )


def _arranged(variable: Variable, nodes: tuple[Node, ...]) -> Value:
    if variable.type.kind is Kind.ROTATION:
        return nodes
    shape = variable.type.shape
    order = {indices: k for k, indices in enumerate(subscripts(shape))}
    return filled(shape, lambda i: nodes[order[i]])


def _coordinate(graph: Graph, variable: Variable) -> CoordinateSymbols:
    if variable.type.kind is Kind.ROTATION:
        return _rotation(graph, variable)
    q = _scalars(graph, variable)
    v = tuple(
        Scalar(
            graph.symbol(rate_name(variable.name, s.indices), VELOCITY),
            rate_name(variable.name, s.indices),
            variable,
            s.indices,
        )
        for s in q
    )
    a = tuple(graph.symbol(f"der({s.name})", ACCELERATION) for s in v)
    return CoordinateSymbols(variable, q, v, a, tuple(s.node for s in v))


def _rotation(graph: Graph, variable: Variable) -> CoordinateSymbols:
    """A rotation: unit quaternion (scalar first) and body angular velocity, q' = q (0, w)/2."""
    name = variable.name

    def make(text: str, k: int, kind: int) -> Scalar:
        return Scalar(graph.symbol(text, kind), text, variable, (k,))

    q = tuple(make(f"{name}[{k + 1}]", k, POSITION) for k in range(4))
    v = tuple(make(f"der({name})[{k + 1}]", k, VELOCITY) for k in range(3))
    a = tuple(graph.symbol(f"der({name}, 2)[{k + 1}]", ACCELERATION) for k in range(3))
    qdot = quaternion_rate(graph, tuple(s.node for s in q), tuple(s.node for s in v))
    return CoordinateSymbols(variable, q, v, a, qdot)
