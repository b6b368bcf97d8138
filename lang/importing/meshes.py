"""Files of surfaces that a robot is drawn by."""

from __future__ import annotations

import os
from pathlib import Path

from .writing import Wishes

DRAWN = (".stl", ".obj", ".dae", ".glb")


class Meshes:
    """Finds files. ``drawn``: whether anything is; ``copies``: what belongs beside the model, from where."""

    def __init__(self, wishes: Wishes) -> None:
        self._wishes = wishes
        self.drawn = False
        self.copies: dict[str, Path] = {}

    def found(self, name: str) -> tuple[str, str]:
        """Return the path of a mesh as the model names it, and why it is not drawn."""
        if self._wishes.meshes == "none":
            return "", "meshes are not wanted"
        if Path(name).suffix.lower() not in DRAWN:
            *all_but_one, last = (end[1:].upper() for end in DRAWN)
            return "", f"surfaces are read from {', '.join(all_but_one)} and {last}"
        path = self._path(name)
        if path is None:
            return "", "there is no such file; --package says where a package lies"
        if self._wishes.meshes == "copy":
            beside = f"{self._wishes.source.stem}_meshes/{path.name}"
            taken = self.copies.setdefault(beside, path)
            if taken != path:
                beside = f"{self._wishes.source.stem}_meshes/{path.parent.name}_{path.name}"
                self.copies[beside] = path
            return beside, ""
        return Path(os.path.relpath(path, self._wishes.folder)).as_posix(), ""

    def _path(self, name: str) -> Path | None:
        """Return the file of a name, with ``package://`` or without."""
        plain = name.removeprefix("file://")
        for scheme in ("package://", "model://"):
            if not name.startswith(scheme):
                continue
            package, _, rest = name.removeprefix(scheme).partition("/")
            above = self._wishes.source.resolve().parents
            for folder in (*self._wishes.packages, *above):
                for path in (folder / package / rest, folder / rest):
                    if path.is_file() and (path.parent != folder or rest == path.name):
                        return path.resolve()
            return None
        path = self._wishes.source.resolve().parent / plain
        return path if path.is_file() else None
