"""Shapes of the library that touch each other, as statements of a model in which a parameter switches them on."""

from __future__ import annotations

from .writing import Writer

SHAPES = ("Plane", "Sphere", "Capsule", "Box", "Cylinder")
PAIRS = (
    ("Plane", "Sphere"),
    ("Plane", "Capsule"),
    ("Plane", "Box"),
    ("Plane", "Cylinder"),
    ("Sphere", "Sphere"),
    ("Sphere", "Capsule"),
    ("Sphere", "Box"),
    ("Sphere", "Cylinder"),
    ("Capsule", "Box"),
    ("Capsule", "Capsule"),
    ("Box", "Box"),
)
"""What the library has contacts of."""
SWITCH = 'structural parameter Boolean contacts = false "whether shapes touch";'
"""What stands at the head of a model with contacts."""


def meet(one: str, other: str) -> bool:
    """Tell whether the library has contacts of two shapes."""
    return (one, other) in PAIRS or (other, one) in PAIRS


class Touching:
    """Collects shapes and what they touch."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._shapes: list[str] = []
        self._given: set[tuple[str, str]] = set()
        self._pairs: dict[tuple[str, str], list[str]] = {}
        self._kinds: set[str] = set()

    def shape(self, given: str, body: str, kind: str, settings: str, where: str) -> str:
        """Set a shape; returns its name, after that of the body where the file gives none of its own."""
        name, count = given, 0
        while not name or (kind, name) in self._given:
            count += 1
            name = f"{body}_{kind.lower()}" + (f"_{count}" if count > 1 else "")
        self._given.add((kind, name))
        name = self._writer.name(kind.lower(), name)
        self._kinds.add(kind)
        self._shapes.append(f"shape {name}: {kind}{settings} on {where};")
        return name

    def touch(self, one: str, other: str, friction: str) -> None:
        """Let two shapes touch, with a coefficient of dry friction as it is written, or none."""
        self._pairs.setdefault((one, friction), []).append(other)

    def used(self) -> tuple[str, ...]:
        """Return the parts of the library."""
        return tuple(kind for kind in SHAPES if self._pairs and kind in self._kinds)

    def statements(self, *first: str) -> str:
        """Return what a model says of contacts, ``first`` at the head; empty where nothing touches."""
        if not self._pairs:
            return ""
        pairs = [
            f"contact {one} with {', '.join(others)}{f' friction {friction}' if friction else ''};"
            for (one, friction), others in self._pairs.items()
        ]
        return "if contacts then\n" + "\n".join([*first, *self._shapes, *pairs]) + "\nend if;"
