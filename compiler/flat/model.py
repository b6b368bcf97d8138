"""The flat model and its expressions: every type on one page.

Invariants: all references are resolved to dotted names of this model (``link[3].a``,
``joint[2].angle``); components, loops, conditionals of structure, inheritance, user functions
and modifications are gone; types, shapes and units are checked; every element knows where it
came from (``origin``). Indices are constants, counted from 0. Quantities are in SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from fractions import Fraction

from msgspec import Struct, field

from mechc.lang.source import Placed, Span
from mechc.lang.units import DIMENSIONLESS, Dimension

# ---------------------------------------------------------------- types


class Kind(Enum):
    REAL = "Real"
    INTEGER = "Integer"
    BOOLEAN = "Boolean"
    STRING = "String"
    ROTATION = "Rotation"  # a coordinate on SO(3); used as a pose in products
    POSE = "pose"  # trans(..), rot(..), quat(..) and their products: not anchored
    FRAME = "frame"  # a pose relative to world, or a free frame
    POINT = "point"  # a point carried by a frame; as a value: world components of its position


class Type(Struct, frozen=True):
    """``shape`` is empty for a scalar; a POINT has shape (2,) or (3,) and dimension length.

    ``angle`` remembers radians for display only.
    """

    kind: Kind
    shape: tuple[int, ...] = ()
    dimension: Dimension = DIMENSIONLESS
    angle: bool = False


class Origin(Struct, frozen=True):
    """Where an element came from: the statement, and the instance it belongs to ("" at the top).

    ``declared``: the statement of the model itself that declares this instance, or the part that contains it.
    """

    span: Span
    instance: str = ""
    declared: Span | None = None

    @property
    def shown(self) -> Span:
        """The place to show a user first: in the model, not inside a library."""
        return self.declared or self.span


# ---------------------------------------------------------------- expressions


class Typed(Placed, frozen=True, kw_only=True):
    type: Type


class Literal(Typed, frozen=True):
    """A scalar constant in SI units (Fraction), a truth value or a string."""

    value: Fraction | bool | str


class Name(Typed, frozen=True):
    """A variable or definition of the flat model, whole; ``world`` and ``time`` are predefined names."""

    name: str


class Element(Typed, frozen=True):
    """``base[i, j]`` with constant indices from 0; fewer indices than dimensions give a sub-array."""

    base: Expression
    indices: tuple[int, ...]


class Derivative(Typed, frozen=True):
    """Total time derivative of any order >= 1. Of a Rotation: body angular velocity, shape (3,)."""

    operand: Expression
    order: int = 1


class Previous(Typed, frozen=True):
    operand: Expression


class Array(Typed, frozen=True):
    """Elements along the first dimension."""

    elements: tuple[Expression, ...]


class Select(Typed, frozen=True):
    """``if condition then a else b`` whose condition is not structural; the other branch is not evaluated."""

    condition: Expression
    then: Expression
    otherwise: Expression


class Apply(Typed, frozen=True):
    """An operator or built-in function.

    Operators: add subtract multiply divide power negate less less_equal greater greater_equal equal
    not_equal and or not. ``multiply`` is scalar*scalar, scalar*array, array*scalar, matrix*vector,
    matrix*matrix, pose*pose, frame*pose (a frame), frame*vector (a point), pose*vector (a vector).
    Functions: the names of ``lang/builtins.py``. Element-wise functions are not spread over arrays.
    """

    function: str
    arguments: tuple[Expression, ...]


class Query(Typed, frozen=True):
    """A question about a named element: reaction, moment, multiplier, momentum, power, closed, energy ...

    ``target`` is the dotted name of a component (joint), constraint, contact, coordinate or force;
    it is empty for ``energy()``, ``kinetic_energy()``, ``potential_energy()``.
    """

    function: str
    target: str
    arguments: tuple[Expression, ...] = ()


class Quadrature(Typed, frozen=True):
    """``integral(body for variable in lower:upper)``; ``variable`` is the name that ``body`` uses."""

    variable: str
    lower: Expression
    upper: Expression
    body: Expression


class FieldDerivative(Typed, frozen=True):
    """``grad``, ``div``, ``curl`` or ``laplacian`` (``operator``) of a field at a place.

    ``body`` is the field in terms of ``variable``, a number or a vector, of which ``place`` is the value. A gradient has
    the shape of the field, then that of the place.
    """

    operator: str
    variable: str
    place: Expression
    body: Expression


class Where(Typed, frozen=True):
    """``body`` in which ``names`` stand for ``values``; each value may use the names before it.

    What a function with a body computes on its way. The names occur nowhere else in the model.
    """

    names: tuple[str, ...]
    values: tuple[Expression, ...]
    body: Expression


class Unknown(Typed, frozen=True):
    """What equations determine: the value of the output ``name``, whole."""

    name: str


Expression = (
    Literal
    | Name
    | Element
    | Derivative
    | Previous
    | Array
    | Select
    | Apply
    | Query
    | Quadrature
    | FieldDerivative
    | Where
    | Unknown
)


# ---------------------------------------------------------------- declarations


class Role(Enum):
    PARAMETER = "parameter"
    COORDINATE = "coordinate"
    STATE = "state"
    DISCRETE = "discrete"
    INPUT = "input"


class Attributes(Struct, frozen=True):
    """``nominal``, ``min``, ``max`` in SI; ``display`` a unit; ``options`` the rest by name (chart, interpolation)."""

    nominal: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    display: str = ""
    options: Mapping[str, str] = field(default_factory=dict)


class StartValue(Struct, frozen=True):
    """The winning initial value of one element; ``guess`` for ``~``."""

    value: Expression
    guess: bool
    origin: Origin


class Variable(Struct, frozen=True):
    """A parameter, coordinate, state, discrete variable or input.

    ``value``: default of a parameter (may refer to other parameters), of an input (parameters, time),
    initial value of a discrete variable; None where none is given. ``start`` and ``rate``: initial value
    of a coordinate or state and of its derivative, whole (shape of the variable; for a Rotation's rate (3,)),
    None where unspecified. ``starts`` and ``rates``: the same for single elements, keyed by indices; they
    win over the whole. ``found``: a parameter whose value is a guess, from which the start finds it.
    """

    name: str
    role: Role
    type: Type
    origin: Origin
    value: Expression | None = None
    start: StartValue | None = None
    rate: StartValue | None = None
    starts: Mapping[tuple[int, ...], StartValue] = field(default_factory=dict)
    rates: Mapping[tuple[int, ...], StartValue] = field(default_factory=dict)
    attributes: Attributes = Attributes()
    doc: str = ""
    found: bool = False


class DefinitionRole(Enum):
    LET = "let"
    OUTPUT = "output"
    FRAME = "frame"
    POINT = "point"


class Definition(Struct, frozen=True):
    """A named expression; ``value`` None only for a free frame. Interface frames bound by ``->`` are aliases."""

    name: str
    role: DefinitionRole
    type: Type
    value: Expression | None
    origin: Origin
    attributes: Attributes = Attributes()
    doc: str = ""


# ---------------------------------------------------------------- mechanics


class Energy(Struct, frozen=True):
    """``kind``: kinetic, potential, lagrangian, dissipation."""

    kind: str
    value: Expression
    origin: Origin
    doc: str = ""


class Mass(Struct, frozen=True):
    """``gravity``: the field that reaches this mass (world components), or None."""

    value: Expression
    at: Expression
    gravity: Expression | None
    origin: Origin


class Inertia(Struct, frozen=True):
    """Scalar in the plane, (3, 3) in space; about the centre of the mass stated beside it, in ``on``'s axes."""

    value: Expression
    on: Expression
    origin: Origin


class Load(Struct, frozen=True):
    """A force or torque. ``on``: a frame or point (vector value) or a scalar (generalised force on it).

    ``source``: who gets the reaction; ``frame``: whose axes the components are in (None: world).
    """

    kind: str
    name: str
    value: Expression
    on: Expression
    at: Expression | None
    source: Expression | None
    frame: Expression | None
    origin: Origin


class Damping(Struct, frozen=True):
    name: str
    value: Expression
    on: Expression
    origin: Origin


class Friction(Struct, frozen=True):
    """``backward`` and ``static_backward``: the limits against a motion backwards, where they are others than ``kinetic`` and
    ``static``. ``one_way``: it never gives way backwards, and these are None; ``reversed``: ``on`` has the opposite sign of what
    is written, so that it is backwards that it never gives way."""

    name: str
    kinetic: Expression
    static: Expression | None
    on: Expression
    options: Mapping[str, Expression]
    origin: Origin
    backward: Expression | None = None
    static_backward: Expression | None = None
    one_way: bool = False
    reversed: bool = False


class Constraint(Struct, frozen=True):
    """``left = right``; ``asserted`` is empty, holonomic or nonholonomic; unnamed ones get ``constraint[k]``."""

    name: str
    asserted: str
    left: Expression
    right: Expression
    origin: Origin


class Drive(Struct, frozen=True):
    """``target``: Name/Element of a coordinate, or its Derivative."""

    target: Expression
    value: Expression
    origin: Origin


class Contact(Struct, frozen=True):
    name: str
    gap: Expression
    restitution: Expression | None
    friction: Expression | None
    static: Expression | None
    along: Expression | None
    options: Mapping[str, Expression]
    origin: Origin
    pair: bool = False
    """Whether it is in the contact of two shapes."""


def friction_name(contact: str) -> str:
    """Return what questions call the friction of a contact."""
    return f"{contact}.friction"


class ContactFamily(Struct, frozen=True):
    """Contacts that are one formula of two things: that of a row and that of a column.

    ``contact``: the one that stands among the contacts of the model, of row ``row`` and the last column. Each row has a contact
    with each column from ``starts`` on, which is called by ``heads`` of the row, ``labels`` of the column and ``end``. ``rows``
    and ``columns``: all that the formula reads of each of them, in one order; of the others it has these in their places.
    ``common``: what it reads beside them.
    """

    contact: str
    row: int
    heads: tuple[str, ...]
    starts: tuple[int, ...]
    labels: tuple[str, ...]
    end: str
    rows: tuple[tuple[Expression, ...], ...]
    columns: tuple[tuple[Expression, ...], ...]
    common: tuple[Expression, ...]


class Unlike(Exception):
    """Contacts that were thought to be a family are not: each of them has to be formed."""


class ClosureEquation(Struct, frozen=True):
    left: Expression
    right: Expression
    origin: Origin


class Joint(Struct, frozen=True):
    """A component with a ``place``: ``to`` is the frame that it places, by the joint's own name for it; ``target`` is the
    frame that this name stands for, ``value`` its pose. ``source`` is the first interface frame.

    ``coordinates``: names of the coordinates the component itself declares. A ``place`` in the top model,
    and a value given to a free frame from outside (a weld), are joints without coordinates.
    """

    name: str
    source: str
    to: str
    target: str
    value: Expression
    coordinates: tuple[str, ...]
    closures: tuple[ClosureEquation, ...]
    cut: bool
    origin: Origin


class InitialCondition(Struct, frozen=True):
    """``initial e = v`` for an expression that is not a plain coordinate, state or rate."""

    target: Expression
    start: StartValue
    origin: Origin


class StateEquation(Struct, frozen=True):
    """``equation der(x) = e``; ``indices`` select an element of ``state`` (empty: whole)."""

    state: str
    indices: tuple[int, ...]
    value: Expression
    origin: Origin


class UnknownOutput(Struct, frozen=True):
    """``output name ~ guess``: its definition has an ``Unknown`` for value."""

    name: str
    guess: Expression
    origin: Origin


class ImplicitEquation(Struct, frozen=True):
    """``equation left = right`` that takes part in determining unknown outputs."""

    left: Expression
    right: Expression
    origin: Origin


class Assertion(Struct, frozen=True):
    condition: Expression
    message: str
    origin: Origin


class Reinit(Struct, frozen=True):
    target: Expression
    value: Expression
    origin: Origin


class Assign(Struct, frozen=True):
    target: Expression
    value: Expression
    origin: Origin


class Terminate(Struct, frozen=True):
    message: str
    origin: Origin


class Impulse(Struct, frozen=True):
    load: Load
    origin: Origin


class Switch(Struct, frozen=True):
    """``release`` or ``engage`` (``engage`` true) of a named constraint, contact, drive or cut joint."""

    target: str
    engage: bool
    origin: Origin


Action = Reinit | Assign | Terminate | Impulse | Switch | Assertion


class EventBranch(Struct, frozen=True):
    condition: Expression
    actions: tuple[Action, ...]
    origin: Origin


class Event(Struct, frozen=True):
    """One ``when`` with its ``elsewhen`` branches."""

    branches: tuple[EventBranch, ...]
    origin: Origin

    @property
    def switched(self) -> frozenset[str]:
        """The names of what ``release`` and ``engage`` switch."""
        actions = (action for branch in self.branches for action in branch.actions)
        return frozenset(action.target for action in actions if isinstance(action, Switch))


class ExactSolution(Struct, frozen=True):
    """``target`` is a Name/Element/Derivative of a coordinate, state or output."""

    target: Expression
    value: Expression
    origin: Origin


class Sample(Struct, frozen=True):
    """The variable of a curve or surface, between two values."""

    variable: str
    type: Type
    lower: Expression
    upper: Expression


class Draw(Struct, frozen=True):
    """A shape. ``place``: a FRAME, a POINT or world components; ``values`` by the names of the shape's arguments.

    ``texts``: colour (``#rrggbb``), text, file (a path).
    """

    shape: str
    values: Mapping[str, Expression]
    points: tuple[Expression, ...]
    place: Expression | None
    texts: Mapping[str, str]
    samples: tuple[Sample, ...]
    origin: Origin


# ---------------------------------------------------------------- experiments


class Setting(Struct, frozen=True):
    """A parameter, initial value, guess or input set by an experiment.

    ``rate``: the setting is of ``der(target)``. ``guess``: written with ``~``.
    """

    target: str
    indices: tuple[int, ...]
    rate: bool
    guess: bool
    value: Expression
    origin: Origin


class Sweep(Struct, frozen=True):
    """``target in values``: one run for each (numbers in SI). ``indices`` and ``rate`` as in ``Setting``."""

    target: str
    values: tuple[Expression, ...]
    structural: bool
    origin: Origin
    indices: tuple[int, ...] = ()
    rate: bool = False


class Experiment(Struct, frozen=True):
    """``options``: stop start every step tolerance method display record ... as checked expressions. ``unfit``: what it sets in
    elements that the model has with its structural values alone, which are others here."""

    name: str
    options: Mapping[str, Expression]
    settings: tuple[Setting, ...]
    sweeps: tuple[Sweep, ...]
    structural: Mapping[str, Fraction | bool | str]
    origin: Origin
    doc: str = ""
    unfit: tuple[str, ...] = ()


class End(Struct, frozen=True):
    """``initial e = v`` or ``final e = v`` of a curve: ``e`` at the lower or the ``upper`` end."""

    target: Expression
    value: Expression
    upper: bool
    origin: Origin


class Variation(Struct, frozen=True):
    """What makes a model one of a curve: the interval of the independent variable, and what is stationary.

    ``lower`` and ``upper`` are formulas of parameters and of the coordinates named in ``unknown``, which are not curves but
    numbers to be found. ``functional`` is None where energies are stated: the action, then.
    """

    lower: Expression
    upper: Expression
    unknown: tuple[str, ...]
    ends: tuple[End, ...]
    functional: Expression | None
    origin: Origin


class Study(Struct, frozen=True):
    """A question that the file puts: its ``kind``, and its settings as they are written outside of files."""

    name: str
    kind: str
    settings: Mapping[str, str | bool]
    origin: Origin
    doc: str = ""


class ReadFile(Struct, frozen=True):
    """A file whose values the model holds: its name as written, and the SHA-256 of its content."""

    name: str
    checksum: str


class TableData(Struct, frozen=True):
    """What a file gives to a table, in SI."""

    points: tuple[float, ...]
    values: tuple[float, ...]


class FlatModel(Struct, frozen=True):
    """One model, flat. Collections keep the order of declaration.

    ``space`` is 2 or 3, or 0 where no vector-valued kinematic expression says it.
    ``structural``: values of the structural parameters that were used.
    """

    name: str
    doc: str
    space: int
    dimensionless: bool
    independent: str
    structural: Mapping[str, Fraction | bool | str]
    variables: tuple[Variable, ...]
    definitions: tuple[Definition, ...]
    energies: tuple[Energy, ...]
    masses: tuple[Mass, ...]
    inertias: tuple[Inertia, ...]
    loads: tuple[Load, ...]
    dampings: tuple[Damping, ...]
    frictions: tuple[Friction, ...]
    constraints: tuple[Constraint, ...]
    drives: tuple[Drive, ...]
    contacts: tuple[Contact, ...]
    joints: tuple[Joint, ...]
    initials: tuple[InitialCondition, ...]
    equations: tuple[StateEquation, ...]
    events: tuple[Event, ...]
    assertions: tuple[Assertion, ...]
    exacts: tuple[ExactSolution, ...]
    experiments: tuple[Experiment, ...]
    origin: Origin
    studies: tuple[Study, ...] = ()
    draws: tuple[Draw, ...] = ()
    quiet: tuple[str, ...] = ()
    """Instances that say ``draw none``, ``""`` for the model itself: nothing of them is drawn by rule."""
    data: Mapping[str, TableData] = {}
    """What files give to tables, by the name that stands instead of points."""
    variation: Variation | None = None
    unknowns: tuple[UnknownOutput, ...] = ()
    implicit: tuple[ImplicitEquation, ...] = ()
    files: tuple[ReadFile, ...] = ()
    families: tuple[ContactFamily, ...] = ()
