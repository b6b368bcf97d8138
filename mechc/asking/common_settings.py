"""What every question may be given beside its settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..runtime.studies.study import Study
from ..runtime.studies.table import kind_of
from ..suggest import closest, setting_meant
from .given_values import TARGETS, UsageMistake, one_of

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


def unknown_setting(question: type[Study], name: str, known: Sequence[str]) -> UsageMistake:
    """Say that a question has no such setting, and what is near or why not."""
    kind = kind_of(question)
    meant = setting_meant(name)
    if said := kind.unused(name) or kind.unused(meant or ""):
        return UsageMistake(said, "leave it out")
    unknown = f"there is no option '{name}' of the study '{kind.name}'"
    if meant in known:
        return UsageMistake(unknown, f"that is called '{meant}' here")
    near = closest(name, [*known, *AROUND])
    return UsageMistake(
        unknown,
        (f"did you mean '{near}'? " if near else "")
        + f"values of the model are given as set={{'{name}': ...}}; the options are "
        + ", ".join((*AROUND, *known)),
    )
