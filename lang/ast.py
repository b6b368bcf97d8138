"""The syntax tree: every node type on one page.

Nodes are frozen, compare without their spans, and print back to equivalent text
(``lang/printer.py``). Names are unresolved, units are text, numbers are exact.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from .source import SourceFile, Span


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    span: Span = field(compare=False, repr=False)


# ---------------------------------------------------------------- expressions


@dataclass(frozen=True, slots=True)
class Number(Node):
    """A bare number; ``text`` keeps how it was written."""

    value: Fraction
    text: str = field(compare=False)


@dataclass(frozen=True, slots=True)
class Quantity(Node):
    """``9.81 m/s^2``: a number with its unit; ``value`` and ``text`` are the number's, as written."""

    value: Fraction
    unit: str
    text: str = field(compare=False)


@dataclass(frozen=True, slots=True)
class String(Node):
    value: str


@dataclass(frozen=True, slots=True)
class Boolean(Node):
    value: bool


@dataclass(frozen=True, slots=True)
class Time(Node):
    """The word ``time``."""


@dataclass(frozen=True, slots=True)
class Part(Node):
    """One segment ``name[indices]`` of a reference."""

    name: str
    indices: tuple[Expression, ...] = ()


@dataclass(frozen=True, slots=True)
class Reference(Node):
    """``a.b[2].c``"""

    parts: tuple[Part, ...]

    @property
    def name(self) -> str:
        """The dotted name without indices."""
        return ".".join(p.name for p in self.parts)


@dataclass(frozen=True, slots=True)
class Derivative(Node):
    """``der(operand, order)``"""

    operand: Expression
    order: int = 1


@dataclass(frozen=True, slots=True)
class Previous(Node):
    """``pre(operand)``"""

    operand: Expression


@dataclass(frozen=True, slots=True)
class Unary(Node):
    """``operator`` is ``-``, ``+`` or ``not``."""

    operator: str
    operand: Expression


