"""Settings in SI: values as people give them, spread over the elements of vectors, rotations whole."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping

from .parse_values import (
    Given,
    GivenValue,
    Scalar,
    UsageMistake,
    elements_of,
    plain,
    read_value_of,
    shown,
    unknown_name,
)
from .rotations import is_rotation, read_rotation


def settings_in_si(
    given: Mapping[str, Given], units: Mapping[str, str], rotations: Collection[str] = ()
) -> dict[str, float]:
    """Convert settings to SI and spread lists over the elements ``name[1]``, ``name[2]``, ...

    ``units`` maps each name that may be set to its SI unit; ``rotations`` are names whose numbers make sense
    together only. One value fills all elements; one for an element goes before one for the whole.
    Raises UsageMistake.
    """
    plainly = {n: w for n, w in given.items() if type(w) is float and math.isfinite(w) and n in units}
    if len(plainly) == len(given) and not plainly.keys() & set(rotations):
        return plainly
    settings: dict[str, float] = {}
    named = [(name, what, elements_of(name, units)) for name, what in given.items()]
    for name, what, elements in sorted(named, key=lambda item: -len(item[2])):
        if name in rotations and is_rotation(what):
            settings.update(zip(elements, read_rotation(name, str(what)), strict=True))
            continue
        if not elements:
            raise unknown_name("parameter or initial value", name, units)
        value = _as_value(name, plain(what))
        numbers = value.in_unit(units[elements[0]], name)
        if value.single and name in rotations:
            raise UsageMistake(
                f"'{name}' is a rotation, which has {len(elements)} numbers",
                f"give it whole, as in {name}='rotz(30 deg)*rotx(0.2)', or as a unit quaternion: {name}={{1, 0, 0, 0}}",
            )
        if value.single:
            numbers *= len(elements)
        if name in units and len(numbers) != 1:
            raise UsageMistake(
                f"'{name}' is one number, {len(numbers)} were given",
                f"run once for each, or write an experiment with '{name} in {{...}}'",
            )
        if len(numbers) != len(elements):
            raise UsageMistake(f"'{name}' has {len(elements)} element(s), {len(numbers)} were given")
        settings.update(zip(elements, numbers, strict=True))
    return settings


def _as_value(name: str, what: Scalar | Iterable[float]) -> GivenValue:
    """Return what was given as numbers with their unit. Raises UsageMistake."""
    if isinstance(what, str):
        return read_value_of(name, what)
    single = isinstance(what, (int, float))
    try:
        numbers = (float(what),) if isinstance(what, (int, float)) else tuple(float(x) for x in what)
    except (TypeError, ValueError):
        raise UsageMistake(
            f"'{name}' takes a number, a text such as \"80 cm\" or a list of numbers, not {shown(what)}"
        ) from None
    if not all(math.isfinite(number) for number in numbers):
        raise UsageMistake(f"'{name}' takes finite numbers, not {shown(what)}")
    return GivenValue(numbers, None, single)
