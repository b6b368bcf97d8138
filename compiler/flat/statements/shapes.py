"""The shapes that can be drawn, with their arguments, and the names of colours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from msgspec import Struct

ArgumentKind = Literal["length", "lengths", "vector", "axis", "corners", "count", "text", "file"]
"""``length``: one, not negative; ``lengths``: one for each edge; ``vector``: a displacement; ``axis``: a direction of
any length; ``corners``: points in the axes of the frame; ``count``: a whole number that is known when compiling."""


class Argument(Struct, frozen=True):
    """``relative``: where it is left out, the size is chosen with the whole picture in view."""

    name: str
    kind: ArgumentKind
    optional: bool = False
    relative: bool = False


class Shape(Struct, frozen=True):
    """``points``: least and most points that it goes through; ``place``: whether it stands ``on`` a frame or ``at`` a
    point: never, always, or where the axes of the world are not meant; ``samples``: its variables ``s in a:b``."""

    words: str
    arguments: tuple[Argument, ...] = ()
    points: tuple[int, int | None] = (0, 0)
    place: Literal["never", "always", "may"] = "always"
    samples: int = 0


_AXIS = Argument("axis", "axis", optional=True)
_RADIUS = Argument("radius", "length")

SHAPES: Mapping[str, Shape] = {
    "box": Shape("a box about the origin of a frame", (Argument("size", "lengths"),)),
    "sphere": Shape("a ball", (Argument("radius", "length", optional=True, relative=True),)),
    "cylinder": Shape("a cylinder about the origin, along x", (_RADIUS, Argument("length", "length"), _AXIS)),
    "cone": Shape(
        "a cone from its base at the origin, along x", (_RADIUS, Argument("length", "length"), _AXIS)
    ),
    "torus": Shape("a ring around z", (_RADIUS, Argument("tube", "length"), _AXIS)),
    "disk": Shape(
        "a flat disk around z", (Argument("radius", "length", optional=True, relative=True), _AXIS)
    ),
    "polygon": Shape("a closed line through corners", (Argument("corners", "corners"),)),
    "mesh": Shape(
        "the surface of an STL or OBJ file", (Argument("file", "file"), Argument("scale", "length"))
    ),
    "frame": Shape(
        "three axes", (Argument("size", "length", optional=True, relative=True),), (1, 1), "never"
    ),
    "line": Shape("a line through points", (), (2, None), "never"),
    "spring": Shape(
        "a helix between two points",
        (
            Argument("radius", "length", optional=True, relative=True),
            Argument("turns", "count", optional=True),
        ),
        (2, 2),
        "never",
    ),
    "trail": Shape("the path of a point up to now", (), (1, 1), "never"),
    "arrow": Shape("an arrow", (Argument("vector", "vector"),)),
    "text": Shape("a text beside a point", (Argument("text", "text"),)),
    "curve": Shape("a curve", (Argument("point", "vector"),), (0, 0), "may", 1),
    "surface": Shape("a surface", (Argument("height", "vector"),), (0, 0), "may", 2),
}

TURNS = 8
"""Turns of a spring that says nothing of them."""

COLOURS: Mapping[str, str] = {
    "black": "#000000",
    "white": "#ffffff",
    "grey": "#808080",
    "gray": "#808080",
    "silver": "#c0c0c0",
    "steel": "#8796a5",
    "iron": "#5a6068",
    "brass": "#c5a14a",
    "copper": "#b87333",
    "gold": "#d4a017",
    "wood": "#a8763e",
    "rubber": "#33363b",
    "red": "#d1493f",
    "orange": "#e08a2c",
    "yellow": "#e3c12f",
    "green": "#3f9b57",
    "teal": "#2a9d8f",
    "blue": "#3572b0",
    "navy": "#27406b",
    "purple": "#7b559e",
    "pink": "#d47fa6",
    "brown": "#7d5538",
}
"""What a colour may be called; ``#rrggbb`` says any other."""
