"""Indices of arrays: all of them in order, and as text. They count from 0, and from 1 where they are shown."""

from __future__ import annotations

from itertools import product

Index = tuple[int, ...]


def subscripts(shape: tuple[int, ...]) -> list[Index]:
    """Return every index of an array in row-major order; that of a scalar is empty."""
    return list(product(*(range(n) for n in shape)))


def subscript_text(index: Index) -> str:
    """Return ``[1,2]``, counted from 1; empty for a scalar."""
    return f"[{','.join(str(i + 1) for i in index)}]" if index else ""


def element_name(name: str, index: Index) -> str:
    """Return the name in results: ``x[1,2]``, counted from 1."""
    return name + subscript_text(index)
