"""The surfaces of files, as pictures draw them."""

from __future__ import annotations

from mechc.compiler.flat.values.mesh_files import Triangle, triangles
from mechc.requests.parse_values import UsageMistake


def drawn_triangles(path: str) -> list[Triangle]:
    """Return the triangles of a file. Raises UsageMistake for one that cannot be read: the model without it runs."""
    try:
        return triangles(path)
    except (OSError, ValueError) as error:
        raise UsageMistake(f"{error}, and a 'draw' of the model shows it") from None
