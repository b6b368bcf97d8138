"""Actions of the grammar that build statements and definitions, where these are more than named children (``rules.py``)."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from .. import ast
from ..diagnostics import Label
from ..grammar.keywords import KEYWORDS
from ..grammar.lexer import Token
from ..source import Span
from ..units import UnitError, parse_unit
from .builder import Action, Builder, Children, dotted, items_of, plain_type, text_of

# ---------------------------------------------------------------- files


def start(b: Builder, c: Children, span: Span) -> tuple[ast.Statement, ...]:
    return tuple(c[0])


def import_names(b: Builder, c: Children, span: Span) -> ast.Import:
    names = tuple(token.text for token in c[4])
    return ast.Import(path=dotted(c[1]), names=names, doc=text_of(b, c[6]), span=span)


def model(b: Builder, c: Children, span: Span) -> ast.Model:
    partial, shape, _, name, doc, body, _, closing, _ = c
    _check_closing(b, "model", name, closing)
    return ast.Model(
        name=name.text,
        name_span=b.span(name),
        body=tuple(body),
        partial=partial is not None,
        shape=shape is not None,
        doc=text_of(b, doc),
        span=span,
    )


def _check_closing(b: Builder, word: str, name: Token, closing: Token) -> None:
    if closing.text != name.text:
        b.reporter.error(
            "E0116",
            f"{word} '{name.text}' ends with the name '{closing.text}'",
            b.span(closing),
            caption=f"this should be '{name.text}'",
            labels=(Label(b.span(name), f"the {word} begins here"),),
            help=f"write 'end {name.text};'",
        )


def function(b: Builder, c: Children, span: Span) -> ast.Function:
    _, name, _, formals, _, result, _, value, doc, _ = c
    if result and result[2]:
        message = f"the results of '{name.text}' need a body"
        help = "write 'return (a, b);' in a body that ends with 'end', or a vector '{a, b}' of one kind"
        b.reporter.error("E0120", message, value.span, help=help)
    return _function(b, name, formals, result, value, (), doc, span)


def routine(b: Builder, c: Children, span: Span) -> ast.Function:
    _, name, _, formals, _, result, doc, body, _, closing, _ = c
    _check_closing(b, "function", name, closing)
    return _function(b, name, formals, result, None, tuple(body), doc, span)


def _function(
    b: Builder,
    name: Token,
    formals: Any,
    result: Any,
    value: ast.Expression | None,
    body: tuple[ast.Statement, ...],
    doc: Token | None,
    span: Span,
) -> ast.Function:
    type, dimensions, results = result or ("", (), ())
    return ast.Function(
        name=name.text,
        name_span=b.span(name),
        arguments=items_of(formals),
        value=value,
        result=type,
        result_dimensions=dimensions,
        results=results,
        body=body,
        doc=text_of(b, doc),
        span=span,
    )


def result(b: Builder, c: Children, span: Span) -> tuple[str, tuple[ast.Dimension, ...], Any]:
    return dotted(c[1]), items_of(c[2]), ()


def results(b: Builder, c: Children, span: Span) -> tuple[str, tuple[ast.Dimension, ...], Any]:
    return "", (), tuple(c[2])


def formal(b: Builder, c: Children, span: Span) -> ast.Argument:
    type, name, dimensions = c[0]
    type = plain_type(b, type, "an argument")
    return ast.Argument(name=name.text, type=type, dimensions=dimensions, span=span)


def type_definition(b: Builder, c: Children, span: Span) -> ast.Type:
    unit = text_of(b, c[4])
    try:
        parse_unit(unit)
    except UnitError as error:
        help = f"did you mean '{error.suggestion}'?" if error.suggestion else ""
        b.reporter.error("E0112", str(error), b.span(c[4]), help=help)
    return ast.Type(name=c[1].text, name_span=b.span(c[1]), unit=unit, doc=text_of(b, c[5]), span=span)


# ---------------------------------------------------------------- declarations


def untyped(b: Builder, c: Children, span: Span) -> tuple[str, Token, tuple[ast.Dimension, ...]]:
    return "", c[0], items_of(c[1])


def typed(b: Builder, c: Children, span: Span) -> tuple[str, Token, tuple[ast.Dimension, ...]]:
    return dotted(c[0]), c[1], items_of(c[2])


def typed_as(b: Builder, c: Children, span: Span) -> tuple[ast.Expression, Token, tuple[ast.Dimension, ...]]:
    return c[2], c[4], items_of(c[5])


def _declaration(b: Builder, typed: Any, attributes: Any, doc: Token | None, span: Span) -> dict[str, Any]:
    type, name, dimensions = typed
    return {
        "type": type if isinstance(type, str) else "",
        "like": None if isinstance(type, str) else type,
        "name": name.text,
        "name_span": b.span(name),
        "dimensions": dimensions,
        "attributes": items_of(attributes),
        "doc": text_of(b, doc),
        "span": span,
    }


def declaration(kind: type[ast.Declaration], field: str, *, attributes: bool = True) -> Action:
    """Return the action of a declaration whose value or start is ``field``; ``attributes``: its type may have some."""

    def action(b: Builder, c: Children, span: Span) -> ast.Declaration:
        typed, *modifications, value, doc, _ = c[1:]
        common = _declaration(b, typed, modifications[0] if attributes else None, doc, span)
        return kind(**{field: value}, **common)

    return action


def parameter(b: Builder, c: Children, span: Span) -> ast.Parameter:
    common = _declaration(b, c[2], c[3], c[5], span)
    value, found = (None, False) if c[4] is None else (c[4].value, c[4].guess)
    if found and c[0] is not None:
        b.reporter.error(
            "E0134",
            "a structural parameter must be known at compile time, so a run cannot solve for it",
            c[4].span,
            help="write '=', or leave 'structural' out",
        )
        found = False
    return ast.Parameter(structural=c[0] is not None, value=value, found=found, **common)


def output(b: Builder, c: Children, span: Span) -> ast.Output:
    value, guess = (None, False) if c[3] is None else (c[3].value, c[3].guess)
    return ast.Output(value=value, guess=guess, **_declaration(b, c[1], c[2], c[4], span))


def unpacked(b: Builder, c: Children, span: Span) -> ast.Unpacked:
    names, value = c[2], c[4]
    lets = tuple(
        ast.Let(
            name=name.text,
            name_span=b.span(name),
            value=ast.Result(call=value, index=k, count=len(names), span=value.span),
            span=span,
        )
        for k, name in enumerate(names)
    )
    return ast.Unpacked(lets=lets, doc=text_of(b, c[5]), span=span)


def return_several(b: Builder, c: Children, span: Span) -> ast.Return:
    return ast.Return(values=(c[2], *c[4]), doc=text_of(b, c[6]), span=span)


def frame(b: Builder, c: Children, span: Span) -> ast.Frame:
    return ast.Frame(value=c[3], **_declaration(b, ("", c[1], items_of(c[2])), None, c[4], span))


def point(b: Builder, c: Children, span: Span) -> ast.Point:
    return ast.Point(value=c[3], **_declaration(b, ("", c[1], items_of(c[2])), None, c[4], span))


def component(b: Builder, c: Children, span: Span) -> ast.Component:
    cut, type, name, dimensions, modifications, condition, doc, _ = c
    if len(type) == 1 and type[0].text in KEYWORDS:
        word, place = type[0].text, b.span(type[0])
        if word in ("var", "return"):
            help = "a model names formulas by 'let' and reports by 'output'"
            b.reporter.error("E0133", f"'{word}' is allowed only in a function", place, help=help)
        else:
            b.reporter.error("E0110", f"'{word}' cannot begin a statement here", place)
    common = _declaration(b, (dotted(type), name, items_of(dimensions)), None, doc, span)
    return ast.Component(
        cut=cut is not None, modifications=items_of(modifications), condition=condition, **common
    )


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
        inner = ", ".join(
            f"{value.function.span.text}.{k.name} = {k.value.span.text}" for k in value.keywords
        )
        help = f"write '{inner}'"
        if [k.name for k in value.keywords] == ["start"]:
            (start,) = value.keywords
            name, start_value = value.function.span.text, start.value.span.text
            help = f"a start is the value itself: '{name} = {start_value}', or '{name} ~ {start_value}' for a guess"
    elif isinstance(value, ast.Reference | ast.Number | ast.Quantity):
        help = (
            f"write 'name = {value.span.text}'; for a part that acts on one side, 'from = {value.span.text}'"
        )
        if isinstance(value, ast.Reference) and (value.span.text == "world" or len(value.parts) == 2):
            help += f"; for a joint between two frames, '{value.span.text} -> other.a'"
    b.reporter.error("E0127", message, span, help=help)
    return ast.Modification(target=value, kind="=", value=value, span=span)


# ---------------------------------------------------------------- mechanics


def two_sided_friction(b: Builder, c: Children, span: Span) -> ast.Friction:
    _, label, (forward, backward), static, _, on, options, doc, _ = c
    static_forward, static_backward = static or (None, None)
    return ast.Friction(
        label=label,
        kinetic=forward,
        static=static_forward,
        on=on,
        options=tuple(options),
        backward=backward,
        static_backward=static_backward,
        doc=text_of(b, doc),
        span=span,
    )


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
        doc=text_of(b, doc),
        span=span,
    )


def contact_of_shapes(b: Builder, c: Children, span: Span) -> ast.ContactOfShapes:
    _, label, of, _, others, terms, doc, _ = c
    friction, restitution, options = terms or (None, None, ())
    return ast.ContactOfShapes(
        label=label,
        of=of,
        others=tuple(others),
        friction=friction,
        restitution=restitution,
        options=tuple(options),
        doc=text_of(b, doc),
        span=span,
    )


def equation(b: Builder, c: Children, span: Span) -> ast.Equation:
    if b.source.position(c[0].end)[0] != b.source.position(c[1].span.start)[0]:
        b.reporter.error(
            "E0120",
            "there is no equation section",
            b.span(c[0]),
            help="each statement has its keyword: 'equation der(x) = ..;', 'constraint a = b;', 'let a = ..;'",
        )
    return ast.Equation(left=c[1], right=c[3], doc=text_of(b, c[4]), span=span)


def experiment(b: Builder, c: Children, span: Span) -> ast.Experiment:
    name = "" if c[1] is None else c[1].text
    return ast.Experiment(name=name, settings=items_of(c[2]), doc=text_of(b, c[3]), span=span)


def study_setting(b: Builder, c: Children, span: Span) -> ast.StudySetting:
    return ast.StudySetting(name=c[0].text, value=c[2], within=c[4] if len(c) > 3 else None, span=span)


# ---------------------------------------------------------------- what is drawn


def draw(b: Builder, c: Children, span: Span) -> ast.Draw:
    _, shape, arguments, on, at, options, doc, _ = c
    given = arguments or ()
    for before, after in pairwise(given):
        if _order(after) < _order(before):
            message = "an argument without a name follows a named one"
            b.reporter.error("E0110", message, after.span, help="put the named ones last, then 's in a:b'")
    return ast.Draw(
        shape=shape.text,
        arguments=tuple(a for a in given if _order(a) == 0),
        keywords=tuple(a for a in given if isinstance(a, ast.Keyword)),
        samples=tuple(a for a in given if isinstance(a, ast.Generator)),
        on=on,
        at=at,
        options=tuple(options),
        doc=text_of(b, doc),
        span=span,
    )


def _order(argument: ast.Node) -> int:
    return 1 if isinstance(argument, ast.Keyword) else 2 if isinstance(argument, ast.Generator) else 0


# ---------------------------------------------------------------- models of curves


def inequality(b: Builder, c: Children, span: Span) -> ast.Inequality | ast.Constraint:
    condition = c[2]
    match condition:
        case ast.Binary(operator="==", left=left, right=right):
            sign = b.source.text.index("==", left.span.end)
            b.reporter.error(
                "E0119", "an equation is written with '='", Span(b.source, sign, sign + 2), help="write '='"
            )
            return ast.Constraint(
                kind="", label=c[1], left=left, right=right, doc=text_of(b, c[3]), span=span
            )
        case ast.Binary(operator="<" | "<=" | ">" | ">="):
            pass
        case _:
            b.reporter.error(
                "E0132",
                "a constraint is an equation or, for a curve, an inequality",
                condition.span,
                caption="this has one side only",
                help=f"write 'constraint {condition.span.text} = 0;' or 'constraint {condition.span.text} >= 0;'",
            )
    return ast.Inequality(label=c[1], condition=condition, doc=text_of(b, c[3]), span=span)


def independent(b: Builder, c: Children, span: Span) -> ast.Independent:
    type, name, dimensions = c[1]
    type = plain_type(b, type, "the independent variable")
    if dimensions:
        b.reporter.error("E0110", "the independent variable is a single number", dimensions[0].span)
    lower, upper = c[2] or (None, None)
    return ast.Independent(
        name=name.text, type=type, lower=lower, upper=upper, doc=text_of(b, c[3]), span=span
    )
