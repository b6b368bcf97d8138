"""Instances of classes and their members: what exists, before any of it is elaborated."""

from __future__ import annotations

from enum import Enum

from msgspec import Struct, field

from mechc.lang import ast
from mechc.lang.source import Span

from ..model import Expression, Origin, Role, Type
from ..subscripts import Index
from .classes import Class
from .scope import Flattening, Poisoned, Scope


class Source(Struct, eq=False):
    """An expression of one scope that is elaborated when first needed, and then shared."""

    node: ast.Expression
    scope: Scope
    _value: Expression | None = None
    _wrong: bool = False

    def value(self) -> Expression:
        if self._wrong:
            raise Poisoned
        if self._value is None:
            try:
                self._value = self.scope.elaborate(self.node)
            except Poisoned:
                self._wrong = True
                raise
        return self._value


Rank = tuple[int, int, int]
"""Depth of the component in whose text a value stands, level of inheritance, both negative; stage."""

DECLARED, STATED, EXTENDED = range(3)
"""What of one text goes before what: declaration, ``initial`` and modifications of components, ``extends``."""


def rank_of(scope: Scope, stage: int) -> Rank:
    """Return the rank of a value given in a scope: that of the outermost text is the largest."""
    depth = 0 if scope.instance is None else scope.instance.depth
    return (-depth, -scope.level, stage)


class Pick(Struct, frozen=True):
    """One array of components that a modification has passed through, and the element it has reached."""

    extents: tuple[int, ...]
    index: Index


class Modifier(Struct, frozen=True):
    """A modification on its way to a member: ``path`` is what is left of its target.

    ``rank`` orders competing ones, the largest wins: ``rank_of``.
    """

    path: tuple[ast.Part, ...]
    kind: str
    rate: bool
    source: Source
    rank: Rank
    span: Span
    picks: tuple[Pick, ...] = ()
    link: bool = False


ROLE_WORDS = {
    Role.PARAMETER: "a parameter",
    Role.COORDINATE: "a coordinate",
    Role.STATE: "a state",
    Role.DISCRETE: "a discrete variable",
    Role.INPUT: "an input",
}


class ElaborationProgress(Enum):
    NEW = 0
    OPEN = 1
    DONE = 2
    WRONG = 3


class InstanceMember(Struct, eq=False):
    """A declared name of an instance; ``name`` is its dotted name in the flat model."""

    declaration: ast.Declaration
    scope: Scope
    name: str
    modifiers: list[Modifier] = field(default_factory=list)
    progress: ElaborationProgress = ElaborationProgress.NEW


class VariableMember(InstanceMember, eq=False):
    """A parameter, coordinate, state, discrete variable or input; ``constant`` if structural.

    ``bound``: the expression an input is connected to.
    """

    role: Role = Role.PARAMETER
    type: Type | None = None
    structural: bool = False
    constant: Expression | None = None
    value: Expression | None = None
    bound: Expression | None = None

    @property
    def stands_for_value(self) -> bool:
        """Whether it is another name of its value: an input that is given from outside, and a parameter of a contact of two shapes."""
        within, declaration = self.scope.instance, self.declaration
        if self.role is Role.INPUT:
            return bool(self.modifiers)
        if self.role is not Role.PARAMETER or self.structural or within is None or not within.pair:
            return False
        guessed = isinstance(declaration, ast.Parameter) and declaration.found
        return not guessed and all(m.kind == "=" for m in self.modifiers)


class DefinitionMember(InstanceMember, eq=False):
    """A ``let`` or ``output``; ``guess`` of one that equations determine."""

    type: Type | None = None
    value: Expression | None = None
    guess: Expression | None = None


class PlaceMember(InstanceMember, eq=False):
    """A frame or point, or an array of them: ``values`` by index, None for a free frame.

    ``welds``: values given to free frames from outside by name, which place them as joints would.
    """

    extents: tuple[int, ...] = ()
    types: dict[Index, Type] = field(default_factory=dict)
    values: dict[Index, Expression | None] = field(default_factory=dict)
    opening: set[Index] = field(default_factory=set)
    welds: dict[Index, tuple[Expression, Origin]] = field(default_factory=dict)


class ComponentMember(InstanceMember, eq=False):
    """A component; ``instances`` by index, none where its condition is false.

    ``statement``: the ``shape`` or the ``contact`` of shapes that makes it.
    """

    statement: ast.Shape | ast.ContactOfShapes | None = None
    extents: tuple[int, ...] = ()
    instances: dict[Index, Instance] = field(default_factory=dict)


