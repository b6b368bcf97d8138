"""Cost of the accelerations, counted: operations for each link, and linear growth."""

from collections.abc import Callable

import pytest
from mechanisms import (
    Mechanism,
    chain_parents,
    closed_chain,
    ladder,
    planar_tree,
    spatial_loop,
    spatial_tree,
    spherical_hub,
    support_on_manifold,
)

from mechc.compiler.graph import Graph
from mechc.compiler.graph.elimination.eliminate import solve

from .test_eliminate import closed_states


def operations(build: Callable[[Graph], Mechanism]) -> int:
    g = Graph()
    m = build(g)
    return solve(g, m.residuals, m.a).operations


def points(count: int, joint_angles: bool) -> Callable[[Graph], Mechanism]:
    return lambda g: planar_tree(g, chain_parents(count), joint_angles=joint_angles, rigid=False)


def bars(count: int) -> Callable[[Graph], Mechanism]:
    return lambda g: planar_tree(g, chain_parents(count), joint_angles=True, rigid=True)


# bounds are the counts reached, rounded up to a whole number: worse means that something was lost
@pytest.mark.parametrize(
    ("name", "build", "links", "bound"),
    [
        ("points, absolute angles", points(20, False), 20, 56),
        ("points, absolute angles", points(100, False), 100, 58),
        ("points, joint angles", points(20, True), 20, 59),
        ("points, joint angles", points(100, True), 100, 61),
        ("bars", bars(20), 20, 79),
        ("bars", bars(100), 100, 81),
        ("spatial chain", lambda g: spatial_tree(g, chain_parents(7)), 7, 173),
        ("spatial chain", lambda g: spatial_tree(g, chain_parents(20)), 20, 233),
        ("hub with 30 spherical joints", lambda g: spherical_hub(g, 30), 96, 175),
        ("spatial loop", lambda g: spatial_loop(g, 20), 20, 413),
        ("closed chain, absolute angles", lambda g: closed_chain(g, 50, joint_angles=False), 50, 115),
        ("closed chain, joint angles", lambda g: closed_chain(g, 50, joint_angles=True), 50, 118),
    ],
)
def test_operations_for_each_link(
    name: str, build: Callable[[Graph], Mechanism], links: int, bound: float
) -> None:
    assert operations(build) <= bound * links


@pytest.mark.parametrize("build", [lambda n: points(n, False), lambda n: points(n, True), bars])
def test_cost_of_a_chain_is_linear(build: Callable[[int], Callable[[Graph], Mechanism]]) -> None:
    """Each further link costs the same, exactly."""
    counts = [operations(build(n)) for n in (20, 30, 40)]
    assert counts[2] - counts[1] == counts[1] - counts[0]


def test_cost_of_a_hub_is_linear() -> None:
    counts = [operations(lambda g, k=k: spherical_hub(g, k)) for k in (6, 12, 24)]  # type: ignore[misc]
    assert counts[2] - counts[1] <= 2.02 * (counts[1] - counts[0])


def test_cost_of_a_ladder_is_linear_with_interleaved_multipliers() -> None:
    counts = []
    for cells in (4, 8, 16):
        g = Graph()
        m = ladder(g, cells)
        after = support_on_manifold(m, closed_states(m, 2, True))
        counts.append(solve(g, m.residuals, m.a, after=after).operations)
    assert counts[2] <= 400 * 16
    assert counts[2] - counts[1] <= 2.02 * (counts[1] - counts[0])


def test_cost_of_a_spatial_loop_is_linear() -> None:
    counts = [operations(lambda g, k=k: spatial_loop(g, k)) for k in (16, 28, 40)]  # type: ignore[misc]
    assert counts[2] - counts[1] <= 1.05 * (counts[1] - counts[0])


def test_interning_by_value_pays() -> None:
    """Structure alone needs at least a fifth more on a spatial chain."""
    g = Graph(by_value=False)
    m = spatial_tree(g, chain_parents(10))
    plain = solve(g, m.residuals, m.a).operations
    assert plain > 1.2 * operations(lambda g: spatial_tree(g, chain_parents(10)))
