"""Diagnostics as text, in the manner of rustc: code, place, source lines with carets, help.

::

    error[E0301]: potential must be an energy
      --> pendulum.mech:7:14
     7 |   potential  -m*g*cos(theta);
       |              ^^^^^^^^^^^^^^^ this is kg.m/s^2 (N), an energy is kg.m^2/s^2 (J)
       = help: one factor of [m] is missing; a length in scope: 'l' (line 3)

A secondary place is underlined with dashes; one without words only shows its line.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import assert_never

from msgspec import Struct
from msgspec.structs import replace

from ..lang.diagnostics import Diagnostic, Severity
from ..lang.source import SourceFile, Span
from .style import PLAIN, Style, printable, width

MOST_SHOWN = 20
"""Diagnostics of one compilation; of more the number is told."""

LONGEST_LINE = 140
"""Cells of a source line that are shown; a longer one is cut around its marks."""


class Mark(Struct, frozen=True):
    """An underlined piece of one shown line: cells [start, end), 0 wide for a line without marks."""

    start: int
    end: int
    text: str
    primary: bool

    @property
    def sign(self) -> str:
        return "^" if self.primary else "-"


class ShownLine(Struct, frozen=True):
    """A source line with its marks; ``number`` counts from 1."""

    number: int
    text: str
    marks: tuple[Mark, ...]


def render(diagnostics: Sequence[Diagnostic], style: Style = PLAIN) -> str:
    """Return all diagnostics as text with a blank line between them, without an end of line.

    At most ``MOST_SHOWN`` are shown, errors before the rest, and the number of those left out.
    """
    chosen = diagnostics
    if len(diagnostics) > MOST_SHOWN:
        chosen = sorted(diagnostics, key=lambda d: d.severity is not Severity.ERROR)[:MOST_SHOWN]
    blocks = [render_diagnostic(d, style) for d in chosen]
    if len(diagnostics) > len(chosen):
        blocks.append(style.dim(f"... and {len(diagnostics) - len(chosen)} more"))
    return "\n\n".join(blocks)


def render_failed(diagnostics: Sequence[Diagnostic], style: Style = PLAIN) -> str:
    """Return the diagnostics of a text that cannot be compiled, then how many errors there are if more than one."""
    text = render(diagnostics, style)
    errors = sum(d.severity is Severity.ERROR for d in diagnostics)
    return text if errors < 2 else f"{text}\n\n{style.red('error')}{style.bold(f': {errors} errors')}"


def render_diagnostic(diagnostic: Diagnostic, style: Style) -> str:
    """Return one diagnostic as text, without an end of line."""
    span = diagnostic.span
    groups = _groups(span, diagnostic) if span is not None else []
    numbers = [line.number for _, lines in groups for line in lines]
    gutter = len(str(max(numbers, default=1))) + 1
    rows = [heading(diagnostic.severity, diagnostic.code, diagnostic.message, style)]
    for i, (place, lines) in enumerate(groups):
        rows.append(place_row(*_where(place.file, place), gutter, first=i == 0, style=style))
        for line in lines:
            rows.extend(line_rows(line, gutter, diagnostic.severity, style))
    rows.extend(note_rows("help", diagnostic.help, gutter, style))
    return "\n".join(rows)


def heading(severity: Severity, code: str, message: str, style: Style) -> str:
    """Return ``error[E0301]: message``; a message without a code has no brackets."""
    word = severity.value + (f"[{code}]" if code else "")
    return _coloured(severity, word, style) + style.bold(f": {message}")


def place_row(name: str, line: int, column: int, gutter: int, *, first: bool, style: Style) -> str:
    """Return ``--> file:line:column``, or ``:::`` for a further file."""
    arrow = "-->" if first else ":::"
    return f"{' ' * gutter}{style.blue(arrow)} {name}:{line}:{column}"


def note_rows(word: str, text: str, gutter: int, style: Style) -> list[str]:
    """Return ``= help: text`` with further lines aligned below; nothing for an empty text."""
    if not text:
        return []
    lead = f"{' ' * (gutter + 1)}{style.blue('=')} {style.bold(word)}: "
    first, *others = text.split("\n")
    return [lead + first, *(" " * (gutter + 5 + len(word)) + row for row in others)]


def line_rows(line: ShownLine, gutter: int, severity: Severity, style: Style) -> list[str]:
    """Return the numbered source line and the rows of marks and captions below it."""
    text, marks = _cut(printable(line.text), line.marks)
    rows = [f"{style.blue(f'{line.number:>{gutter}} |')} {text}".rstrip()]
    bar = style.blue(" " * gutter + " |")

    def paint(mark: Mark, words: str) -> str:
        return _coloured(severity, words, style) if mark.primary else style.blue(words)

    for layer in _layers([m for m in marks if m.end > m.start]):
        last = layer[-1]
        row, column = "", 0
        for mark in layer:
            row += " " * (mark.start - column) + paint(mark, mark.sign * (mark.end - mark.start))
            column = mark.end
        rows.append(f"{bar} {row}" + (" " + paint(last, last.text) if last.text else ""))
        hanging = [m for m in layer[:-1] if m.text]
        if hanging:
            rows.append(f"{bar} {_connectors(hanging, paint)}")
        while hanging:
            mark = hanging.pop()
            lead = _connectors(hanging, paint, until=mark.start)
            rows.append(f"{bar} {lead}{paint(mark, mark.text)}")
    return rows


def _connectors(marks: Sequence[Mark], paint: Callable[[Mark, str], str], until: int = 0) -> str:
    row, column = "", 0
    for mark in marks:
        row += " " * (mark.start - column) + paint(mark, "|")
        column = mark.start + 1
    return row + " " * (until - column)


def _layers(marks: Sequence[Mark]) -> list[list[Mark]]:
    """Split marks into rows of disjoint ones, the primary mark in the first row."""
    layers: list[list[Mark]] = []
    for mark in sorted(marks, key=lambda m: (not m.primary, m.start)):
        for layer in layers:
            if all(mark.end < m.start or m.end < mark.start for m in layer):
                layer.append(mark)
                break
        else:
            layers.append([mark])
    return [sorted(layer, key=lambda m: m.start) for layer in layers]


def _cut(text: str, marks: tuple[Mark, ...]) -> tuple[str, tuple[Mark, ...]]:
    """Cut a line that is too long to the part around its marks."""
    if len(text) <= LONGEST_LINE:
        return text, marks
    first = min((m.start for m in marks), default=0)
    start = max(0, min(first - 20, len(text) - LONGEST_LINE))
    end = start + LONGEST_LINE
    shown = ("..." if start else "") + text[start:end] + ("..." if end < len(text) else "")
    shift = start - 3 if start else 0
    limit = width(shown)
    moved = [
        replace(m, start=min(m.start - shift, limit - 1), end=min(m.end - shift, limit))
        for m in marks
        if m.start - shift < limit or m.primary
    ]
    return shown, tuple(moved)


def _coloured(severity: Severity, text: str, style: Style) -> str:
    match severity:
        case Severity.ERROR:
            return style.red(text)
        case Severity.WARNING:
            return style.yellow(text)
        case Severity.NOTE:
            return style.green(text)
        case _:
            assert_never(severity)


def _where(file: SourceFile, place: Span) -> tuple[str, int, int]:
    line, column = file.position(place.start)
    return file.name, line, column


def _groups(span: Span, diagnostic: Diagnostic) -> list[tuple[Span, list[ShownLine]]]:
    """Collect the shown lines of each file, the file of the primary place first."""
    places = [(span, diagnostic.caption, True)] + [(x.span, x.text, False) for x in diagnostic.labels]
    files: list[tuple[Span, dict[int, list[Mark]]]] = []
    for place, text, primary in places:
        lines = next((lines for first, lines in files if first.file == place.file), None)
        if lines is None:
            lines = {}
            files.append((place, lines))
        number, mark = _mark(place, text, primary)
        marks = lines.setdefault(number, [])
        if primary or text:
            marks.append(mark)
    return [
        (first, [ShownLine(n, first.file.line(n), tuple(marks)) for n, marks in sorted(lines.items())])
        for first, lines in files
    ]


def _mark(place: Span, text: str, primary: bool) -> tuple[int, Mark]:
    """Return the number of the first line of a place, and its mark there in cells."""
    number, column = place.file.position(place.start)
    line = place.file.line(number)
    before = line[: column - 1]
    piece = line[column - 1 : column - 1 + place.end - place.start].rstrip()
    start = width(before)
    return number, Mark(start, max(width(before + piece), start + 1), text, primary)
