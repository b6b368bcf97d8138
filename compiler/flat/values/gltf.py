"""The triangles of a binary glTF file (https://registry.khronos.org/glTF), in metres and in the axes of the file."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

Corner = tuple[float, float, float]
Triangle = tuple[Corner, Corner, Corner]
Columns = Sequence[float]
"""A matrix of four columns of four, one after the other."""

STILL: Columns = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
WHOLE: Mapping[int, str] = {5121: "B", 5123: "H", 5125: "I"}
"""How numbers of corners are stored, by their code."""
LIST, STRIP, FAN = 4, 5, 6


def gltf_triangles(data: bytes, name: str) -> list[Triangle]:
    """Return the triangles of all shapes where the scene places them. Raises ValueError."""
    try:
        return list(_File(data, name).triangles())
    except (KeyError, IndexError, TypeError, struct.error, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"'{name}' is not a glTF file: {error}") from None
    except RecursionError:
        raise ValueError(f"'{name}' is not a glTF file: a node holds itself") from None


class _File:
    def __init__(self, data: bytes, name: str) -> None:
        self.name = name
        if data[:4] != b"glTF" or int.from_bytes(data[4:8], "little") != 2:
            raise ValueError(f"'{name}' is not a glTF file of version 2")
        at, parts = 12, {}
        while at + 8 <= len(data):
            size, kind = struct.unpack_from("<I4s", data, at)
            parts[kind] = data[at + 8 : at + 8 + size]
            at += 8 + size
        self.tree: Any = json.loads(parts[b"JSON"])
        self.numbers = parts.get(b"BIN\0", b"")
        if needed := self.tree.get("extensionsRequired"):
            raise ValueError(f"'{name}' needs {', '.join(needed)} of glTF, which is not read")

    def triangles(self) -> Iterator[Triangle]:
        scenes = self.tree.get("scenes")
        nodes = self.tree.get("nodes", [])
        inner = {child for node in nodes for child in node.get("children", [])}
        roots = [k for k in range(len(nodes)) if k not in inner]
        if scenes:
            roots = scenes[self.tree.get("scene", 0)].get("nodes", [])
        for root in roots:
            yield from self.node(nodes[root], STILL)

    def node(self, node: Any, placed: Columns) -> Iterator[Triangle]:
        placed = _times(placed, _own(node))
        if "mesh" in node:
            for primitive in self.tree["meshes"][node["mesh"]]["primitives"]:
                yield from self.primitive(primitive, placed)
        for child in node.get("children", []):
            yield from self.node(self.tree["nodes"][child], placed)

    def primitive(self, primitive: Any, placed: Columns) -> Iterator[Triangle]:
        kind = primitive.get("mode", LIST)
        if kind not in (LIST, STRIP, FAN):
            return  # points and lines
        accessor = self.tree["accessors"][primitive["attributes"]["POSITION"]]
        found = self.read(accessor, "f", 3)
        corners = [_moved(placed, found[k : k + 3]) for k in range(0, len(found), 3)]
        places: Sequence[int] = range(len(corners))
        if "indices" in primitive:
            numbered = self.tree["accessors"][primitive["indices"]]
            places = [int(k) for k in self.read(numbered, WHOLE[numbered["componentType"]], 1)]
        if kind == LIST:
            faces = [places[k : k + 3] for k in range(0, len(places) - 2, 3)]
        elif kind == FAN:
            faces = [(places[0], b, c) for b, c in pairwise(places[1:])]
        else:
            faces = [
                (places[k], places[k + 1 + k % 2], places[k + 2 - k % 2]) for k in range(len(places) - 2)
            ]
        for a, b, c in faces:
            yield corners[a], corners[b], corners[c]

    def read(self, accessor: Any, kind: str, count: int) -> list[float]:
        """Return the numbers of an accessor, ``count`` of each entry. Raises ValueError."""
        if "sparse" in accessor or "bufferView" not in accessor:
            raise ValueError(f"'{self.name}' holds corners that are sparse, which is not read")
        view = self.tree["bufferViews"][accessor["bufferView"]]
        if view["buffer"] != 0 or "uri" in self.tree["buffers"][0]:
            raise ValueError(f"'{self.name}' keeps its corners in another file, which is not read")
        entry = struct.Struct(f"<{count}{kind}")
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        step = view.get("byteStride", entry.size)
        places = range(start, start + step * accessor["count"], step)
        return [value for at in places for value in entry.unpack_from(self.numbers, at)]


def _own(node: Any) -> Columns:
    """Return where a node places what it holds."""
    if "matrix" in node:
        given: Columns = node["matrix"]
        return given
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    a, b, c = node.get("scale", (1.0, 1.0, 1.0))
    turn = (
        (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)),
        (2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)),
        (2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)),
    )
    columns = [[size * value for value in column] for size, column in zip((a, b, c), turn, strict=True)]
    return (*columns[0], 0.0, *columns[1], 0.0, *columns[2], 0.0, *node.get("translation", (0, 0, 0)), 1.0)


def _times(first: Columns, then: Columns) -> Columns:
    """Return the map that does ``then``, and ``first`` after it."""
    return [
        sum(first[4 * i + row] * then[4 * column + i] for i in range(4))
        for column in range(4)
        for row in range(4)
    ]


def _moved(by: Columns, corner: Sequence[float]) -> Corner:
    x, y, z = corner
    first, second, third = (by[k] * x + by[k + 4] * y + by[k + 8] * z + by[k + 12] for k in range(3))
    return first, second, third
