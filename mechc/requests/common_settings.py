"""What every question may be given beside its settings."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..runtime.studies.study import Study
from ..runtime.studies.table import kind_of
from ..suggest import closest, setting_meant
from .parse_values import UsageMistake, shown

if TYPE_CHECKING:
    from ..runtime.results.streamed import Streamed

AROUND = ("experiment", "inputs", "progress", "to")


def check_around(given: Mapping[str, Any]) -> None:
    """Raise UsageMistake for what stands around a question and is of a wrong kind."""
    inputs = given.get("inputs")
    if inputs is not None and not isinstance(inputs, Mapping):
        given_as = repr(inputs) if isinstance(inputs, (str, int, float)) else f"a {type(inputs).__name__}"
        raise UsageMistake(
            f"'inputs' are tables or functions by the names of inputs, not {given_as}",
            'as in inputs={"push": "push.csv"}',
        )
    for name, what in (inputs or {}).items():
        if isinstance(what, (int, float)):
            raise UsageMistake(
                f"the input '{name}' comes from a table or a function of the time, not from {shown(what)}",
                f"a value that stays is set, as in set={{'{name}': {shown(what)}}}",
            )
    progress = given.get("progress")
    if progress is not None and not callable(progress):
        raise UsageMistake(f"'progress' is called with the fraction done; {shown(progress)} cannot be called")
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


def around_of(question: type[Study], given: Mapping[str, Any], known: Collection[str]) -> dict[str, Any]:
    """Take out what stands around a question whose settings are ``known``; some have one that is called ``to``. Raises
    UsageMistake, ResultsFileError."""
    check_around(given)
    around = {n: given[n] for n in AROUND if given.get(n) is not None and (n != "to" or n not in known)}
    return around | ({"to": file_of(question, around["to"], given)} if "to" in around else {})


def file_of(question: type[Study], to: Any, given: Mapping[str, Any]) -> Streamed:
    """Return the file that a run writes while it goes on. Raises UsageMistake, ResultsFileError."""
    from ..runtime.results.streamed import Streamed
    from ..runtime.studies.runs.simulate import Run

    if not issubclass(question, Run):
        raise UsageMistake(
            "'to' is for a run: this question has no points that it could write", "leave it out"
        )
    if given.get("sensitivity"):
        raise UsageMistake(
            "derivatives of a motion are known at its end only, and are no columns of a file that grows with the run",
            "write the file after the run: --output without --streamed, solution.save(path) in Python",
        )
    return to if isinstance(to, Streamed) else Streamed(Path(to))
