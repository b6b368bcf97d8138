"""Room for chains of definitions, each of which needs the next: more frames of Python than it grants."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

_DEEPEST = 20_000
"""Frames of Python: expressions are at most 150 deep, and a definition may need others that come later."""


@contextmanager
def deep_recursion() -> Iterator[None]:
    """Allow deeper recursion than usual; beyond that RecursionError is raised as ever."""
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, _DEEPEST))
    try:
        yield
    finally:
        sys.setrecursionlimit(before)
