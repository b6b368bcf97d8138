"""The syntax tree: every node type on one page.

Nodes are frozen, compare without their spans, and print back to equivalent text
(``lang/printing/printer.py``). Names are unresolved, units are text, numbers are exact.
"""

from __future__ import annotations

from fractions import Fraction
from typing import ClassVar

from .source import Placed, SourceFile, Span


class Node(Placed, frozen=True):
    pass


# ---------------------------------------------------------------- expressions


class Number(Node, frozen=True):
    """A bare number; ``text`` keeps how it was written."""

    aside: ClassVar[frozenset[str]] = frozenset({"span", "text"})

    value: Fraction
    text: str


class Quantity(Node, frozen=True):
    """``9.81 m/s^2``: a number with its unit; ``value`` and ``text`` are the number's, as written."""

    aside: ClassVar[frozenset[str]] = frozenset({"span", "text"})

    value: Fraction
    unit: str
    text: str


class String(Node, frozen=True):
    value: str


class Boolean(Node, frozen=True):
    value: bool


class Time(Node, frozen=True):
    """The word ``time``."""


class Part(Node, frozen=True):
    """One segment ``name[indices]`` of a reference."""

    name: str
    indices: tuple[Expression, ...] = ()


class Reference(Node, frozen=True):
    """``a.b[2].c``"""

    parts: tuple[Part, ...]

    @property
    def name(self) -> str:
        """The dotted name without indices."""
        parts = self.parts
        return parts[0].name if len(parts) == 1 else ".".join(p.name for p in parts)


class Derivative(Node, frozen=True):
    """``der(operand, order)``"""

    operand: Expression
    order: int = 1


class Previous(Node, frozen=True):
    """``pre(operand)``"""

    operand: Expression


class Unary(Node, frozen=True):
    """``operator`` is ``-``, ``+`` or ``not``."""

    operator: str
    operand: Expression


class Binary(Node, frozen=True):
    """``operator`` is one of ``+ - * / ^ < <= > >= == <> and or``."""

    operator: str
    left: Expression
    right: Expression


class Branch(Node, frozen=True):
    condition: Expression
    value: Expression


class Conditional(Node, frozen=True):
    """``if c then a elseif d then b else e``"""

    branches: tuple[Branch, ...]
    otherwise: Expression


class Vector(Node, frozen=True):
    """``{a, b, c} unit``"""

    elements: tuple[Expression, ...]
    unit: str = ""


class Range(Node, frozen=True):
    """``start:stop`` or ``start:step:stop``"""

    start: Expression
    stop: Expression
    step: Expression | None = None


class Whole(Node, frozen=True):
    """``:`` alone in brackets: all indices, or a size that the value tells."""


class Generator(Node, frozen=True):
    """``for name in range``; the range may be any expression with a value of several elements.

    ``joined``: written ``, name in range`` after another one.
    """

    name: str
    range: Expression
    joined: bool = False


class Comprehension(Node, frozen=True):
    """``{element for i in r} unit``"""

    element: Expression
    generators: tuple[Generator, ...]
    unit: str = ""


class Aggregate(Node, frozen=True):
    """The argument of ``sum(e for i in r)``, ``integral(e for s in a:b)``."""

    element: Expression
    generators: tuple[Generator, ...]


class Keyword(Node, frozen=True):
    """A named argument of a call."""

    name: str
    value: Expression


class Call(Node, frozen=True):
    """``f(a, name = b) unit``"""

    function: Reference
    arguments: tuple[Expression, ...]
    keywords: tuple[Keyword, ...] = ()
    unit: str = ""


class Result(Node, frozen=True):
    """One of the results of a call: the value of each name in ``let (a, b) = call;``."""

    call: Expression
    index: int
    count: int


class Parenthesis(Node, frozen=True):
    """``(inner) unit``"""

    inner: Expression
    unit: str = ""


class Subscript(Node, frozen=True):
    """``base[indices]`` where the base is not a plain reference: ``f(x)[2]``, ``{1, 2}[i]``."""

    base: Expression
    indices: tuple[Expression, ...]


Expression = (
    Number
    | Quantity
    | String
    | Boolean
    | Time
    | Reference
    | Derivative
    | Previous
    | Unary
    | Binary
    | Conditional
    | Vector
    | Range
    | Whole
    | Comprehension
    | Aggregate
    | Call
    | Result
    | Parenthesis
    | Subscript
)


# ---------------------------------------------------------------- pieces of statements


class Dimension(Node, frozen=True):
    """One array dimension ``[n]``, ``[i in 1:n]``; without a name ``size`` is the extent."""

    size: Expression
    name: str = ""


class Modification(Node, frozen=True):
    """``target = value`` (known), ``target ~ value`` (guess), ``a -> b`` (link), ``p in values`` (sweep).

    ``target`` is a reference or ``der(reference)``; for a link it is the left-hand expression.
    """

    target: Expression
    kind: str
    value: Expression


class Start(Node, frozen=True):
    """``= value`` or, with ``guess``, ``~ value``."""

    value: Expression
    guess: bool


