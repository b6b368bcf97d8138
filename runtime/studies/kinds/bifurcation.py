"""Equilibria over a parameter: the model by its value, and table and picture of stable and unstable branches."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from msgspec.structs import replace

from ...case import find_experiment, input_values
from ...local.branches import Bifurcation, EquilibriumBranch, EquilibriumPoint, Tracer
from ...local.operating_point import Site
from ...local.search import Box
from ...outcome import SimulationError
from ...problem import Array
from ...settings import Range
from ..findings import Cell, Curve, Panel, Table
from ..study import Study


def moved_parameter(study: Study, site: Site, over: Range) -> Callable[[float], Site]:
    """Return the model as a function of a parameter or a constant input, by its share of the range."""
    problem, functions = site.problem, site.case.functions
    names = [q.name for q in problem.parameters]
    inputs = [q.name for q in problem.inputs]
    known: dict[float, Site] = {}
    if over.name in inputs:
        index = inputs.index(over.name)

        def by_input(share: float) -> Site:
            u = site.u.copy()
            u[index] = over.low + share * (over.high - over.low)
            return replace(site, u=u)

        return by_input
    if over.name not in names:
        raise SimulationError(
            f"'{over.name}' is not a parameter of '{problem.name}': equilibria do not depend on where a motion starts",
            help="follow them over a parameter or a constant input",
        )
    index = names.index(over.name)
    experiment = find_experiment(problem, study.experiment)
    given = np.zeros(len(names), dtype=np.uint8)
    for name in study.values:
        if name in names:
            given[names.index(name)] = 1
    for setting in experiment.settings if experiment else ():
        if setting.array == "p":
            given[setting.index] = 1
    given[index] = 1

    def by_parameter(share: float) -> Site:
        if share not in known:
            if len(known) > 4096:
                known.clear()
            p = site.p.copy()
            p[index] = over.low + share * (over.high - over.low)
            functions.parameters(p, given)
            u = input_values(functions, site.case.tables, site.t, p, len(inputs))
            known[share] = replace(site, p=p, u=u)
        return known[share]

    return by_parameter


LOOKS = {
    True: ("stable", "line", 0),
    False: ("unstable", "dashed", 1),
    None: ("stability cannot be told", "dotted", 4),
}
"""How a branch is named and drawn, by whether it is stable."""


def diagram(
    site: Site,
    box: Box,
    over: Range,
    tracer: Tracer,
    branches: list[EquilibriumBranch],
    specials: list[Bifurcation],
) -> tuple[Panel, ...]:
    """Return coordinates over the parameter: branches by their stability, special points as dots."""
    panels = []
    states = {q.name: k for k, q in enumerate(site.problem.states)}
    for j in list(box.moved)[:3]:
        name = site.chart.names[int(j)]
        if name not in states:
            continue
        place = states[name]
        curves: list[Curve] = []
        for branch in branches:
            xs = np.array([over.low + p.x[-1] * (over.high - over.low) for p in branch.points])
            ys = np.array([tracer.state(p.x)[place] for p in branch.points])
            told = [p.stable.stable for p in branch.points]
            edges_at = [0, *(k for k in range(1, len(told)) if told[k] is not told[k - 1]), len(told)]
            for first, last in itertools.pairwise(edges_at):
                stop = min(last + 1, len(told))
                label, style, colour = LOOKS[told[first]]
                named = any(curve.name == label for curve in curves)
                curves.append(Curve("" if named else label, xs[first:stop], ys[first:stop], style, colour))
        if specials:
            xs = np.array([over.low + s.x[-1] * (over.high - over.low) for s in specials])
            ys = np.array([tracer.state(s.x)[place] for s in specials])
            curves.append(Curve("special points", xs, ys, "points", 2))
        panels.append(Panel(name, over.name, over.unit, name, site.problem.states[place].unit, tuple(curves)))
    return tuple(panels)


COUNT = 11
"""Values of the parameter in the table, where nobody says how many."""
SAME = 1e-12
"""Shares of the range that are closer than this are one value."""
NOTHING = 1e-13
"""Coordinates below this share of their range are told as 0: points are known to rounding."""
WORDS = {True: "stable", False: "unstable", None: "cannot be told"}


class BranchValues:
    """The states of a point on a branch, as tables tell them."""

    def __init__(self, site: Site, tracer: Tracer, places: Sequence[int]) -> None:
        self.tracer, self.places = tracer, places
        self.states = site.problem.states
        moved = (site.chart.names[int(j)] for j in tracer.box.moved)
        self.sizes = dict(zip(moved, np.abs(tracer.scales), strict=True))

    @property
    def head(self) -> list[tuple[str, str]]:
        return [(self.states[k].name, self.states[k].unit) for k in self.places]

    def of(self, x: Array) -> list[float]:
        y = self.tracer.state(x)
        least = [NOTHING * self.sizes.get(self.states[k].name, 0.0) for k in self.places]
        return [0.0 if abs(y[k]) < size else float(y[k]) for k, size in zip(self.places, least, strict=True)]


def branches_in_numbers(
    over: Range,
    tracer: Tracer,
    branches: Sequence[EquilibriumBranch],
    specials: Sequence[Bifurcation],
    values: BranchValues,
) -> Table:
    """Return the branches in the order in which they are followed: at values of the parameter, at ends and special points."""
    shares = np.linspace(0.0, 1.0, over.count or COUNT)
    rows: list[tuple[Cell, ...]] = []
    for number, branch in enumerate(branches, 1):
        mine = [s for s in branch.specials if any(s is one for one in specials)]
        for x, word in _ordered(tracer, branch, mine, shares):
            share = float(next((s for s in shares if abs(s - x[-1]) < SAME), x[-1]))
            value = over.low + share * (over.high - over.low)
            rows.append((float(number), value, *values.of(x), word))
    title = f"branches at {len(shares)} values of {over.name}, at their ends and special points"
    return Table(title, (("branch", ""), (over.name, over.unit), *values.head, ("", "")), tuple(rows))


def _ordered(
    tracer: Tracer, branch: EquilibriumBranch, specials: Sequence[Bifurcation], shares: Array
) -> Iterator[tuple[Array, str]]:
    """Yield points along a branch: state and parameter, and what is to be said of it."""
    points = branch.points
    where = [_segment(points, special.x) for special in specials]
    if len(points) == 1 or not _among(shares, points[0].x):
        yield points[0].x, WORDS[points[0].stable.stable]
    for k, (a, b) in enumerate(itertools.pairwise(points)):
        for share in _passed(a.x, b.x, shares, last=k == len(points) - 2):
            part = (share - a.x[-1]) / (b.x[-1] - a.x[-1])
            x = tracer.at_share(a.x + part * (b.x - a.x), share)
            if x is None:  # the parameter hardly changes along the branch here
                x = min((a.x, b.x), key=lambda end: abs(float(end[-1]) - share))
            yield x, WORDS[tracer.point(x, b.tangent).stable.stable]
        for special, at in zip(specials, where, strict=True):
            if at == k:
                yield special.x, special.kind
    if len(points) > 1 and not _among(shares, points[-1].x):
        yield points[-1].x, WORDS[points[-1].stable.stable]


def _among(shares: Array, x: Array) -> bool:
    return bool(np.any(np.abs(shares - x[-1]) < SAME))


def _passed(a: Array, b: Array, shares: Array, *, last: bool) -> list[float]:
    """Return the shares from one point to the next one, without that of the latter unless it is the last."""
    begin, end = float(a[-1]), float(b[-1])
    if abs(end - begin) < SAME:
        return []
    inside = (shares > min(begin, end) - SAME) & (shares < max(begin, end) + SAME)
    found: list[float] = shares[inside & (last | (np.abs(shares - end) >= SAME))].tolist()
    return found if begin < end else found[::-1]


def _segment(points: Sequence[EquilibriumPoint], x: Array) -> int:
    """Return the number of the piece of the branch that a point lies on."""
    ends = [np.linalg.norm(x - p.x) for p in points]
    ways = [
        before + after - np.linalg.norm(b.x - a.x)
        for (before, after), (a, b) in zip(itertools.pairwise(ends), itertools.pairwise(points), strict=True)
    ]
    return int(np.argmin(ways)) if ways else 0
