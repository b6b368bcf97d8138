"""What an FMU says of itself."""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, version

from msgspec import Struct

from mechc.lang.diagnostics import Reporter

DATE = "2026-01-01T00:00:00Z"
"""Fixed, so that the same model gives the same bytes."""

LONGEST = 100
"""Characters of a model's name: importers put it into names of files and functions."""

CATEGORIES = {
    "logStatusWarning": "warnings",
    "logStatusDiscard": "steps that must be repeated with a smaller step size",
    "logStatusError": "errors",
    "logStatusFatal": "fatal errors",
    "logEvents": "messages of events, such as the one that ends a simulation",
}


class Identity(Struct, frozen=True):
    """``kinds``: me, cs or both. Times in s; ``tolerance`` of the default experiment."""

    name: str
    model_identifier: str
    doc: str
    token: str
    kinds: tuple[str, ...]
    start: float
    stop: float
    tolerance: float
    step: float
    sources: tuple[str, ...]
    needs_completed_step: bool


def checked_identifier(name: str) -> str:
    """Return the name of a model as that of files and C functions. Raises CompileError: E0907."""
    fault = ""
    if re.fullmatch(r"con|prn|aux|nul|com\d|lpt\d", name, re.IGNORECASE):
        fault = "Windows has no file of this name"
    elif len(name) > LONGEST:
        fault = f"it has {len(name)} characters, importers take {LONGEST}"
    if fault:
        raise Reporter().fail(
            "E0907",
            f"an FMU cannot be called '{name}': {fault}",
            None,
            help="rename the model, or export one that extends it: "
            f"model Other extends {name[:40]}{'...' if len(name) > 40 else ''}; end Other;",
        )
    return name


def tool() -> str:
    """Return the name of the compiler with its version."""
    try:
        return f"mechc {version('mechc')}"
    except PackageNotFoundError:
        return "mechc"
