"""Models as classes: inheritance spread out, once for each model, before anything is instantiated."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from msgspec import Struct, field

from mechc.lang import ast
from mechc.lang.builtins import PREDEFINED
from mechc.lang.diagnostics import Label, Reporter
from mechc.suggest import closest

from .namespace import Namespace

_ALWAYS = (
    ast.Experiment,
    ast.Study,
    ast.Dimensionless,
    ast.Independent,
    ast.Extends,
    ast.Final,
    ast.Stationary,
)
"""Statements that no condition or loop may decide about."""


class Stated(Struct, frozen=True):
    """A statement of ``model`` with the names it sees; ``level`` 0 is the model itself, 1 its base, and so on."""

    statement: ast.Statement
    namespace: Namespace
    level: int
    model: ast.Model


class Inherited(Struct, frozen=True):
    """A modification in an ``extends`` clause."""

    modification: ast.Modification
    namespace: Namespace
    level: int


class Class(Struct):
    """``statements`` with those of the bases first; ``declarations`` by name, those under ``if`` apart."""

    model: ast.Model
    namespace: Namespace
    statements: list[Stated] = field(default_factory=list)
    declarations: dict[str, Stated] = field(default_factory=dict)
    conditional: dict[str, ast.Declaration] = field(default_factory=dict)
    inherited: list[Inherited] = field(default_factory=list)
    lineage: dict[int, int] = field(default_factory=dict)
    """How many steps of inheritance lead to a model, by its ``id``; 0 to the model itself."""
    kinds: set[str] = field(default_factory=set)
    """The names of these models."""
    experiments: dict[str, Stated] = field(default_factory=dict)
    studies: dict[str, Stated] = field(default_factory=dict)
    interface: tuple[str, ...] = ()
    places: tuple[ast.Place, ...] = ()
    dimensionless: bool = False
    broken: bool = False

    @property
    def name(self) -> str:
        return self.model.name


class Classes(Struct):
    """The classes of one compilation."""

    reporter: Reporter
    _known: dict[int, Class] = field(default_factory=dict)

    def of(self, model: ast.Model, namespace: Namespace) -> Class:
        found = self._known.get(id(model))
        if found is None:
            inside = namespace.inside(model.body)
            found = self._known[id(model)] = Class(model, inside)
            self._spread(found, model, inside, 0, [], set())
            _finish(found, self.reporter)
        return found

    def _spread(
        self,
        result: Class,
        model: ast.Model,
        namespace: Namespace,
        level: int,
        trail: list[ast.Model],
        seen: set[int],
    ) -> None:
        if any(model is above for above in trail):
            names = " -> ".join(m.name for m in [*trail, model])
            self.reporter.error(
                "E0405",
                f"model '{model.name}' extends itself",
                trail[-1].name_span,
                caption=names,
            )
            result.broken = True
            return
        if id(model) in seen:  # a base shared by two bases counts once
            return
        seen.add(id(model))
        result.lineage[id(model)] = level
        result.kinds.add(model.name)
        namespace.resolve()
        for statement in model.body:
            if not isinstance(statement, ast.Extends):
                continue
            base = self._base(statement, namespace, model.shape)
            if base is None:
                result.broken = True
                continue
            inner = base[1].inside(base[0].body)
            self._spread(result, base[0], inner, level + 1, [*trail, model], seen)
            result.inherited += [Inherited(m, namespace, level) for m in statement.modifications]
        for statement in model.body:
            if not isinstance(statement, ast.Extends | ast.Import | ast.Function | ast.Type):
                result.statements += [Stated(s, namespace, level, model) for s in ast.single(statement)]

    def _base(
        self, statement: ast.Extends, namespace: Namespace, shape: bool
    ) -> tuple[ast.Model, Namespace] | None:
        look_up = namespace.look_up_shape if shape else namespace.look_up
        found = look_up(statement.base, statement.span)
        if found is not None and isinstance(found.definition, ast.Model):
            return found.definition, found.namespace
        if found is not None or not namespace.broken:
            near = closest(statement.base, namespace.shapes() if shape else namespace.names())
            self.reporter.error(
                "E0203",
                f"there is no {'shape ' if shape else ''}model '{statement.base}'",
                statement.span,
                help=f"did you mean '{near}'?" if near else "",
            )
        return None


def _finish(result: Class, reporter: Reporter) -> None:
    """Collect the declarations, interface frames and experiments of the spread statements."""
    interface: list[str] = []
    places: list[ast.Place] = []
    for stated in result.statements:
        statement = stated.statement
        match statement:
            case ast.Declaration():
                _declare(result, stated, statement, reporter)
                if isinstance(statement, ast.Frame) and statement.value is None and not statement.dimensions:
                    interface.append(statement.name)
            case ast.Dimensionless():
                result.dimensionless = True
            case ast.Experiment():
                _add_experiment(result, stated, statement, reporter)
            case ast.Study():
                _add_study(result, stated, statement, reporter)
            case ast.Place():
                places.append(statement)
            case ast.Shape() | ast.ContactOfShapes():
                _name(result, statement, reporter)
            case ast.If():
                for inner in _inside(statement, reporter):
                    if isinstance(inner, ast.Place):
                        places.append(inner)
                    elif isinstance(inner, ast.Shape | ast.ContactOfShapes):
                        _name(result, inner, reporter)
                    else:
                        _check_name(inner, reporter)
                        result.conditional.setdefault(inner.name, inner)
            case ast.For():
                _refuse_declarations(statement.body, reporter)
            case _:
                pass
    result.interface = tuple(interface)
    result.places = tuple(places)


def _check_name(statement: ast.Declaration, reporter: Reporter) -> None:
    """Report a declaration that would hide what every model has."""
    if statement.name in PREDEFINED:
        reporter.error(
            "E0211",
            f"'{statement.name}' is the name of something that every model has: {PREDEFINED[statement.name]}",
            statement.name_span,
            help=f"choose another name, for example '{statement.name}_'",
        )


def _declare(result: Class, stated: Stated, statement: ast.Declaration, reporter: Reporter) -> None:
    _check_name(statement, reporter)
    first = result.declarations.get(statement.name)
    if first is not None:
        if first.model is not stated.model and first.statement == statement:
            return
        assert isinstance(first.statement, ast.Declaration)
        reporter.error(
            "E0204",
            f"'{statement.name}' is declared twice",
            statement.name_span,
            caption="again here",
            labels=(Label(first.statement.name_span, "first here"),),
            help="to change an inherited value, write 'extends Base(name = value);'"
            if first.model is not stated.model
            else "",
        )
        return
    result.declarations[statement.name] = stated


def _add_experiment(result: Class, stated: Stated, statement: ast.Experiment, reporter: Reporter) -> None:
    first = result.experiments.get(statement.name)
    if first is not None and first.level == stated.level:
        named = f"'{statement.name}'" if statement.name else "without a name"
        reporter.error(
            "E0803",
            f"there are two experiments {named}",
            statement.span,
            caption="again here",
            labels=(Label(first.statement.span, "first here"),),
        )
        return
    result.experiments[statement.name] = stated


def _add_study(result: Class, stated: Stated, statement: ast.Study, reporter: Reporter) -> None:
    first = result.studies.get(statement.name)
    if first is not None and first.level == stated.level:
        reporter.error(
            "E0830",
            f"there are two studies '{statement.name}'",
            statement.span,
            caption="again here",
            labels=(Label(first.statement.span, "first here"),),
        )
        return
    result.studies[statement.name] = stated


def component_of(statement: ast.Shape | ast.ContactOfShapes) -> ast.Component:
    """Return the component that a statement makes."""
    shape = statement if isinstance(statement, ast.Shape) else None
    label = statement.label
    return ast.Component(
        name=label.name if label is not None else "shape" if shape else "contact",
        name_span=statement.span if label is None else label.span,
        type=shape.type if shape else "contact",
        modifications=shape.modifications if shape else (),
        doc=statement.doc,
        span=statement.span,
    )


def _name(result: Class, statement: ast.Shape | ast.ContactOfShapes, reporter: Reporter) -> None:
    """Enter the name that a statement gives to the component which it makes."""
    if statement.label is not None and not statement.label.indices:
        declaration = component_of(statement)
        _check_name(declaration, reporter)
        result.conditional.setdefault(declaration.name, declaration)


_Named = ast.Declaration | ast.Place | ast.Shape | ast.ContactOfShapes


def _inside(statement: ast.If, reporter: Reporter) -> Iterator[_Named]:
    """Yield what stands under a structural condition and must be known before it is decided."""
    bodies = [branch.body for branch in statement.branches] + [statement.otherwise]
    for body in bodies:
        for inner in chain.from_iterable(map(ast.single, body)):
            if isinstance(inner, _Named):
                yield inner
            elif isinstance(inner, _ALWAYS):
                _refuse(inner, "if", reporter)
            elif isinstance(inner, ast.If):
                yield from _inside(inner, reporter)
            elif isinstance(inner, ast.For):
                _refuse_declarations(inner.body, reporter)


def _refuse_declarations(body: tuple[ast.Statement, ...], reporter: Reporter) -> None:
    for inner in chain.from_iterable(map(ast.single, body)):
        if isinstance(inner, ast.Declaration):
            reporter.error(
                "E0410",
                f"'{inner.name}' is declared inside 'for'",
                inner.span,
                help=f"declare an array outside the loop, as in '{inner.name}[i in 1:n]'",
            )
        elif isinstance(inner, ast.For):
            _refuse_declarations(inner.body, reporter)
        elif isinstance(inner, ast.If):
            for branch in inner.branches:
                _refuse_declarations(branch.body, reporter)
            _refuse_declarations(inner.otherwise, reporter)
        elif isinstance(inner, _ALWAYS):
            _refuse(inner, "for", reporter)


def _refuse(statement: ast.Statement, word: str, reporter: Reporter) -> None:
    name = type(statement).__name__.lower()
    reporter.error(
        "E0410",
        f"'{name}' cannot stand inside '{word}'",
        statement.span,
        caption="it always belongs to the whole model",
    )
