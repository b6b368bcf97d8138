"""Warnings of dissipations that are dry friction: their force jumps at rest, and a motion that ends there slides along the jump."""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import isfinite
from random import Random

from mechc.lang.diagnostics import Reporter

from ..flat.model import Energy
from ..graph import Node
from ..graph.evaluate import Tape
from .system import MechanicalSystem

NEAR = 1e-6
"""Velocities beside rest: what is smooth there is of the order of its square, a kink of its first power."""
NEARER = 4
"""How much nearer to rest a kink is that much smaller, what is smooth by the square of it."""
DRAWS = 3

_ALONE = re.compile(r"dissipation\s+(?:(?P<factor>.+?)\s*\*\s*)?abs\(\s*der\((?P<on>.+)\)\s*\)\s*;?")


def warn_of_sliding(system: MechanicalSystem, statements: Sequence[Node], reporter: Reporter) -> None:
    """Warn of dissipations that bend where nothing moves. ``statements``: the formula of each energy of the model."""
    for energy, value in zip(system.model.energies, statements, strict=True):
        if energy.kind != "dissipation" or not _bends_at_rest(system, value):
            continue
        reporter.warning(
            "W0566",
            "the force of this dissipation jumps where the motion comes to rest",
            energy.origin.shown,
            caption="the dissipation has a kink there, and a run that comes to rest stops with an error",
            help=f"for dry friction, which can rest, write '{_friction(energy)}'",
        )


def _friction(energy: Energy) -> str:
    """Return the statement to write instead: of c*abs(der(s)) itself, of others its form."""
    found = _ALONE.fullmatch(energy.origin.span.text.strip())
    if (
        found is None
        or "der(" in (found["factor"] or "")
        or not (_product(found["factor"] or "1 N") and _balanced(found["on"]))
    ):
        return (
            "friction F on s;' with the size F of the force and what it acts on, s, as in 'friction 2 N on x;"
        )
    return f"friction {found['factor'] or '1'} on {found['on']};"


def _balanced(text: str) -> bool:
    depth = 0
    for letter in text:
        depth += (letter == "(") - (letter == ")")
        if depth < 0:
            return False
    return depth == 0


def _product(text: str) -> bool:
    """Tell whether a text is a product of terms in brackets: no sum stands outside of these."""
    bare, last = text, ""
    while bare != last:
        last, bare = bare, re.sub(r"[({\[][^(){}\[\]]*[)}\]]", "", bare)
    return _balanced(text) and not re.search(r"[-+](?!\d)|\d\s*[-+]|\b(if|then|else|and|or)\b", bare)


def _bends_at_rest(system: MechanicalSystem, value: Node) -> bool:
    """Tell whether the formula grows by the first power of velocities beside rest, both ways."""
    graph, velocities = system.graph, sorted(system.symbols.velocities)
    known = graph.support(value)
    if not set(velocities).intersection(known):
        return False
    tape = Tape(graph, [value], known)
    random = Random(5)
    bends = 0
    for _ in range(DRAWS):
        around = {n: random.uniform(0.5, 1.5) for n in known}
        way = {v: random.uniform(-1.0, 1.0) for v in velocities if v in known}
        try:
            still, there, back, near, behind = (
                tape(around | {v: share * x for v, x in way.items()})[value]
                for share in (0.0, NEAR, -NEAR, NEAR / NEARER, -NEAR / NEARER)
            )
        except (ArithmeticError, ValueError):
            return False
        bend, size = there + back - 2 * still, abs(there) + abs(back) + abs(still)
        if not (isfinite(bend) and size < 1e9):
            return False
        nearer = near + behind - 2 * still
        bends += bend > NEAR / 100 and bend > 1e-9 * size and nearer > bend / NEARER**1.5
    return bends == DRAWS
