"""Rotations as they are written: ``rotz(30 deg)*rotx(10 deg)``, ``axis_angle({1, 1, 0}, 0.2)``, as unit quaternions."""

from __future__ import annotations

import math
import re

from .parse_values import UsageMistake, read_value

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
                f"'{name}': '{part}' is no rotation",
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
