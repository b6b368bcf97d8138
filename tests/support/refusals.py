"""Models that are refused, and what is said of them."""

from __future__ import annotations

import pytest

import mechc
from mechc.lang.diagnostics import Diagnostic


def refused(text: str) -> tuple[Diagnostic, ...]:
    """Compile a model that is wrong; return what is said of it."""
    with pytest.raises(mechc.CompileError) as caught:
        mechc.loads(text)
    return caught.value.diagnostics
