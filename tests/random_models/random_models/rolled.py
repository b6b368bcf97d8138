"""The same model with loops in its C code, which only long ones have else: what repeats itself is found in short ones, too."""

from __future__ import annotations

import importlib
from unittest.mock import patch

from random_models.compiled import Compiled, compiled

LONG, SHORT = 30, 10
"""Statements of a function that is looked through for loops, and of one that is when another is long."""


def in_loops(text: str) -> Compiled:
    """Compile a text as if it were long."""
    lowering = importlib.import_module("mechc.compiler.program.lower")
    with patch.multiple(lowering, LONG=LONG, SHORT=SHORT):
        return compiled(text, quick=False)
