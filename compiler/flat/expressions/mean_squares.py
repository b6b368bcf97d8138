"""The root of the mean square of a signal since the start, ``rms(e)``, of an acceleration as people feel it where a weighting is named.

It is sqrt((I + d e^2)/(T + d)) with the integrals I of e^2 and T of 1, and a time d that is lost in any other: so it is abs(e) at the start, the
limit, where no time has passed. A weighting is a chain of filters of second order at rest at the start, each with two hidden states.
"""

from __future__ import annotations

from fractions import Fraction

from mechc.lang import ast
from mechc.lang.units import Dimension
from mechc.runtime.weightings import WEIGHTINGS

from .. import types
from ..model import Apply, Expression, Literal, Name, Type
from ..operands import unbound_names
from .functions import combined
from .signature import ElaboratedCall

NO_TIME = Fraction(1, 10**200)


def rms(call: ElaboratedCall) -> Expression:
    """Return the value of ``rms(e, weighting = "…")``."""
    interval = call.scope.flattening.interval
    if interval is not None:
        raise call.scope.fail("E0552", "'rms' is a mean over time, and a curve has none", call.node.span)
    call.arguments = [call.scope.elaborate(node) for node in call.nodes]
    type = call.scalar(0)
    if unbound_names(call.arguments[0]):
        raise call.scope.fail(
            "E0315",
            "a mean over time cannot stand in the body of a function, or inside of an integral",
            call.node.span,
            caption="what it is of has a name only there",
        )
    means = _MeanSquare(call)
    e = call.arguments[0]
    for keyword in call.node.keywords:
        e = means.weighted(e, keyword.value)
    square = means.product(e, e)
    time = call.scope.flattening.time_type
    none = Literal(type=time, span=call.node.span, value=NO_TIME)
    one = Literal(type=types.NUMBER, span=call.node.span, value=Fraction(1))
    above = means.sum(means.integral(square), means.product(none, square))
    below = means.sum(means.integral(one), none)
    mean = means.apply("divide", square.type, above, below)
    return means.apply("sqrt", types.real(type.dimension, angle=type.angle), mean)


class _MeanSquare:
    def __init__(self, call: ElaboratedCall) -> None:
        self.call, self.flattening = call, call.scope.flattening

    def apply(self, function: str, type: Type, *arguments: Expression) -> Apply:
        return Apply(type=type, span=self.call.node.span, function=function, arguments=arguments)

    def product(self, *items: Expression) -> Expression:
        return combined(list(items), "multiply", self.call.node.span)

    def sum(self, *items: Expression) -> Expression:
        return combined(list(items), "add", self.call.node.span)

    def integral(self, body: Expression) -> Name:
        """Return a hidden state that begins at zero and whose rate is ``body``."""
        name, type = self._state(body.type.dimension)
        self._follow(name, body, type)
        return name

    def _state(self, rate: Dimension) -> tuple[Name, Type]:
        """Return a hidden state by its rate, which is told later. States of one call and of calls within are numbered as they come."""
        flattening, span = self.flattening, self.call.node.span
        flattening.integrals_named += 1
        type = types.real(rate * flattening.time_type.dimension)
        return Name(type=type, span=span, name=f"integral[{flattening.integrals_named}]"), type

    def _follow(self, name: Name, body: Expression, type: Type) -> None:
        self.flattening.integrals.append((name.name, body, type, self.call.scope.origin(self.call.node.span)))

    def weighted(self, e: Expression, named: ast.Expression) -> Expression:
        """Return an acceleration after the filter of a weighting."""
        scope = self.call.scope
        chosen = scope.elaborate(named)
        known = chosen.value if isinstance(chosen, Literal) else None
        if not isinstance(known, str) or known not in WEIGHTINGS:
            given = f", not '{known}'" if isinstance(known, str) else ""
            raise scope.fail(
                "E0333",
                f"the weighting is one of {', '.join(WEIGHTINGS)}{given}",
                named.span,
                help='as in weighting = "ISO2631-Wk"',
            )
        if e.type.dimension != types.ACCELERATION or self.flattening.dimensionless:
            raise self.call.wrong(0, f"an acceleration in m/s^2 for '{known}'")
        for above, below in WEIGHTINGS[known].sections():
            e = self._filtered(e, above, below)
        return e

    def _filtered(self, u: Expression, above: tuple[float, ...], below: tuple[float, ...]) -> Expression:
        """Return b(s)/a(s) u for quadratics with a(0) = 1: p' = q, q' = (u - p - a1 q)/a2, and b0 p + b1 q + b2 q' of these."""
        time = self.flattening.time_type.dimension
        p, p_type = self._state(u.type.dimension / time)
        q, q_type = self._state(u.type.dimension / time / time)

        def factor(number: float, dimension: Dimension) -> Literal:
            return Literal(type=types.real(dimension), span=self.call.node.span, value=Fraction(number))

        left = self.sum(
            u, self.product(factor(-1, types.NUMBER.dimension), p), self.product(factor(-below[1], time), q)
        )
        rate = self.apply(
            "divide", types.real(u.type.dimension / time / time), left, factor(below[2], time * time)
        )
        self._follow(p, q, p_type)
        self._follow(q, rate, q_type)
        terms = [
            self.product(factor(above[0], types.NUMBER.dimension), p), self.product(factor(above[1], time), q),
            self.product(factor(above[2], time * time), rate),
        ]  # fmt: skip
        return self.sum(*(term for number, term in zip(above, terms, strict=True) if number))
