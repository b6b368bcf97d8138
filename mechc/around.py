"""What every question may be given beside its settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .model import TARGETS
from .settings import UsageMistake, one_of

AROUND = ("experiment", "inputs", "target", "progress")


def check_around(given: Mapping[str, Any]) -> None:
    """Raise UsageMistake for what stands around a question and is of a wrong kind."""
    one_of(given.get("target") or "auto", TARGETS, "target")
    if not isinstance(given.get("inputs") or {}, Mapping):
        raise UsageMistake(
            f"'inputs' are CSV files by the names of inputs, not {given['inputs']!r}",
            'as in inputs={"push": "push.csv"}',
        )
    progress = given.get("progress")
    if progress is not None and not callable(progress):
        raise UsageMistake(f"'progress' is called with the fraction done; {progress!r} cannot be called")
    if not isinstance(given.get("experiment") or "", str):
        raise UsageMistake(f"'experiment' is a name, not {given['experiment']!r}")
