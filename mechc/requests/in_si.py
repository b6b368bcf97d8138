"""Settings in SI: values as people give them, spread over the elements of vectors; rotations as unit quaternions."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping

from .parse_values import (
    Given,
    GivenValue,
    Scalar,
    UsageMistake,
    elements_of,
    plain,
    read_value,
    read_value_of,
    shown,
    unknown_name,
)


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


_FACTOR = re.compile(r"\s*(rotx|roty|rotz|axis_angle)\s*\((.*)\)\s*", re.DOTALL)
_AXES = {"rotx": (1.0, 0.0, 0.0), "roty": (0.0, 1.0, 0.0), "rotz": (0.0, 0.0, 1.0)}
_BETWEEN = re.compile(r"\)\s*\*(?=\s*[a-z])")

Quaternion = tuple[float, float, float, float]


def is_rotation(text: object) -> bool:
    """Tell whether a value is written as rotations and not as numbers."""
    return isinstance(text, str) and text.lstrip().startswith((*_AXES, "axis_angle"))


def read_rotation(name: str, text: str) -> Quaternion:
    """Read a product of rotations, the outer ones first as in a model; scalar part first. Raises UsageMistake."""
    whole: Quaternion = (1.0, 0.0, 0.0, 0.0)
    parts = _BETWEEN.split(text)
    for part in (*(p + ")" for p in parts[:-1]), parts[-1]):
        found = _FACTOR.fullmatch(part)
        if found is None:
            raise UsageMistake(
                f"'{name}': '{part}' is not a rotation",
                "one is written as rotz(30 deg)*axis_angle({1, 1, 0}, 0.2)",
            )
        try:
            whole = _product(whole, _factor(found[1], found[2]))
        except UsageMistake as mistake:
            raise UsageMistake(f"'{name}': {mistake.message}", mistake.help) from None
    return whole


def _factor(function: str, inside: str) -> Quaternion:
    axis, angle = _AXES.get(function, (0.0, 0.0, 0.0)), inside
    if function == "axis_angle":
        vector, brace, angle = inside.partition("}")
        numbers = read_value(vector + brace).numbers if brace else ()
        if len(numbers) != 3 or not angle.lstrip().startswith(","):
            raise UsageMistake(
                f"axis_angle takes an axis and an angle, not '{inside}'", "axis_angle({1, 1, 0}, 0.2)"
            )
        length, angle = math.hypot(*numbers), angle.lstrip()[1:]
        if not length > 0:
            raise UsageMistake(f"the axis {vector}{brace} has no direction")
        axis = (numbers[0] / length, numbers[1] / length, numbers[2] / length)
    value = read_value(angle)
    if not value.single:
        raise UsageMistake(f"an angle is one number, not '{angle.strip()}'")
    (half,) = (number / 2 for number in value.in_unit("rad", "the angle"))
    sine = math.sin(half)
    return math.cos(half), sine * axis[0], sine * axis[1], sine * axis[2]


def _product(p: Quaternion, q: Quaternion) -> Quaternion:
    (a, b, c, d), (e, f, g, h) = p, q
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )
