"""Experiments that are many runs: values drawn at random, and what is kept of each. The runtime gets them as texts, in SI."""

from __future__ import annotations

from fractions import Fraction

from mechc.lang import ast

from .. import model, types
from ..instances.declared_types import fit
from ..model import Expression
from ..names.scope import Scope
from ..values.evaluate import constant, not_structural

SETTINGS = ("keep", "samples", "seed", "sampling", "errors")
"""Names that an experiment of many runs sets, where no variable of the model has them."""
VARY = "vary"
DISTRIBUTIONS = {
    "normal": ("mean", "standard deviation"),
    "uniform": ("lower end", "upper end"),
    "lognormal": ("median", "standard deviation of the logarithm"),
    "triangular": ("lowest value", "likeliest value", "highest value"),
}


def is_spread(node: ast.Modification) -> bool:
    """Whether a setting draws its values at random: ``theta ~ normal(1 rad, 0.01 rad)``."""
    value = node.value
    return (
        node.kind == "~"
        and isinstance(value, ast.Call)
        and not value.keywords
        and len(value.function.parts) == 1
        and value.function.parts[0].name in DISTRIBUTIONS
    )


def spread(scope: Scope, node: ast.Modification, left: Expression) -> str:
    """Check a distribution and return it as a text with numbers in SI."""
    call = node.value
    assert isinstance(call, ast.Call)
    kind = call.function.parts[0].name
    wanted = DISTRIBUTIONS[kind]
    if left.type.shape or left.type.kind is model.Kind.ROTATION:
        raise scope.fail(
            "E0809",
            "a random value is that of one parameter, initial value or input",
            node.target.span,
            caption=f"this is {types.describe(left.type)}",
        )
    if len(call.arguments) != len(wanted):
        raise scope.fail(
            "E0809",
            f"'{kind}' takes {len(wanted)} values: {', '.join(wanted)}",
            call.span,
            caption=f"{len(call.arguments)} are given",
        )
    numbers = []
    for place, argument in enumerate(call.arguments):
        of_logarithm = kind == "lognormal" and place == 1
        value = scope.elaborate(argument)
        value = fit(
            scope, value, types.NUMBER if of_logarithm else left.type, argument.span, name=wanted[place]
        )
        number = constant(value)
        if not isinstance(number, Fraction):
            raise not_structural(scope, argument, value, "the numbers of a distribution")
        numbers.append(repr(float(number)))
    return f"{''.join(node.target.span.text.split())} ~ {kind}({', '.join(numbers)})"


def setting(scope: Scope, name: str, node: ast.Modification) -> Expression:
    """Return a setting of an experiment of many runs as a text that the runtime reads."""
    if node.kind != "=":
        raise scope.fail("E0804", f"'{name}' is set by '='", node.span, help=f"write '{name} = ...'")
    text = " ".join(node.value.span.text.split())
    if name == "sampling" or (name == "errors" and text.startswith('"')):
        text = text.strip('"')
    return text_of(node, text)


def text_of(node: ast.Modification, text: str) -> Expression:
    return model.Literal(type=types.STRING, span=node.value.span, value=text)
