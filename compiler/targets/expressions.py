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
from ..program.branches import GuardedPart, GuardedParts
from ..program.model import Body, Literal, Load, Lookup, Operate, Statement, Store, Value, operands_of
from .literal import LiteralText
from .sincos_batch import turn_groups, turn_places

INDENT = "    "

INLINE = 46
"""Longest expression that is written inside another one."""


class BranchForm(Struct, frozen=True):
    """How a branch is written: ``begin`` of (condition, whether it holds), ``end``; before it the line that makes room for a result, of
    (name, what stands there for now, whether it is a condition), and in it the line that gives it its value.

    ``single``: it is of one number. Then what stands there is that of the other side, and no choice is left after the branch."""

    begin: Callable[[str, bool], str]
    end: str
    room: Callable[[str, str, bool], str]
    result: Callable[[str, str], str]
    nothing: tuple[str, str]
    """What stands there for now, of a number and of a condition."""
    single: bool


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
    branch: BranchForm | None = None
    """How it leaves out what one side of a choice needs; None: it computes all."""
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
    form, found = dialect.branch, GuardedParts({}, {})
    if form is not None:
        found = GuardedParts.of(body)
    groups = turn_groups(body, found.edges()) if dialect.turns else {}
    turned: dict[tuple[int, Value], str] = {}
    for condition in found.conditions():
        uses[condition] += 1
    results: dict[Value, str] = {}
    readers = {a: v for v, s in enumerate(body) for a in operands_of(s)} if found.begins else {}
    chosen: dict[Value, Text] = {}
    indent = ""
    for position, statement in enumerate(body):
        for _ in range(found.ends.get(position, 0)):
            assert form is not None
            indent = indent[: -len(INDENT)]
            if form.end:
                yield f"{indent}{form.end}"
        for branch in found.begins.get(position, ()):
            assert form is not None
            for result in branch.results:
                if result in results:
                    continue
                count += 1
                results[result] = f"v{count}"
                kind = _is_condition(body[result], dialect)
                given = form.nothing[kind]
                choice = readers.get(result, 0) if form.single and uses[result] == 1 else 0
                if choice and (other := _other_side(body[choice], branch)) < position:
                    given = fitting(values[other], 0, kind, dialect)
                    chosen[choice] = Text(f"v{count}", ATOM, kind)
                yield f"{indent}{form.room(f'v{count}', given, kind)}"
            asked = fitting(values[branch.condition], UNARY, True, dialect)
            yield f"{indent}{form.begin(asked, branch.holds)}"
            indent += INDENT
        hint = ""
        if groups and position in groups and dialect.turns:
            array = f"sin_cos_{position}"
            turned = turn_places(array, groups[position])
            angles = [fitting(values[a], 0, False, dialect) for a in groups[position]]
            yield from (f"{indent}{line}" for line in dialect.turns(array, angles))
        match statement:
            case Operate():
                code = statement.code
                known = turned.get((code, statement.operands[0])) if turned else None
                value = chosen.get(position) or (
                    Text(known, ATOM) if known else _operation(statement, body, values, dialect)
                )
                if position in chosen and position not in results:
                    values.append(value)
                    continue
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
                line = dialect.store(statement, fitting(values[operand], 0, False, dialect))
                yield f"{indent}{line}" if line else ""
                values.append(_NOTHING)
                continue
            case Lookup(table, order, operand):
                at = fitting(values[operand], 0, False, dialect)
                value = Text(dialect.lookup(table, order, at), ATOM)
            case _:
                assert_never(statement)
        # what is only stored needs no name, however long it is
        if position in results:
            assert form is not None
            yield f"{indent}{form.result(results[position], value.text)}"
            values.append(Text(results[position], ATOM, value.condition))
            continue
        long = len(value.text) > INLINE and not stored[position]
        if uses[position] > 1 or long or type(statement) is Load:
            if not hint:
                count += 1
                hint = f"v{count}"
            yield f"{indent}{dialect.declare(hint, value.text, value.condition)}"
            value = Text(hint, ATOM, value.condition)
        values.append(value)


_NOTHING = Text("", ATOM)


def _other_side(statement: Statement, branch: GuardedPart) -> Value:
    """Return what a choice between a result of a branch and something else takes on the other side."""
    _, then, otherwise = operands_of(statement)
    return otherwise if branch.holds else then


def _is_condition(statement: Statement, dialect: Dialect) -> bool:
    return type(statement) is Operate and dialect.forms[statement.code].condition


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
