"""What is to be known of a fit beside its numbers: what has no end, what is poor, at a bound, left out or late."""

from __future__ import annotations

import numpy as np

from ..driving_inputs import begin_of
from ..outcome import time_text
from ..sheets import units_apart
from .measured import Measured
from .residuals import Motions
from .search import POOR, FitSearch, SearchResult
from .uncertainty import FitErrors

FEW = 10
"""Values of a column of which one may well be half of all squares."""


def remarks_of(search: FitSearch, found: SearchResult, judged: FitErrors, names: list[str]) -> list[str]:
    """Give all but what has no end (``endless_of``). ``names`` [k]: the unknowns in words."""
    motions = search.motions
    return [
        *_poor(search, found),
        *_outliers(search, found),
        *judged.unseen.texts,
        *_at_bounds(search, found, names),
        *_left_out(motions),
        *_missing(motions),
        *_of_data(motions.data),
        *_late(motions),
    ]


def endless_of(search: FitSearch, found: SearchResult, names: list[str]) -> list[str]:
    """Say which unknowns have no end."""
    said = []
    for k in search.runaways(found):
        unit = search.motions.unknowns[k].unit
        value = f"{found.x[k]:.3g}{f' {unit}' if unit else ''}"
        steps = f", where motions begin to take more than {search.motions.most_steps} steps"
        said.append(
            f"{names[k]} grows without bound: the larger it is, the smaller are the residuals; the search left it at {value}"
            + (steps if search.motions.given_up else "")
        )
    return said


def _poor(search: FitSearch, found: SearchResult) -> list[str]:
    """Say that the model does not move as it was measured."""
    if not search.poor(found):
        return []
    return [
        "the fit is poor: residuals are large and follow one another, as where the model is another or the search ended in a "
        "wrong valley; the intervals mean nothing"
    ]


def _outliers(search: FitSearch, found: SearchResult) -> list[str]:
    """Say which single values count more than all others of their column together."""
    if search.loss != "linear":
        return []
    motions, said = search.motions, []
    computed = motions.at(found.x)
    for k, name in enumerate(motions.outputs):
        squares, motion, row = motions.farthest(computed, k)
        most = squares.max(initial=0.0)
        few = np.count_nonzero(squares) < FEW or np.sqrt(most) <= POOR * search.scatter[k]
        if few or most <= squares.sum() / 2:
            continue
        at = time_text(motions.problem, float(motion.times[row]))
        said.append(
            f"one value of '{name}' counts more than all others together: that at {at} of {motion.source}; if it is not a measurement, "
            "leave its row out, or let it count less with loss = soft_l1 (--loss soft_l1)"
        )
    return said


def _at_bounds(search: FitSearch, found: SearchResult, names: list[str]) -> list[str]:
    """Say which unknowns ended at their bounds: their intervals go beyond them."""
    near = 1e-6 * search.sizes
    at = (found.x - search.low < near) | (search.high - found.x < near)
    return [f"{name} ended at its bound" for name, yes in zip(names, at, strict=True) if yes]


def _left_out(motions: Motions) -> list[str]:
    there = dict.fromkeys(name for motion in motions.data for name in motion.columns)
    rest = [name for name in there if name not in motions.outputs]
    return [f"not compared: {', '.join(rest)}"] if rest else []


def _missing(motions: Motions) -> list[str]:
    """Say which columns hold values in some rows only."""
    said = []
    for motion in motions.data:
        for name in motions.outputs:
            missing = int(np.isnan(motion.columns[name]).sum()) if name in motion.columns else 0
            if missing:
                rows = f"{missing} of {motion.times.size} rows of {motion.source}"
                said.append(f"{rows} hold{'s' if missing == 1 else ''} no value of '{name}'")
    return said


def _of_data(data: tuple[Measured, ...]) -> list[str]:
    """Say what is to be known of how the data were read."""
    remarks = [remark for motion in data for remark in motion.remarks]
    return remarks + units_apart([(motion.source, motion.units) for motion in data])


def _late(motions: Motions) -> list[str]:
    """Say when the motions begin whose data do not begin at 0."""
    remarks: list[str] = []
    for motion, options in zip(motions.data, motions.options, strict=True):
        first = float(motion.times[0])
        if options.begin is not None or first <= 1.5 * float(np.max(np.diff(motion.times))):
            continue
        begin = begin_of(motions.problem, options.inputs, first)
        at = time_text(motions.problem, first)
        if begin > 0:
            remarks.append(f"the motion begins at {at}, where the measured inputs of {motion.source} do")
            continue
        remarks.append(
            f"the data of {motion.source} begin at {at}, the motion with its initial values at {begin:g}; with start = "
            f'{first:.10g} (--start "{first:.10g}") it begins where the data do'
        )
    return remarks
