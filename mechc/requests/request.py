"""A question as it was put, before anything of it is read, and what every question may be given beside its settings."""

from __future__ import annotations

import functools
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field
from msgspec.structs import replace

from ..runtime.case import Progress
from ..runtime.settings import FORMULAS, FROM_OUTSIDE, QuestionSetting, settings_of
from ..runtime.studies.study import Study
from ..runtime.studies.table import kind_of
from ..suggest import closest, setting_meant
from .parse_values import UsageMistake, shown

if TYPE_CHECKING:
    from ..runtime.results.streamed import Streamed


class Asked(Struct, frozen=True):
    """A question as it was put: ``given`` are its settings by name, texts with units where people may write them.

    ``inputs`` are tables or functions by the name of the input; ``progress`` is called with the fraction done; ``to`` is the file (``Streamed``) that a run grows.
    ``lasts``: whoever puts the question again has this very value, and it names nothing that may have changed meanwhile.
    """

    question: type[Study]
    experiment: str | None = None
    given: Mapping[str, object] = field(default_factory=dict)
    inputs: Mapping[str, Any] = field(default_factory=dict)
    progress: Progress | None = None
    to: Any = None
    lasts: bool = False

    def changed(self, **settings: object) -> Asked:
        """Return the same question with other settings."""
        return replace(self, given={**self.given, **settings}, lasts=False)


SIMPLE = frozenset({str, float, int, bool, type(None)})


class Known(Struct, frozen=True):
    """What can be given to a question: its settings by name, names that people use for them, those that hold lists of texts,
    those that may hold formulas, and those that may name files."""

    settings: Mapping[str, QuestionSetting]
    called: Mapping[str, str]
    lists: Collection[str]
    formulas: Sequence[str]
    outside: Collection[str]


@functools.cache
def known_of(question: type[Study]) -> Known:
    """Return what can be given to a question."""
    settings = settings_of(question)
    return Known(
        {s.name: s for s in settings},
        {s.option: s.name for s in settings if s.option != s.name},
        {s.name for s in settings if s.kind == "kept"},
        [s.name for s in settings if s.kind in FORMULAS],
        {s.name for s in settings if s.kind in FROM_OUTSIDE},
    )


def asked(question: type[Study], given: Mapping[str, Any]) -> Asked:
    """Take what was given apart. Raises UsageMistake for a setting that the question has not."""
    types = tuple(map(type, given.values()))
    if SIMPLE.issuperset(types) and given.get("to") is None:
        return _asked_simply(question, types, *given, *given.values())
    return _asked(question, given)


@functools.lru_cache(maxsize=64)
def _asked_simply(question: type[Study], types: tuple[type, ...], *given: Any) -> Asked:
    """Take apart what is made of values that nobody can change: their names, then they. The types tell ``True`` from 1."""
    made = _asked(question, dict(zip(given[: len(types)], given[len(types) :], strict=True)))
    return replace(made, lasts=not known_of(question).outside & made.given.keys())


def _asked(question: type[Study], given: Mapping[str, Any]) -> Asked:
    of = known_of(question)
    known, called, lists = of.settings, of.called, of.lists
    # the tables of inputs are a mapping, names of them are none
    if called:
        given = {called.get(n, n) if not isinstance(what, Mapping) else n: what for n, what in given.items()}
    for name in given:
        if name not in known and name not in AROUND:
            raise unknown_setting(question, name, [*known])
    if lists:
        given = {
            n: ", ".join(w) if n in lists and isinstance(w, (list, tuple)) else w for n, w in given.items()
        }
    around = around_of(question, given, known)
    return Asked(question, given={n: v for n, v in given.items() if n in known and v is not None}, **around)


def holds_formulas(it: Asked) -> bool:
    """Whether a setting that may hold formulas was given."""
    return any(isinstance(it.given.get(name), str) for name in known_of(it.question).formulas)


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
            "derivatives of a motion are known at its end only, and are not columns of a file that grows with the run",
            "write the file after the run: --output without --streamed, solution.save(path) in Python",
        )
    return to if isinstance(to, Streamed) else Streamed(Path(to))
