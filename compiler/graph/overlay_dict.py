"""A dictionary over another one, for trials that may be given up."""

from __future__ import annotations

from .reached import Node


class Above(dict[int, Node]):
    """Entries above those of another dictionary, which stays as it is meanwhile."""

    __slots__ = ("below",)

    def __init__(self, below: dict[int, Node]) -> None:
        super().__init__()
        self.below = below

    def get(self, key: int) -> Node | None:  # type: ignore[override]
        found = super().get(key)
        return self.below.get(key) if found is None else found

    def copy(self) -> dict[int, Node]:
        return {**self.below, **self}

    def put_down(self) -> dict[int, Node]:
        """Return the other dictionary with all entries."""
        self.below.update(self)
        return self.below
