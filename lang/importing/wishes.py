"""What is wanted of a model that is made from another format."""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct


class Wishes(Struct, frozen=True):
    """``source``: the file; ``folder``: where the model will stand. ``packages``: folders of ROS packages, or folders that hold
    some. ``floating``: whether the root moves freely. ``meshes``: linked where they lie, copied beside the model, or not drawn.
    """

    source: Path
    folder: Path
    packages: tuple[Path, ...] = ()
    floating: bool = False
    meshes: str = "link"
