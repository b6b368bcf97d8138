"""What stands in the body of a function: its arguments, and the names that its steps declare."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ..lang import ast
from ..lang.source import Span
from .document import Document

Local = ast.Argument | ast.Declaration


def function_at(document: Document, offset: int) -> ast.Function | None:
    """Return the function whose text surrounds a place, from the last tree."""
    for _, statement in document.statements():
        if isinstance(statement, ast.Function) and statement.span.start < offset < statement.span.end:
            return statement
    return None


def locals_at(document: Document, offset: int) -> dict[str, tuple[Local, Span]]:
    """Return the names that a place in a function sees, and where each is declared; the last one of a name counts."""
    function = function_at(document, offset)
    if function is None:
        return {}
    found: dict[str, tuple[Local, Span]] = {a.name: (a, _name_of(a)) for a in function.arguments}
    for declaration in _declared(function.body):
        if declaration.name_span.start <= offset:
            found[declaration.name] = (declaration, declaration.name_span)
    return found


def _declared(body: Iterable[ast.Statement]) -> Iterator[ast.Declaration]:
    for statement in body:
        match statement:
            case ast.Declaration():
                yield statement
            case ast.Unpacked(lets=lets):
                yield from lets
            case ast.For(body=inner):
                yield from _declared(inner)
            case ast.If(branches=branches, otherwise=otherwise):
                yield from _declared((*(s for b in branches for s in b.body), *otherwise))


def _name_of(argument: ast.Argument) -> Span:
    """Return where the name of an argument stands, after its type and before its sizes."""
    span = argument.span
    start = span.start + (span.text.rfind(argument.name, 0, (span.text.find("[") + 1 or len(span.text) + 1)))
    return Span(span.file, start, start + len(argument.name))
