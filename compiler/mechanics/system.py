"""The Lagrangian record: the one thing that every model lowers to.

Symbols are those of the field: q, v, a, x, u, p; T, V, R energies; all formulas are nodes of ``graph``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from msgspec import Struct

from ..flat.model import Definition, FlatModel, Origin, Query, StartValue
from ..graph import Graph, Node
from ..graph.vector import Matrix, Vector
from .families import FamilyRows
from .kinematics.frames import Frame, FrameKinematics, Point
from .kinematics.rates import TotalDerivative
from .kinematics.reactions import VirtualDisplacement
from .kinematics.topology import Topology
from .meaning.delays import Delayed
from .meaning.lower import Lowering
from .meaning.symbols import Scalar, Symbols
from .meaning.unknowns import UnknownSystem
from .modes import BranchRow, Mode


class PointMass(Struct, frozen=True):
    """A mass [kg] at a point, in the uniform ``field`` [m/s^2] (world components), if any."""

    mass: Node
    point: Point
    field: Vector | None
    origin: Origin


class RotaryInertia(Struct, frozen=True):
    """A moment of inertia [kg.m^2] about the centre of the mass stated beside it: 1x1 in the plane, 3x3 in space."""

    inertia: Matrix
    frame: Frame
    origin: Origin


class EffortPairs(Struct, frozen=True):
    """Generalised forces by virtual power: ``pairs`` of (rate, effort), each product a power [W].

    ``supplied``: their work counts as supplied energy, unless they brake whatever the motion, as a drag: then it counts
    as dissipated.
    """

    name: str
    pairs: tuple[tuple[Node, Node], ...]
    supplied: bool
    origin: Origin


class ConstraintRows(Struct, frozen=True):
    """Residuals left - right. ``level``: ``position`` (functions of q and t) or ``velocity`` (affine in v).

    ``joint`` names the closure the rows come from; units are those of the residuals.
    """

    name: str
    level: Literal["position", "velocity"]
    residuals: tuple[Node, ...]
    units: tuple[str, ...]
    asserted: str
    joint: str
    origin: Origin
    mode: Mode | None = None


class DriveRow(Struct, frozen=True):
    """A prescribed motion: indices into q and v with their formulas of time.

    ``q`` and ``values`` are empty where only the rate is prescribed; ``names`` of the reactions, one for each v. ``balanced``: the
    balance of forces on a coordinate without mass prescribes it, as a function of the state, and no reaction drives it.
    ``combined``: its coordinate moves mass, but a motion of several of them together moves none. ``guess``: where a balance is solved by steps, the symbol from whose value they begin, which follows the motion, and its first
    value.
    """

    names: tuple[str, ...]
    q: tuple[int, ...]
    v: tuple[int, ...]
    values: tuple[Node, ...]
    rates: tuple[Node, ...]
    origin: Origin
    balanced: bool = False
    combined: bool = False
    guess: tuple[Node, Node] | None = None


class InitialValue(Struct, frozen=True):
    """Initial value of one number: ``value`` of parameters; ``known`` for ``=``; ``start`` says where it is written.

    ``by_others``: the same in terms of the coordinates, velocities and states that it is stated with; None if none.
    """

    value: Node
    known: bool
    start: StartValue | None
    by_others: Node | None = None


class InitialRow(Struct, frozen=True):
    """``initial e = v`` for one number of an expression: ``residual`` e - v; only wished where not ``known``."""

    name: str
    residual: Node
    known: bool
    unit: str
    origin: Origin


class OutputRow(Struct, frozen=True):
    """One number of an output."""

    name: str
    node: Node
    definition: Definition


class ExactRow(Struct, frozen=True):
    """The closed solution of one number, by its name in results."""

    name: str
    node: Node
    origin: Origin


class AssertionRow(Struct, frozen=True):
    condition: Node
    message: str
    origin: Origin


class WholeNumber(Struct, frozen=True):
    """A number of a whole curve and the symbol that stands for it: an integral of ``node`` over the range, or the value of
    ``node`` at ``place``."""

    symbol: Node
    name: str
    node: Node
    place: Node | None
    unit: str
    origin: Origin


class CurveRows(Struct, frozen=True):
    """A condition on a curve: residuals that are zero, or with ``bound`` not negative.

    ``on_the_curve``: at every place; else they are made of numbers of the whole curve. ``upper``: None, or the end at
    which they hold.
    """

    name: str
    residuals: tuple[Node, ...]
    bound: bool
    on_the_curve: bool
    upper: bool | None
    units: tuple[str, ...]
    origin: Origin


class Curve(Struct, frozen=True):
    """What a curve is found from. ``functional`` is a formula of the symbols of ``numbers`` and of ``unknown``, the ends of
    the range that are to be found; ``action``: it is that of energies."""

    lower: Node
    upper: Node
    unknown: tuple[Scalar, ...]
    functional: Node
    action: bool
    unit: str
    numbers: tuple[WholeNumber, ...]
    rows: tuple[CurveRows, ...]
    origin: Origin


class MechanicalSystem(Struct, frozen=True):
    """One model as a Lagrangian system.

    Invariants: q, v and a have sizes nq, nv, nv; ``qdot`` = N(q) v; frames form a tree rooted in ``world``; loops are
    constraints. ``kinetic``, ``potential`` and ``lagrangian`` are the energies that the user wrote as formulas; those
    of bodies are in ``masses`` and ``inertias``. ``virtual``: displacements of joints whose reactions are asked for,
    all zero. ``unknown_rates``: symbols for rates of inputs, accelerations and forces, which nothing determines.
    ``queries``: symbols that stand for answers which only the equations can give.
    """

    model: FlatModel
    graph: Graph
    symbols: Symbols
    kinematics: FrameKinematics
    rate: TotalDerivative
    lowering: Lowering
    topology: Topology
    q: tuple[Scalar, ...]
    v: tuple[Scalar, ...]
    a: tuple[Node, ...]
    qdot: tuple[Node, ...]
    rotations: tuple[tuple[int, int], ...]
    masses: tuple[PointMass, ...]
    inertias: tuple[RotaryInertia, ...]
    kinetic: Node
    potential: Node
    lagrangian: Node
    dissipation: Node
    efforts: tuple[EffortPairs, ...]
    constraints: tuple[ConstraintRows, ...]
    families: tuple[FamilyRows, ...]
    drives: tuple[DriveRow, ...]
    xdot: Mapping[Node, Node]
    unknown_rates: Mapping[Node, Scalar | Query | Delayed]
    start_q: tuple[InitialValue, ...]
    start_v: tuple[InitialValue, ...]
    start_x: tuple[InitialValue, ...]
    initials: tuple[InitialRow, ...]
    outputs: tuple[OutputRow, ...]
    exacts: tuple[ExactRow, ...]
    assertions: tuple[AssertionRow, ...]
    queries: Mapping[Node, Query]
    virtual: Mapping[str, VirtualDisplacement]
    branches: tuple[BranchRow, ...] = ()
    sought: tuple[UnknownSystem, ...] = ()
    """Balances on coordinates without mass that steps solve; beside those of outputs, of which the lowering knows."""
    curve: Curve | None = None
