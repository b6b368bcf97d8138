"""A call of a built-in function while its types are checked, and the questions that rules ask about it."""

from __future__ import annotations

from msgspec import Struct

from mechc.lang import ast
from mechc.lang.builtins import BUILTINS
from mechc.lang.diagnostics import Label
from mechc.lang.units import Dimension

from .. import types
from ..instances.declared_types import unit_help
from ..model import Apply, Expression, Kind, Type
from ..names.scope import Poisoned, Scope


class ElaboratedCall(Struct):
    """``arguments`` are elaborated; ``nodes`` are the same as written."""

    scope: Scope
    node: ast.Call
    name: str
    arguments: list[Expression]

    @property
    def nodes(self) -> tuple[ast.Expression, ...]:
        return self.node.arguments

    def apply(self, type: Type, *arguments: Expression, function: str = "") -> Apply:
        """Return the call as an expression of ``type``."""
        return Apply(
            type=type,
            span=self.node.span,
            function=function or self.name,
            arguments=arguments or tuple(self.arguments),
        )

    def wrong(self, index: int, wanted: str, code: str = "E0304", help: str = "") -> Poisoned:
        """Report an argument that is not what the function takes."""
        given = types.describe(self.arguments[index].type)
        return self.scope.fail(
            code,
            f"'{self.name}' takes {wanted}, this is {given}",
            self.nodes[index].span,
            caption=f"this is {given}",
            help=help,
        )

    def scalar(self, index: int) -> Type:
        """Return the type of an argument that must be a single number."""
        type = self.arguments[index].type
        if type.kind not in types.NUMERIC:
            raise self.wrong(index, "a number", "E0308")
        if type.shape:
            raise self.wrong(
                index,
                "one value",
                "E0321",
                f"write '{{{self.name}(x[i]) for i in 1:{type.shape[0]}}}'"
                if BUILTINS[self.name].most == 1
                else "",
            )
        return type

    def number(self, index: int, wanted: str = "a number") -> None:
        """Check that an argument is a single number without unit."""
        type = self.scalar(index)
        if not type.dimension.is_none:
            raise self.wrong(index, wanted)

    def vector(self, index: int, sizes: tuple[int, ...] = (), wanted: str = "a vector") -> Type:
        """Return the type of an argument that must be a vector, of one of the sizes if they are given."""
        type = types.numeric(self.arguments[index].type)
        if type.kind is not Kind.REAL or len(type.shape) != 1:
            raise self.wrong(index, wanted, "E0305")
        if sizes and type.shape[0] not in sizes:
            raise self.wrong(index, f"a vector of {' or '.join(map(str, sizes))} components", "E0305")
        return type

    def frame(self, index: int) -> Expression:
        """Return an argument that must be a frame."""
        argument = self.arguments[index]
        if argument.type.kind is not Kind.FRAME or argument.type.shape:
            raise self.wrong(index, "a frame", "E0332")
        return argument

    def place(self, index: int) -> Expression:
        """Return an argument that must be a frame or a point."""
        argument = self.arguments[index]
        type = argument.type
        if type.kind is Kind.FRAME and not type.shape:
            return argument
        if type.kind is Kind.POINT and len(type.shape) == 1:
            return argument
        raise self.wrong(
            index, "a frame or a point", "E0332", "a point is declared as 'point P = F * {x, y};'"
        )

    def same(self, first: int, second: int) -> Type:
        """Return the common type of two arguments that must be alike."""
        a, b = self.arguments[first], self.arguments[second]
        if a.type.dimension == b.type.dimension or types.is_zero(b):
            return types.numeric(a.type)
        if types.is_zero(a):
            return types.numeric(b.type)
        given, wanted = types.describe(b.type), types.describe(a.type)
        raise self.scope.fail(
            "E0302",
            f"the arguments of '{self.name}' differ: one is {wanted}, another is {given}",
            self.nodes[second].span,
            caption=f"this is {given}",
            labels=(Label(self.nodes[first].span, f"this is {wanted}"),),
            help=unit_help(b, a.type, self.nodes[second].span)
            or unit_help(a, b.type, self.nodes[first].span),
        )

    def dimension(self, dimension: Dimension) -> Dimension:
        """Return a dimension, or none in a dimensionless model."""
        return types.NUMBER.dimension if self.scope.flattening.dimensionless else dimension

    def space(self) -> int:
        return self.scope.flattening.space.known(self.scope, self.node.span)

    def require_space(self, size: int, word: str = "") -> None:
        self.scope.flattening.space.require(size, self.scope, self.node.span, word or f"'{self.name}'")
