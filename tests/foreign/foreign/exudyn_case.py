"""A system of Exudyn's tests and examples, and words that the texts share."""

from __future__ import annotations

from msgspec import Struct


class Example(Struct, frozen=True):
    """``read``: what is compared at the end, in the order of the reference."""

    name: str
    source: str
    text: str
    read: tuple[str, ...]


def xyz(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}[{k}]" for name in names for k in (1, 2, 3))


def xy(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}[{k}]" for name in names for k in (1, 2))


def spatial(*lines: str) -> str:
    return "\n".join(["import mech.spatial.*;", "gravity {0, 0, -9.81} m/s^2;", *lines])


def planar(*lines: str) -> str:
    return "\n".join(["import mech.planar.*;", "gravity {0, -9.81} m/s^2;", *lines])


def cells(name: str, rows: int, columns: int) -> tuple[str, ...]:
    return tuple(f"{name}[{i},{k}]" for i in range(1, rows + 1) for k in range(1, columns + 1))


def elements(name: str, n: int) -> tuple[str, ...]:
    return tuple(f"{name}[{k}]" for k in range(1, n + 1))
