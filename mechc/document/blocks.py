"""What a document is made of, whatever file it is written to."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from msgspec import Struct


class Heading(Struct, frozen=True):
    text: str


class Paragraph(Struct, frozen=True):
    text: str


class Preformatted(Struct, frozen=True):
    """Lines as a terminal shows them."""

    text: str


class Rows(Struct, frozen=True):
    """A table; ``head`` may be empty."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class Picture(Struct, frozen=True):
    """A picture by its PNG file."""

    png: bytes
    caption: str


class MovingPage(Struct, frozen=True):
    """A page that moves, as HTML; it has no place on paper."""

    html: str


Block = Heading | Paragraph | Preformatted | Rows | Picture | MovingPage


class Document(Struct, frozen=True):
    title: str
    subtitle: str
    blocks: tuple[Block, ...]


Writer = Callable[[Document, Path], None]
