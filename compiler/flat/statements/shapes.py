"""The shapes that can be drawn, with their arguments, and the names of colours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from msgspec import Struct

ArgumentKind = Literal["length", "lengths", "scale", "vector", "axis", "corners", "count", "text", "file"]
"""``length``: one, not negative; ``lengths``: one for each edge; ``scale``: one, or one for each axis, where a negative one
mirrors; ``vector``: a displacement; ``axis``: a direction of
any length; ``corners``: points in the axes of the frame; ``count``: a whole number that is known when compiling."""


class ShapeArgument(Struct, frozen=True):
    """``relative``: where it is left out, the size is chosen with the whole picture in view."""

    name: str
    kind: ArgumentKind
    optional: bool = False
    relative: bool = False


class ShapeKind(Struct, frozen=True):
    """``points``: least and most points that it goes through; ``place``: whether it stands ``on`` a frame or ``at`` a
    point: never, always, or where the axes of the world are not meant; ``samples``: its variables ``s in a:b``."""

    words: str
    arguments: tuple[ShapeArgument, ...] = ()
    points: tuple[int, int | None] = (0, 0)
    place: Literal["never", "always", "may"] = "always"
    samples: int = 0


_AXIS = ShapeArgument("axis", "axis", optional=True)
_RADIUS = ShapeArgument("radius", "length")

SHAPES: Mapping[str, ShapeKind] = {
    "box": ShapeKind("a box about the origin of a frame", (ShapeArgument("size", "lengths"),)),
    "sphere": ShapeKind("a ball", (ShapeArgument("radius", "length", optional=True, relative=True),)),
    "cylinder": ShapeKind(
        "a cylinder about the origin, along x", (_RADIUS, ShapeArgument("length", "length"), _AXIS)
    ),
    "cone": ShapeKind(
        "a cone from its base at the origin, along x", (_RADIUS, ShapeArgument("length", "length"), _AXIS)
    ),
    "torus": ShapeKind("a ring around z", (_RADIUS, ShapeArgument("tube", "length"), _AXIS)),
    "disk": ShapeKind(
        "a flat disk around z", (ShapeArgument("radius", "length", optional=True, relative=True), _AXIS)
    ),
    "plane": ShapeKind("an endless plane across z", (_AXIS,)),
    "polygon": ShapeKind("a closed line through corners", (ShapeArgument("corners", "corners"),)),
    "mesh": ShapeKind(
        "the surface of a mesh file", (ShapeArgument("file", "file"), ShapeArgument("scale", "scale"))
    ),
    "frame": ShapeKind(
        "three axes", (ShapeArgument("size", "length", optional=True, relative=True),), (1, 1), "never"
    ),
    "line": ShapeKind("a line through points", (), (2, None), "never"),
    "spring": ShapeKind(
        "a helix between two points",
        (
            ShapeArgument("radius", "length", optional=True, relative=True),
            ShapeArgument("turns", "count", optional=True),
        ),
        (2, 2),
        "never",
    ),
    "trail": ShapeKind("the path of a point up to now", (), (1, 1), "never"),
    "arrow": ShapeKind("an arrow", (ShapeArgument("vector", "vector"),)),
    "text": ShapeKind("a text beside a point", (ShapeArgument("text", "text"),)),
    "curve": ShapeKind("a curve", (ShapeArgument("point", "vector"),), (0, 0), "may", 1),
    "surface": ShapeKind("a surface", (ShapeArgument("height", "vector"),), (0, 0), "may", 2),
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