class Option(Node, frozen=True):
    """``, name = value`` at the end of a contact or friction statement."""

    name: str
    value: Expression


class LabelName(Node, frozen=True):
    """``name[i]:`` before a force, constraint, contact ..."""

    name: str
    indices: tuple[Expression, ...] = ()


# ---------------------------------------------------------------- statements


class Statement(Node, frozen=True, kw_only=True):
    doc: str = ""


class Import(Statement, frozen=True):
    """``import a.b.*`` (``names`` is ``("*",)``), ``import P = a.b`` (alias), ``import a.b.{X, Y}``."""

    path: str
    alias: str = ""
    names: tuple[str, ...] = ()


class Extends(Statement, frozen=True):
    base: str
    modifications: tuple[Modification, ...] = ()


class Named(Statement, frozen=True, kw_only=True):
    """What gives a name to something; ``name_span`` is where the name itself stands."""

    aside: ClassVar[frozenset[str]] = frozenset({"span", "name_span"})

    name: str
    name_span: Span


class Declaration(Named, frozen=True, kw_only=True):
    """What all declarations share; ``type`` is empty where it is to be inferred. ``like``: ``typeof(e)`` in its place."""

    type: str = ""
    like: Expression | None = None
    dimensions: tuple[Dimension, ...] = ()
    attributes: tuple[Modification, ...] = ()


class Parameter(Declaration, frozen=True, kw_only=True):
    """``found``: ``~ value``, a guess from which the start finds it."""

    structural: bool = False
    value: Expression | None = None
    found: bool = False


class Coordinate(Declaration, frozen=True, kw_only=True):
    start: Start | None = None


class State(Declaration, frozen=True, kw_only=True):
    start: Start | None = None


class Discrete(Declaration, frozen=True, kw_only=True):
    value: Expression | None = None


class Input(Declaration, frozen=True, kw_only=True):
    value: Expression | None = None


class Output(Declaration, frozen=True, kw_only=True):
    """``guess``: written ``~ value``; equations determine it."""

    value: Expression | None = None
    guess: bool = False


class Let(Declaration, frozen=True, kw_only=True):
    value: Expression


class Unpacked(Statement, frozen=True):
    """``let (a, b) = call;``: a ``let`` for each name, whose value is that ``Result`` of the call."""

    lets: tuple[Let, ...]

    @property
    def value(self) -> Expression:
        """The call."""
        result = self.lets[0].value
        assert isinstance(result, Result)
        return result.call


def single(statement: Statement) -> tuple[Statement, ...]:
    """Return the declarations that a statement stands for; any other one is itself."""
    return statement.lets if isinstance(statement, Unpacked) else (statement,)


class Var(Declaration, frozen=True, kw_only=True):
    """A variable in the body of a function."""

    value: Expression


class Frame(Declaration, frozen=True, kw_only=True):
    """Without ``value`` the frame is free and must be placed."""

    value: Expression | None = None


class Point(Declaration, frozen=True, kw_only=True):
    value: Expression | None = None


class Component(Declaration, frozen=True, kw_only=True):
    """``[cut] Type name[dims](modifications) if condition;`` with ``type`` the dotted model name."""

    cut: bool = False
    modifications: tuple[Modification, ...] = ()
    condition: Expression | None = None


class Energy(Statement, frozen=True):
    """``kind`` is ``kinetic``, ``potential``, ``lagrangian`` or ``dissipation``."""

    kind: str
    value: Expression


class Gravity(Statement, frozen=True):
    value: Expression


class Mass(Statement, frozen=True):
    value: Expression
    at: Expression


class Inertia(Statement, frozen=True):
    value: Expression
    on: Expression


class Load(Statement, frozen=True):
    """``force`` or ``torque`` (``kind``)."""

    kind: str
    label: LabelName | None
    value: Expression
    on: Expression
    at: Expression | None = None
    source: Expression | None = None
    frame: Expression | None = None


class Damping(Statement, frozen=True):
    label: LabelName | None
    value: Expression
    on: Expression


class Friction(Statement, frozen=True):
    """``friction f [static fs] on s``; of two sides, ``forward f backward b [static forward fs backward bs] on s``."""

    label: LabelName | None
    kinetic: Expression
    static: Expression | None
    on: Expression
    options: tuple[Option, ...] = ()
    backward: Expression | None = None
    static_backward: Expression | None = None


class Effort(Node, frozen=True):
    """``by force on s``, ``by torque on F`` or ``by u`` after a constraint; ``kind`` is force, torque or input."""

    kind: str
    on: Expression


class Constraint(Statement, frozen=True):
    """``kind`` is empty, ``holonomic`` or ``nonholonomic``; ``by``: what keeps it, where that does not act along it."""

    kind: str
    label: LabelName | None
    left: Expression
    right: Expression
    by: Effort | None = None


class Inequality(Statement, frozen=True):
    """``constraint label: a >= b;``, of a curve."""

    label: LabelName | None
    condition: Expression


class Drive(Statement, frozen=True):
    target: Expression
    value: Expression


