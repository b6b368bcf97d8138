"""Where a model rests, and over a parameter: branches with folds, forks and Hopf points."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec.structs import replace

from ...local.branches import Bifurcation, EquilibriumBranch, Tracer, cut, near
from ...local.equilibrium import Equilibrium, at_rest, check_autonomous
from ...local.equilibrium_feasibility import check_side, contacts, penetrated, standing, stilled, touched_by
from ...local.jumps import on_surfaces, rests_at_jumps
from ...local.operating_point import PART, Site, edges, moving_inputs, site_of, switched
from ...local.search import Box, Search, balanced, box_of
from ...local.stability import UNTOLD, Stability, eigenvalue_text, stability
from ...local.survey import Survey, surveyed
from ...local.vibration import SECOND_ORDER
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...settings import Place, Range, settable
from ..findings import Cell, Curve, Findings, Panel, Table
from ..flow.sampled_loop import held_samples
from ..study import OF_A_MOTION, Study
from .bifurcation import WORDS, BranchValues, branches_in_numbers, diagram, moved_parameter

GUESSES = 64
FEW_GUESSES = 4
"""Before a proof, to see whether it can end."""
SEEDS = (0.0, 0.13, 0.29, 0.5, 0.71, 0.87, 1.0)
"""Shares of the range of a parameter at which all equilibria are looked for."""
BESIDE = 0.011
"""How far from a seed they are looked for where they are not isolated at the seed itself, as at a fork."""
MOST_GUESSES = 32
"""At each of these."""
TOGETHER = 1e-5
"""Special points closer than this, in shares of the range and sizes of the coordinates, are one."""
LOOSE = 0.03
"""The same where one of them could not be located."""
MOST_BRANCHES = 60
COMPLETE = {None: "", True: ", the list is complete", False: ", whether these are all is not proven"}
INCOMPLETE = ", may be incomplete"
RESTING = "equilibria that rest on contacts are found only where these contacts are closed at the start"


class FoundEquilibria(Findings, frozen=True, eq=False, kw_only=True):
    """``equilibria`` and ``special`` points as the JSON object has them: plain data in SI."""

    equilibria: tuple[dict[str, Any], ...]
    special: tuple[dict[str, Any], ...] = ()


class FindEquilibria(Study, frozen=True, kw_only=True):
    """All equilibria within ``min`` and ``max`` of the coordinates, angles over a turn; over a parameter their branches."""

    unused = OF_A_MOTION
    needs: ClassVar[frozenset[str]] = frozenset({PART, SECOND_ORDER, "projection"})
    of_own_states = True

    over: Annotated[
        tuple[Range, ...],
        settable(
            'Follow them along a parameter; "w = 0 .. 10, 50" lists them at 50 values (default: 11).',
            "ranges",
        ),
    ] = ()
    prove: Annotated[
        bool, settable("Prove by interval arithmetic that there are no others within the bounds.", "flag")
    ] = False
    guesses: Annotated[int, settable("Number of guesses from which to search (default: 64).", "count")] = (
        GUESSES
    )

    def solve(self, problem: Problem) -> FoundEquilibria:
        """Find them. Raises SimulationError for models that never rest."""
        begun = site_of(problem, self, Place())
        site = stilled(begun, begun.y)
        check_autonomous(site, site.derivatives(at_rest(site, site.y)), site.y)
        remarks = [*moving_inputs(site), *held_samples(problem)]
        box = box_of(site)
        moved = on_surfaces(site)
        if idle := tuple(name for name in box.idle if name not in moved):
            no = "no force" if touched_by(site, site.y, idle) else "nothing"
            remarks.append(f"{no} depends on {', '.join(idle)}: told for the value of the start")
        if contacts(site):
            remarks.append(RESTING)
        if self.over:
            if self.prove:
                raise SimulationError(
                    "a proof is about one value of the parameters", help="leave 'over' or 'prove' out"
                )
            return _over(self, site, box, remarks)
        evened = balanced(site, box)
        if self.prove:
            from ...local.proof import proven

            few = Search(evened, box)
            if evened.balanced or any(few.goes_on(one) for one in few.run(FEW_GUESSES)):
                raise SimulationError(
                    "equilibria of this model are not isolated: no list of them can be proven to be complete",
                    help="leave 'prove' out",
                )
            proof = proven(site, box)
            remarks.append(proof.message)
            return _listed(site, box, list(proof.equilibria), remarks, proof.complete)
        if evened.balanced:
            site = evened
            names = ", ".join(f"'{site.chart.names[j]}'" for j in site.balanced)
            remarks.append(f"the rates of {names} are rounding wherever it is looked at, and count as zero")
        search = Search(site, box)
        search.run(self.guesses)
        survey = surveyed(search)
        remarks.append(survey.why)
        return _listed(site, box, search.sorted(), remarks, None, survey)


def _values(site: Site, y: Array) -> dict[str, float]:
    problem = site.problem
    return {problem.states[k].name: float(y[k]) for k in problem.own if problem.states[k].kind != "rate"}


def _record(
    site: Site, y: Array, told: Stability, parameter: dict[str, float], errors: dict[str, float | None]
) -> dict[str, Any]:
    return {
        "values": _values(site, y),
        "parameter": parameter,
        "stable": told.stable,
        "eigenvalues": [[float(v.real), float(v.imag)] for v in told.eigenvalues],
        "errors": errors,
    }


def _errors(site: Site, box: Box, one: Equilibrium) -> dict[str, float | None]:
    """Return the bound of the error of each displacement; None along directions in which nothing pushes."""
    chart = site.chart
    loose = np.abs(one.free).max(axis=1, initial=0.0) > 1e-6
    return {
        name: None if loose[j] and j in box.moved else float(one.errors[j])
        for j, name in enumerate(chart.names)
        if j < chart.nd or j >= chart.nd + site.problem.nv
    }


def _listed(
    site: Site,
    box: Box,
    found: list[Equilibrium],
    remarks: list[str],
    complete: bool | None,
    survey: Survey | None = None,
) -> FoundEquilibria:
    records, rows = [], []
    names = list(_values(site, site.y))
    beyond = lines = touching = 0
    for one in found:
        stands = standing(switched(site, one.y), one)
        beyond += bool(stands.beyond)
        if not stands.rests:
            continue
        there = edges(stands.site, one.y)
        try:
            told = stability(stands.site, one.y, box.idle, one.errors)
        except SimulationError as error:
            told = UNTOLD
            remarks.append(f"eigenvalues and stability of one cannot be told: {error}")
        if there.sharp:
            told = replace(told, stable=None)
            remarks.append(f"{', '.join(there.sharp)}: what happens on the other side is not examined")
        if there.held:
            touching += any("contact" in what for what in there.held)
            remarks.append(f"{', '.join(there.held)}: eigenvalues and stability are those with that held")
        record = _record(site, one.y, told, {}, _errors(site, box, one))
        records.append(record)
        worst: list[float | None] = list(record["errors"].values())
        rows.append(
            _row(record, names, None if any(e is None for e in worst) else max([0.0, *filter(None, worst)]))
        )
        if one.free[box.moved].size and np.abs(one.free[box.moved]).max() > 0:
            if Search(stands.site, box).goes_on(one):
                lines += 1
                remarks.append("some of these are not isolated: a whole line of equilibria goes through each")
            else:
                remarks.append(
                    "at some of these the stiffness is singular, although no other equilibria are nearby"
                )
    for rest in rests_at_jumps(site, box):
        errors = dict(zip(site.chart.names, map(float, rest.errors), strict=True))
        record = _record(site, rest.y, UNTOLD, {}, {n: e for n, e in errors.items() if n in names})
        records.append(record)
        rows.append(_row(record, names, max(record["errors"].values(), default=0.0)))
        remarks.append(
            f"the {_ordinal(len(records))} is held by forces that jump at '{rest.surface}': eigenvalues and stability are not told there"
        )
    units = {q.name: q.unit for q in site.problem.states}
    head = (*((name, units[name]) for name in names), ("error", ""), ("", ""), ("eigenvalues", _per(site)))
    count = len(records)
    if beyond:
        remarks.append(f"left out: {beyond} beyond contacts, where the equations alone would rest")
    away = " away from contacts" if contacts(site) and not touching else ""
    if touching:
        away = " on contacts" if touching == count else f", {touching} of them on contacts"
    message = f"{count} equilibri{'um' if count == 1 else 'a'}{away}" + COMPLETE[complete]
    if lines:
        message += f", {'' if lines == count else f'{lines} of them '}not isolated"
    if survey is not None and not survey.confirmed:
        message += INCOMPLETE
    return FoundEquilibria(
        study="equilibria",
        model=site.problem.name,
        outcome=Outcome.COMPLETED,
        message=message,
        errors_from="residual and rounding times the condition of the equations",
        remarks=tuple(dict.fromkeys(remarks)),
        tables=(Table("", head, tuple(rows)),) if rows else (),
        panels=(_spectrum(records, site),),
        details={
            "equilibria": records,
            "special": [],
            **({} if complete is None else {"complete": complete}),
            **_count(survey),
            "bounds": _bounds(site, box),
            "accuracy": {
                "errors": [record["errors"] for record in records],
                "errors_from": "residual and rounding times the condition of the equations",
            },
        },
        equilibria=tuple(records),
    )


def _ordinal(n: int) -> str:
    ends = {1: "st", 2: "nd", 3: "rd"}
    return f"{n}{'th' if n % 100 in (11, 12, 13) else ends.get(n % 10, 'th')}"


def _count(survey: Survey | None) -> dict[str, Any]:
    if survey is None:
        return {}
    return {
        "may_be_incomplete": not survey.confirmed,
        "signs": survey.signs,
        "signs_expected": survey.expected,
        "singular_points": [list(place) for place in survey.singular],
    }


SAME = 1e-9
"""Of eigenvalues that are drawn as one point, relative to the largest."""


def _per(site: Site) -> str:
    return f"1/{site.problem.time.unit}" if site.problem.time.unit else ""


def _row(record: dict[str, Any], names: list[str], error: float | None) -> tuple[Cell, ...]:
    values = [complex(*pair) for pair in record["eigenvalues"]]
    shown = [z for z in values if z.imag >= 0][:3]
    listed = ", ".join(eigenvalue_text(z) for z in shown) + (
        ", ..." if len([z for z in values if z.imag >= 0]) > 3 else ""
    )
    return (
        *(_shown(record["values"][name], error) for name in names),
        error,
        WORDS[record["stable"]],
        listed,
    )


def _shown(value: float, error: float | None) -> float:
    return 0.0 if error is not None and abs(value) <= error else value


def _bounds(site: Site, box: Box) -> dict[str, list[float]]:
    return {
        site.chart.names[int(j)]: [float(low), float(high)]
        for j, low, high in zip(box.moved, box.low, box.high, strict=True)
    }


def _spectrum(records: list[dict[str, Any]], site: Site) -> Panel:
    curves: dict[tuple[complex, ...], list[str]] = {}
    for record in records:
        values = tuple(complex(*pair) for pair in record["eigenvalues"])
        size = max(map(abs, values), default=0.0)
        same = next(
            (
                one
                for one in curves
                if len(one) == len(values)
                and all(abs(a - b) <= SAME * size for a, b in zip(one, values, strict=True))
            ),
            values,
        )
        errors = record["errors"]
        shown = [
            (n, 0.0 if abs(v) <= (errors.get(n) or 0.0) else v) for n, v in list(record["values"].items())[:2]
        ]
        curves.setdefault(same, []).append(", ".join(f"{n} = {v:.4g}" for n, v in shown))
    drawn = tuple(
        Curve("; ".join(names), np.array(values).real, np.array(values).imag, style="points", colour=k)
        for k, (values, names) in enumerate(curves.items())
    )
    return Panel("eigenvalues", "real part", _per(site), "imaginary part", _per(site), drawn)


def _over(study: FindEquilibria, site: Site, box: Box, remarks: list[str]) -> FoundEquilibria:
    if len(study.over) != 1:
        raise SimulationError(
            "equilibria are followed over one parameter", help='over = "NAME = LOW .. HIGH"'
        )
    over = study.over[0]
    at = moved_parameter(study, site, over)
    span = np.maximum(box.high - box.low, 1e-12)
    tracer = Tracer(
        replace(site, y=at_rest(site, site.y)), box, at, np.where(box.periodic, 2 * np.pi, span) / 2
    )
    branches: list[EquilibriumBranch] = []
    pending: list[Array] = []
    doubt = ""
    for first in SEEDS:
        for share in (first, first + (BESIDE if first < 0.9 else -BESIDE)):
            search = Search(replace(at(share), y=tracer.start), box)
            search.run(min(MOST_GUESSES, 4 + 8 * len(box.moved)))
            if not any(one.free.size for one in search.sorted()):
                break
        here, survey = search.site, surveyed(search)
        if not survey.confirmed and not doubt:
            doubt = f"at {over.name} = {over.low + share * (over.high - over.low):.6g}: {survey.why}"
        for one in search.sorted():
            if one.free.size:
                raise SimulationError(
                    "equilibria of this model are not isolated, so that they have no branches over a parameter",
                    help="fix what nothing pushes on, or look at single values: mechc study equilibria without 'over'",
                )
            check_side(here, one.y, over.name)
            if not penetrated(here, one.y):
                pending.append(tracer.coordinates(one.y, share))
    specials: list[Bifurcation] = []
    while pending and len(branches) < MOST_BRANCHES:
        seed = pending.pop(0)
        if near(branches, seed, tracer, 2e-3):
            continue
        branch = tracer.trace(seed)
        branches.append(branch)
        for special in branch.specials:
            specials.append(special)
            if special.kind == "fork":
                pending += tracer.beside(special)
    if pending:
        remarks.append(f"there are more than {MOST_BRANCHES} branches: not all were followed")
    for point in (point for branch in branches for point in branch.points):
        check_side(at(float(point.x[-1])), tracer.state(point.x), over.name)
    branches, specials, left = cut(branches, specials, tracer)
    if left:
        remarks.append(f"branches end at contacts: {left} of their points lie beyond and are left out")
    if doubt:
        remarks.append(doubt)
    return _followed(
        site, box, over, tracer, branches, _distinct(specials, tracer), remarks, complete=not doubt
    )


def _distinct(specials: list[Bifurcation], tracer: Tracer) -> list[Bifurcation]:
    """Return special points once each; a fold of one branch that is a fork of another is a fork."""
    found: list[Bifurcation] = []
    for special in sorted(specials, key=lambda s: ("fork", "hamiltonian hopf", "hopf", "fold").index(s.kind)):
        if not any(_same(special, other, tracer) for other in found):
            found.append(special)
    return sorted(found, key=lambda s: (round(float(s.x[-1]), 12), s.kind))


def _same(a: Bifurcation, b: Bifurcation, tracer: Tracer) -> bool:
    turn = 2 * np.pi / tracer.scales
    d = a.x - b.x
    d[:-1] = np.where(tracer.box.periodic, (d[:-1] + turn / 2) % turn - turn / 2, d[:-1])
    # a branch that turns back at a fork of another seems to fold there, and the fold cannot be located
    within = TOGETHER if a.exact and b.exact else LOOSE
    return float(np.linalg.norm(d)) < within


def _followed(
    site: Site,
    box: Box,
    over: Range,
    tracer: Tracer,
    branches: list[EquilibriumBranch],
    specials: list[Bifurcation],
    remarks: list[str],
    *,
    complete: bool,
) -> FoundEquilibria:
    def value(share: float) -> float:
        return over.low + share * (over.high - over.low)

    records: list[dict[str, Any]] = []
    for number, branch in enumerate(branches):
        for point in branch.points:
            y = tracer.state(point.x)
            record = _record(site, y, point.stable, {over.name: value(float(point.x[-1]))}, {})
            del record["errors"]
            records.append({**record, "branch": number + 1})
    points: list[dict[str, Any]] = [
        {
            "kind": special.kind,
            "parameter": {over.name: value(float(special.x[-1]))},
            "values": _values(site, tracer.state(special.x)),
            "located": special.exact,
        }
        for special in specials
    ]
    states = site.problem.states
    told = BranchValues(site, tracer, [k for k in site.problem.own if states[k].kind != "rate"])
    head = (("", ""), (over.name, over.unit), *told.head)
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (s.kind, value(float(s.x[-1])), *told.of(s.x)) for s in specials
    )
    tables = [Table("", head, rows)] if rows else []
    if branches:
        tables.append(branches_in_numbers(over, tracer, branches, specials, told))
        if over.count is None:
            remarks.append(
                f'"{over.name} = LOW .. HIGH, 50" gives 50 values; the JSON object holds all points of the branches'
            )
    listed = "; ".join(f"{p['kind']} at {over.name} = {p['parameter'][over.name]:.9g}" for p in points)
    return FoundEquilibria(
        study="equilibria",
        model=site.problem.name,
        outcome=Outcome.COMPLETED,
        message=f"{len(branches)} branch{'' if len(branches) == 1 else 'es'}"
        + ("" if complete else INCOMPLETE)
        + (f"; {listed}" if listed else ""),
        errors_from="points solve the equations to rounding; special points are roots, to rounding of what tells them",
        remarks=tuple(dict.fromkeys(remarks)),
        tables=tuple(tables),
        panels=diagram(site, box, over, tracer, branches, specials),
        details={
            "equilibria": records,
            "special": points,
            "may_be_incomplete": not complete,
            "bounds": _bounds(site, box),
            "accuracy": {
                "errors": {},
                "errors_from": "residuals of all points are rounding; special points are roots",
            },
        },
        equilibria=tuple(records),
        special=tuple(points),
    )
