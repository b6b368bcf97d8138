"""Long lines: documents that know where they may be broken.

A document is flat text, a row of documents, a bracket with items, or a chain of operands. What fits on the
line is set flat; otherwise items and operands fill the lines, aligned below the first of them
(in the manner of Wadler 2003, without his choice between several layouts).
"""

from __future__ import annotations

from typing import assert_never

from msgspec import Struct

WIDTH = 100
CONTINUATION = 4


class Bracketed(Struct, frozen=True):
    """``open item, item close``, then ``tail``: what must stay with the closing sign."""

    open: str
    items: tuple[Doc, ...]
    close: str
    tail: str = ""


class Link(Struct, frozen=True):
    """A sign and the operand after it: ``flat`` on one line, ``broken`` at the beginning of a line."""

    flat: str
    broken: str
    operand: Doc


class Chain(Struct, frozen=True):
    """An operand and links, broken before the signs."""

    first: Doc
    links: tuple[Link, ...]


class Unbroken(Struct, frozen=True):
    """Parts one after the other, never broken between them."""

    parts: tuple[Doc, ...]


class Clauses(Struct, frozen=True):
    """The clauses of a statement with blanks between; those that do not fit go on indented."""

    parts: tuple[Doc, ...]


Doc = str | Bracketed | Chain | Unbroken | Clauses


def flat(doc: Doc) -> str:
    """Return the text on one line."""
    match doc:
        case str():
            return doc
        case Bracketed(open, items, close, tail):
            return open + ", ".join(flat(i) for i in items) + close + tail
        case Chain(first, links):
            return flat(first) + "".join(link.flat + flat(link.operand) for link in links)
        case Unbroken(parts):
            return "".join(flat(p) for p in parts)
        case Clauses(parts):
            return " ".join(flat(p) for p in parts)
        case _:
            assert_never(doc)


def lay_out(doc: Doc, column: int, after: int = 0) -> str:
    """Return the text from a column, with room for ``after`` more characters on its last line."""
    text = flat(doc)
    if column + len(text) + after <= WIDTH:
        return text
    match doc:
        case str():
            return text
        case Bracketed(open, items, close, tail):
            start = column + len(open)
            lines = open
            end = len(close) + len(tail) + after
            for i, item in enumerate(items):
                last = i == len(items) - 1
                lines = _append(lines, column, "" if i == 0 else " ", item, end if last else 1, start)
                lines += "" if last else ","
            return lines + close + tail
        case Chain(first, links):
            lines = lay_out(first, column, after if not links else 0)
            for i, link in enumerate(links):
                room = after if i == len(links) - 1 else 0
                here = _column(lines, column)
                if here + len(link.flat) + len(flat(link.operand)) + room <= WIDTH:
                    lines += link.flat + flat(link.operand)
                else:
                    lines += "\n" + " " * column + link.broken
                    lines += lay_out(link.operand, column + len(link.broken), room)
            return lines
        case Unbroken(parts):
            lines = ""
            for i, part in enumerate(parts):
                rest = sum(len(flat(p)) for p in parts[i + 1 :])
                lines += lay_out(part, _column(lines, column), after + rest)
            return lines
        case Clauses(parts):
            lines = ""
            for i, part in enumerate(parts):
                room = after if i == len(parts) - 1 else 0
                lines = _append(lines, column, " " if i else "", part, room, column + CONTINUATION)
            return lines
        case _:
            assert_never(doc)


def _append(lines: str, column: int, blank: str, part: Doc, after: int, indent: int) -> str:
    """Add a part on the last line if it fits there, else on a new line where that helps."""
    here = _column(lines, column) + len(blank)
    length = len(flat(part)) + after
    fits_here = here + length <= WIDTH
    if blank and not fits_here and (indent + length <= WIDTH or here > WIDTH // 2):
        return lines + "\n" + " " * indent + lay_out(part, indent, after)
    return lines + blank + lay_out(part, here, after)


def _column(lines: str, column: int) -> int:
    """Return the column after text that began at ``column``."""
    newline = lines.rfind("\n")
    return column + len(lines) if newline < 0 else len(lines) - newline - 1
