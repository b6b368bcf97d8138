"""The triangles of a COLLADA file (https://www.khronos.org/collada/), in metres.

The axis that points up is left as it is, as programs for robots leave it: links have axes of their own.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise

Corner = tuple[float, float, float]
Triangle = tuple[Corner, Corner, Corner]
Rows = tuple[tuple[float, ...], ...]
"""Three rows of four: a map of the space that keeps lines."""

FACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")


def collada_triangles(data: bytes, name: str) -> list[Triangle]:
    """Return the triangles of all shapes where the scene places them; faces of more corners are cut. Raises ValueError."""
    try:
        root = ET.fromstring(data)
        return list(_File(root, name).triangles())
    except (ET.ParseError, KeyError, IndexError) as error:
        raise ValueError(f"'{name}' is not a COLLADA file: {error.args[0]}") from None
    except RecursionError:
        raise ValueError(f"'{name}' is not a COLLADA file: a node holds itself") from None


class _File:
    def __init__(self, root: ET.Element, name: str) -> None:
        self.name = name
        for element in root.iter():
            element.tag = element.tag.rpartition("}")[2]
        if root.tag != "COLLADA":
            raise ValueError(f"'{name}' is not a COLLADA file: it begins with '{root.tag}'")
        self.by_id = {one.get("id"): one for one in root.iter() if one.get("id")}
        self.root = root

    def triangles(self) -> Iterator[Triangle]:
        unit = self.root.find("asset/unit")
        size = float(unit.get("meter", "1")) if unit is not None else 1.0
        metres: Rows = ((size, 0.0, 0.0, 0.0), (0.0, size, 0.0, 0.0), (0.0, 0.0, size, 0.0))
        shown = self.root.find("scene/instance_visual_scene")
        if shown is None:
            for geometry in self.root.iter("geometry"):
                yield from self.geometry(geometry, metres)
            return
        for node in self.of(shown).findall("node"):
            yield from self.node(node, metres)

    def of(self, instance: ET.Element, at: str = "url") -> ET.Element:
        """Return what an element points to. Raises KeyError."""
        target = instance.get(at, "")
        if target.removeprefix("#") not in self.by_id:
            raise KeyError(f"there is no '{target}'")
        return self.by_id[target.removeprefix("#")]

    def node(self, node: ET.Element, placed: Rows) -> Iterator[Triangle]:
        for child in node:
            if child.tag in _TURNS:
                count, turn = _TURNS[child.tag]
                placed = _times(placed, turn(self.numbers(child, count)))
            elif child.tag in ("lookat", "skew"):
                raise ValueError(f"'{self.name}' places a shape by '{child.tag}', which is not read")
        for child in node:
            match child.tag:
                case "node":
                    yield from self.node(child, placed)
                case "instance_node":
                    yield from self.node(self.of(child), placed)
                case "instance_geometry":
                    yield from self.geometry(self.of(child), placed)
                case "instance_controller":
                    raise ValueError(f"'{self.name}' holds a shape with joints of its own, which is not read")

    def numbers(self, element: ET.Element, count: int | None = None) -> list[float]:
        words = (element.text or "").split()
        try:
            found = [float(word) for word in words]
        except ValueError:
            found = []
        if len(found) != (len(words) if count is None else count):
            raise ValueError(f"'{self.name}' is not a COLLADA file: '{element.tag}' is not so many numbers")
        return found

    def geometry(self, geometry: ET.Element, placed: Rows) -> Iterator[Triangle]:
        for faces in geometry.iterfind("mesh/*"):
            if faces.tag not in FACES:
                continue
            inputs = faces.findall("input")
            step = 1 + max((int(one.get("offset", "0")) for one in inputs), default=0)
            vertex = _meaning(inputs, "VERTEX")
            corners = [_moved(placed, corner) for corner in self.corners(self.of(vertex, "source"))]
            offset = int(vertex.get("offset", "0"))
            counts = (
                [int(k) for k in self.numbers(one)] if (one := faces.find("vcount")) is not None else None
            )
            for p in faces.iter("p"):
                places = [int(k) for k in self.numbers(p)][offset::step]
                for a, b, c in _cut(faces.tag, places, counts):
                    yield corners[a], corners[b], corners[c]

    def corners(self, vertices: ET.Element) -> list[Corner]:
        source = self.of(_meaning(vertices.findall("input"), "POSITION"), "source")
        accessor = source.find("technique_common/accessor")
        if accessor is None:
            raise KeyError("a source has no accessor")
        values = self.numbers(self.of(accessor, "source"))
        start, step = int(accessor.get("offset", "0")), int(accessor.get("stride", "1"))
        firsts = range(start, start + step * int(accessor.get("count", "0")), step)
        return [(values[k], values[k + 1], values[k + 2]) for k in firsts]


def _meaning(inputs: Sequence[ET.Element], what: str) -> ET.Element:
    """Return the input with a meaning. Raises KeyError."""
    for one in inputs:
        if one.get("semantic") == what:
            return one
    raise KeyError(f"there is no input '{what}'")


def _cut(kind: str, places: Sequence[int], counts: list[int] | None) -> Iterator[tuple[int, int, int]]:
    """Cut faces into triangles."""
    if kind == "tristrips":
        for k in range(len(places) - 2):
            a, b, c = places[k : k + 3]
            yield (a, c, b) if k % 2 else (a, b, c)
        return
    if kind == "triangles":
        counts = [3] * (len(places) // 3)
    start = 0
    for count in counts if counts is not None else [len(places)]:
        face = places[start : start + count]
        start += count
        for b, c in pairwise(face[1:]):
            yield face[0], b, c


def _translated(given: list[float]) -> Rows:
    x, y, z = given
    return ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z))


def _scaled(given: list[float]) -> Rows:
    x, y, z = given
    return ((x, 0.0, 0.0, 0.0), (0.0, y, 0.0, 0.0), (0.0, 0.0, z, 0.0))


def _turned(given: list[float]) -> Rows:
    *axis, degrees = given
    size = math.hypot(*axis) or 1.0
    x, y, z = (a / size for a in axis)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    d = 1 - c
    return (
        (c + x * x * d, x * y * d - z * s, x * z * d + y * s, 0.0),
        (y * x * d + z * s, c + y * y * d, y * z * d - x * s, 0.0),
        (z * x * d - y * s, z * y * d + x * s, c + z * z * d, 0.0),
    )


def _rows(given: list[float]) -> Rows:
    return tuple(tuple(given[k : k + 4]) for k in (0, 4, 8))


_TURNS: Mapping[str, tuple[int, Callable[[list[float]], Rows]]] = {
    "translate": (3, _translated),
    "scale": (3, _scaled),
    "rotate": (4, _turned),
    "matrix": (16, _rows),
}
"""By the element that places a node: how many numbers it has, and what they mean."""


def _times(first: Rows, then: Rows) -> Rows:
    """Return the map that does ``then``, and ``first`` after it."""
    return tuple(
        tuple(sum(row[i] * then[i][k] for i in range(3)) + (row[3] if k == 3 else 0.0) for k in range(4))
        for row in first
    )


def _moved(by: Rows, corner: Corner) -> Corner:
    x, y, z = (row[0] * corner[0] + row[1] * corner[1] + row[2] * corner[2] + row[3] for row in by)
    return x, y, z
