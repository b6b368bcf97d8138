"""What compiling asks of Python's interpreter: no search for cyclic garbage, and more frames than it grants by itself."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager

DEEPEST = 20_000
"""Frames of Python: expressions are at most 150 deep, and a definition may need others that come later."""


@contextmanager
def compiling() -> Iterator[None]:
    """Compile without searching for garbage, of which there is hardly any (a tenth of the time of a large model), and with room for
    chains of definitions, each of which needs the next; beyond that RecursionError is raised as ever."""
    collected, frames = gc.isenabled(), sys.getrecursionlimit()
    gc.disable()
    sys.setrecursionlimit(max(frames, DEEPEST))
    try:
        yield
    finally:
        sys.setrecursionlimit(frames)
        if collected:
            gc.enable()
