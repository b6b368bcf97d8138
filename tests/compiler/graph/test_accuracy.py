"""Rounding errors of the eliminated program, against the same program in 80 digits.

The bounds are ten times what was measured over several states (elimination without pivoting loses digits
only where a heavy body hangs outboard of light ones, in proportion to the ratio of the masses).
"""

from collections.abc import Callable

import mpmath
import pytest
from mechanisms import Mechanism, chain_parents, planar_tree, spatial_tree

from mechc.compiler.graph import Graph, Node
from mechc.compiler.graph.elimination.eliminate import solve
from mechc.compiler.graph.evaluate import evaluate, multiprecision

CHAINS: dict[str, Callable[[Graph, int], Mechanism]] = {
    "absolute angles": lambda g, n: planar_tree(g, chain_parents(n), joint_angles=False, rigid=True),
    "joint angles": lambda g, n: planar_tree(g, chain_parents(n), joint_angles=True, rigid=True),
    "spatial": lambda g, n: spatial_tree(g, chain_parents(n)),
}


def worst_error(m: Mechanism, states: list[dict[Node, float]]) -> float:
    """Return the largest error of an acceleration, relative to the largest acceleration."""
    g = m.graph
    solutions = solve(g, m.residuals, m.a).solutions
    worst = 0.0
    for at in states:
        found = evaluate(g, solutions, at)
        with mpmath.workdps(80):
            exact = evaluate(
                g, solutions, {n: mpmath.mpf(v) for n, v in at.items()}, multiprecision(mpmath.mp)
            )
            scale = max(abs(x) for x in exact)
            worst = max(worst, *(float(abs(f - x) / scale) for f, x in zip(found, exact, strict=True)))
    return worst


@pytest.mark.parametrize("kind", CHAINS)
def test_long_chains_lose_no_digits(kind: str) -> None:
    m = CHAINS[kind](Graph(), 60)
    assert worst_error(m, [m.environment(seed) for seed in range(2)]) < 2e-14


@pytest.mark.parametrize(
    ("masses", "bound"), [("growing", 1e-11), ("falling", 2e-14), ("alternating", 4e-14), ("heavy tip", 3e-7)]
)
@pytest.mark.parametrize("kind", CHAINS)
def test_mass_ratios_of_a_hundred_million(kind: str, masses: str, bound: float) -> None:
    count, ratio = 10, 1e8
    g = Graph()
    m = CHAINS[kind](g, count)
    states = []
    for seed in range(3):
        at = m.environment(seed)
        for i in range(count):
            match masses:
                case "growing":
                    factor = ratio ** (i / (count - 1))
                case "falling":
                    factor = ratio ** (-i / (count - 1))
                case "alternating":
                    factor = ratio if i % 2 else 1.0
                case _:
                    factor = ratio if i == count - 1 else 1.0
            for letter in ("m", "J", "JK"):
                n = g.symbol(f"{letter}{i}")
                if n in at:
                    at[n] *= factor
        states.append(at)
    assert worst_error(m, states) < bound
