"""Parameters of tests that prove the same: a few are fast, the others slow."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def slow_but(fast: Collection[Any], values: Iterable[Any]) -> list[Any]:
    """Mark the values that are not among the fast ones."""
    return [v if v in fast else pytest.param(v, marks=pytest.mark.slow) for v in values]


def slow_among(slow: Collection[Any], values: Iterable[Any]) -> list[Any]:
    """Mark the values that are among the slow ones."""
    return [pytest.param(v, marks=pytest.mark.slow) if v in slow else v for v in values]
