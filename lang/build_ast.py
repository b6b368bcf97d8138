"""One action for each rule of the grammar: from the values of its symbols to a node.

An action gets the children of its rule in the order of ``mech.lark``, with None for a part in
brackets that is left out; tokens are children too. Terminals come as ``Token``, lists as ``list``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from . import ast
from .diagnostics import Label, Reporter
from .keywords import KEYWORDS
from .lexer import Token
from .source import SourceFile, Span
from .units import UnitError, parse_unit

Children = list[Any]


@dataclass(frozen=True, slots=True)
class Builder:
    """What the actions share: the file, and where to report what the grammar cannot forbid."""

    source: SourceFile
    reporter: Reporter

    def span(self, token: Token) -> Span:
        return Span(self.source, token.start, token.end)


Action = Callable[[Builder, Children, Span], Any]

_ESCAPE = re.compile(r"\\(.)")
_ESCAPES = {'"': '"', "\\": "\\", "n": "\n", "t": "\t"}
_LARGEST_EXPONENT = 400
_LONGEST_NUMBER = 400


def _text(b: Builder, token: Token | None) -> str:
    """Return what a string stands for; an absent one is empty."""
    if token is None:
        return ""
    body = token.text[1:-1]
    if "\\" not in body:
        return body

    def replace(match: re.Match[str]) -> str:
        if match[1] not in _ESCAPES:
            start = token.start + 1 + match.start()
            b.reporter.error(
                "E0129",
                f"'\\{match[1]}' means nothing in a text",
                Span(b.source, start, start + 2),
                help="a backslash itself is written '\\\\'; known are '\\n', '\\t', '\\\"' and '\\\\'",
            )
        return _ESCAPES.get(match[1], match[1])

    return _ESCAPE.sub(replace, body)


def _value(b: Builder, text: str, span: Span) -> Fraction:
    """Return the exact value of a number that a float can hold."""
    exponent = re.search(r"[eE]([+-]?\d+)$", text)
    if len(text) <= _LONGEST_NUMBER and not (exponent and abs(int(exponent[1])) > _LARGEST_EXPONENT):
        value = Fraction(text)
        if value < 2**1023:
            return value
    shown = text if len(text) <= 24 else text[:20] + "..."
    b.reporter.error(
        "E0109",
        f"the number '{shown}' is out of range",
        span,
        help="numbers lie between 1e-400 and 8e307 and have at most 400 digits",
    )
    return Fraction(1)


def _dotted(names: list[Token]) -> str:
    return ".".join(token.text for token in names)


def _list(value: list[Any] | None) -> tuple[Any, ...]:
    return tuple(value) if value else ()


# ---------------------------------------------------------------- files


def start(b: Builder, c: Children, span: Span) -> tuple[ast.Statement, ...]:
    return tuple(c[0])


def import_path(b: Builder, c: Children, span: Span) -> ast.Import:
    return ast.Import(path=_dotted(c[1]), doc=_text(b, c[2]), span=span)


def import_all(b: Builder, c: Children, span: Span) -> ast.Import:
    return ast.Import(path=_dotted(c[1]), names=("*",), doc=_text(b, c[4]), span=span)


def import_alias(b: Builder, c: Children, span: Span) -> ast.Import:
    return ast.Import(path=_dotted(c[3]), alias=c[1].text, doc=_text(b, c[4]), span=span)


def import_names(b: Builder, c: Children, span: Span) -> ast.Import:
    names = tuple(token.text for token in c[4])
    return ast.Import(path=_dotted(c[1]), names=names, doc=_text(b, c[6]), span=span)


def model(b: Builder, c: Children, span: Span) -> ast.Model:
    partial, _, name, doc, body, _, closing, _ = c
    if closing.text != name.text:
        b.reporter.error(
            "E0116",
            f"model '{name.text}' ends with the name '{closing.text}'",
            b.span(closing),
            caption=f"this should be '{name.text}'",
            labels=(Label(b.span(name), "the model begins here"),),
            help=f"write 'end {name.text};'",
        )
    return ast.Model(
        name=name.text,
        name_span=b.span(name),
        body=tuple(body),
        partial=partial is not None,
        doc=_text(b, doc),
        span=span,
    )


def function(b: Builder, c: Children, span: Span) -> ast.Function:
    _, name, _, formals, _, result, _, value, doc, _ = c
    type, dimensions = result or ("", ())
    return ast.Function(
        name=name.text,
        name_span=b.span(name),
        arguments=_list(formals),
        value=value,
        result=type,
        result_dimensions=dimensions,
        doc=_text(b, doc),
        span=span,
    )


def result(b: Builder, c: Children, span: Span) -> tuple[str, tuple[ast.Dimension, ...]]:
    return _dotted(c[1]), _list(c[2])


def formal(b: Builder, c: Children, span: Span) -> ast.Argument:
    type, name, dimensions = c[0]
    return ast.Argument(name=name.text, type=type, dimensions=dimensions, span=span)


def type_definition(b: Builder, c: Children, span: Span) -> ast.Type:
    unit = _text(b, c[4])
    try:
        parse_unit(unit)
    except UnitError as error:
        help = f"did you mean '{error.suggestion}'?" if error.suggestion else ""
        b.reporter.error("E0112", str(error), b.span(c[4]), help=help)
    return ast.Type(name=c[1].text, name_span=b.span(c[1]), unit=unit, doc=_text(b, c[5]), span=span)


# ---------------------------------------------------------------- declarations


def extends(b: Builder, c: Children, span: Span) -> ast.Extends:
    return ast.Extends(base=_dotted(c[1]), modifications=_list(c[2]), doc=_text(b, c[3]), span=span)


def untyped(b: Builder, c: Children, span: Span) -> tuple[str, Token, tuple[ast.Dimension, ...]]:
    return "", c[0], _list(c[1])


def typed(b: Builder, c: Children, span: Span) -> tuple[str, Token, tuple[ast.Dimension, ...]]:
    return _dotted(c[0]), c[1], _list(c[2])


def _declaration(b: Builder, typed: Any, attributes: Any, doc: Token | None, span: Span) -> dict[str, Any]:
    type, name, dimensions = typed
    return {
        "type": type,
        "name": name.text,
        "name_span": b.span(name),
        "dimensions": dimensions,
        "attributes": _list(attributes),
        "doc": _text(b, doc),
        "span": span,
    }


def parameter(b: Builder, c: Children, span: Span) -> ast.Parameter:
    common = _declaration(b, c[2], c[3], c[5], span)
    return ast.Parameter(structural=c[0] is not None, value=c[4], **common)


def coordinate(b: Builder, c: Children, span: Span) -> ast.Coordinate:
    return ast.Coordinate(start=c[3], **_declaration(b, c[1], c[2], c[4], span))


def state(b: Builder, c: Children, span: Span) -> ast.State:
    return ast.State(start=c[3], **_declaration(b, c[1], c[2], c[4], span))


def discrete(b: Builder, c: Children, span: Span) -> ast.Discrete:
    return ast.Discrete(value=c[3], **_declaration(b, c[1], c[2], c[4], span))


def input(b: Builder, c: Children, span: Span) -> ast.Input:
    return ast.Input(value=c[3], **_declaration(b, c[1], c[2], c[4], span))


def output(b: Builder, c: Children, span: Span) -> ast.Output:
    return ast.Output(value=c[3], **_declaration(b, c[1], c[2], c[4], span))


def let(b: Builder, c: Children, span: Span) -> ast.Let:
    return ast.Let(value=c[2], **_declaration(b, c[1], None, c[3], span))


def frame(b: Builder, c: Children, span: Span) -> ast.Frame:
    return ast.Frame(value=c[3], **_declaration(b, ("", c[1], _list(c[2])), None, c[4], span))


def point(b: Builder, c: Children, span: Span) -> ast.Point:
    return ast.Point(value=c[3], **_declaration(b, ("", c[1], _list(c[2])), None, c[4], span))


def component(b: Builder, c: Children, span: Span) -> ast.Component:
    cut, type, name, dimensions, modifications, condition, doc, _ = c
    if len(type) == 1 and type[0].text in KEYWORDS:
        b.reporter.error("E0110", f"'{type[0].text}' cannot begin a statement here", b.span(type[0]))
    common = _declaration(b, (_dotted(type), name, _list(dimensions)), None, doc, span)
    return ast.Component(
        cut=cut is not None, modifications=_list(modifications), condition=condition, **common
    )


def second(b: Builder, c: Children, span: Span) -> Any:
    """Return the second of the children: what stands between brackets or behind a word."""
    return c[1]


def known_start(b: Builder, c: Children, span: Span) -> ast.Start:
    return ast.Start(value=c[1], guess=False, span=span)


def guessed_start(b: Builder, c: Children, span: Span) -> ast.Start:
    return ast.Start(value=c[1], guess=True, span=span)


def extent(b: Builder, c: Children, span: Span) -> ast.Dimension:
    return ast.Dimension(size=c[0], span=span)


def indexed_extent(b: Builder, c: Children, span: Span) -> ast.Dimension:
    return ast.Dimension(size=c[2], name=c[0].text, span=span)


def modify(b: Builder, c: Children, span: Span) -> ast.Modification:
    target, operator, value = c
    kind = "in" if operator.kind == "IN" else operator.text
    if kind != "->" and not isinstance(
        target.operand if isinstance(target, ast.Derivative) else target, ast.Reference
    ):
        b.reporter.error(
            "E0127",
            f"what stands before '{kind}' must be a name",
            target.span,
            help="write 'name = value' or 'der(name) = value'",
        )
    return ast.Modification(target=target, kind=kind, value=value, span=span)


def bare(b: Builder, c: Children, span: Span) -> ast.Modification:
    """Refuse a modification without a sign."""
    value = c[0]
    help = "write 'name = value', 'name ~ guess' or 'a -> b'"
    message = "a modification gives a value to a name"
    if isinstance(value, ast.Call) and value.keywords and not value.arguments:
        message = "a modification of a part inside is written with a dot"
        inner = ", ".join(f"{value.function.name}.{k.name} = {k.value.span.text}" for k in value.keywords)
        help = f"write '{inner}'"
    elif isinstance(value, ast.Reference | ast.Number | ast.Quantity):
        help = f"write 'name = {value.span.text}'"
    b.reporter.error("E0127", message, span, help=help)
    return ast.Modification(target=value, kind="=", value=value, span=span)


# ---------------------------------------------------------------- mechanics


def energy(b: Builder, c: Children, span: Span) -> ast.Energy:
    return ast.Energy(kind=c[0].text, value=c[1], doc=_text(b, c[2]), span=span)


def gravity(b: Builder, c: Children, span: Span) -> ast.Gravity:
    return ast.Gravity(value=c[1], doc=_text(b, c[2]), span=span)


def mass(b: Builder, c: Children, span: Span) -> ast.Mass:
    return ast.Mass(value=c[1], at=c[3], doc=_text(b, c[4]), span=span)


def inertia(b: Builder, c: Children, span: Span) -> ast.Inertia:
    return ast.Inertia(value=c[1], on=c[3], doc=_text(b, c[4]), span=span)


def force(b: Builder, c: Children, span: Span) -> ast.Load:
    _, label, value, _, on, at, source, frame, doc, _ = c
    return ast.Load(
        kind="force",
        label=label,
        value=value,
        on=on,
        at=at,
        source=source,
        frame=frame,
        doc=_text(b, doc),
        span=span,
    )


def torque(b: Builder, c: Children, span: Span) -> ast.Load:
    _, label, value, _, on, source, frame, doc, _ = c
    return ast.Load(
        kind="torque",
        label=label,
        value=value,
        on=on,
        source=source,
        frame=frame,
        doc=_text(b, doc),
        span=span,
    )


def damping(b: Builder, c: Children, span: Span) -> ast.Damping:
    return ast.Damping(label=c[1], value=c[2], on=c[4], doc=_text(b, c[5]), span=span)


def friction(b: Builder, c: Children, span: Span) -> ast.Friction:
    _, label, kinetic, static, _, on, options, doc, _ = c
    return ast.Friction(
        label=label,
        kinetic=kinetic,
        static=static,
        on=on,
        options=tuple(options),
        doc=_text(b, doc),
        span=span,
    )


def constraint(b: Builder, c: Children, span: Span) -> ast.Constraint:
    return ast.Constraint(kind="", label=c[1], left=c[2], right=c[4], doc=_text(b, c[5]), span=span)


def asserted_constraint(b: Builder, c: Children, span: Span) -> ast.Constraint:
    return ast.Constraint(kind=c[0].text, label=c[2], left=c[3], right=c[5], doc=_text(b, c[6]), span=span)


def drive(b: Builder, c: Children, span: Span) -> ast.Drive:
    return ast.Drive(target=c[1], value=c[3], doc=_text(b, c[4]), span=span)


def contact(b: Builder, c: Children, span: Span) -> ast.Contact:
    _, label, gap, restitution, slip, options, doc, _ = c
    friction, static, along = slip or (None, None, None)
    return ast.Contact(
        label=label,
        gap=gap,
        restitution=restitution,
        friction=friction,
        static=static,
        along=along,
        options=tuple(options),
        doc=_text(b, doc),
        span=span,
    )


def slip(b: Builder, c: Children, span: Span) -> tuple[Any, Any, Any]:
    return c[1], c[2], c[3]


def option(b: Builder, c: Children, span: Span) -> ast.Option:
    return ast.Option(name=c[1].text, value=c[3], span=span)


def label(b: Builder, c: Children, span: Span) -> ast.LabelName:
    return ast.LabelName(name=c[0].text, indices=_list(c[1]), span=span)


def place(b: Builder, c: Children, span: Span) -> ast.Place:
    return ast.Place(target=c[1], value=c[3], doc=_text(b, c[4]), span=span)


def closure(b: Builder, c: Children, span: Span) -> ast.Closure:
    return ast.Closure(left=c[1], right=c[3], doc=_text(b, c[4]), span=span)


def initial(b: Builder, c: Children, span: Span) -> ast.Initial:
    return ast.Initial(target=c[1], start=c[2], doc=_text(b, c[3]), span=span)


def final(b: Builder, c: Children, span: Span) -> ast.Final:
    return ast.Final(target=c[1], start=c[2], doc=_text(b, c[3]), span=span)


def equation(b: Builder, c: Children, span: Span) -> ast.Equation:
    if b.source.position(c[0].end)[0] != b.source.position(c[1].span.start)[0]:
        b.reporter.error(
            "E0120",
            "there is no equation section",
            b.span(c[0]),
            help="each statement has its keyword: 'equation der(x) = ..;', 'constraint a = b;', 'let a = ..;'",
        )
    return ast.Equation(left=c[1], right=c[3], doc=_text(b, c[4]), span=span)


def exact(b: Builder, c: Children, span: Span) -> ast.Exact:
    return ast.Exact(left=c[1], right=c[3], doc=_text(b, c[4]), span=span)


def assertion(b: Builder, c: Children, span: Span) -> ast.Assert:
    return ast.Assert(condition=c[1], message=_text(b, c[3]), doc=_text(b, c[4]), span=span)


def experiment(b: Builder, c: Children, span: Span) -> ast.Experiment:
    name = "" if c[1] is None else c[1].text
    return ast.Experiment(name=name, settings=_list(c[2]), doc=_text(b, c[3]), span=span)


def dimensionless(b: Builder, c: Children, span: Span) -> ast.Dimensionless:
    return ast.Dimensionless(doc=_text(b, c[1]), span=span)


def independent(b: Builder, c: Children, span: Span) -> ast.Independent:
    type, name, dimensions = c[1]
    if dimensions:
        b.reporter.error("E0110", "the independent variable is a single number", dimensions[0].span)
    lower, upper = c[2] or (None, None)
    return ast.Independent(name=name.text, type=type, lower=lower, upper=upper, doc=_text(b, c[3]), span=span)


def interval(b: Builder, c: Children, span: Span) -> tuple[Any, Any]:
    return c[1], c[3]


def stationary(b: Builder, c: Children, span: Span) -> ast.Stationary:
    return ast.Stationary(value=c[1], doc=_text(b, c[2]), span=span)


# ---------------------------------------------------------------- blocks


def for_block(b: Builder, c: Children, span: Span) -> ast.For:
    return ast.For(name=c[1].text, range=c[3], body=tuple(c[5]), doc=_text(b, c[8]), span=span)


def if_block(b: Builder, c: Children, span: Span) -> ast.If:
    _, condition, _, body, others, otherwise, _, _, doc, _ = c
    first = ast.IfBranch(condition=condition, body=tuple(body), span=_branch_span(b, condition, body))
    return ast.If(branches=(first, *others), otherwise=_list(otherwise), doc=_text(b, doc), span=span)


def _branch_span(b: Builder, condition: ast.Expression, body: list[Any]) -> Span:
    return condition.span.to(body[-1].span) if body else condition.span


def elseif_block(b: Builder, c: Children, span: Span) -> ast.IfBranch:
    return ast.IfBranch(condition=c[1], body=tuple(c[3]), span=_branch_span(b, c[1], c[3]))


def when_block(b: Builder, c: Children, span: Span) -> ast.When:
    _, condition, _, actions, others, _, _, doc, _ = c
    first = ast.WhenBranch(
        condition=condition, actions=tuple(actions), span=_branch_span(b, condition, actions)
    )
    return ast.When(branches=(first, *others), doc=_text(b, doc), span=span)


def elsewhen_block(b: Builder, c: Children, span: Span) -> ast.WhenBranch:
    return ast.WhenBranch(condition=c[1], actions=tuple(c[3]), span=_branch_span(b, c[1], c[3]))


def reinit(b: Builder, c: Children, span: Span) -> ast.Reinit:
    return ast.Reinit(target=c[2], value=c[4], doc=_text(b, c[6]), span=span)


def assign(b: Builder, c: Children, span: Span) -> ast.Assign:
    return ast.Assign(target=c[0], value=c[2], doc=_text(b, c[3]), span=span)


def terminate(b: Builder, c: Children, span: Span) -> ast.Terminate:
    return ast.Terminate(message=_text(b, c[2]), doc=_text(b, c[4]), span=span)


def impulse(b: Builder, c: Children, span: Span) -> ast.Impulse:
    _, value, _, on, at, source, frame, doc, _ = c
    return ast.Impulse(value=value, on=on, at=at, source=source, frame=frame, doc=_text(b, doc), span=span)


def release(b: Builder, c: Children, span: Span) -> ast.Release:
    return ast.Release(target=c[1], doc=_text(b, c[2]), span=span)


def engage(b: Builder, c: Children, span: Span) -> ast.Engage:
    return ast.Engage(target=c[1], doc=_text(b, c[2]), span=span)


# ---------------------------------------------------------------- expressions


def _subscripted(base: Any, indices: list[Any] | None, span: Span) -> Any:
    return base if indices is None else ast.Subscript(base=base, indices=tuple(indices), span=span)


def _up_to(span: Span, last: Token) -> Span:
    return Span(span.file, span.start, last.end)


def conditional(b: Builder, c: Children, span: Span) -> ast.Conditional:
    first = ast.Branch(condition=c[1], value=c[3], span=c[1].span.to(c[3].span))
    return ast.Conditional(branches=(first, *c[4]), otherwise=c[6], span=span)


def elseif(b: Builder, c: Children, span: Span) -> ast.Branch:
    return ast.Branch(condition=c[1], value=c[3], span=span)


def binary(b: Builder, c: Children, span: Span) -> ast.Binary:
    return ast.Binary(operator=c[1].text, left=c[0], right=c[2], span=span)


def quotient(b: Builder, c: Children, span: Span) -> ast.Binary:
    left, _, right = c
    if isinstance(left, ast.Number) and isinstance(right, ast.Quantity):
        number, unit = f"{left.text}/{right.text}", right.unit
        exact = left.value / right.value if right.value else Fraction(0)
        decimal = f"{float(exact):g}" if right.value else ""
        simple = decimal and Fraction(decimal) == exact
        help = f"write '{decimal} {unit}' or '({number}) {unit}'" if simple else f"write '({number}) {unit}'"
        b.reporter.error(
            "E0114",
            f"'{left.text}/{right.text} {unit}' would divide {left.text} by {right.text} {unit}",
            span,
            caption="the unit belongs to the divisor alone",
            help=f"{help}; if you mean the inverse: '{left.text}/({right.text} {unit})'",
        )
    return ast.Binary(operator="/", left=left, right=right, span=span)


def power(b: Builder, c: Children, span: Span) -> ast.Binary:
    base, sign, exponent = c
    if isinstance(base, ast.Quantity) or (isinstance(base, ast.Parenthesis | ast.Vector) and base.unit):
        b.reporter.error(
            "E0128",
            "a power behind a unit could belong to the number or to the unit",
            b.span(sign),
            help=f"write '({base.span.text})^{exponent.span.text}' for the power of the whole quantity",
        )
    return ast.Binary(operator="^", left=base, right=exponent, span=span)


def unary(b: Builder, c: Children, span: Span) -> ast.Unary:
    return ast.Unary(operator=c[0].text, operand=c[1], span=span)


def number(b: Builder, c: Children, span: Span) -> ast.Number:
    text = c[0].text
    return ast.Number(value=_value(b, text, span), text=text, span=span)


def quantity(b: Builder, c: Children, span: Span) -> ast.Quantity:
    text, unit = c[0].text.split()
    return ast.Quantity(value=_value(b, text, span), unit=unit, text=text, span=span)


def string(b: Builder, c: Children, span: Span) -> ast.String:
    return ast.String(value=_text(b, c[0]), span=span)


def true(b: Builder, c: Children, span: Span) -> ast.Boolean:
    return ast.Boolean(value=True, span=span)


def false(b: Builder, c: Children, span: Span) -> ast.Boolean:
    return ast.Boolean(value=False, span=span)


def time(b: Builder, c: Children, span: Span) -> ast.Time:
    return ast.Time(span=span)


def derivative(b: Builder, c: Children, span: Span) -> ast.Expression:
    _, _, operand, order, closing, indices = c
    base = ast.Derivative(operand=operand, order=order or 1, span=_up_to(span, closing))
    subscripted: ast.Expression = _subscripted(base, indices, span)
    return subscripted


def order(b: Builder, c: Children, span: Span) -> int:
    text = c[1].text
    if not text.isdigit() or not 1 <= int(text) <= 9:
        message = "the order of a derivative is a whole number from 1 to 9"
        b.reporter.error("E0110", message, b.span(c[1]), help="write 'der(x, 2)' for the second derivative")
        return 1
    return int(text)


def previous(b: Builder, c: Children, span: Span) -> ast.Expression:
    base = ast.Previous(operand=c[2], span=_up_to(span, c[3]))
    subscripted: ast.Expression = _subscripted(base, c[4], span)
    return subscripted


def vector(b: Builder, c: Children, span: Span) -> ast.Expression:
    _, elements, closing, unit, indices = c
    base = ast.Vector(
        elements=tuple(elements), unit=unit.text if unit else "", span=_up_to(span, unit or closing)
    )
    subscripted: ast.Expression = _subscripted(base, indices, span)
    return subscripted


def comprehension(b: Builder, c: Children, span: Span) -> ast.Expression:
    _, element, generators, closing, unit, indices = c
    base = ast.Comprehension(
        element=element,
        generators=tuple(generators),
        unit=unit.text if unit else "",
        span=_up_to(span, unit or closing),
    )
    subscripted: ast.Expression = _subscripted(base, indices, span)
    return subscripted


def parenthesis(b: Builder, c: Children, span: Span) -> ast.Expression:
    _, inner, closing, unit, indices = c
    base = ast.Parenthesis(inner=inner, unit=unit.text if unit else "", span=_up_to(span, unit or closing))
    subscripted: ast.Expression = _subscripted(base, indices, span)
    return subscripted


def call(b: Builder, c: Children, span: Span) -> ast.Expression:
    function, _, arguments, closing, indices = c
    positional, named = [], []
    for argument in arguments or ():
        if isinstance(argument, ast.Keyword):
            named.append(argument)
            continue
        if named:
            message = "an argument without a name stands behind a named one"
            b.reporter.error("E0110", message, argument.span, help="put the named arguments last")
        positional.append(argument)
    base = ast.Call(
        function=function,
        arguments=tuple(positional),
        keywords=tuple(named),
        span=_up_to(span, closing),
    )
    subscripted: ast.Expression = _subscripted(base, indices, span)
    return subscripted


def keyword(b: Builder, c: Children, span: Span) -> ast.Keyword:
    return ast.Keyword(name=c[0].text, value=c[2], span=span)


def aggregate(b: Builder, c: Children, span: Span) -> ast.Aggregate:
    return ast.Aggregate(element=c[0], generators=tuple(c[1]), span=span)


def generator(b: Builder, c: Children, span: Span) -> ast.Generator:
    return ast.Generator(name=c[1].text, range=c[3], span=span)


def reference(b: Builder, c: Children, span: Span) -> ast.Reference:
    return ast.Reference(parts=tuple(c[0]), span=span)


def part(b: Builder, c: Children, span: Span) -> ast.Part:
    return ast.Part(name=c[0].text, indices=_list(c[1]), span=span)


def span_of(b: Builder, c: Children, span: Span) -> ast.Range:
    return ast.Range(start=c[0], stop=c[2], span=span)


def stepped_span(b: Builder, c: Children, span: Span) -> ast.Range:
    return ast.Range(start=c[0], stop=c[4], step=c[2], span=span)


ACTIONS: Mapping[str, Action] = {
    "start": start,
    "import_path": import_path,
    "import_all": import_all,
    "import_alias": import_alias,
    "import_names": import_names,
    "model": model,
    "function": function,
    "result": result,
    "formal": formal,
    "type": type_definition,
    "extends": extends,
    "untyped": untyped,
    "typed": typed,
    "parameter": parameter,
    "coordinate": coordinate,
    "state": state,
    "discrete": discrete,
    "input": input,
    "output": output,
    "let": let,
    "frame": frame,
    "point": point,
    "component": component,
    "value": second,
    "condition": second,
    "dimensions": second,
    "modifications": second,
    "clause": second,
    "else_block": second,
    "indices": second,
    "known_start": known_start,
    "guessed_start": guessed_start,
    "extent": extent,
    "indexed_extent": indexed_extent,
    "modify": modify,
    "bare": bare,
    "energy": energy,
    "gravity": gravity,
    "mass": mass,
    "inertia": inertia,
    "force": force,
    "torque": torque,
    "damping": damping,
    "friction": friction,
    "constraint": constraint,
    "asserted_constraint": asserted_constraint,
    "drive": drive,
    "contact": contact,
    "slip": slip,
    "option": option,
    "label": label,
    "place": place,
    "closure": closure,
    "initial": initial,
    "final": final,
    "equation": equation,
    "exact": exact,
    "assert": assertion,
    "experiment": experiment,
    "dimensionless": dimensionless,
    "independent": independent,
    "interval": interval,
    "stationary": stationary,
    "for_block": for_block,
    "if_block": if_block,
    "elseif_block": elseif_block,
    "when_block": when_block,
    "elsewhen_block": elsewhen_block,
    "reinit": reinit,
    "assign": assign,
    "terminate": terminate,
    "impulse": impulse,
    "release": release,
    "engage": engage,
    "conditional": conditional,
    "elseif": elseif,
    "binary": binary,
    "quotient": quotient,
    "power": power,
    "unary": unary,
    "number": number,
    "quantity": quantity,
    "string": string,
    "true": true,
    "false": false,
    "time": time,
    "derivative": derivative,
    "order": order,
    "previous": previous,
    "vector": vector,
    "comprehension": comprehension,
    "parenthesis": parenthesis,
    "call": call,
    "keyword": keyword,
    "aggregate": aggregate,
    "generator": generator,
    "reference": reference,
    "part": part,
    "span": span_of,
    "stepped_span": stepped_span,
}
"""The action of each rule, by its name in the grammar."""
