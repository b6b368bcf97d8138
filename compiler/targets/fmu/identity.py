"""What an FMU says of itself."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

DATE = "2026-01-01T00:00:00Z"
"""Fixed, so that the same model gives the same bytes."""

CATEGORIES = {
    "logStatusWarning": "warnings",
    "logStatusDiscard": "steps that must be repeated with a smaller step size",
    "logStatusError": "errors",
    "logStatusFatal": "fatal errors",
}


@dataclass(frozen=True, slots=True)
class Identity:
    """``kinds``: me, cs or both. Times in s; ``tolerance`` of the default experiment."""

    name: str
    doc: str
    token: str
    kinds: tuple[str, ...]
    start: float
    stop: float
    tolerance: float
    step: float
    sources: tuple[str, ...]
    needs_completed_step: bool

    @property
    def model_identifier(self) -> str:
        return re.sub(r"\W", "_", self.name, flags=re.ASCII)


def tool() -> str:
    """Return the name of the compiler with its version."""
    try:
        return f"mechc {version('mechc')}"
    except PackageNotFoundError:
        return "mechc"
