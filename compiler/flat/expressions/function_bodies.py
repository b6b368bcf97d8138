"""Bodies of functions, step by step: what each name is worth where it stands, and what is returned on which condition.

Loops are written out. Where a condition is not known when compiling, both branches are taken, and a choice is made
of each value in which they differ. What is more than a name becomes a name of its own (``Where``), so that an
expression grows with the steps that were taken and not with how often their values are used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Never

from msgspec import Struct, field

from mechc.lang import ast
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span
from mechc.suggest import closest

from .. import types
from ..instances.declared_types import broadcast, declared_type, fit
from ..instances.instantiate import extents
from ..instances.members import is_typed, stated_type
from ..model import Array, Element, Expression, Kind, Literal, Name, Type, Where
from ..names.scope import Scope
from ..operands import free_names, written_size
from ..values.evaluate import constant, elements, values_of
from ..values.indexing import positions
from .choices import ChoiceBranch, choice
from .operators import require_truth

LARGEST = 200_000
"""Most operations of a body that is written out."""

Made = Callable[[], Expression]
Results = Callable[[Scope, ast.Call], Sequence[Made]]
"""Of a call, what makes each of its results."""

_NAMED = (Kind.REAL, Kind.INTEGER, Kind.BOOLEAN)


class Bindings(Struct):
    """Names for values on the way, in order."""

    names: list[str] = field(default_factory=list)
    values: list[Expression] = field(default_factory=list)

    def name(self, scope: Scope, name: str, value: Expression) -> Expression:
        """Return a value that may be used often: itself where it is little, else a new name for it."""
        if _is_little(value) or value.type.kind not in _NAMED:
            return value
        scope.flattening.quadratures += 1
        own = f"{name}#{scope.flattening.quadratures}"
        self.names.append(own)
        self.values.append(value)
        return Name(type=value.type, span=value.span, name=own)

    def around(self, scope: Scope, body: Expression, span: Span, function: str) -> Expression:
        """Return a value with the names that it needs. Reports one that is too long."""
        needed = dict.fromkeys(free_names(body))
        kept = []
        for k in reversed(range(len(self.names))):
            if self.names[k] in needed:
                needed |= free_names(self.values[k])
                kept.append(k)
        if not kept:
            return body
        names = tuple(self.names[k] for k in reversed(kept))
        values = tuple(self.values[k] for k in reversed(kept))
        result = Where(type=body.type, span=span, names=names, values=values, body=body)
        if written_size(result) > LARGEST:
            raise scope.fail(
                "E0419",
                f"written out, '{function}' has more than {LARGEST} operations here",
                span,
                help="its loops are written out: use fewer steps",
            )
        return result


def _is_little(value: Expression) -> bool:
    if isinstance(value, Array):
        return all(map(_is_little, value.elements))
    return isinstance(value, Literal | Name) or (isinstance(value, Element) and _is_little(value.base))


class _Known(Struct):
    """What a name in a body is: ``word`` says it; of a variable ``type`` is None while its value is a bare 0."""

    word: str
    span: Span
    type: Type | None = None
    typed_by: Span | None = None


class _Fork(Struct, frozen=True):
    """What is returned if a condition holds, and if it does not; None where the steps go on."""

    condition: Expression
    then: _Exit
    otherwise: _Exit


class _Returned(Struct, frozen=True):
    values: tuple[Expression, ...]
    statement: ast.Return


_Exit = _Fork | _Returned | None
_Values = dict[str, Expression]


class FunctionBody:
    """One call of a function with a body."""

    def __init__(self, scope: Scope, function: ast.Function, results: Results) -> None:
        self.scope = scope
        self.function = function
        self.results_of = results
        self.bindings = Bindings()
        self.known: dict[str, _Known] = {}

    def argument(self, formal: ast.Argument, value: Expression) -> Expression:
        """Name the value of an argument."""
        self.known[formal.name] = _Known("an argument", formal.span)
        return self.bindings.name(self.scope, formal.name, value)

    def results(self, values: _Values) -> list[Expression]:
        """Take all steps from the values of the arguments, and return what the function gives."""
        for name in values.keys() - self.known.keys():
            self.known[name] = _Known("the size of an argument", self.function.name_span)
        left, found = self.steps(self.function.body, values)
        if left is not None:
            self.no_return()
        return [self.chosen(found, k) for k in range(max(1, len(self.function.results)))]

    def no_return(self) -> Never:
        function = self.function
        returns = any(_returns(s) for s in function.body)
        raise self.scope.fail(
            "E0221",
            f"function '{function.name}' may end without 'return'"
            if returns
            else f"function '{function.name}' returns nothing",
            function.name_span,
            caption="not every way through it returns a value" if returns else "",
            help="end it with 'return e;'"
            if not returns
            else "return a value after the last 'if' or loop, too",
        )

    # ------------------------------------------------------------ steps

    def steps(self, body: Sequence[ast.Statement], values: _Values) -> tuple[_Values | None, _Exit]:
        """Return the values after some steps, None where all ways have returned, and what was returned."""
        found: list[_Exit] = []
        left: _Values | None = values
        for before, statement in zip((None, *body), body, strict=False):
            if before is not None and _always_returns(before):
                raise self.scope.fail(
                    "E0221",
                    "nothing reaches this",
                    statement.span,
                    caption="every way before it has returned",
                    help="remove it, or return under a condition",
                )
            if left is None:  # by a condition that is known
                break
            left, here = self.step(statement, left)
            found.append(here)
        return left, _one_behind_the_other(found)

    def step(self, statement: ast.Statement, values: _Values) -> tuple[_Values | None, _Exit]:
        match statement:
            case ast.Let() | ast.Var():
                self.declare(statement, values)
            case ast.Unpacked():
                self.unpack(statement, values)
            case ast.Assign():
                self.assign(statement, values)
            case ast.Return():
                return None, self.returned(statement, values)
            case ast.For():
                return self.loop(statement, values)
            case ast.If():
                return self.branches(statement, statement.branches, values)
            case _:
                raise AssertionError(type(statement))
        return values, None

    def at(self, values: _Values) -> Scope:
        """Return the scope of expressions that see these values."""
        outer = self.scope
        return Scope(outer.flattening, None, outer.namespace, values, outer.calls, outer.in_event)

    def free(self, name: str, span: Span, values: _Values) -> None:
        """Report a name that means something here already."""
        if name in values:
            raise self.scope.fail(
                "E0204",
                f"'{name}' is declared twice",
                span,
                caption="again here",
                labels=(Label(self.known[name].span, f"'{name}' is {self.known[name].word}"),),
                help=f"a new value is given by '{name} := ..;'"
                if self.known[name].word == "a variable"
                else "",
            )

    def declare(self, statement: ast.Let | ast.Var, values: _Values) -> None:
        scope, name = self.at(values), statement.name
        self.free(name, statement.name_span, values)
        value = scope.elaborate(statement.value)
        target = numeric = types.numeric(value.type)
        if is_typed(statement):
            target = stated_type(statement, scope, value.type)
            value = fit(scope, value, target, statement.value.span, name=name, declared=statement.name_span)
        elif statement.dimensions:
            target = types.with_shape(numeric, extents(scope, statement.dimensions, value.type.shape))
            value = broadcast(scope, value, target, statement.value.span, name, statement.name_span)
        variable = isinstance(statement, ast.Var)
        if variable and value.type.kind not in _NAMED:
            raise scope.fail(
                "E0308",
                f"a variable is a number or a truth value, this is {types.describe(value.type)}",
                statement.value.span,
                help="a value that stays the same is named by 'let'",
            )
        open = variable and not is_typed(statement) and types.is_zero(value)
        self.known[name] = _Known(
            "a variable" if variable else "a 'let'",
            statement.name_span,
            None if open else target,
            statement.name_span,
        )
        values[name] = self.bindings.name(scope, name, value)

    def unpack(self, statement: ast.Unpacked, values: _Values) -> None:
        found = unpacked(self.at(values), statement.value, len(statement.lets), self.results_of)
        for let, made in zip(statement.lets, found, strict=True):
            value = made()
            self.free(let.name, let.name_span, values)
            self.known[let.name] = _Known("a 'let'", let.name_span, types.numeric(value.type))
            values[let.name] = self.bindings.name(self.scope, let.name, value)

    def assign(self, statement: ast.Assign, values: _Values) -> None:
        scope = self.at(values)
        part = statement.target.parts[0]
        known = self.variable(statement.target, values)
        old = values[part.name]
        shape = (known.type or old.type).shape
        value = scope.elaborate(statement.value)
        chosen: list[int | list[int]] = []
        if len(part.indices) > len(shape):
            raise scope.fail(
                "E0316",
                f"'{part.name}' is {types.describe(known.type or old.type)}, this has {len(part.indices)} indices",
                statement.target.span,
            )
        for node, size in zip(part.indices, shape, strict=False):
            chosen.append(positions(scope, node, size, part.span))
        several = tuple(len(c) for c in chosen if isinstance(c, list))
        target = (*several, *shape[len(chosen) :])
        if known.type is None and not types.is_zero(value):
            known.type = types.make(Kind.REAL, shape, value.type.dimension, value.type.angle)
            if value.type.kind is Kind.BOOLEAN:
                known.type = types.with_shape(types.BOOLEAN, shape)
            known.typed_by = statement.value.span
        if known.type is not None:
            value = fit(
                scope,
                value,
                types.with_shape(known.type, target),
                statement.value.span,
                name=statement.target.span.text,
                declared=known.typed_by,
            )
        else:
            wanted = types.with_shape(types.numeric(value.type), target)
            value = broadcast(scope, value, wanted, statement.value.span, part.name, known.span)
        value = self.bindings.name(scope, part.name, value)
        if chosen:
            if known.type is not None and types.is_zero(old):
                old = types.retyped_zero(old, known.type.dimension, known.type.angle)
            value = _replaced(old, chosen, value)
        values[part.name] = value

    def variable(self, target: ast.Reference, values: _Values) -> _Known:
        """Return the variable that is assigned to. Reports anything else."""
        name, span = target.parts[0].name, target.span
        known = self.known.get(name) if name in values else None
        if known is not None and known.word == "a variable" and len(target.parts) == 1:
            return known
        if known is None:
            left = self.known.get(name)
            variables = [n for n in values if self.known[n].word == "a variable"]
            near = closest(name, variables)
            raise self.scope.fail(
                "E0201",
                f"there is no variable '{name}' here",
                span,
                labels=(Label(left.span, "this ends with the block that it stands in"),) if left else (),
                help=f"did you mean '{near}'?" if near else f"declare it before: 'var {name} = 0;'",
            )
        help = {
            "a 'let'": f"declare it by 'var {name} = ..;' where its value changes",
            "an argument": f"begin with 'var {name}_ = {name};' and change that",
            "a variable": "a variable has elements, 'x[i]', but no members",
        }.get(known.word, "")
        raise self.scope.fail(
            "E0220",
            f"'{name}' is {known.word} and keeps its value"
            if known.word != "a variable"
            else "a member has no value",
            span,
            labels=(Label(known.span, f"'{name}' is {known.word}"),),
            help=help,
        )

    # ------------------------------------------------------------ blocks

    def inside(self, values: _Values, outer: _Values) -> _Values:
        """Return the values after a block: what it declared is gone."""
        return {name: values[name] for name in outer}

    def loop(self, statement: ast.For, values: _Values) -> tuple[_Values | None, _Exit]:
        scope = self.at(values)
        self.free(statement.name, statement.range.span, values)
        found: list[_Exit] = []
        for item in values_of(scope, statement.range):
            self.known[statement.name] = _Known("the counter of a loop", statement.range.span)
            inner = {**values, statement.name: self.bindings.name(scope, statement.name, item)}
            left, here = self.steps(statement.body, inner)
            found.append(here)
            if left is None:
                return None, _one_behind_the_other(found)
            values = self.inside(left, values)
        return values, _one_behind_the_other(found)

    def branches(
        self, statement: ast.If, branches: Sequence[ast.IfBranch], values: _Values
    ) -> tuple[_Values | None, _Exit]:
        if not branches:
            left, found = self.steps(statement.otherwise, dict(values))
            return None if left is None else self.inside(left, values), found
        first = branches[0]
        scope = self.at(values)
        condition = scope.elaborate(first.condition)
        require_truth(scope, first.condition, condition)
        known = constant(condition)
        if known is False:
            return self.branches(statement, branches[1:], values)
        if known is not True:
            condition = self.bindings.name(scope, "if", condition)
        left, found = self.steps(first.body, dict(values))
        then = None if left is None else self.inside(left, values)
        if known is True:
            return then, found
        otherwise, other = self.branches(statement, branches[1:], values)
        both = None if found is None and other is None else _Fork(condition, found, other)
        if then is None or otherwise is None:
            return (otherwise if then is None else then), both
        return {n: self.merged(n, condition, then[n], otherwise[n], statement) for n in values}, both

    def merged(
        self, name: str, condition: Expression, then: Expression, otherwise: Expression, statement: ast.If
    ) -> Expression:
        """Return what a name is worth after two branches."""
        if then is otherwise:
            return then
        value = choice(
            self.scope,
            statement.span,
            condition,
            ChoiceBranch(then.span, then),
            ChoiceBranch(otherwise.span, otherwise),
        )
        return self.bindings.name(self.scope, name, value)

    # ------------------------------------------------------------ results

    def returned(self, statement: ast.Return, values: _Values) -> _Returned:
        function, scope = self.function, self.at(values)
        wanted = max(1, len(function.results))
        if len(statement.values) != wanted:
            names = ", ".join(r.name for r in function.results)
            raise scope.fail(
                "E0222",
                f"'{function.name}' gives {_count(wanted)}, this returns {len(statement.values)}",
                statement.span,
                labels=(Label(function.name_span, f"it gives ({names})" if names else "it gives one value"),),
                help=f"write 'return ({names});', one value for each"
                if names
                else "say what they are after the arguments, as in '-> (Length r, Angle phi)'",
            )
        found = []
        declared = function.results or (
            ast.Argument(
                name=function.name,
                type=function.result,
                dimensions=function.result_dimensions,
                span=function.name_span,
            ),
        )
        for result, node in zip(declared, statement.values, strict=True):
            value = scope.elaborate(node)
            if result.type:
                type = declared_type(scope, result.type, result.span)
                type = types.with_shape(type, extents(scope, result.dimensions, value.type.shape))
                value = fit(scope, value, type, node.span, name=result.name, declared=result.span)
            found.append(self.bindings.name(scope, result.name, value))
        return _Returned(tuple(found), statement)

    def chosen(self, found: _Exit, k: int) -> Expression:
        """Return the result of number ``k`` by what holds."""
        return self._branch(found, k).value

    def _branch(self, found: _Exit, k: int) -> ChoiceBranch:
        assert found is not None
        if isinstance(found, _Returned):
            return ChoiceBranch(found.statement.values[k].span, found.values[k])
        then, otherwise = self._branch(found.then, k), self._branch(found.otherwise, k)
        value = choice(self.scope, found.condition.span, found.condition, then, otherwise)
        return ChoiceBranch(then.span, self.bindings.name(self.scope, "result", value))


def unpacked(scope: Scope, call: ast.Expression, count: int, results: Results) -> Sequence[Made]:
    """Return what makes the results of a call that are given names at once. Reports what gives others."""
    if not isinstance(call, ast.Call):
        raise scope.fail(
            "E0222",
            "several names are given to the results of a function",
            call.span,
            caption="this is not a call of a function",
            help="write 'let (a, b) = f(x);'",
        )
    found = results(scope, call)
    if len(found) != count:
        raise scope.fail(
            "E0222",
            f"'{call.function.name}' gives {_count(len(found))}, here are {_count(count, 'name')}",
            call.span,
            help="" if len(found) > 1 else "write 'let a = f(x);' and 'a[1]' for its elements",
        )
    return found


def _count(number: int, noun: str = "value") -> str:
    return f"{'one' if number == 1 else number} {noun}{'s' * (number != 1)}"


def _returns(statement: ast.Statement) -> bool:
    match statement:
        case ast.Return():
            return True
        case ast.For(body=body):
            return any(map(_returns, body))
        case ast.If(branches=branches, otherwise=otherwise):
            inside: Iterable[ast.Statement] = (*(s for b in branches for s in b.body), *otherwise)
            return any(map(_returns, inside))
        case _:
            return False


def _always_returns(statement: ast.Statement) -> bool:
    """Whether every way through a step returns, whatever holds."""
    match statement:
        case ast.Return():
            return True
        case ast.If(branches=branches, otherwise=otherwise):
            return all(
                body and _always_returns(body[-1]) for body in (*(b.body for b in branches), otherwise)
            )
        case _:
            return False


def _one_behind_the_other(parts: Sequence[_Exit]) -> _Exit:
    found: _Exit = None
    for part in reversed(parts):  # each is looked through once
        found = _filled(part, found)
    return found


def _filled(found: _Exit, rest: _Exit) -> _Exit:
    """Put what is returned later in the places where the steps went on."""
    if found is None or rest is None:
        return found or rest
    if isinstance(found, _Returned):
        return found
    return _Fork(found.condition, _filled(found.then, rest), _filled(found.otherwise, rest))


def _replaced(old: Expression, chosen: Sequence[int | list[int]], new: Expression) -> Expression:
    """Return an array with the elements at some positions exchanged."""
    if not chosen:
        return new
    first, rest = chosen[0], chosen[1:]
    items = elements(old)
    if isinstance(first, int):
        items[first] = _replaced(items[first], rest, new)
    else:
        for k, part in zip(first, elements(new), strict=True):
            items[k] = _replaced(items[k], rest, part)
    kind = Kind.REAL if Kind.REAL in (old.type.kind, new.type.kind) else new.type.kind
    type = types.make(kind, old.type.shape, new.type.dimension, old.type.angle or new.type.angle)
    return Array(type=type, span=new.span, elements=tuple(items))
