"""What a message is: a value with a code, a place, further places and help.

Codes: E01xx text and syntax, E02xx names and imports, E03xx types, shapes and units,
E04xx components and modifications, E05xx mechanics, E06xx initialisation, E07xx events,
contact and friction, E08xx experiments and structural parameters, E09xx export.
W and N stand for warnings and notes with the same families. Each code has one page in
``mechc/errors/CODE.md``. ``mechc/presentation/render.py`` turns diagnostics into text.
"""

from __future__ import annotations

from enum import Enum
from typing import TypedDict, Unpack

from msgspec import Struct

from .source import Span


class Severity(Enum):
    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


class Label(Struct, frozen=True):
    """A secondary place with its own words."""

    span: Span
    text: str


class Details(TypedDict, total=False):
    """What a diagnostic may say beside its message, as ``Diagnostic`` has it."""

    caption: str
    labels: tuple[Label, ...]
    help: str


class Diagnostic(Struct, frozen=True):
    """One message. ``message`` is lower case and says what is wrong in the user's words;
    ``caption`` stands beside the carets; ``help`` says what to do."""

    severity: Severity
    code: str
    message: str
    span: Span | None
    caption: str = ""
    labels: tuple[Label, ...] = ()
    help: str = ""

    def __str__(self) -> str:
        """Return all that it says, as plain lines; ``mechc.render`` draws it beside the text."""
        lines = [f"{self.severity.value}[{self.code}]: {self.message}"]
        if self.span is not None:
            lines.append(f"  --> {_place(self.span)}{': ' if self.caption else ''}{self.caption}")
        lines += [
            f"  ::: {_place(label.span)}{': ' if label.text else ''}{label.text}" for label in self.labels
        ]
        lines += [f"  = help: {self.help}"] if self.help else []
        return "\n".join(lines)


def _place(span: Span) -> str:
    line, column = span.file.position(span.start)
    return f"{span.file.name}:{line}:{column}"


class CompileError(Exception):
    """Compilation stopped; ``diagnostics`` says why (at least one is an error)."""

    def __init__(self, diagnostics: tuple[Diagnostic, ...]) -> None:
        super().__init__("\n\n".join(map(str, diagnostics)))
        self.diagnostics = diagnostics

    def __reduce__(self) -> tuple[type[CompileError], tuple[object, ...]]:
        """Pickle with the diagnostics: it may be raised in another process."""
        return CompileError, (self.diagnostics,)


class Reporter:
    """Collects the diagnostics of one compilation, in order, without repeats."""

    def __init__(self) -> None:
        self._items: dict[Diagnostic, None] = {}

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        return tuple(self._items)

    def add(self, diagnostic: Diagnostic) -> None:
        """Record a diagnostic that is made already."""
        self._items[diagnostic] = None

    def withdraw(self, kept: int) -> tuple[Diagnostic, ...]:
        """Take back all but the first so many, and return them."""
        taken = self.diagnostics[kept:]
        for diagnostic in taken:
            del self._items[diagnostic]
        return taken

    def error(self, code: str, message: str, span: Span | None, **details: Unpack[Details]) -> None:
        """Record an error and go on; see ``stop_on_errors`` and ``fail``."""
        self.add(Diagnostic(Severity.ERROR, code, message, span, **details))

    def warning(self, code: str, message: str, span: Span | None, **details: Unpack[Details]) -> None:
        self.add(Diagnostic(Severity.WARNING, code, message, span, **details))

    def note(self, code: str, message: str, span: Span | None, **details: Unpack[Details]) -> None:
        self.add(Diagnostic(Severity.NOTE, code, message, span, **details))

    @property
    def has_errors(self) -> bool:
        return any(d.severity is Severity.ERROR for d in self._items)

    def stop_on_errors(self) -> None:
        """Raise ``CompileError`` if an error has been recorded."""
        if self.has_errors:
            raise CompileError(self.diagnostics)

    def fail(self, code: str, message: str, span: Span | None, **details: Unpack[Details]) -> CompileError:
        """Record an error and return the exception to raise: ``raise reporter.fail(...)``."""
        self.error(code, message, span, **details)
        return CompileError(self.diagnostics)
