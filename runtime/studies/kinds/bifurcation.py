"""Equilibria over a parameter: the model by its value, and the picture of stable and unstable branches."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from msgspec.structs import replace

from ...case import find_experiment, input_values
from ...local.branches import Branch, Special, Tracer
from ...local.search import Box
from ...local.site import Site
from ...outcome import SimulationError
from ...settings import Range
from ..findings import Curve, Panel
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
            f"'{over.name}' is no parameter of '{problem.name}': equilibria do not depend on where a motion starts",
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
    site: Site, box: Box, over: Range, tracer: Tracer, branches: list[Branch], specials: list[Special]
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
