"""What is drawn: statements ``draw``, checked once all else is known, since nothing may depend on them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING

from msgspec import Struct, field

from mechc.lang import ast
from mechc.lang.source import Span
from mechc.lang.units import Dimension
from mechc.suggest import closest

from .. import types
from ..expressions.coordinates import definition_of
from ..model import Apply, Array, Draw, Expression, Kind, Literal, Name, Previous, Query, Sample
from ..names.instance import Instance
from ..names.scope import Flattening, Poisoned, Scope
from ..operands import children
from ..values.evaluate import constant

if TYPE_CHECKING:
    from .shapes import ShapeArgument, ShapeKind

_WANTED = {
    "length": "a length",
    "lengths": "a vector of 2 or 3 lengths",
    "scale": "a length, or a vector of 3 lengths",
    "vector": "a vector of 2 or 3 lengths",
    "axis": "a vector of 2 or 3 numbers",
    "corners": "a list of points in the axes of the frame, as in '{{0, 0}, {1, 0}, {0, 1}} m'",
    "count": "a whole number that is known when compiling",
    "text": "a text",
    "file": "the name of a file",
}


def drawings(statements: Iterable[tuple[ast.Draw, Scope]], flattening: Flattening) -> tuple[Draw, ...]:
    """Return all that is drawn; a shape that is wrong is reported."""
    found: list[Draw] = []
    for statement, scope in statements:
        size, sums = flattening.space.size, len(flattening.integrals)
        try:
            drawn = _Checker(scope, statement).draw()
            if flattening.space.size != size or len(flattening.integrals) != sums:
                flattening.space.size = size
                del flattening.integrals[sums:]
                raise not_in_a_picture(
                    scope, statement.span, "an integral over time, or a frame in a model without"
                )
        except Poisoned:
            continue
        found.append(drawn)
    return tuple(found)


def audible(found: list[tuple[ast.Draw, Scope]], instance: Instance) -> list[tuple[ast.Draw, Scope]]:
    """Return what is drawn of an instance: ``draw none`` silences its components, and the bases of who says so."""
    levels = [scope.level for draw, scope in found if draw.shape == "none" and scope.instance is instance]
    if not levels:
        return found
    least = min(levels)
    return [
        (draw, scope)
        for draw, scope in found
        if scope.instance is instance and scope.level <= least and draw.shape != "none"
    ]


def is_quiet(instance: Instance) -> bool:
    """Tell whether an instance says ``draw none``."""
    items = (item.statement for item in instance.expanded or ())
    return any(isinstance(s, ast.Draw) and s.shape == "none" for s in items)


class _Checker(Struct):
    """One statement while it is checked."""

    scope: Scope
    statement: ast.Draw
    values: dict[str, Expression] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)

    def draw(self) -> Draw:
        scope, statement = self.scope, self.statement
        shape = self.shape()
        samples, inner = self.samples(shape)
        least, _ = shape.points
        points = tuple(self.point(node) for node in self.point_nodes(shape))
        if least and len(points) < least:
            raise self.fail(f"'{statement.shape}' goes through {_points(shape)}", statement.span)
        self.arguments(shape, inner)
        place = self.place(shape)
        self.options()
        for value in (*self.values.values(), *points, *((place,) if place is not None else ())):
            check_alone(scope, value, statement.span)
        return Draw(
            statement.shape, self.values, points, place, self.texts, samples, scope.origin(statement.span)
        )

    def fail(self, message: str, span: Span, help: str = "", caption: str = "") -> Poisoned:
        return self.scope.fail("E1002", message, span, help=help, caption=caption)

    def shape(self) -> ShapeKind:
        from .shapes import SHAPES

        name = self.statement.shape
        if name in SHAPES:
            return SHAPES[name]
        near = closest(name, (*SHAPES, "none"))
        help = f"did you mean '{near}'?" if near else f"the shapes are {', '.join(SHAPES)}"
        raise self.scope.fail("E1001", f"there is no shape '{name}'", self.statement.span, help=help)

    # ------------------------------------------------------------ arguments

    def point_nodes(self, shape: ShapeKind) -> list[ast.Expression | ast.Aggregate]:
        least, most = shape.points
        given = list(self.statement.arguments)
        return given if most is None else given[:most] if least else []

    def arguments(self, shape: ShapeKind, inner: Scope) -> None:
        """Check the arguments after the points, by their order and by name."""
        statement = self.statement
        rest = list(statement.arguments)[len(self.point_nodes(shape)) :]
        if len(rest) > len(shape.arguments):
            extra = rest[len(shape.arguments)]
            raise self.fail(
                f"'{statement.shape}' has {_takes(shape)}", extra.span, caption="this is one too many"
            )
        given = {a.name: node for a, node in zip(shape.arguments, rest, strict=False)}
        known = {a.name: a for a in shape.arguments}
        for keyword in statement.keywords:
            if keyword.name not in known:
                near = closest(keyword.name, known)
                help = f"did you mean '{near}'?" if near else ""
                raise self.fail(
                    f"'{statement.shape}' has no argument '{keyword.name}': it has {_takes(shape)}",
                    keyword.span,
                    help=help,
                )
            if keyword.name in given:
                raise self.fail(f"'{keyword.name}' is given twice", keyword.span)
            given[keyword.name] = keyword.value
        for argument in shape.arguments:
            if argument.name in given:
                self.argument(argument, given[argument.name], inner)
            elif not argument.optional:
                raise self.fail(
                    f"'{statement.shape}' needs its {argument.name}, {_WANTED[argument.kind]}",
                    statement.span,
                    help=f"it has {_takes(shape)}",
                )

    def argument(self, argument: ShapeArgument, node: ast.Expression | ast.Aggregate, scope: Scope) -> None:
        if isinstance(node, ast.Aggregate):
            raise self.fail("'for' makes no argument of a shape", node.span, help="write 's in a:b'")
        value = scope.elaborate(node)
        if argument.kind in ("text", "file"):
            from ..expressions.meshes import mesh_path

            text = constant(value)
            if not isinstance(text, str):
                raise self.wrong(argument, value, node.span)
            of_file = argument.kind == "file"
            self.texts[argument.name] = str(mesh_path(self.scope, value, node.span)) if of_file else text
            return
        if not self.fits(argument, value):
            raise self.wrong(argument, value, node.span)
        self.check_sign(argument, value, node.span)
        self.values[argument.name] = value

    def wrong(self, argument: ShapeArgument, value: Expression, span: Span) -> Poisoned:
        wanted = _WANTED[argument.kind]
        if argument.name == "height":
            wanted = "a length, or a vector of 3 lengths"
        given = types.describe(value.type)
        return self.fail(
            f"'{argument.name}' of '{self.statement.shape}' is {wanted}", span, caption=f"this is {given}"
        )

    def length(self) -> Dimension:
        return types.NUMBER.dimension if self.scope.flattening.dimensionless else types.LENGTH

    def fits(self, argument: ShapeArgument, value: Expression) -> bool:
        kind, shape, dimension = value.type.kind, value.type.shape, value.type.dimension
        if kind not in types.NUMERIC:
            return False
        lengths = dimension == self.length() or types.is_zero(value)
        match argument.kind:
            case "length":
                return lengths and not shape
            case "lengths":
                return lengths and shape in ((2,), (3,))
            case "scale":
                return lengths and shape in ((), (3,))
            case "vector" if argument.name == "height":
                return lengths and shape in ((), (3,))
            case "vector":
                return lengths and shape in ((2,), (3,))
            case "axis":
                return dimension.is_none and shape in ((2,), (3,))
            case "corners":
                return lengths and len(shape) == 2 and shape[0] >= 3 and shape[1] in (2, 3)
            case _:
                number = constant(value)
                return isinstance(number, Fraction) and number.denominator == 1 and 1 <= number <= 200

    def check_sign(self, argument: ShapeArgument, value: Expression, span: Span) -> None:
        """Report a size that is negative whatever the parameters."""
        single = argument.kind == "scale" and not value.type.shape
        if not single and argument.kind not in ("length", "lengths"):
            return
        for item in value.elements if isinstance(value, Array) else (value,):
            number = constant(item)
            if isinstance(number, Fraction) and number < 0:
                raise self.scope.fail(
                    "E1003",
                    f"'{argument.name}' of '{self.statement.shape}' is a size, and negative",
                    span,
                    help="write 'abs(..)' if its sign has another meaning",
                )

    # ------------------------------------------------------------ places

    def point(self, node: ast.Expression | ast.Aggregate) -> Expression:
        if isinstance(node, ast.Aggregate):
            raise self.fail("'for' makes no point of a shape", node.span)
        value = self.scope.elaborate(node)
        if not self.is_place(value) or (
            self.statement.shape == "frame" and value.type.kind is not Kind.FRAME
        ):
            wanted = (
                "a frame"
                if self.statement.shape == "frame"
                else "a frame, a point or a vector of 2 or 3 lengths"
            )
            raise self.scope.fail(
                "E1005",
                f"'{self.statement.shape}' is drawn {'for' if wanted == 'a frame' else 'through'} {wanted}",
                node.span,
                caption=f"this is {types.describe(value.type)}",
            )
        return value

    def is_place(self, value: Expression) -> bool:
        kind, shape = value.type.kind, value.type.shape
        if kind is Kind.FRAME:
            return not shape
        if kind is Kind.POINT:
            return len(shape) == 1
        lengths = value.type.dimension == self.length() or types.is_zero(value)
        return kind in types.NUMERIC and lengths and shape in ((2,), (3,))

    def place(self, shape: ShapeKind) -> Expression | None:
        statement = self.statement
        both = [node for node in (statement.on, statement.at) if node is not None]
        if len(both) == 2 or (both and shape.place == "never") or (not both and shape.place == "always"):
            said = "has no 'on' or 'at'" if shape.place == "never" else "stands 'on' a frame or 'at' a point"
            raise self.scope.fail(
                "E1005",
                f"'{statement.shape}' {said}",
                both[-1].span if both else statement.span,
                help="its points say where it is" if shape.place == "never" else "",
            )
        if not both:
            return None
        value = self.scope.elaborate(both[0])
        if statement.on is not None and (value.type.kind is not Kind.FRAME or value.type.shape):
            help = "write 'at' for a point" if self.is_place(value) else ""
            raise self.scope.fail(
                "E1005",
                "a shape is drawn 'on' a frame",
                both[0].span,
                caption=f"this is {types.describe(value.type)}",
                help=help,
            )
        if not self.is_place(value):
            raise self.scope.fail(
                "E1005",
                "a shape is drawn 'at' a frame, a point or a vector of 2 or 3 lengths",
                both[0].span,
                caption=f"this is {types.describe(value.type)}",
            )
        return value

    # ------------------------------------------------------------ variables of curves, and options

    def samples(self, shape: ShapeKind) -> tuple[tuple[Sample, ...], Scope]:
        given = self.statement.samples
        if len(given) != shape.samples:
            wanted = (
                "no variable",
                "one variable, as in 's in 0 m:1 m'",
                "two, as in 'x in 0 m:1 m, y in 0 m:1 m'",
            )
            raise self.fail(
                f"'{self.statement.shape}' has {wanted[shape.samples]}",
                given[-1].span if given else self.statement.span,
            )
        found = [self.sample(node) for node in given]
        local = {
            node.name: Name(type=sample.lower.type, span=node.span, name=sample.variable)
            for node, sample in zip(given, found, strict=True)
        }
        return tuple(found), self.scope.with_local(local)

    def sample(self, node: ast.Generator) -> Sample:
        bounds = node.range
        if not isinstance(bounds, ast.Range) or bounds.step is not None:
            raise self.fail("a variable of a shape runs over 'a:b'", bounds.span)
        lower, upper = self.scope.elaborate(bounds.start), self.scope.elaborate(bounds.stop)
        first, last = types.numeric(lower.type), types.numeric(upper.type)
        zero = types.is_zero(lower) or types.is_zero(upper)
        alike = first.dimension == last.dimension or zero
        if (
            first.kind not in types.NUMERIC
            or last.kind not in types.NUMERIC
            or first.shape
            or last.shape
            or not alike
        ):
            raise self.fail(
                "both ends of a range are numbers of one unit",
                bounds.span,
                caption=f"from {types.describe(lower.type)} to {types.describe(upper.type)}",
            )
        angle = first.angle or last.angle
        dimension = last.dimension if types.is_zero(lower) else first.dimension
        type = types.real(dimension, angle=angle)
        lower = types.retyped_zero(lower, dimension, angle) if types.is_zero(lower) else lower
        upper = types.retyped_zero(upper, dimension, angle) if types.is_zero(upper) else upper
        flattening = self.scope.flattening
        flattening.quadratures += 1
        return Sample(f"{node.name}#{flattening.quadratures}", type, lower, upper)

    def options(self) -> None:
        for option in self.statement.options:
            from .shapes import COLOURS

            if option.name not in ("colour", "color"):
                raise self.scope.fail(
                    "E0415",
                    f"a shape has no option '{option.name}'",
                    option.span,
                    help="the option is colour",
                )
            text = constant(self.scope.elaborate(option.value))
            if not isinstance(text, str):
                raise self.scope.fail("E1006", "a colour is a text", option.value.span)
            if text not in COLOURS and not re.fullmatch("#[0-9a-fA-F]{6}", text):
                near = closest(text, COLOURS)
                raise self.scope.fail(
                    "E1006",
                    f"there is no colour '{text}'",
                    option.value.span,
                    help=f"did you mean '{near}'?"
                    if near
                    else '"#rrggbb" is any, others have names: ' + ", ".join(COLOURS),
                )
            self.texts["colour"] = COLOURS.get(text, text.casefold())


def _takes(shape: ShapeKind) -> str:
    names = [f"{a.name}{' (if wanted)' if a.optional else ''}" for a in shape.arguments]
    if shape.points[1] != 0:
        names.insert(0, _points(shape))
    return ", ".join(names) or "no arguments"


def _points(shape: ShapeKind) -> str:
    least, most = shape.points
    return "at least 2 points" if most is None else "1 point" if least == 1 else "2 points"


def check_alone(scope: Scope, value: Expression, span: Span) -> None:
    """Report what a picture cannot ask without changing the model: answers of the equations, memory, clocks."""
    for part in _parts(scope.flattening, value):
        match part:
            case Query(function=function):
                raise not_in_a_picture(scope, span, f"'{function}'")
            case Previous():
                raise not_in_a_picture(scope, span, "'pre'")
            case Apply(function="sample" | "initial" | "delay" as function):
                raise not_in_a_picture(scope, span, f"'{function}'")
            case _:
                pass


def not_in_a_picture(scope: Scope, span: Span, what: str) -> Poisoned:
    return scope.fail(
        "E1007",
        f"{what} cannot be asked for a picture: it would change the model",
        span,
        help="declare an output, as in 'output R = reaction(pin);', and draw that",
    )


def _parts(flattening: Flattening, value: Expression) -> Iterator[Expression]:
    """Yield all that an expression is made of, through abbreviations, but not through outputs."""
    seen: set[int | str] = set()
    pending = [value]
    while pending:
        at = pending.pop()
        key = at.name if isinstance(at, Name) else id(at)
        if key in seen or isinstance(at, Literal):
            continue
        seen.add(key)
        yield at
        if not isinstance(at, Name):
            pending.extend(children(at))
            continue
        member = flattening.definitions.get(at.name)
        if member is not None and not isinstance(member.declaration, ast.Output):
            pending.extend(definition_of(flattening, at.name))
