"""Source text and places in it."""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cached_property
from typing import ClassVar

from msgspec import Struct

_LINE_END = re.compile("\n")


class SourceFile(Struct, frozen=True, dict=True):
    """A named text. Line ends are normalised to ``\\n`` before one is made."""

    name: str
    text: str

    def __repr__(self) -> str:
        return f"SourceFile({self.name!r})"

    @cached_property
    def _line_starts(self) -> tuple[int, ...]:
        return (0, *(match.end() for match in _LINE_END.finditer(self.text)))

    def position(self, offset: int) -> tuple[int, int]:
        """Return (line, column) of a character offset, both counted from 1."""
        line = bisect_right(self._line_starts, offset)
        return line, offset - self._line_starts[line - 1] + 1

    def line(self, number: int) -> str:
        """Return the text of a line (counted from 1) without its end."""
        start = self._line_starts[number - 1]
        end = self._line_starts[number] - 1 if number < len(self._line_starts) else len(self.text)
        return self.text[start:end]


class Span(Struct, frozen=True):
    """The half-open range [start, end) of characters in a file."""

    file: SourceFile
    start: int
    end: int

    @property
    def text(self) -> str:
        return self.file.text[self.start : self.end]

    def to(self, other: Span) -> Span:
        """Return the span from the start of this one to the end of the other."""
        return Span(self.file, self.start, other.end)


class Placed(Struct, frozen=True, eq=False, kw_only=True):
    """What a text states at ``span``. Where it stands is not a part of it: equal statements compare equal.

    ``aside`` names the fields that neither count in a comparison nor show.
    """

    aside: ClassVar[frozenset[str]] = frozenset({"span"})

    span: Span

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self._stated() == other._stated()

    def __ne__(self, other: object) -> bool:  # that of structs does not ask `==`
        return not self == other

    def __hash__(self) -> int:
        return hash(self._stated())

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{n}={getattr(self, n)!r}' for n in self._names())})"

    def _names(self) -> list[str]:
        return [name for name in self.__struct_fields__ if name not in self.aside]

    def _stated(self) -> tuple[object, ...]:
        return tuple(getattr(self, name) for name in self._names())
