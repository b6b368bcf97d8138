"""The meaning of one flat model (README.md lists the methods)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from mechc.compiler.flat.model import FlatModel


class Meaning:
    """What one model does."""

    def __init__(
        self,
        flat: FlatModel,
        values: Mapping[str, float] | None = None,
        experiment: str | None = None,
        inputs: Mapping[str, Callable[[float], float]] | None = None,
    ) -> None:
        self.flat = flat
