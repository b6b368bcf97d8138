"""Syntax trees to text in the canonical layout.

One statement a line, two blanks for each level, long lines broken, comments kept, at most one
empty line in a row. ``parse(format_file(tree)) == tree``, and formatting twice changes nothing.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Sequence

from msgspec import Struct, field

from .. import ast
from .expressions import document, print_expression, quote
from .layout import Clauses, Doc, Unbroken, lay_out
from .statements import Simple, function_head, statement_document

__all__ = ["format_file", "print_expression"]

_STEP = 2
_STRING = re.compile(r'"(?:[^"\\\n]|\\[^\n])*"')


class _Line(Struct):
    """A piece of output: the text without its indentation, and the source range it came from."""

    text: str
    indent: int
    start: int
    end: int
    opens: bool = False
    closes: bool = False
    trailing: list[str] = field(default_factory=list)
    separate: bool = False  # wants an empty line before it


def format_file(file: ast.File) -> str:
    """Return the text of a file in the canonical layout."""
    printer = _Printer(file)
    for item in file.items:
        printer.statement(item, 0)
    printer.place_comments()
    return printer.text()


class _Printer:
    def __init__(self, file: ast.File) -> None:
        self.source = file.source.text
        self.comments = file.comments
        self.starts = [c.span.start for c in file.comments]
        self.code = _without_comments_and_strings(self.source, file.comments)
        self.lines: list[_Line] = []
        self.inside: set[int] = set()  # comments printed with the statement that holds them

    def add(self, doc: Doc, indent: int, start: int, end: int, *, opens: bool = False) -> None:
        self.lines.append(_Line(lay_out(doc, indent), indent, start, end, opens=opens))

    def close(self, text: str, word: str, indent: int, after: int, end: int) -> None:
        """Add the line of a word that ends or divides a block, found in the source after ``after``."""
        match = re.compile(rf"\b{word}\b").search(self.code, after, end)
        start = match.start() if match else end
        finish = end if word == "end" else start + len(word)
        self.lines.append(_Line(text, indent, start, finish, opens=word != "end", closes=True))

    def statement(self, s: ast.Statement, indent: int) -> None:
        start, end = s.span.start, s.span.end
        doc = f" {quote(s.doc)}" if s.doc else ""
        match s:
            case ast.Model():
                name = f"{'partial ' if s.partial else ''}{'shape ' if s.shape else ''}model {s.name}"
                separate = bool(self.lines)
                title: tuple[Doc, ...] = (name, quote(s.doc)) if s.doc else (name,)
                self.add(Clauses(title), indent, start, s.name_span.end, opens=True)
                self.lines[-1].separate = separate
                after = self.block(s.body, indent, s.name_span.end)
                self.close(f"end {s.name};", "end", indent, after, end)
            case ast.Function(value=None):
                head = function_head(s)
                title = (head, quote(s.doc)) if s.doc else (head,)
                separate = bool(self.lines)
                begin = s.body[0].span.start if s.body else end
                after = self.code.rfind(")", start, begin)
                self.add(Clauses(title), indent, start, max(after, s.name_span.end), opens=True)
                self.lines[-1].separate = separate
                after = self.block(s.body, indent, max(after, s.name_span.end))
                self.close(f"end {s.name};", "end", indent, after, end)
            case ast.For():
                head = Unbroken((f"for {s.name} in ", document(s.range), " loop"))
                self.add(head, indent, start, s.range.span.end, opens=True)
                after = self.block(s.body, indent, s.range.span.end)
                self.close(f"end for{doc};", "end", indent, after, end)
            case ast.If():
                after = start
                for i, branch in enumerate(s.branches):
                    word = "if" if i == 0 else "elseif"
                    after = self.branch(word, branch.condition, branch.body, indent, start, after)
                if s.otherwise:
                    self.close("else", "else", indent, after, s.otherwise[0].span.start)
                    after = self.block(s.otherwise, indent, after)
                self.close(f"end if{doc};", "end", indent, after, end)
            case ast.When():
                after = start
                for i, when in enumerate(s.branches):
                    word = "when" if i == 0 else "elsewhen"
                    after = self.branch(word, when.condition, when.actions, indent, start, after)
                self.close(f"end when{doc};", "end", indent, after, end)
            case _:
                self.simple(s, indent)

    def branch(
        self,
        word: str,
        condition: ast.Expression,
        body: Sequence[ast.Statement],
        indent: int,
        start: int,
        after: int,
    ) -> int:
        """Add one branch of ``if`` or ``when`` and return where its body ends."""
        head = Unbroken((f"{word} ", document(condition), " then"))
        if after == start:
            self.add(head, indent, start, condition.span.end, opens=True)
        else:
            match = re.compile(rf"\b{word}\b").search(self.code, after, condition.span.start)
            begin = match.start() if match else condition.span.start
            self.add(head, indent, begin, condition.span.end, opens=True)
            self.lines[-1].closes = True
        return self.block(body, indent, condition.span.end)

    def block(self, body: Iterable[ast.Statement], indent: int, after: int) -> int:
        """Add the statements of a block and return where the last of them ends."""
        for s in body:
            self.statement(s, indent + _STEP)
            after = s.span.end
        return after

    def simple(self, s: ast.Statement, indent: int) -> None:
        """Add a statement; one with comments inside stays as it was written."""
        start, end = s.span.start, s.span.end
        first, last = bisect_right(self.starts, start), bisect_right(self.starts, end - 1)
        if first < last:
            self.inside.update(range(first, last))
            text = _shift(self.source, start, end, indent)
            self.lines.append(_Line(text, indent, start, end))
        else:
            assert isinstance(s, Simple), s
            self.add(statement_document(s), indent, start, end)

    def place_comments(self) -> None:
        """Put each comment after the line it follows in the source, or on a line of its own."""
        own: list[_Line] = []
        starts = [line.start for line in self.lines]
        for i, comment in enumerate(self.comments):
            if i in self.inside:
                continue
            start, end = comment.span.start, comment.span.end
            index = bisect_right(starts, start)
            begin = self.source.rfind("\n", 0, start) + 1
            if self.code[begin:start].strip() and index:
                self.lines[index - 1].trailing.append(comment.text)
                self.lines[index - 1].end = max(self.lines[index - 1].end, end)
                continue
            indent = 0
            if index < len(self.lines):
                following = self.lines[index]
                indent = following.indent + (_STEP if following.closes else 0)
            own.append(_Line(_shift(self.source, start, end, indent), indent, start, end))
        self.lines = sorted(self.lines + own, key=lambda line: line.start)

    def text(self) -> str:
        parts: list[str] = []
        previous: _Line | None = None
        for line in self.lines:
            if previous is not None and self.empty_line_between(previous, line):
                parts.append("")
            text = " " * line.indent + line.text
            for comment in line.trailing:
                text += "  " + comment
            parts.append(text)
            previous = line
        return "".join(part + "\n" for part in parts)

    def empty_line_between(self, a: _Line, b: _Line) -> bool:
        if b.closes or a.opens:
            return False
        return self.source.count("\n", a.end, b.start) > 1 or (b.separate and a.text.startswith("end "))


def _without_comments_and_strings(source: str, comments: Sequence[ast.Comment]) -> str:
    """Return the source with blanks for comments and underscores for texts, at the same places."""
    pieces: list[str] = []
    position = 0
    for comment in comments:
        pieces.append(source[position : comment.span.start])
        pieces.append(re.sub(r"[^\n]", " ", comment.text))
        position = comment.span.end
    pieces.append(source[position:])
    return _STRING.sub(lambda m: "_" * len(m[0]), "".join(pieces))


def _shift(source: str, start: int, end: int, indent: int) -> str:
    """Return a piece of source, its further lines moved as far as its first one."""
    begin = source.rfind("\n", 0, start) + 1
    before = source[begin:start].expandtabs(8)
    move = indent - len(before)
    first, *others = source[start:end].split("\n")
    lines = [first.rstrip()]
    for other in others:
        text = other.expandtabs(8)
        blanks = len(text) - len(text.lstrip())
        lines.append((" " * max(blanks + move, 0) + text.lstrip()).rstrip())
    return "\n".join(lines)
