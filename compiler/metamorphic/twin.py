"""What a twin of a model is, and what making one needs to know of the motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from random import Random

from msgspec import Struct, field

from mechc.lang.units import BASE, Dimension

from ..flat.model import Expression, FlatModel

States = Mapping[str, float]
"""Numbers in SI by the names that results have."""


ACCOUNTS = frozenset({"energy.supplied", "energy.dissipated"})
"""In which of them a force counts is seen by its formula, which may be another one in a twin."""


class NotApplicable(Exception):
    """Say why a twin of this kind cannot be made of a model."""


class Twin(Struct, frozen=True):
    """``model`` must move as the one it was made of; ``says``: what was changed, in words.

    ``apart``: outputs that mean something else there, heads of names; ``names``: what is called otherwise there;
    ``factors``: by what units are larger there, as factors of kg, m, s, A; ``start``: the states it begins at, where these are
    not those that the model states; ``backwards``: its time runs from the stop to the start; ``beside``: the model with
    further outputs, with which it is compared instead of the model; ``shakes``: parameters that move its start, zero but
    for what is tried.
    """

    name: str
    says: str
    model: FlatModel
    apart: frozenset[str] = frozenset()
    names: Mapping[str, str] = field(default_factory=dict)
    factors: tuple[float, float, float, float] | None = None
    start: States | None = None
    backwards: bool = False
    beside: FlatModel | None = None
    shakes: tuple[str, ...] = ()

    def factor(self, dimension: Dimension) -> float:
        """Return by what a quantity is larger than in the model."""
        return size(dimension, self.factors) if self.factors is not None else 1.0

    def means(self, name: str) -> bool:
        """Whether a result of this name is the same in both."""
        return not any(
            name == head or name.startswith((f"{head}[", f"{head}.", f"{head}(")) for head in self.apart
        )


class Seen(Struct, frozen=True):
    """What is known of the motion: its time from ``begin`` to ``stop``, its ``first`` and ``last`` states, the ``largest``
    size of each, and the ``sizes`` that errors are measured against; ``evaluated`` gives the entries of expressions at the start."""

    begin: float
    stop: float
    first: States
    last: States
    largest: States
    sizes: States
    evaluated: Callable[[Sequence[Expression]], list[list[float]]]


Make = Callable[[FlatModel, Seen | None, Random], Twin]
"""Makes a twin, or raises NotApplicable; without a motion only what needs none."""


def size(dimension: Dimension, factors: tuple[float, float, float, float]) -> float:
    """Return the factor of a dimension."""
    found = 1.0
    for exponent, factor in zip(dimension.exponents, (*factors, *[1.0] * (len(BASE) - 4)), strict=True):
        found *= factor ** float(exponent)
    return found
