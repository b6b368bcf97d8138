"""Settings of a question: fields of a frozen struct, each with what it means and how people write it.

A field whose type is ``Annotated[..., settable(description, kind)]`` can be set from outside: by the command line, from Python
and in files, all of which read this one place. Fields without it are for callers in Python only.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import get_type_hints

from msgspec import Meta, Struct, field

KINDS = (
    *("time", "number", "count", "flag", "text", "names", "place", "ranges", "directions"),
    *(
        "formula",
        "formulas",
        "condition",
        "surface",
        "interval",
        "energy",
        "free",
        "amounts",
        "data",
        "point",
    ),
    *("varying", "kept", "share", "matrix", "seconds", "cluster", "frequencies"),
)
"""How a setting is written: a time (``"250 ms"``, a bare number is SI), a number, a whole number, yes or no, a word,
names of quantities, a state (``Place``), ranges of values (``Range``), names of parameters, initial values and inputs, a
formula of the model (``Formula``), several with or without names, a condition (1 where it holds), where a formula has a value (``FormulaSurface``), a time or a
formula of it, an energy,
what a search may change (``Free``), amounts of quantities, measured motions, a point by its coordinates, the members of an
ensemble (``ensembles/members.py``), what is kept of them (``Kept``), all, none or a share, a matrix of numbers, seconds of a
clock, a Dask cluster, frequencies (``Frequencies``)."""

FORMULAS = ("formula", "formulas", "condition", "surface", "interval", "kept")
"""The kinds that may hold formulas, which are compiled with the model."""

FROM_OUTSIDE = ("data", "varying", "cluster")
"""The kinds whose texts may name what changes outside: files, a cluster."""

START, EQUILIBRIUM = "start", "equilibrium"


class Place(Struct, frozen=True):
    """A state that a study is asked about: the ``word`` start or equilibrium, or the start with other ``values`` (SI)."""

    word: str = START
    values: Mapping[str, float] = field(default_factory=dict)


class Range(Struct, frozen=True):
    """The values of a parameter, an initial value or an input from ``low`` to ``high`` in SI; ``count`` of them, where that was said."""

    name: str
    unit: str
    low: float
    high: float
    count: int | None = None


class Frequencies(Struct, frozen=True):
    """Angular frequencies in rad per unit of time: ``values`` as they were listed, or from ``low`` to ``high``, ``count`` of them where that
    was said. ``hertz``: they were given in cycles; ``bare``: without a unit."""

    values: tuple[float, ...] = ()
    low: float = 0.0
    high: float = 0.0
    count: int | None = None
    hertz: bool = False
    bare: bool = False


class Formula(Struct, frozen=True):
    """A quantity of the model by its ``name``, and the ``text`` by which it was asked for."""

    name: str
    text: str


class FormulaSurface(Struct, frozen=True):
    """Where the quantity ``name`` has the value ``level``, in SI; ``text`` as it was written."""

    name: str
    level: float
    text: str


class Free(Struct, frozen=True):
    """A parameter, an initial value or an input that a search may change, in SI; bounds are None where they were not given."""

    name: str
    unit: str
    low: float | None = None
    high: float | None = None


class QuestionSetting(Struct, frozen=True):
    """One setting of a question: the name of its field, what it means, how it is written (``KINDS``), and what people
    call it where that is not the field's name."""

    name: str
    description: str
    kind: str
    option: str


def settable(description: str, kind: str, *, option: str = "") -> Meta:
    """Mark a field as one that can be set from outside; ``option``: what people call it, if not by its name."""
    assert kind in KINDS
    return Meta(description=description, extra={"kind": kind, "option": option})


@functools.cache
def settings_of(question: type[Struct]) -> tuple[QuestionSetting, ...]:
    """Give the settings of a question in the order of its fields, without those that it does not use."""
    found = []
    unused = getattr(question, "unused", ())
    for name, hint in get_type_hints(question, include_extras=True).items():
        for meta in getattr(hint, "__metadata__", ()):
            if isinstance(meta, Meta) and meta.extra and meta.description and name not in unused:
                found.append(
                    QuestionSetting(name, meta.description, meta.extra["kind"], meta.extra["option"] or name)
                )
    return tuple(found)
