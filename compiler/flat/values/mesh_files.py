"""The triangles of a mesh file: STL, text or binary, OBJ, COLLADA and binary glTF."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path

from .collada import collada_triangles
from .gltf import gltf_triangles

Corner = tuple[float, float, float]
Triangle = tuple[Corner, Corner, Corner]

_RECORD = struct.Struct("<12f2x")


def triangles(path: str | Path) -> list[Triangle]:
    """Return the triangles of a file. Raises OSError, and ValueError for a file that holds none."""
    path = Path(path)
    found = READERS[path.suffix.casefold()](path.read_bytes(), path.name)
    if not found:
        raise ValueError(f"'{path.name}' holds no triangle")
    return found


def _stl(data: bytes, name: str) -> list[Triangle]:
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if len(data) == 84 + _RECORD.size * count:
        return [(n[3:6], n[6:9], n[9:12]) for n in _RECORD.iter_unpack(data[84:])]
    words = data.decode("ascii", errors="replace").split()
    corners = [_corner(words[k + 1 : k + 4], name) for k, word in enumerate(words) if word == "vertex"]
    if not words or words[0] != "solid" or not corners or len(corners) % 3:
        raise ValueError(f"'{name}' is not an STL file")
    return list(zip(corners[::3], corners[1::3], corners[2::3], strict=True))


def _obj(data: bytes, name: str) -> list[Triangle]:
    """Faces of more than three corners are cut into triangles that share the first one."""
    corners: list[Corner] = []
    found: list[Triangle] = []
    for line in data.decode("utf-8", errors="replace").splitlines():
        match line.split():
            case ["v", *numbers]:
                corners.append(_corner(numbers[:3], name))
            case ["f", *ends]:
                face = [corners[k] for k in _places(ends, len(corners), name)]
                found += [(face[0], b, c) for b, c in pairwise(face[1:])]
    return found


def _places(ends: list[str], count: int, name: str) -> Iterator[int]:
    for end in ends:
        try:
            place = int(end.partition("/")[0])
        except ValueError:
            raise ValueError(f"'{name}' is not an OBJ file: '{end}' is not a corner of a face") from None
        if not 0 < abs(place) <= count:
            raise ValueError(f"'{name}' is not an OBJ file: there is no corner {place}")
        yield place - 1 if place > 0 else count + place


def _corner(numbers: list[str], name: str) -> Corner:
    try:
        x, y, z = map(float, numbers)
    except ValueError:
        raise ValueError(f"'{name}' is not a mesh: a corner is not three numbers") from None
    return x, y, z


READERS: Mapping[str, Callable[[bytes, str], list[Triangle]]] = {
    ".stl": _stl,
    ".obj": _obj,
    ".dae": collada_triangles,
    ".glb": gltf_triangles,
}
"""How files are read, by the end of their names."""
