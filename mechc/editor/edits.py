"""Edits of a text: its canonical layout, a name changed everywhere, and what a message proposes."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from msgspec import Struct

from ..lang import ast
from ..lang.diagnostics import CompileError, Diagnostic, Reporter, Severity
from ..lang.parser import parse
from ..lang.printing.printer import format_file
from ..lang.source import Span
from .document import Document, region_of
from .names import Word, is_library, meaning, word_at
from .pieces import names

_NAME = re.compile(r"[A-Za-z_]\w*")
_MEANT = re.compile(r"did you mean '([^']+)'")
_WRITE = re.compile(
    r"(?:write|put|close it with|a comparison is written|a power is written|as in) '[^']+'(?: or '[^']+')*|^'[^']+'"
)
_QUOTED = re.compile(r"'([^']+)'")
_OTHER_NAME = re.compile(r"choose another name, for example '([^']+)'")
_CLOSE = re.compile(r"(?:put|close it with) '([^']+)'")
_GIVEN = re.compile(r"write '[\w.]+ = \.\.\.'")
_LEAVE_OUT = re.compile(r"(?:leave out|drop the word) '([^']+)'")
_REMOVE = re.compile(r"remove (?:it|the)\b|leave one of them out|leave it out")
_SEMICOLON = re.compile(r"';' is missing|expected ';'|';' missing")


class Edit(Struct, frozen=True):
    """Replace [start, end) by ``text``."""

    start: int
    end: int
    text: str


class Fix(Struct, frozen=True):
    """What a message proposes, and the edits that do it."""

    title: str
    edits: tuple[Edit, ...]


def _one(title: str, start: int, end: int, text: str) -> Fix:
    return Fix(title, (Edit(start, end, text),))


def formatted(document: Document) -> Edit | None:
    """Return the whole text in the canonical layout; None where it cannot be read, or is so already."""
    try:
        new = format_file(parse(document.source, Reporter()))
    except CompileError:
        return None
    return None if new == document.text else Edit(0, len(document.text), new)


def occurrences(document: Document, place: Span) -> list[tuple[int, int]]:
    """Return all places [start, end) of a text where a name means what is declared at ``place``, in this text or in another."""
    places = []
    regions = document.regions()
    for name in names(document.text):
        start, end = name.piece.start, name.piece.end
        if name.piece.text != place.text:
            continue
        there = meaning(document, Word(name.path, start, end), region_of(regions, start))
        if there is None or there.place is None:
            continue
        if there.place.start == place.start and same_file(there.place, place):
            places.append((start, end))
    return places


def same_file(a: Span, b: Span) -> bool:
    """Whether two places are in one file, by whatever way it was found."""
    return a.file.name == b.file.name or Path(a.file.name).resolve() == Path(b.file.name).resolve()


def renamed(documents: Iterable[Document], place: Span, name: str) -> list[tuple[Document, list[Edit]]]:
    """Return the edits that give what is declared at a place another name, in all these texts; none for names of the library, and
    where its own text would be wrong afterwards: the name may be taken, or hide another one."""
    if not _NAME.fullmatch(name) or is_library(place):
        return []
    found = []
    for document in documents:
        edits = [Edit(start, end, name) for start, end in occurrences(document, place)]
        if not edits:
            continue
        if same_file(Span(document.source, 0, 0), place) and not _fits(document, edits):
            return []
        found.append((document, edits))
    return found


def _fits(document: Document, edits: Iterable[Edit]) -> bool:
    """Whether a text that was right is so after edits."""
    if document.broken or any(d.severity is Severity.ERROR for d in document.at_once()):
        return True
    other = Document(document.path, applied(document.text, edits))
    return not any(d.severity is Severity.ERROR for d in other.at_once())


def applied(text: str, edits: Iterable[Edit]) -> str:
    """Return a text after edits that do not overlap."""
    for edit in sorted(edits, key=lambda e: e.start, reverse=True):
        text = text[: edit.start] + edit.text + text[edit.end :]
    return text


def fixes(document: Document, diagnostic: Diagnostic, seconds: float = math.inf) -> list[Fix]:
    """Return the edits that a message proposes, of which each was tried: the message is gone, and no other one has come.

    ``seconds`` of processor time may pass before one is tried; further ones are left out.
    """
    until = time.process_time() + seconds
    span = diagnostic.span
    if span is None or span.file.name != document.source.name:
        return []
    found: dict[str, Fix] = {}
    for fix in _proposals(document, diagnostic, span):
        if fix.title not in found and time.process_time() < until and _mends(document, diagnostic, fix.edits):
            found[fix.title] = fix
    return list(found.values())


def _proposals(document: Document, diagnostic: Diagnostic, span: Span) -> Iterator[Fix]:
    """Yield the edits that the words of a message may mean."""
    words = f"{diagnostic.message} {diagnostic.help}"
    for meant in _MEANT.findall(words):
        if wrong := _misspelt(document, span.start, span.end, meant):
            yield _one(f"replace by '{meant}'", *wrong, meant)
    if _SEMICOLON.search(words):
        end = _end_of_code(document.text, span.start)
        yield _one("insert ';'", end, end, ";")
    if match := _OTHER_NAME.search(diagnostic.help):
        yield _everywhere(document, span.text, match[1])
    if match := _CLOSE.search(diagnostic.help):
        line = document.text.find("\n", span.start)
        end = _end_of_code(document.text, line if line >= 0 else len(document.text))
        end -= document.text[:end].endswith(";") and match[1] != "*/"
        yield _one(f"insert '{match[1]}'", end, end, match[1])
    if _GIVEN.search(diagnostic.help) and (at := document.text.find("~", span.start)) >= 0:
        yield _one("write '=' for '~'", at, at + 1, "=")
    for match in _WRITE.finditer(diagnostic.help):
        for text in _QUOTED.findall(match[0]):
            if ".." in text or re.match(r"name\b", text):
                continue  # says only how it begins, or what kind of thing stands there
            if not document.text[span.start : span.end].isascii():
                yield _everywhere(document, span.text, text)
            if text.endswith(";"):
                begin = document.text.rfind("\n", 0, span.start) + 1
                yield _one(f"write '{text}'", begin, _behind(document.text, span.end), f"{text}\n")
            yield _one(f"write '{text}'", span.start, span.end, text)
            if diagnostic.caption or not text[0].isalpha():
                for place, end in _like(document.text, span.start, span.end, text):
                    yield _one(f"write '{text}'", place, end, text)
    if match := _LEAVE_OUT.search(diagnostic.help):
        at = document.text.find(match[1])
        if at >= 0:
            yield _one(f"leave out '{match[1]}'", at, at + len(match[1]), "")
    if _REMOVE.search(diagnostic.help):
        start, end = _statement(document, span)
        yield _one("remove it", start, _behind(document.text, end), "")


def _everywhere(document: Document, old: str, new: str) -> Fix:
    """Return the fix that changes a word wherever it stands."""
    word = rf"(?<!\w){re.escape(old)}(?!\w)"
    places = re.finditer(word, document.text)
    return Fix(f"write '{new}' for '{old}'", tuple(Edit(m.start(), m.end(), new) for m in places))


def _like(text: str, start: int, end: int, new: str) -> Iterator[tuple[int, int]]:
    """Yield the pieces of [start, end) that have the length and the kind of what is written instead: operators, brackets."""
    if len(new) <= 2 and not new[0].isalnum():
        for match in re.finditer(r"[^\w\s]+", text[start : min(end + 1, len(text))]):
            yield start + match.start(), start + match.end()


def _statement(document: Document, span: Span) -> tuple[int, int]:
    """Return the statement that a place belongs to, with the blanks before it; the place itself where there is none."""
    found = (span.start, span.end)
    inside = () if document.tree is None or document.broken else document.tree.items
    while inside:
        around = next((s for s in inside if s.span.start <= span.start and span.end <= s.span.end), None)
        if around is None:
            break
        found = (around.span.start, around.span.end)
        inside = around.body if isinstance(around, ast.Model) else ()
    before = document.text[: found[0]]
    return len(before.rstrip(" \t")), found[1]


def _behind(text: str, offset: int) -> int:
    """Return where a statement and its line end."""
    match = re.match(r"[ \t]*;?[ \t]*\n?", text[offset:])
    return offset + (match.end() if match else 0)


def _mends(document: Document, diagnostic: Diagnostic, edits: Iterable[Edit]) -> bool:
    """Whether a message is gone after an edit and no other error has come, as far as one looked who found the message."""
    new = applied(document.text, edits)
    if new == document.text:
        return False
    other, found_early = Document(document.path, new), diagnostic in document.at_once()
    found = other.at_once() if found_early else other.in_full()
    if any((d.code, d.message) == (diagnostic.code, diagnostic.message) for d in found):
        return False
    if document.broken and not other.broken:
        return True  # what else is wrong could not be told before
    before = {(d.code, d.message) for d in (document.at_once() if found_early else document.in_full())}
    return all((d.code, d.message) in before for d in found if d.severity is Severity.ERROR)


def _misspelt(document: Document, start: int, end: int, meant: str) -> tuple[int, int] | None:
    """Return the word within [start, end) that is most like what was meant."""
    from ..suggest import edit_distance

    words = [
        (start + m.start(), start + m.end())
        for m in re.finditer(r"[A-Za-z_][\w.]*", document.text[start:end])
    ]
    if not words:
        word = word_at(document.text, start)
        return None if word is None else (word.start, word.end)
    return min(words, key=lambda w: edit_distance(document.text[w[0] : w[1]], meant))


def _end_of_code(text: str, offset: int) -> int:
    """Return where the last word before a place ends."""
    return len(text[:offset].rstrip())
