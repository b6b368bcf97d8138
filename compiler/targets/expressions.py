"""Statements as nested expressions: what the C and the Python printer share.

A value used once is written where it is used, as long as lines stay readable; any other gets a name. The
order of the arithmetic is that of the program, because each operation keeps its own operands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import assert_never

from msgspec import Struct

from ..graph.operation import ATOM, PRODUCT, UNARY, Form
from ..graph.operations import ADD, COS, SIN, SUB
from ..program.model import Body, Literal, Load, Lookup, Operate, Store, Value, operands_of
from .literal import LiteralText
from .sincos_batch import turn_groups, turn_places

INLINE = 46
"""Longest expression that is written inside another one."""


class Dialect(Struct, frozen=True):
    """A target language: one form for each operation, and how it writes everything else."""

    forms: Mapping[int, Form]
    literal: Callable[[Fraction], tuple[str, int]]
    """An exact constant as text, and how strongly it binds."""
    lookup: Callable[[int, int, str], str]
    """The call for (table, order, argument)."""
    declare: Callable[[str, str, bool], str]
    """The line that names a value: (name, expression, whether it is a condition)."""
    store: Callable[[Store, str], str]
    """The line that stores an expression."""
    as_condition: Form
    as_number: Form
    number: str = ""
    """What makes a number of Python one of the library, of which a quotient by zero is infinite or undefined, as in C."""
    quiet: str = ""
    """The line above a function that computes such numbers, where the library would warn of them."""
    turns: Callable[[str, Sequence[str]], Iterator[str]] | None = None
    """The lines that fill an array of a name with sines and cosines of several angles (turns.py)."""


class Text(Struct, gc=False):
    """A value as it is written where it is used; ``plain``: it is an argument of the function with a name."""

    text: str
    binds: int
    condition: bool = False
    plain: bool = False


def lines(body: Body, dialect: Dialect, names: Mapping[tuple[str, int], str]) -> Iterator[str]:
    """Yield the lines of a body: named values and stores, in order."""
    body = tuple(body)
    uses, stored = _uses(body)
    values: list[Text] = []
    count = 0
    groups = turn_groups(body) if dialect.turns else {}
    turned: dict[tuple[int, Value], str] = {}
    for position, statement in enumerate(body):
        hint = ""
        if groups and position in groups and dialect.turns:
            array = f"sin_cos_{position}"
            turned = turn_places(array, groups[position])
            yield from dialect.turns(array, [fitting(values[a], 0, False, dialect) for a in groups[position]])
        match statement:
            case Operate():
                code = statement.code
                known = turned.get((code, statement.operands[0])) if turned else None
                value = Text(known, ATOM) if known else _operation(statement, body, values, dialect)
                if code == SIN or code == COS:  # noqa: SIM109, the fastest way to ask
                    argument = values[statement.operands[0]]
                    if argument.plain:
                        hint = f"{'sin' if code == SIN else 'cos'}_{argument.text}"
            case Load(array, index):
                name = names.get((array, index), "")
                if name:
                    values.append(Text(name, ATOM, False, name.isidentifier()))
                    continue
                value = Text(f"{array}[{index}]", ATOM)
            case Literal(number):
                values.append(Text(*dialect.literal(number)))
                continue
            case Store(_, _, operand):
                yield dialect.store(statement, fitting(values[operand], 0, False, dialect))
                values.append(_NOTHING)
                continue
            case Lookup(table, order, operand):
                at = fitting(values[operand], 0, False, dialect)
                value = Text(dialect.lookup(table, order, at), ATOM)
            case _:
                assert_never(statement)
        # what is only stored needs no name, however long it is
        long = len(value.text) > INLINE and not stored[position]
        if uses[position] > 1 or long or type(statement) is Load:
            if not hint:
                count += 1
                hint = f"v{count}"
            yield dialect.declare(hint, value.text, value.condition)
            value = Text(hint, ATOM, value.condition)
        values.append(value)


_NOTHING = Text("", ATOM)


def _uses(body: Body) -> tuple[list[int], bytearray]:
    """Return how often each value is used, and whether it is stored."""
    uses = [0] * len(body)
    stored = bytearray(len(body))
    for statement in body:
        if type(statement) is Operate:
            for operand in statement.operands:
                uses[operand] += 1
        else:
            for operand in operands_of(statement):
                uses[operand] += 1
            if type(statement) is Store:
                stored[statement.value] = 1
    return uses, stored


def _operation(statement: Operate, body: Body, values: Sequence[Text], dialect: Dialect) -> Text:
    """Return an operation with its operands in place."""
    operands = statement.operands
    literal = statement.code <= SUB and isinstance(body[operands[1]], Literal)
    return applied(statement.code, [values[a] for a in operands], literal, dialect)


def applied(code: int, operands: Sequence[Text], literal: bool, dialect: Dialect) -> Text:
    """Return an operation on operands; ``literal``: whether the second one is a constant."""
    form = dialect.forms[code]
    template = form.template
    parts = [
        value.text
        if value.binds >= need and value.condition is condition
        else fitting(value, need, condition, dialect)
        for value, need, condition in zip(operands, form.needs, form.conditions, strict=False)
    ]
    if code <= SUB and literal and parts[1][0] == "-":
        # x + -2 is x - 2, and x - -2 is x + 2, also when rounded
        template, parts[1] = ("{} - {}" if code == ADD else "{} + {}"), parts[1][1:]
    return Text(template.format(*parts), form.binds, form.condition)


def fitting(value: Text, need: int, condition: bool, dialect: Dialect) -> str:
    """Return an operand with parentheses where it binds too weakly, converted where the kind differs."""
    if value.condition == condition:
        return value.text if value.binds >= need else f"({value.text})"
    form = dialect.as_condition if condition else dialect.as_number
    inner = value.text if value.binds >= form.needs[0] else f"({value.text})"
    text = form.template.format(inner)
    return text if form.binds >= need else f"({text})"


def multiple_of_pi(c: LiteralText, name: str) -> tuple[str, int]:
    """Return n pi / d as text, with ``name`` for pi, and how strongly it binds."""
    signed = c.text in ("", "-")
    text = f"{c.text}{name}" if signed else f"{c.text} * {name}"
    if c.divisor:
        return f"{text} / {c.divisor}", PRODUCT
    return text, PRODUCT if not signed else UNARY if c.text else ATOM