@dataclass(frozen=True, slots=True)
class Binary(Node):
    """``operator`` is one of ``+ - * / ^ < <= > >= == <> and or``."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Branch(Node):
    condition: Expression
    value: Expression


@dataclass(frozen=True, slots=True)
class Conditional(Node):
    """``if c then a elseif d then b else e``"""

    branches: tuple[Branch, ...]
    otherwise: Expression


@dataclass(frozen=True, slots=True)
class Vector(Node):
    """``{a, b, c} unit``"""

    elements: tuple[Expression, ...]
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Range(Node):
    """``start:stop`` or ``start:step:stop``"""

    start: Expression
    stop: Expression
    step: Expression | None = None


@dataclass(frozen=True, slots=True)
class Generator(Node):
    """``for name in range``; the range may be any expression with a value of several elements."""

    name: str
    range: Expression


@dataclass(frozen=True, slots=True)
class Comprehension(Node):
    """``{element for i in r} unit``"""

    element: Expression
    generators: tuple[Generator, ...]
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Aggregate(Node):
    """The argument of ``sum(e for i in r)``, ``integral(e for s in a:b)``."""

    element: Expression
    generators: tuple[Generator, ...]


@dataclass(frozen=True, slots=True)
class Keyword(Node):
    """A named argument of a call."""

    name: str
    value: Expression


@dataclass(frozen=True, slots=True)
class Call(Node):
    function: Reference
    arguments: tuple[Expression, ...]
    keywords: tuple[Keyword, ...] = ()


@dataclass(frozen=True, slots=True)
class Parenthesis(Node):
    """``(inner) unit``"""

    inner: Expression
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Subscript(Node):
    """``base[indices]`` where the base is no plain reference: ``f(x)[2]``, ``{1, 2}[i]``."""

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
    | Comprehension
    | Aggregate
    | Call
    | Parenthesis
    | Subscript
)


# ---------------------------------------------------------------- pieces of statements


@dataclass(frozen=True, slots=True)
class Dimension(Node):
    """One array dimension ``[n]``, ``[i in 1:n]``; without a name ``size`` is the extent."""

    size: Expression
    name: str = ""


@dataclass(frozen=True, slots=True)
class Modification(Node):
    """``target = value`` (known), ``target ~ value`` (guess), ``a -> b`` (link), ``p in values`` (sweep).

    ``target`` is a reference or ``der(reference)``; for a link it is the left-hand expression.
    """

    target: Expression
    kind: str
    value: Expression


@dataclass(frozen=True, slots=True)
class Start(Node):
    """``= value`` or, with ``guess``, ``~ value``."""

    value: Expression
    guess: bool


@dataclass(frozen=True, slots=True)
class Option(Node):
    """``, name = value`` at the end of a contact or friction statement."""

    name: str
    value: Expression


@dataclass(frozen=True, slots=True)
class LabelName(Node):
    """``name[i]:`` before a force, constraint, contact ..."""

    name: str
    indices: tuple[Expression, ...] = ()


# ---------------------------------------------------------------- statements


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement(Node):
    doc: str = ""


@dataclass(frozen=True, slots=True)
class Import(Statement):
    """``import a.b.*`` (``names`` is ``("*",)``), ``import P = a.b`` (alias), ``import a.b.{X, Y}``."""

    path: str
    alias: str = ""
    names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Extends(Statement):
    base: str
    modifications: tuple[Modification, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Declaration(Statement):
    """What all declarations share; ``type`` is empty where it is to be inferred."""

    name: str
    name_span: Span = field(compare=False, repr=False)
    type: str = ""
    dimensions: tuple[Dimension, ...] = ()
    attributes: tuple[Modification, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter(Declaration):
    structural: bool = False
    value: Expression | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Coordinate(Declaration):
    start: Start | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class State(Declaration):
    start: Start | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Discrete(Declaration):
    value: Expression | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Input(Declaration):
    value: Expression | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Output(Declaration):
    value: Expression | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Let(Declaration):
    value: Expression


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame(Declaration):
    """Without ``value`` the frame is free and must be placed."""

    value: Expression | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Point(Declaration):
    value: Expression | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Component(Declaration):
    """``[cut] Type name[dims](modifications) if condition;`` with ``type`` the dotted model name."""

    cut: bool = False
    modifications: tuple[Modification, ...] = ()
    condition: Expression | None = None


@dataclass(frozen=True, slots=True)
class Energy(Statement):
    """``kind`` is ``kinetic``, ``potential``, ``lagrangian`` or ``dissipation``."""

    kind: str
    value: Expression


@dataclass(frozen=True, slots=True)
class Gravity(Statement):
    value: Expression


@dataclass(frozen=True, slots=True)
class Mass(Statement):
    value: Expression
    at: Expression


@dataclass(frozen=True, slots=True)
class Inertia(Statement):
    value: Expression
    on: Expression


@dataclass(frozen=True, slots=True)
class Load(Statement):
    """``force`` or ``torque`` (``kind``)."""

    kind: str
    label: LabelName | None
    value: Expression
    on: Expression
    at: Expression | None = None
    source: Expression | None = None
    frame: Expression | None = None


@dataclass(frozen=True, slots=True)
class Damping(Statement):
    label: LabelName | None
    value: Expression
    on: Expression


@dataclass(frozen=True, slots=True)
class Friction(Statement):
    label: LabelName | None
    kinetic: Expression
    static: Expression | None
    on: Expression
    options: tuple[Option, ...] = ()


@dataclass(frozen=True, slots=True)
class Constraint(Statement):
    """``kind`` is empty, ``holonomic`` or ``nonholonomic``."""

    kind: str
    label: LabelName | None
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Drive(Statement):
    target: Expression
    value: Expression


@dataclass(frozen=True, slots=True)
class Contact(Statement):
    label: LabelName | None
    gap: Expression
    restitution: Expression | None = None
    friction: Expression | None = None
    static: Expression | None = None
    along: Expression | None = None
    options: tuple[Option, ...] = ()


@dataclass(frozen=True, slots=True)
class Place(Statement):
    target: Reference
    value: Expression


@dataclass(frozen=True, slots=True)
class Closure(Statement):
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Initial(Statement):
    target: Expression
    start: Start


@dataclass(frozen=True, slots=True)
class Final(Statement):
    target: Expression
    start: Start


@dataclass(frozen=True, slots=True)
class Equation(Statement):
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Exact(Statement):
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Assert(Statement):
    condition: Expression
    message: str


@dataclass(frozen=True, slots=True)
class Experiment(Statement):
    name: str
    settings: tuple[Modification, ...] = ()


@dataclass(frozen=True, slots=True)
class Dimensionless(Statement):
    pass


@dataclass(frozen=True, slots=True)
class Independent(Statement):
    name: str
    type: str = ""
    lower: Expression | None = None
    upper: Expression | None = None


@dataclass(frozen=True, slots=True)
class Stationary(Statement):
    value: Expression


@dataclass(frozen=True, slots=True)
class For(Statement):
    name: str
    range: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class IfBranch(Node):
    condition: Expression
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class If(Statement):
    branches: tuple[IfBranch, ...]
    otherwise: tuple[Statement, ...] = ()


# ---------------------------------------------------------------- events


@dataclass(frozen=True, slots=True)
class Reinit(Statement):
    target: Expression
    value: Expression


@dataclass(frozen=True, slots=True)
class Assign(Statement):
    target: Reference
    value: Expression


@dataclass(frozen=True, slots=True)
class Terminate(Statement):
    message: str


@dataclass(frozen=True, slots=True)
class Impulse(Statement):
    value: Expression
    on: Expression
    at: Expression | None = None
    source: Expression | None = None
    frame: Expression | None = None


@dataclass(frozen=True, slots=True)
class Release(Statement):
    target: Reference


@dataclass(frozen=True, slots=True)
class Engage(Statement):
    target: Reference


Action = Reinit | Assign | Terminate | Impulse | Release | Engage | Assert


@dataclass(frozen=True, slots=True)
class WhenBranch(Node):
    condition: Expression
    actions: tuple[Action, ...]


@dataclass(frozen=True, slots=True)
class When(Statement):
    branches: tuple[WhenBranch, ...]


# ---------------------------------------------------------------- files


@dataclass(frozen=True, slots=True)
class Argument(Node):
    """A formal argument of a function."""

    name: str
    type: str = ""
    dimensions: tuple[Dimension, ...] = ()


@dataclass(frozen=True, slots=True)
class Function(Statement):
    """``function f(Length x, k) -> Force = e;``"""

    name: str
    name_span: Span = field(compare=False, repr=False, kw_only=True)
    arguments: tuple[Argument, ...]
    value: Expression
    result: str = ""
    result_dimensions: tuple[Dimension, ...] = ()


@dataclass(frozen=True, slots=True)
class Type(Statement):
    """``type Curvature = unit "1/m";``"""

    name: str
    name_span: Span = field(compare=False, repr=False, kw_only=True)
    unit: str


@dataclass(frozen=True, slots=True)
class Model(Statement):
    name: str
    name_span: Span = field(compare=False, repr=False)
    body: tuple[Statement, ...] = ()
    partial: bool = False


@dataclass(frozen=True, slots=True)
class Comment:
    """A comment with its delimiters, kept for the formatter."""

    text: str
    span: Span = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class File(Node):
    """One file: imports, types, functions, models, and bare statements, in order."""

    source: SourceFile = field(compare=False, repr=False)
    items: tuple[Statement, ...]
    comments: tuple[Comment, ...] = field(default=(), compare=False)
