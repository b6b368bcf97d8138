"""A question as it was put, before anything of it is read."""

from __future__ import annotations

import functools
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from msgspec import Struct, field
from msgspec.structs import replace

from ..runtime.case import Progress
from ..runtime.settings import FORMULAS, FROM_OUTSIDE, QuestionSetting, settings_of
from ..runtime.studies.study import Study
from .common_settings import AROUND, around_of, unknown_setting


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
