"""Steady motions: all coordinates but cyclic ones rest, and the rates of those stay: equilibria of Routh's function.
Under constraints, or where none is cyclic, shifts and turns carry the motion (``carried.py``).

E. J. Routh, A treatise on the stability of a given state of motion (1877). A minimum of the energy with the momenta of the
cyclic coordinates held is stable.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar

import numpy as np

from ...local.operating_point import PART, moving_inputs, site_of
from ...local.search import box_of
from ...local.stability import eigenvalue_text
from ...outcome import Outcome, SimulationError
from ...problem import Problem
from ...settings import Place, Range, settable
from ..findings import Cell, Curve, Findings, Panel, Table
from ..study import OF_A_MOTION, Study
from .relative_equilibria import CarriedSearch
from .routh import SteadyMotion, SteadySearch

Search = SteadySearch | CarriedSearch
SHOWN = 4
"""Places that a remark names."""
COUNT = 41
WORDS = {True: "stable", False: "unstable", None: "cannot be told"}


class Steady(Study, frozen=True, kw_only=True):
    """Steady motions with the momenta of the start, or with its values but those of ``vary``."""

    unused = OF_A_MOTION
    needs: ClassVar[frozenset[str]] = frozenset({PART, "phase"})
    of_own_states = True

    vary: Annotated[
        tuple[str, ...],
        settable(
            'Unknowns, while all else keeps its value at the start: "theta", "der(phi)"; without it the '
            "coordinates that rest, with the momenta of the start.",
            "names",
        ),
    ] = ()
    over: Annotated[
        tuple[Range, ...],
        settable(
            'Find them at values of a quantity: "der(phi) = 1 .. 10, 91"; 41 values without a number.',
            "ranges",
        ),
    ] = ()

    def solve(self, problem: Problem) -> Findings:
        """Find them. Raises SimulationError where there is no cyclic coordinate, or what is sought does not fit."""
        if len(self.over) > 1:
            raise SimulationError(
                "steady motions are sought over one quantity", help='over = "NAME = LOW .. HIGH"'
            )
        first = _search(problem, self, {})
        if not self.over:
            return _listed(first, first.run())
        over = self.over[0]
        values = np.linspace(over.low, over.high, over.count or COUNT)
        found, searches = [], []
        for k, value in enumerate(values):
            search = _search(problem, self, {over.name: float(value)})
            found.append((float(value), search.run()))
            searches.append(search)
            if self.progress is not None:
                self.progress((k + 1) / len(values))
        return _followed(first, over, found, _poles(searches))


def _search(problem: Problem, study: Steady, values: Mapping[str, float]) -> Search:
    """Return the search in cyclic coordinates, or along moves of all where constraints tie these or none is cyclic."""
    if problem.hybrid is not None or problem.rotations or problem.nq != problem.nv:
        what = "switches" if problem.hybrid is not None else "has rotations or driven coordinates"
        raise SimulationError(
            f"'{problem.name}' {what}: steady motions are sought in coordinates that are free, or tied by constraints",
            help="describe rotations by Euler angles; or drive the turn (drive phi = w*time) and ask 'equilibria'",
        )
    if problem.nq == 0 or len(problem.own) > problem.nq + problem.nv:
        raise SimulationError(
            f"'{problem.name}' has states of first order or no coordinates: it has no cyclic coordinates to move steadily in",
            help="'equilibria' finds where it rests",
        )
    if not problem.constraints and box_of(site_of(problem, study, Place())).idle:
        return SteadySearch(problem, study, study.vary, values)
    return CarriedSearch(problem, study, study.vary, values)


def _record(search: Search, one: SteadyMotion, parameter: dict[str, float]) -> dict[str, Any]:
    momenta = search.momenta_at(one.y)
    return {
        "values": {search.names[k]: float(one.y[k]) for k in search.columns()},
        "momenta": {name: float(v) for name, v in zip(search.axes, momenta, strict=True)},
        "parameter": parameter,
        "stable": one.stable,
        "eigenvalues": [[float(v.real), float(v.imag)] for v in one.eigenvalues],
        "errors": {search.names[k]: e if np.isfinite(e) else None for k, e in one.errors.items()},
    }


def _listed(search: Search, found: list[SteadyMotion]) -> Findings:
    problem, site = search.site.problem, search.site
    units = search.units
    rate = f"1/{problem.time.unit}" if problem.time.unit else ""
    rows: list[tuple[Cell, ...]] = []
    for one in found:
        shown = [eigenvalue_text(v) for v in one.eigenvalues if v.imag >= 0][:3]
        rows.append((*_cells(one, search.columns()), ", ".join(shown)))
    head = (
        *((search.names[k], units[k]) for k in search.columns()), ("error", ""), ("", ""), ("eigenvalues", rate),
    )  # fmt: skip
    remarks = list(moving_inputs(site))
    if words := search.words():
        remarks.append(f"as at the start: {words}")
    remarks += _poles([search])
    if any(not np.isfinite(e) for one in found for e in one.errors.values()):
        remarks.append(
            "some of these are not isolated, or where the coordinates are singular: their errors cannot be told"
        )
    records = [_record(search, one, {}) for one in found]
    return Findings(
        study="steady",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=_count(len(found)),
        errors_from="residual and rounding times the condition of the equations",
        remarks=tuple(remarks),
        tables=(Table("", head, tuple(rows)),) if rows else (),
        panels=_potential(search, found),
        details={
            "steady": records,
            "cyclic": search.axes,
            "accuracy": {"errors": [r["errors"] for r in records], "errors_from": "residual and rounding times the condition"},
        },
    )  # fmt: skip


def _poles(searches: Sequence[Search]) -> list[str]:
    """Say where coordinates lose their meaning, which is none of the motions that are told."""
    places = sorted({place for one in searches if isinstance(one, SteadySearch) for place in one.undefined})
    if not places:
        return []
    more = f"; and {len(places) - SHOWN} more" if len(places) > SHOWN else ""
    return [
        f"left out, as a cyclic coordinate loses its meaning there, like an azimuth at a pole: {'; '.join(places[:SHOWN])}{more}; "
        "what is steady there needs other coordinates"
    ]


def _cells(one: SteadyMotion, columns: list[int]) -> tuple[Cell, ...]:
    """Return the values of a motion, the largest of their errors, and whether it is stable."""
    worst = max(one.errors.values(), default=0.0)
    values = (0.0 if abs(one.y[k]) <= worst else float(one.y[k]) for k in columns)
    return (*values, worst if np.isfinite(worst) else None, WORDS[one.stable])


def _count(count: int) -> str:
    return f"{count} steady motion{'' if count == 1 else 's'}"


def _potential(search: Search, found: list[SteadyMotion]) -> tuple[Panel, ...]:
    """Draw Routh's potential over the one coordinate that rests; of several, the eigenvalues."""
    problem = search.site.problem
    if isinstance(search, CarriedSearch) or len(search.shape) != 1 or not search.fixed:
        rate = f"1/{problem.time.unit}" if problem.time.unit else ""
        curves = tuple(
            Curve(", ".join(f"{search.names[k]} = {one.y[k]:.4g}" for k in search.columns()[:2]),
                  one.eigenvalues.real.astype(float), one.eigenvalues.imag.astype(float), "points", k)
            for k, one in enumerate(found)
        )  # fmt: skip
        return (Panel("eigenvalues", "real part", rate, "imaginary part", rate, curves),)
    k = search.shape[0]
    x = np.linspace(search.low[k], search.high[k], 801)
    with np.errstate(all="ignore"):
        h = np.array([search.amended(np.array([value])) for value in x])
    places = [float(one.y[k]) for one in found]
    heights = [search.amended(np.array([place])) for place in places]
    top = 3 * max([abs(v) for v in heights], default=float(np.nanmedian(np.abs(h))))
    middle = float(np.mean(heights)) if heights else float(np.nanmedian(h))
    h[np.abs(h - middle) > max(top, 1e-300)] = np.nan
    unit = problem.phase[search.energy_place].unit
    curves = (
        Curve("energy with the momenta of the start", x, h),
        Curve("steady", np.array(places), np.array(heights), "points"),
    )
    return (Panel("Routh's potential", search.names[k], problem.states[k].unit, "energy", unit, curves),)


