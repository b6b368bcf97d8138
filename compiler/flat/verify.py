"""What holds for every flat model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from mechc.lang.units import Dimension

from ..malformed import Malformed
from . import types
from .checks.cycles import chains_to_themselves
from .model import (
    Apply,
    Array,
    Constraint,
    Definition,
    DefinitionRole,
    Derivative,
    Drive,
    Element,
    Energy,
    Event,
    Experiment,
    Expression,
    FieldDerivative,
    FlatModel,
    Inertia,
    Joint,
    Kind,
    Literal,
    Mass,
    Name,
    Origin,
    Previous,
    Quadrature,
    Query,
    Role,
    Select,
    StateEquation,
    Switch,
    Type,
    Typed,
    Unknown,
    Variable,
    Where,
    friction_name,
)
from .operands import children
from .show import text
from .subscripts import element_name
from .well_typed import mistake

EXPRESSIONS = (
    Literal,
    Name,
    Element,
    Derivative,
    Previous,
    Array,
    Select,
    Apply,
    Query,
    Quadrature,
    FieldDerivative,
    Where,
    Unknown,
)
_ENERGIES = {"kinetic": types.ENERGY, "potential": types.ENERGY, "dissipation": types.POWER}


def verify(model: FlatModel) -> None:
    """Raise Malformed where a flat model is not what model.py says.

    Names are unique and declared, nothing is defined by itself; types, shapes and dimensions of expressions follow from
    their operands, and fit the statement they stand in; everything has an origin inside its file.
    """
    _Check(model).run()


class _Check:
    def __init__(self, model: FlatModel) -> None:
        self.model = model
        self.types = _types(model)
        independent = model.independent not in ("", "time")
        self.second: Dimension | None = types.TIME
        if model.dimensionless:
            self.second = types.NUMBER.dimension
        elif independent:
            self.second = None
        self.variables = {v.name: v for v in model.variables}
        self.frames = {d.name for d in model.definitions if d.type.kind is Kind.FRAME} | {"world"}

    def run(self) -> None:
        self.unique()
        for where, element in self.elements():
            self.element(where, element)
        self.acyclic()

    # ------------------------------------------------------------ names

    def unique(self) -> None:
        model = self.model
        declared = [("variables", v.name) for v in model.variables]
        declared += [("definitions", d.name) for d in model.definitions]
        labelled = (model.loads, model.dampings, model.frictions, model.constraints, model.contacts)
        named = [(e.__class__.__name__, e.name) for many in labelled for e in many if e.name]
        for what, names in (
            ("declared", [*declared, ("predefined", "world"), ("predefined", "time")]),
            ("labelled", named),
            ("a joint", [("joints", j.name) for j in model.joints if j.name]),
            ("an experiment", [("experiments", e.name) for e in model.experiments]),
            ("a study", [("studies", s.name) for s in model.studies]),
        ):
            first: dict[str, str] = {}
            for kind, name in names:
                if name in first:
                    raise Malformed(f"flat model, {kind} '{name}'", f"the name is {what} twice")
                first[name] = kind

    def acyclic(self) -> None:
        for chain in chains_to_themselves(self.model.variables, self.model.definitions):
            raise Malformed(f"flat model, '{chain[0]}'", f"is defined by itself: {' -> '.join(chain)}")

    # ------------------------------------------------------------ elements

    def elements(self) -> Iterator[tuple[str, Struct]]:
        for name in self.model.__struct_fields__:
            value = getattr(self.model, name)
            if isinstance(value, tuple):
                yield from ((f"{name}[{k}]", element) for k, element in enumerate(value))

    def element(self, where: str, element: Struct) -> None:
        for path, part in _parts(element):
            if isinstance(part, Origin):
                self.origin(f"{where}{path}", element, part)
            elif isinstance(part, EXPRESSIONS):
                self.expression(f"{where}{path}", part)
        wrong = self.unfit(element)
        if wrong:
            raise Malformed(f"flat model, {where}", wrong, _shown(element))

    def origin(self, where: str, element: Struct, origin: Origin) -> None:
        for span in (origin.span, origin.shown):
            if not 0 <= span.start <= span.end <= len(span.file.text):
                raise Malformed(
                    f"flat model, {where}",
                    f"its origin {span.start}..{span.end} lies outside of {span.file.name}",
                    _shown(element),
                )

    def expression(self, where: str, root: Expression) -> None:
        """Check an expression and all in it, operands before what is made of them."""
        seen: set[tuple[int, int]] = set()
        pending: list[tuple[Expression, Mapping[str, Type], bool]] = [(root, self.types, False)]
        while pending:
            at, names, ready = pending.pop()
            if ready:
                wrong = mistake(at, names, self.second) or self.unanswered(at)
                if wrong:
                    raise Malformed(f"flat model, {where}", wrong, _around(at, root))
            elif (id(at), len(names)) not in seen:
                seen.add((id(at), len(names)))
                pending.append((at, names, True))
                bound = names
                if isinstance(at, Quadrature):
                    bound = {**names, at.variable: types.numeric(at.lower.type)}
                    if types.is_zero(at.lower):
                        bound[at.variable] = types.numeric(at.upper.type)
                elif isinstance(at, FieldDerivative):
                    bound = {**names, at.variable: types.numeric(at.place.type)}
                elif isinstance(at, Where):
                    given = zip(at.names, at.values, strict=True)
                    bound = {**names, **{name: value.type for name, value in given}}
                pending += [(e, bound, False) for e in children(at)]

    def unanswered(self, expression: Expression) -> str:
        """Tell of a question about something that is not there."""
        if not isinstance(expression, Query) or not expression.target:
            return ""
        target = expression.target
        return "" if self.is_named(target) else f"asks about '{target}', which nothing is named"

    def is_named(self, target: str) -> bool:
        model = self.model
        labels = (
            model.loads,
            model.dampings,
            model.frictions,
            model.constraints,
            model.contacts,
            model.joints,
        )
        names = {e.name for many in labels for e in many} | self.types.keys()
        names |= {friction_name(contact.name) for contact in model.contacts if contact.friction is not None}
        return target in names or target.partition("[")[0] in self.variables

    # ------------------------------------------------------------ what fits a statement

    def unfit(self, element: Struct) -> str:
        """Return why an element does not fit the model; empty if it does."""
        match element:
            case Variable():
                return self.variable(element)
            case Definition(value=None, role=role):
                return "" if role is DefinitionRole.FRAME else "has no value, but is not a free frame"
            case Definition(value=Typed() as value, type=type):
                same = types.numeric(value.type).kind is types.numeric(type).kind
                return "" if same and value.type.shape == type.shape else "its value is of another type"
            case Energy(kind=kind, value=value):
                return self.quantity(value, (), _ENERGIES.get(kind, types.ENERGY))
            case Mass(value=value, at=at, gravity=gravity):
                field = gravity is None or gravity.type.shape == (self.model.space,)
                placed = at.type.kind in (Kind.POINT, Kind.FRAME) and field
                return self.quantity(value, (), types.MASS) if placed else "stands at no point of this space"
            case Inertia(value=value, on=on):
                shape = (3, 3) if self.model.space == 3 else ()
                return (
                    self.quantity(value, shape, types.INERTIA)
                    if on.type.kind is Kind.FRAME
                    else "is on no frame"
                )
            case Constraint(left=left, right=right) | Drive(target=left, value=right):
                return self.alike(left, right)
            case Joint():
                return self.joint(element)
            case StateEquation(state=state, indices=indices):
                known = self.variables.get(state)
                there = known is not None and known.role is Role.STATE and _inside(indices, known.type.shape)
                return "" if there else f"'{element_name(state, indices)}' is not a state"
            case Event(branches=branches):
                unknown = [a.target for b in branches for a in b.actions if isinstance(a, Switch)]
                unknown = [name for name in unknown if not self.is_named(name)]
                truths = all(b.condition.type.kind is Kind.BOOLEAN for b in branches)
                return (
                    f"switches '{unknown[0]}', which is nothing"
                    if unknown
                    else ""
                    if truths
                    else "asks no condition"
                )
            case Experiment(settings=settings, sweeps=sweeps):
                targets = [s.target for s in settings] + [s.target for s in sweeps if not s.structural]
                unknown = [name for name in targets if name not in self.variables]
                return f"sets '{unknown[0]}', which is not a variable" if unknown else ""
            case _:
                return ""

    def variable(self, variable: Variable) -> str:
        shape = (4,) if variable.type.kind is Kind.ROTATION else variable.type.shape
        rates = (3,) if variable.type.kind is Kind.ROTATION else variable.type.shape
        if not all(_inside(i, shape) for i in variable.starts) or not all(
            _inside(i, rates) for i in variable.rates
        ):
            return "has initial values for elements that it has not"
        if variable.role is not Role.COORDINATE and (variable.rate or variable.rates):
            return f"is a {variable.role.value}, whose rate has no initial value"
        if variable.role in (Role.PARAMETER, Role.INPUT, Role.DISCRETE) and (
            variable.start or variable.starts
        ):
            return f"is a {variable.role.value}, and has 'start' instead of 'value'"
        if variable.value is not None and variable.value.type.shape not in (variable.type.shape, ()):
            return f"its value has the shape {variable.value.type.shape}"
        return ""

    def joint(self, joint: Joint) -> str:
        ends = [name for name in (joint.source, joint.target) if name]
        lost = [
            name for name in ends if name.partition("[")[0] not in self.frames and name not in self.frames
        ]
        if lost:
            return f"ends at '{lost[0]}', which is not a frame"
        strange = [
            n
            for n in joint.coordinates
            if n not in self.variables or self.variables[n].role is not Role.COORDINATE
        ]
        if strange:
            return f"owns '{strange[0]}', which is not a coordinate"
        return "" if joint.value.type.kind is Kind.FRAME else "places no frame"

    def quantity(self, value: Expression, shape: tuple[int, ...], dimension: Dimension) -> str:
        wanted = types.NUMBER.dimension if self.model.dimensionless else dimension
        if value.type.shape != shape:
            return f"its value has the shape {value.type.shape} instead of {shape}"
        if value.type.dimension != wanted and not types.is_zero(value):
            return f"its value is in {value.type.dimension}, not in {wanted}"
        return ""

    def alike(self, left: Expression, right: Expression) -> str:
        a, b = left.type, right.type
        if types.is_zero(left) or types.is_zero(right):
            return ""
        return "" if a.dimension == b.dimension else f"its sides are in {a.dimension} and in {b.dimension}"


def _types(model: FlatModel) -> dict[str, Type]:
    """Return the types of all names: variables, definitions, those of curves that are drawn, ``world``, ``time``."""
    found = {d.name: d.type for d in model.definitions} | {v.name: v.type for v in model.variables}
    found |= {s.variable: s.type for draw in model.draws for s in draw.samples}
    if model.independent in ("", "time") and not model.dimensionless:
        return found | {"world": types.FRAME, "time": types.real(types.TIME)}
    pending: list[object] = [model]
    while pending:  # the type of an independent variable that is not a time stands where it is used
        at = pending.pop()
        if isinstance(at, Name) and at.name == "time":
            return found | {"world": types.FRAME, "time": at.type}
        pending += [part for _, part in _fields(at)]
    return found | {"world": types.FRAME, "time": types.real(types.TIME)}


def _fields(at: object) -> list[tuple[str, object]]:
    if isinstance(at, tuple):
        return [(f"[{k}]", part) for k, part in enumerate(at)]
    if isinstance(at, Mapping):
        return [(f"[{key!r}]", part) for key, part in at.items()]
    if isinstance(at, Struct) and not isinstance(at, Type):
        return [
            (f".{name}", getattr(at, name)) for name in at.__struct_fields__ if name not in ("span", "file")
        ]
    return []


def _parts(element: Struct) -> Iterator[tuple[str, object]]:
    """Yield the origins and whole expressions of an element, each with its path."""
    pending: list[tuple[str, object]] = [("", element)]
    while pending:
        path, at = pending.pop()
        if isinstance(at, (Origin, *EXPRESSIONS)):
            yield path, at
        else:
            pending += [(path + step, part) for step, part in _fields(at)]


def _inside(indices: tuple[int, ...], shape: tuple[int, ...]) -> bool:
    return len(indices) <= len(shape) and all(0 <= i < n for i, n in zip(indices, shape, strict=False))


# ---------------------------------------------------------------- what surrounds a mistake


def _shown(element: Struct) -> list[str]:
    """Return an element field by field, and where it stands."""
    lines = [element.__class__.__name__]
    for name, value in _fields(element):
        if isinstance(value, EXPRESSIONS):
            lines.append(f"  {name} = {text(value)} : {types.describe(value.type)}")
        elif isinstance(value, str | int | Type) and value != "":
            lines.append(f"  {name} = {types.describe(value) if isinstance(value, Type) else value}")
        elif isinstance(value, Origin):
            lines += _place(value)
    return lines


def _place(origin: Origin) -> list[str]:
    span = origin.span
    if not 0 <= span.start <= len(span.file.text):
        return []
    line, column = span.file.position(span.start)
    return [f"  {span.file.name}:{line}:{column}: {span.file.line(line).strip()}"]


def _around(at: Expression, root: Expression) -> list[str]:
    """Return an expression with its operands and their types, and the formula it stands in."""
    lines = [f"-> {text(at)} : {types.describe(at.type)}"]
    lines += [f"     {text(operand)} : {types.describe(operand.type)}" for operand in children(at)]
    lines += [f"   in {text(root)}"] if root is not at else []
    return lines + _place(Origin(at.span))
