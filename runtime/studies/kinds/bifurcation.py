"""The picture of equilibria over a parameter: stable and unstable branches, and what lies between them."""

from __future__ import annotations

import itertools

import numpy as np

from ...local.branches import Branch, Special, Tracer
from ...local.search import Box
from ...local.site import Site
from ...settings import Range
from ..findings import Curve, Panel


def diagram(
    site: Site, box: Box, over: Range, tracer: Tracer, branches: list[Branch], specials: list[Special]
) -> tuple[Panel, ...]:
    """Return coordinates over the parameter: stable branches as lines, others dashed, special points as dots."""
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
            good = np.array([p.stable.stable is True for p in branch.points])
            edges_at = [0, *(np.flatnonzero(np.diff(good.astype(int))) + 1).tolist(), len(good)]
            for first, last in itertools.pairwise(edges_at):
                stop = min(last + 1, len(good))
                kind = bool(good[first])
                label = "stable" if kind else "unstable"
                named = any(curve.name == label for curve in curves)
                curves.append(
                    Curve(
                        "" if named else label,
                        xs[first:stop],
                        ys[first:stop],
                        "line" if kind else "dashed",
                        0 if kind else 1,
                    )
                )
        if specials:
            xs = np.array([over.low + s.x[-1] * (over.high - over.low) for s in specials])
            ys = np.array([tracer.state(s.x)[place] for s in specials])
            curves.append(Curve("special", xs, ys, "points", 2))
        panels.append(Panel(name, over.name, over.unit, name, site.problem.states[place].unit, tuple(curves)))
    return tuple(panels)
