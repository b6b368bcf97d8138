"""Which checks a model gets in a run of the campaign, and by which compiler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from random_models.compiled import Compiled
from random_models.starts import followed


@dataclass(frozen=True)
class Mode:
    """Which checks a model gets, whether libtcc compiles it; ``share``: whether a seed gets a check."""

    quick: bool
    checks: tuple[str, ...]
    share: Callable[[str, int, Compiled], bool] = lambda name, seed, base: True

    def wants(self, name: str, seed: int, base: Compiled) -> bool:
        """Return whether a model gets a check."""
        return name in self.checks and self.share(name, seed, base)


_SELDOM = {"given": 2, "other words": 4, "dimensionless": 0, "loops": 1}
_IN_TURN = ("spelled out", "composed", "targets", "said otherwise")


def _one(name: str, seed: int, base: Compiled) -> bool:
    if name == "given" and followed(base.text):
        return True
    if name in _SELDOM:
        return seed % 5 == _SELDOM[name]
    if name == "composed" and base.constrained:  # another order may hang the joints of a loop otherwise
        return True
    return name not in _IN_TURN or name == _IN_TURN[seed % len(_IN_TURN)]


_ALWAYS = ("values", "oracle", "followers", "integrals", "counted", "sweeps")


def _sparse(name: str, seed: int, base: Compiled) -> bool:
    """Whether a seed gets a check where each model gets the definition and one twin in turn."""
    return name in _ALWAYS or name == _TWINS[seed % len(_TWINS)]


def _in_turn(name: str, seed: int, base: Compiled) -> bool:
    """Whether a seed gets a check where each model gets its motion and programs, and further motions in turn."""
    others = ("motions of twins", "twins", "events", "members")
    return name not in others or name == others[seed % len(others)]


def _some(name: str, seed: int, base: Compiled) -> bool:
    match name:
        case "motion" | "motions of twins" | "twins":
            return seed % 10 == 0 or (base.switches and seed % 2 == 1)
        case "events" | "tabled":
            return seed % 4 == 3
        case "members":
            return seed % 20 == 13
        case "exports":
            return seed % 80 == 47
        case "units":
            return seed % 80 == 7
    return _one(name, seed, base)


AT_STATES = (
    "values",
    "oracle",
    "followers",
    "integrals",
    "counted",
    "sweeps",
    "structured",
    "spelled out",
    "by element",
    "other words",
    "dimensionless",
    "as people compose",
    "composed",
    "said otherwise",
    "given",
    "targets",
    "loops",
)
_ALONG = ("motion", "motions of twins", "twins", "events", "tabled", "members", "exports")
_TWINS = tuple(name for name in AT_STATES if name not in _ALWAYS)
MODES = {
    "mixed": Mode(False, (*AT_STATES, *_ALONG, "units"), _some),
    "states": Mode(False, AT_STATES, _one),
    "sparse": Mode(False, AT_STATES, _sparse),
    "quick": Mode(True, AT_STATES, _one),
    "events": Mode(True, ("events", "tabled")),
    "motions": Mode(False, _ALONG),
    "runs": Mode(False, _ALONG, _in_turn),
    "units": Mode(True, ("units",)),
}
"""``states``: functions compiled as C, at states, a structured twin and at most one more of each model; ``sparse``: the definition and one twin in turn; ``motions``: short motions, Python modules, C programs;
``runs``: the same, of twins, by events and of ensembles in turn; ``units``: FMUs."""