class Contact(Statement, frozen=True):
    label: LabelName | None
    gap: Expression
    restitution: Expression | None = None
    friction: Expression | None = None
    static: Expression | None = None
    along: Expression | None = None
    options: tuple[Option, ...] = ()


class ContactOfShapes(Statement, frozen=True):
    """``contact A with B, C friction f restitution e;``: of all shapes of A with all those of the others."""

    label: LabelName | None
    of: Reference
    others: tuple[Reference, ...]
    friction: Expression | None = None
    restitution: Expression | None = None
    options: tuple[Option, ...] = ()


class Shape(Statement, frozen=True):
    """``shape Sphere(r = 1 cm) on frame at place;``; without ``on`` a model of a contact says which shape it is for."""

    label: LabelName | None
    type: str
    modifications: tuple[Modification, ...] = ()
    on: Expression | None = None
    at: Expression | None = None


class Place(Statement, frozen=True):
    target: Reference
    value: Expression


class Closure(Statement, frozen=True):
    left: Expression
    right: Expression


class Initial(Statement, frozen=True):
    target: Expression
    start: Start


class StationaryStart(Statement, frozen=True):
    """``initial stationary x, y;``; without names all coordinates and states, here and in components."""

    targets: tuple[Expression, ...] = ()


class Final(Statement, frozen=True):
    target: Expression
    start: Start


class Equation(Statement, frozen=True):
    left: Expression
    right: Expression


class Exact(Statement, frozen=True):
    left: Expression
    right: Expression


class Assert(Statement, frozen=True):
    condition: Expression
    message: str


class Experiment(Statement, frozen=True):
    name: str
    settings: tuple[Modification, ...] = ()


class StudySetting(Node, frozen=True):
    """``name = value``, or ``name = value in within``."""

    name: str
    value: Expression
    within: Expression | None = None


class Study(Statement, frozen=True):
    name: str
    kind: str
    settings: tuple[StudySetting, ...] = ()


class Dimensionless(Statement, frozen=True):
    pass


class Independent(Statement, frozen=True):
    name: str
    type: str = ""
    lower: Expression | None = None
    upper: Expression | None = None


class Stationary(Statement, frozen=True):
    value: Expression


class Draw(Statement, frozen=True):
    """``draw shape(arguments, name = value, s in a:b) on frame at point, option = value;``"""

    shape: str
    arguments: tuple[Expression | Aggregate, ...] = ()
    keywords: tuple[Keyword, ...] = ()
    samples: tuple[Generator, ...] = ()
    on: Expression | None = None
    at: Expression | None = None
    options: tuple[Option, ...] = ()


class For(Statement, frozen=True):
    name: str
    range: Expression
    body: tuple[Statement, ...]


class IfBranch(Node, frozen=True):
    condition: Expression
    body: tuple[Statement, ...]


class If(Statement, frozen=True):
    branches: tuple[IfBranch, ...]
    otherwise: tuple[Statement, ...] = ()


# ---------------------------------------------------------------- events


class Reinit(Statement, frozen=True):
    target: Expression
    value: Expression


class Assign(Statement, frozen=True):
    target: Reference
    value: Expression


class Terminate(Statement, frozen=True):
    message: str


class Impulse(Statement, frozen=True):
    value: Expression
    on: Expression
    at: Expression | None = None
    source: Expression | None = None
    frame: Expression | None = None


class Release(Statement, frozen=True):
    target: Reference


class Engage(Statement, frozen=True):
    target: Reference


Action = Reinit | Assign | Terminate | Impulse | Release | Engage | Assert


class WhenBranch(Node, frozen=True):
    condition: Expression
    actions: tuple[Action, ...]


class When(Statement, frozen=True):
    branches: tuple[WhenBranch, ...]


# ---------------------------------------------------------------- files


class Argument(Node, frozen=True):
    """A formal argument of a function."""

    name: str
    type: str = ""
    dimensions: tuple[Dimension, ...] = ()


class Return(Statement, frozen=True):
    """``return e;``, ``return (a, b);``"""

    values: tuple[Expression, ...]


class Function(Named, frozen=True):
    """``function f(Length x, k) -> Force = e;``, or with a body instead of ``value``.

    ``results``: the names of several, ``-> (Length r, Angle phi)``.
    """

    arguments: tuple[Argument, ...]
    value: Expression | None = None
    result: str = ""
    result_dimensions: tuple[Dimension, ...] = ()
    results: tuple[Argument, ...] = ()
    body: tuple[Statement, ...] = ()


class Type(Named, frozen=True):
    """``type Curvature = unit "1/m";``"""

    unit: str


class Model(Named, frozen=True):
    """``shape``: a ``shape model``, which statements ``shape`` set on frames, and nothing else names."""

    body: tuple[Statement, ...] = ()
    partial: bool = False
    shape: bool = False


class Comment(Placed, frozen=True):
    """A comment with its delimiters, kept for the formatter."""

    text: str


class File(Node, frozen=True):
    """One file: imports, types, functions, models, and bare statements, in order."""

    aside: ClassVar[frozenset[str]] = frozenset({"span", "source", "comments"})

    source: SourceFile
    items: tuple[Statement, ...]
    comments: tuple[Comment, ...] = ()
