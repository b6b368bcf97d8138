"""What is varied, as people write it: ``m, l = 0.5 m .. 2 m, theta = 0 .. 1 rad, 200``, for searches and for scans alike."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from msgspec import Struct

from ..runtime.settings import Free, Range
from .in_si import settings_in_si
from .parse_values import UsageMistake, elements_of, shown, tidy, unknown_name

_COMMA = re.compile(r",(?![^\[\](){}]*[\])}])")
"""A comma that stands in no brackets."""


class Varied(Struct, frozen=True):
    """One item of such a list: a name, the text or the numbers of its range, and the number of values; None where not said."""

    name: str
    ends: tuple[Any, Any] | None = None
    count: str | None = None


def varied(setting: str, given: str | Mapping[str, Any]) -> list[Varied]:
    """Take a list of what is varied apart. ``given``: a text, a mapping from names to ranges, or several names.

    A range is a text ``"LOW .. HIGH"``, with ``", COUNT"`` where a number of values is meant, or (low, high) or (low, high,
    count). Raises UsageMistake.
    """
    if isinstance(given, str):
        return _in_text(setting, given)
    if not isinstance(given, Mapping):
        return [Varied(tidy(str(name))) for name in given]
    found = []
    for name, what in given.items():
        if what is None:
            found.append(Varied(tidy(name)))
        elif isinstance(what, str):
            found += _in_text(setting, f"{name} = {what}")
        else:
            ends = tuple(what)
            if len(ends) not in (2, 3):
                raise UsageMistake(f"the values of '{name}' are a range (low, high), not {shown(what)}")
            found.append(Varied(tidy(name), (ends[0], ends[1]), str(ends[2]) if len(ends) == 3 else None))
    return found


def _in_text(setting: str, text: str) -> list[Varied]:
    found: list[Varied] = []
    for part in _COMMA.split(text):
        name, sign, what = (piece.strip() for piece in part.partition("="))
        if not sign and re.fullmatch(r"\d+", name) and found and found[-1].ends and not found[-1].count:
            found[-1] = Varied(found[-1].name, found[-1].ends, name)
            continue
        if not part.strip() and text.strip():
            raise UsageMistake(
                f"'{text.strip()}' has a comma with no name after or before it",
                f"names are one text, without blanks or in quotes: --{setting} A,B",
            )
        if not name or (sign and not what):
            raise UsageMistake(
                f"'{setting}' takes names, with ranges where they are meant, not '{part.strip()}'",
                f'{setting} = "a, b = 0 .. 1"',
            )
        if not sign and len(several := re.sub(r"\[[^]]*\]", "", name).split()) > 1 and "(" not in name:
            raise UsageMistake(
                f"'{name}' is not one name: names are separated by commas", f"{', '.join(several)}"
            )
        low, dots, high = (piece.strip() for piece in what.partition(".."))
        if sign and not (dots and low and high):
            raise UsageMistake(f"the values of '{name}' are a range, not '{what}'", f'"{name} = LOW .. HIGH"')
        found.append(Varied(tidy(name), (low, high) if sign else None))
    return found


def ranges(setting: str, given: Any, units: Mapping[str, str]) -> tuple[Range, ...]:
    """Read ranges of values. ``units``: SI units of what may be varied. Raises UsageMistake for names without a range."""
    found = []
    for item in varied(setting, given):
        _known(item.name, units)
        if item.ends is None:
            raise UsageMistake(
                f"the values of '{item.name}' are missing",
                f'a range, {setting} = "{item.name} = 0 .. 1", or with a number of values "{item.name} = 0 .. 1, 20"',
            )
        count = None
        if item.count is not None:
            count = int(item.count) if item.count.isdigit() else 0
            if not count:
                raise UsageMistake(
                    f"the number of values of '{item.name}' is a whole number from 1 on, not {item.count}"
                )
        low, high = _limits(item, units[item.name])
        found.append(Range(item.name, units[item.name], low, high, count))
    return tuple(found)


def free(setting: str, given: Any, units: Mapping[str, str]) -> tuple[Free, ...]:
    """Read what a search may change, with bounds where they are given; a vector stands for its elements."""
    found: list[Free] = []
    for item in varied(setting, given):
        if item.count is not None:
            raise UsageMistake(
                f"'{item.name}' is searched between bounds, which have no number of values",
                f'"{item.name} = LOW .. HIGH"',
            )
        names = elements_of(item.name, units)
        if not names:
            raise unknown_name("parameter, initial value or input", item.name, units)
        low, high = (None, None) if item.ends is None else _limits(item, units[names[0]])
        for name in names:
            if name in (other.name for other in found):
                raise UsageMistake(f"'{name}' is free twice")
            found.append(Free(name, units[name], low, high))
    return tuple(found)


def _known(name: str, units: Mapping[str, str]) -> None:
    if name not in units:
        raise unknown_name("parameter, initial value or input", name, units)


def _limits(item: Varied, unit: str) -> tuple[float, float]:
    """Return both ends of a range in SI; the unit of the upper end serves a bare lower one. Raises UsageMistake."""
    assert item.ends is not None
    low, high = item.ends
    if isinstance(low, str) and isinstance(high, str):
        low = unit_of_the_other(low, high)
    ends = [settings_in_si({item.name: end}, {item.name: unit})[item.name] for end in (low, high)]
    if not ends[0] < ends[1]:
        raise UsageMistake(
            f"the range of '{item.name}' goes from a lower to a higher value, not from {item.ends[0]} to {item.ends[1]}"
        )
    return ends[0], ends[1]


def unit_of_the_other(low: str, high: str) -> str:
    """Return ``0`` as ``0 rad/s`` where only the upper end has a unit."""
    unit = high.lstrip("+-.0123456789eE ").strip()
    bare = not low.strip("+-.0123456789eE ")
    return f"{low} {unit}" if bare and unit else low