def _followed(
    search: Search, over: Range, found: list[tuple[float, list[SteadyMotion]]], remarks: Sequence[str]
) -> Findings:
    problem, units = search.site.problem, search.units
    records = [_record(search, one, {over.name: value}) for value, motions in found for one in motions]
    held = all(np.isclose(r["values"].get(over.name, v), v) for r in records for v in r["parameter"].values())
    title = over.name if held else f"{over.name} at the start"
    panels = []
    for k in search.columns():
        name = search.names[k]
        if k not in search.unknown:
            continue
        curves = []
        for colour, stable in enumerate((True, False, None)):
            points = [
                (r["parameter"][over.name], r["values"][name]) for r in records if r["stable"] is stable
            ]
            if points:
                x, y = np.array(points).T
                curves.append(Curve(WORDS[stable], x, y, "points", colour))
        panels.append(Panel(name, title, over.unit, name, search.units[k], tuple(curves)))
    columns = [k for k in search.columns() if search.names[k] != title]
    head = ((title, over.unit), *((search.names[k], units[k]) for k in columns), ("error", ""), ("", ""))
    rows = tuple((value, *_cells(one, columns)) for value, motions in found for one in motions)
    counts = sorted({len(motions) for _, motions in found})
    between = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    return Findings(
        study="steady",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"{between} steady motion{'' if between == '1' else 's'} at each of {len(found)} values of {title}",
        errors_from="residual and rounding times the condition of the equations",
        remarks=(*remarks, *_changes(over, found)),
        tables=(Table("", head, rows),) if rows else (),
        panels=tuple(panels),
        details={"steady": records, "cyclic": search.axes},
    )


def _changes(over: Range, found: list[tuple[float, list[SteadyMotion]]]) -> Iterator[str]:
    """Yield in words between which values the number of motions, or how many of them are stable, changes."""
    for (low, before), (high, after) in itertools.pairwise(found):
        counts = [(len(side), sum(one.stable is True for one in side)) for side in (before, after)]
        if counts[0] != counts[1]:
            (was, stood), (now, stand) = counts
            yield (
                f"between {over.name} = {low:.6g} and {high:.6g} the steady motions change from {was} ({stood} stable) "
                f"to {now} ({stand} stable)"
            )
