"""The text of a model that is made from another format: its names, numbers, poses and statements."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from msgspec import Struct

from ..builtins import BUILTINS
from ..grammar.keywords import KEYWORDS

Vector = tuple[float, ...]
Matrix = tuple[Vector, ...]
Parts = Mapping[str, tuple[str, ...]]
"""By file of the library: the parts that a model uses."""


class Writer:
    """Collects statements. ``taken``: names that components may not have. ``changed``: names of the file that had to change;
    ``copies``: files that belong beside the model, from where they are."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = {*KEYWORDS, *BUILTINS, "world", "pi", "e", *taken}
        self._names: dict[tuple[str, str], str] = {}
        self.changed: dict[str, str] = {}
        self.statements: list[str] = []
        self.copies: Mapping[str, Path] = {}
        self._left: dict[str, list[int]] = {}

    def name(self, kind: str, given: str) -> str:
        """Return the name of what is called ``given`` in the file: the same, or one that the language allows and nothing has."""
        if (kind, given) in self._names:
            return self._names[kind, given]
        plain = re.sub(r"\W+", "_", given, flags=re.ASCII).strip("_") or kind
        plain = plain if plain[0].isalpha() else f"{kind}_{plain}"
        name, count = plain, 1
        for other in (plain, f"{plain}_{kind}", *(f"{plain}_{k}" for k in range(2, 10_000))):
            if other not in self._taken:
                name = other
                break
            count += 1
        self._taken.add(name)
        self._names[kind, given] = name
        if name != given:
            self.changed[f"{kind} {given}"] = name
        return name

    def say(self, statement: str) -> None:
        self.statements.append(statement)

    def gap(self) -> None:
        """Leave an empty line."""
        if self.statements and self.statements[-1]:
            self.statements.append("")

    def leave_out(self, what: str, line: int) -> None:
        """Note that the model does not hold something of the file."""
        self._left.setdefault(what, []).append(line)

    def left_out(self) -> list[str]:
        """Return what the model does not hold, each with its lines."""
        return [f"{what} ({_lines(lines)})" if any(lines) else what for what, lines in self._left.items()]


def _lines(lines: list[int]) -> str:
    there = sorted({line for line in lines if line})
    return f"line{'s' if len(there) > 1 else ''} {', '.join(map(str, there))}"


def number(value: float) -> str:
    """Return the shortest text that reads back as the same number."""
    text = repr(float(value))
    return "0" if value == 0 else text.removesuffix(".0")


def quantity(value: float, unit: str) -> str:
    return f"{number(value)} {unit}"


def vector(values: Sequence[float], unit: str = "") -> str:
    return "{" + ", ".join(map(number, values)) + "}" + (f" {unit}" if unit else "")


def each_axis(scale: Sequence[float]) -> str:
    """Return the length that 1 in a file is: one, or one for each axis where they differ or mirror."""
    same = len(set(scale)) == 1 and scale[0] > 0
    return quantity(scale[0], "m") if same else vector(scale, "m")


def matrix(rows: Matrix, unit: str) -> str:
    if all(rows[i][k] == 0 for i in range(3) for k in range(3) if i != k):
        return f"diag({vector([rows[i][i] for i in range(3)], unit)})"
    return "{" + ", ".join(map(vector, rows)) + "} " + unit


def text(value: str) -> str:
    return '"' + value.replace("\\", "\\\\").replace('"', "'").replace("\n", " ") + '"'


# ---------------------------------------------------------------- poses


def moved(frame: str, place: Sequence[float]) -> str:
    return f"{frame} * trans({vector(place, 'm')})" if any(place) else frame


def turned(frame: str, angles: Sequence[float]) -> str:
    """Turn by roll, pitch and yaw: about the fixed x, then y, then z."""
    for about, angle in zip("zyx", reversed(angles), strict=True):
        if angle:
            frame += f" * rot{about}({quantity(angle, 'rad')})"
    return frame


def turned_by_quaternion(frame: str, q: Sequence[float]) -> str:
    """Turn by a unit quaternion, its real part first."""
    if not any(q[1:]):
        return frame
    axis = [k for k in range(3) if q[k + 1]]
    if len(axis) == 1:
        angle = 2 * math.atan2(q[axis[0] + 1], q[0])
        return f"{frame} * rot{'xyz'[axis[0]]}({quantity(angle, 'rad')})"
    return f"{frame} * quat({', '.join(map(number, q))})"


def rotation(angles: Sequence[float]) -> Matrix:
    """Return the matrix of roll, pitch and yaw."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in angles)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


ROUNDING = 1e-14
"""Of the largest moment of an inertia that was turned: what is smaller is none."""


def in_axes(inertia: Matrix, turn: Matrix) -> Matrix:
    """Return R J R' as a symmetric matrix."""
    n = range(3)
    half = [[sum(turn[i][k] * inertia[k][j] for k in n) for j in n] for i in n]
    full = [[sum(half[i][k] * turn[j][k] for k in n) for j in n] for i in n]
    least = ROUNDING * max(abs(value) for row in full for value in row)
    even = [[(full[i][j] + full[j][i]) / 2 for j in n] for i in n]
    return tuple(tuple(value if abs(value) > least else 0.0 for value in row) for row in even)


def eigenvalues(J: Matrix) -> tuple[float, float, float]:
    """Return those of a symmetric matrix of three rows, rising (Smith, Comm. ACM 4, 1961)."""
    off = J[0][1] ** 2 + J[0][2] ** 2 + J[1][2] ** 2
    mean = (J[0][0] + J[1][1] + J[2][2]) / 3
    size = math.sqrt((sum((J[i][i] - mean) ** 2 for i in range(3)) + 2 * off) / 6)
    if size == 0:
        return mean, mean, mean
    B = [[(J[i][k] - (mean if i == k else 0)) / size for k in range(3)] for i in range(3)]
    half = (
        B[0][0] * (B[1][1] * B[2][2] - B[1][2] * B[2][1])
        - B[0][1] * (B[1][0] * B[2][2] - B[1][2] * B[2][0])
        + B[0][2] * (B[1][0] * B[2][1] - B[1][1] * B[2][0])
    ) / 2
    angle = math.acos(min(1.0, max(-1.0, half))) / 3
    high = mean + 2 * size * math.cos(angle)
    low = mean + 2 * size * math.cos(angle + 2 * math.pi / 3)
    return low, 3 * mean - high - low, high


class Wishes(Struct, frozen=True):
    """``source``: the file; ``folder``: where the model will stand. ``packages``: folders of ROS packages, or folders that hold
    some. ``floating``: whether the root moves freely. ``meshes``: linked where they lie, copied beside the model, or not drawn.
    """

    source: Path
    folder: Path
    packages: tuple[Path, ...] = ()
    floating: bool = False
    meshes: str = "link"