AnyMember = VariableMember | DefinitionMember | PlaceMember | ComponentMember


Labelled = (
    ast.Load
    | ast.Damping
    | ast.Friction
    | ast.Constraint
    | ast.Inequality
    | ast.Contact
    | ast.ContactOfShapes
    | ast.Shape
)
"""Statements that may have a name."""


class LabelMember(Struct, eq=False):
    """A named statement: ``kind`` is force, torque, damping, friction, constraint, contact or shape. ``made``: what it makes;
    ``element``: the one of it that is meant, counted from 0; all without it. ``friction``: that of a contact, once it is asked for."""

    kind: str
    name: str
    statement: Labelled
    scope: Scope
    made: ComponentMember | None = None
    progress: ElaborationProgress = ElaborationProgress.NEW
    element: Index | None = None
    friction: LabelMember | None = None


class Expanded(Struct, eq=False):
    """A statement of an instance after ``for`` and ``if``; ``made``: the component that a shape or a contact of shapes is;
    ``pairs``: of a contact that stands for those of two loops."""

    statement: ast.Statement
    scope: Scope
    made: ComponentMember | None = None
    pairs: PairLoop | None = None


class PairLoop(Struct, frozen=True, eq=False):
    """Two loops around a contact: the scopes of the outer one, the first turn of the inner one in each of them, and those of the
    longest one, in which nothing of the outer one is known. ``row``: that one's."""

    row: int
    rows: tuple[Scope, ...]
    starts: tuple[int, ...]
    columns: tuple[Scope, ...]
    turns: tuple[tuple[int, ...], tuple[int, ...]]
    """The values of both variables."""
    names: tuple[str, str]


class Instance(Struct, eq=False):
    """One object of a class. ``members`` grows when structural conditions are decided (``expanded``)."""

    flattening: Flattening
    cls: Class
    path: str
    parent: Instance | None
    declaration: ast.Component | None
    depth: int
    members: dict[str, AnyMember] = field(default_factory=dict)
    labels: dict[tuple[str, Index], LabelMember] = field(default_factory=dict)
    modifiers: dict[str, list[Modifier]] = field(default_factory=dict)
    expanded: list[Expanded] | None = None
    expanding: bool = False
    gravity: Expression | None = None
    gravity_field: tuple[Scope, ast.Reference] | None = None
    """A function of the place that is the field, in the scope where it is stated."""
    gravity_span: Span | None = None
    unnamed: int = 0
    in_families: set[str] = field(default_factory=set)
    """Labels of contacts of which one stands for those of two loops."""
    """How many of its shapes have no name of their own."""
    pair: bool = False
    """It is a contact of two shapes, whose parameters are names of their values: of a heap there are thousands."""
    options: tuple[tuple[ast.Option, Scope], ...] = ()
    """Of the contacts that it has."""

    @property
    def made_at(self) -> Span | None:
        """The place of the statement that makes this instance; None for the model itself."""
        return None if self.declaration is None else self.declaration.span

    @property
    def model(self) -> ast.Model:
        return self.cls.model

    def full_name(self, name: str) -> str:
        return f"{self.path}.{name}" if self.path else name


class SetShape(Struct, eq=False):
    """A shape of the whole model. ``frames``: the names of those on which it sits, each fixed to the one before, the nearest first;
    ``body``: the last one, through rigid connections, the same for all shapes of one rigid body; ``name``: its own, that of what
    carries it, or where that carries several ``crate.shape[2]``."""

    instance: Instance
    frames: tuple[str, ...]
    body: str
    name: str


class Shapes(Struct, eq=False):
    """All shapes of a model, the frames by their names, and for what a joint or weld holds rigidly its pose; ``wrong`` where some
    are missing, since they were reported."""

    all: list[SetShape] = field(default_factory=list)
    frames: dict[str, tuple[PlaceMember, Index]] = field(default_factory=dict)
    rigid: dict[str, Expression] = field(default_factory=dict)
    wrong: bool = False


def let_go(instance: Instance) -> None:
    """Empty an instance that has been elaborated, with all below: members and their scopes refer to each other in circles, and
    while a model is compiled nothing collects those."""
    instance.flattening.variables.clear()
    instance.flattening.definitions.clear()
    pending = [instance]
    while pending:
        at = pending.pop()
        for member in at.members.values():
            if isinstance(member, ComponentMember):
                pending += member.instances.values()
        at.members.clear()
        at.labels.clear()
        at.modifiers.clear()
        at.expanded = None
