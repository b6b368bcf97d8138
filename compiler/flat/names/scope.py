"""What an expression sees while it is elaborated, and how a mistake in it is reported."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Unpack

from msgspec import Struct, field

from mechc.lang import ast
from mechc.lang.diagnostics import Details, Label, Reporter
from mechc.lang.source import Span

from .. import types
from ..model import Expression, Literal, Origin, TableData, Type
from .classes import Classes
from .namespace import Namespace, SourceLibrary

if TYPE_CHECKING:
    from ..model import ReadFile
    from ..moments import Moments
    from .instance import ComponentMember, DefinitionMember, Instance, InstanceMember, Shapes, VariableMember

Constant = Fraction | bool | str


class Poisoned(Exception):
    """What is being elaborated is wrong, and that has been reported."""


def skip(reporter: Reporter) -> None:
    """Go on without what is poisoned. Nothing is left out of a model without a word."""
    assert reporter.has_errors, "a part of the model was skipped, and no error was reported"


def _decimal_commas(*places: Span) -> str:
    """Ask about three numbers of which two may be one, written with a decimal comma: ``{0, -9,81}``."""
    for place in places:
        if found := re.search(r"\{[^{}]*?(\d+),(\d+)[^{}]*\}", place.text):
            return f"is ',' meant as a decimal point? '{found[1]}.{found[2]}' is one number, '{found[1]},{found[2]}' are two"
    return ""


class Space(Struct):
    """Whether the model is planar or spatial, and the place that said so first."""

    size: int = 0
    span: Span | None = None
    word: str = ""
    mixed: bool = False

    def require(self, size: int, scope: Scope, span: Span, word: str) -> None:
        """State that ``word`` at ``span`` belongs to ``size`` dimensions."""
        if self.size == size:
            return
        if self.size == 0:
            self.size, self.span, self.word = size, span, word
            return
        labels = (Label(self.span, f"{self.word}: {_PLACES[self.size]}"),) if self.span else ()
        error = scope.fail(
            "E0306",
            "the plane and space cannot be mixed",
            span,
            caption=f"{word}: {_PLACES[size]}",
            labels=labels,
            help=_decimal_commas(*(s for s in (self.span, span) if s))
            or "use one of mech.planar and mech.spatial, and vectors of one length",
        )
        self.mixed = True  # what follows from it is not reported
        raise error

    def known(self, scope: Scope, span: Span) -> int:
        """Return 2 or 3; an error where nothing in the model tells."""
        if self.size == 0:
            raise scope.fail(
                "E0307",
                "nothing shows whether this model is planar or spatial",
                span,
                caption="the number of components depends on it",
                help="a vector with 2 or 3 components, 'rot' or 'rotz' shows it, for example 'gravity {0, -9.81 m/s^2};'",
            )
        return self.size


_PLACES = {2: "planar", 3: "spatial"}


class Interval(Struct):
    """The range of the independent variable of a model of a curve, and the type of what is stationary once it is known.

    ``unknown``: coordinates that are numbers, as the range ends there.
    """

    lower: Expression
    upper: Expression
    unknown: tuple[str, ...]
    span: Span
    functional: Callable[[], Type]


class Flattening(Struct):
    """The state of one compilation that all passes share; ``make`` makes the instances of shapes and of their contacts."""

    reporter: Reporter
    library: SourceLibrary
    classes: Classes
    elaborate: Callable[[ast.Expression, Scope], Expression]
    make: Callable[[ComponentMember], None]
    overrides: Mapping[str, Constant]
    dimensionless: bool = False
    independent: str = "time"
    time_type: Type = field(default_factory=lambda: types.real(types.TIME))
    space: Space = field(default_factory=Space)
    interval: Interval | None = None
    instances: int = 0
    turns: int = 0
    quadratures: int = 0
    constants: dict[int, tuple[ast.Node, Literal]] = field(default_factory=dict)
    meshes: dict[str, Moments] = field(default_factory=dict)
    numbers: dict[tuple[str, str], Expression] = field(default_factory=dict)
    files: dict[str, ReadFile] = field(default_factory=dict)
    data: dict[str, TableData] = field(default_factory=dict)
    shapes: Shapes | None = None
    touching: dict[int, Span] = field(default_factory=dict)
    """Where pairs of shapes are said to touch, by both numbers in one."""
    each_pair: bool = False
    variables: dict[str, VariableMember] = field(default_factory=dict)
    definitions: dict[str, DefinitionMember] = field(default_factory=dict)
    opened: list[InstanceMember] = field(default_factory=list)
    """What is being resolved, the outermost first, with what is resolved behind it."""
    integrals: list[tuple[str, Expression, Type, Origin]] = field(default_factory=list)
    integrals_named: int = 0
    _reported: set[tuple[str, str, int]] = field(default_factory=set)

    def report(self, scope: Scope, code: str, message: str, span: Span, **details: Unpack[Details]) -> None:
        """Record an error once for each place, however many instances share it."""
        key = (code, span.file.name, span.start)
        follows = self.space.mixed and code in ("E0305", "E0306")
        if key in self._reported or follows:
            return
        self._reported.add(key)
        details["labels"] = (*details.get("labels", ()), *scope.trail())
        self.reporter.error(code, message, span, **details)


class Scope(Struct):
    """Names in reach: ``local`` (indices of loops, arguments of functions), then the members of ``instance``,
    then the definitions of ``namespace``. ``calls`` are the functions being inlined, outermost first."""

    flattening: Flattening
    instance: Instance | None
    namespace: Namespace
    local: Mapping[str, Expression] = field(default_factory=dict)
    calls: tuple[tuple[str, Span], ...] = ()
    in_event: bool = False
    level: int = 0

    def elaborate(self, node: ast.Expression) -> Expression:
        """Return the checked expression. Raises Poisoned after reporting what is wrong with it."""
        return self.flattening.elaborate(node, self)

    def with_local(self, names: Mapping[str, Expression]) -> Scope:
        return Scope(
            self.flattening,
            self.instance,
            self.namespace,
            {**self.local, **names},
            self.calls,
            self.in_event,
            self.level,
        )

    def without(self, name: str) -> Scope:
        """Return the same scope where a local name is not known."""
        scope = self.with_local({})
        scope.local = {known: value for known, value in self.local.items() if known != name}
        return scope

    def for_events(self) -> Scope:
        return Scope(self.flattening, self.instance, self.namespace, self.local, self.calls, True, self.level)

    @property
    def path(self) -> str:
        """The dotted name of the instance; empty at the top."""
        return "" if self.instance is None else self.instance.path

    def origin(self, span: Span) -> Origin:
        top = self.instance
        while top is not None and top.parent is not None and top.parent.made_at is not None:
            top = top.parent
        return Origin(span, self.path, None if top is None else top.made_at)

    def report(self, code: str, message: str, span: Span, **details: Unpack[Details]) -> None:
        """Record an error and go on."""
        self.flattening.report(self, code, message, span, **details)

    def fail(self, code: str, message: str, span: Span, **details: Unpack[Details]) -> Poisoned:
        """Record an error and return the exception to raise: ``raise scope.fail(...)``."""
        self.report(code, message, span, **details)
        return Poisoned()

    def trail(self) -> tuple[Label, ...]:
        """Say where the text that is being elaborated was called or instantiated from."""
        labels = [Label(span, f"'{name}' is called here") for name, span in reversed(self.calls[-1:])]
        instance = self.instance
        if instance is not None and instance.made_at is not None:
            labels.append(Label(instance.made_at, f"in '{instance.path}', which is a {instance.model.name}"))
            top = instance
            while top.parent is not None and top.parent.made_at is not None:
                top = top.parent
            if top is not instance and top.made_at is not None:
                labels.append(Label(top.made_at, f"part of '{top.path}'"))
        return tuple(labels)
