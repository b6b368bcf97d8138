"""Natural frequencies, damping and shapes of small motions about an equilibrium."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np

from ...local.active_constraints import sliding
from ...local.chart import Chart
from ...local.equilibrium import Equilibrium, resting
from ...local.equilibrium_feasibility import arrived
from ...local.operating_point import PART, Site, moving_inputs, refuse_edges, site_of
from ...local.vibration import (
    SECOND_ORDER,
    Modes,
    conservative_modes,
    first_order_modes,
    general_modes,
    vibration,
)
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...settings import EQUILIBRIUM, Place, settable
from ..findings import Cell, Curve, Findings, Panel, Table
from ..flow.sampled_loop import held_samples
from ..study import OF_A_MOTION, Study

DRAWN = 6
"""Shapes in the picture."""
FEW = 3
"""Coordinates whose shapes a strip has room for."""
MOVES = 0.05
"""Parts of a shape below this share of the largest one are not told."""
NAMED = 4


class FoundModes(Findings, frozen=True, eq=False, kw_only=True):
    """``frequencies`` [k] in rad/s and ``dampings`` [k], -Re/|.| of the ``eigenvalues`` [k], one of each conjugate pair;
    ``shapes`` [n][k] of the displacements ``names``, of generalised mass 1 where nothing damps (complex where something
    does, of length 1 each)."""

    frequencies: Array
    dampings: Array
    eigenvalues: Any
    shapes: Any
    names: tuple[str, ...]
    at: dict[str, float]


class FindModes(Study, frozen=True, kw_only=True):
    """Modes of small motions: about the start if it is an equilibrium, else about the equilibrium reached from it."""

    unused = OF_A_MOTION
    needs: ClassVar[frozenset[str]] = frozenset({PART, SECOND_ORDER, "projection"})
    of_own_states = True

    at: Annotated[
        Place | None,
        settable("Where: the start, the equilibrium reached from it, or other values.", "place"),
    ] = None

    def solve(self, problem: Problem) -> FoundModes:
        """Find the modes. Raises SimulationError where there is no equilibrium, and at edges of contacts and friction."""
        site = site_of(problem, self, self.at or Place())
        remarks = [*moving_inputs(site), *held_samples(problem)]
        with np.errstate(invalid="ignore", over="ignore"):  # a search may leave where the model is defined
            site, rest = _resting(site, self.at, remarks)
        remarks += refuse_edges(site, rest.y, "mode of small motions")
        modes, kind = _modes(site, rest)
        for group in modes.groups:
            if not all(modes.rigid[k] for k in group):
                remarks.append(
                    f"modes {', '.join(str(k + 1) for k in group)} have one frequency: combinations of their shapes are shapes too"
                )
        count = int(modes.rigid.sum())
        if count:
            listed = ", ".join(str(k + 1) for k in np.flatnonzero(modes.rigid))
            remarks.append(
                f"nothing brings back mode{'s' if count > 1 else ''} {listed}: a motion with no frequency"
            )
        return _found_modes(site, rest, modes, kind, tuple(remarks))


def _resting(site: Site, at: Place | None, remarks: list[str]) -> tuple[Site, Equilibrium]:
    found = resting(site, site.y)
    if found is not None:
        return site, found
    if at is not None and at.word != EQUILIBRIUM:
        raise SimulationError(
            "this state is not an equilibrium, so that small motions about it are not vibrations",
            help="leave 'at' out for the equilibrium that is reached from it; mechc study linearize takes any state",
        )
    site, found = arrived(site, site.y)
    if at is None:
        remarks.append(
            "the start is not an equilibrium: the modes are about the state above, where it would come to rest if damped"
        )
    return site, found


def _modes(site: Site, rest: Equilibrium) -> tuple[Modes, str]:
    states = site.chart.size - site.chart.nd - site.problem.nv
    if states:
        return first_order_modes(site, rest.y), "with states"
    if sliding(site):
        return first_order_modes(site, rest.y), "with friction"  # whose limit may depend on velocities
    found = vibration(site, rest.y)
    if not found.conservative:
        return general_modes(found), "damped or gyroscopic"
    beside = vibration(site, site.chart.moved(rest.y, rest.errors))
    off = np.abs((beside.entries[1] - found.entries[1]).todense())
    return conservative_modes(found, np.asarray(off)), "conservative"


def _found_modes(
    site: Site, rest: Equilibrium, modes: Modes, kind: str, remarks: tuple[str, ...]
) -> FoundModes:
    problem, chart = site.problem, site.chart
    names = chart.names[: modes.shapes.shape[0]]
    values = modes.eigenvalues
    frequencies = np.abs(values)
    dampings = (
        np.where(frequencies > 0, -values.real / np.where(frequencies > 0, frequencies, 1.0), 0.0) + 0.0
    )
    real = kind == "conservative"
    shapes = modes.shapes.real if real else modes.shapes
    unit = f"rad/{problem.time.unit}" if problem.time.unit else ""
    at = {problem.states[k].name: float(rest.y[k]) for k in problem.own if problem.states[k].kind != "rate"}
    rows: list[tuple[Cell, ...]] = [
        (str(k + 1), float(frequencies[k]), modes.errors[k], float(dampings[k]), _moves(chart, shapes[:, k]))
        for k in range(len(values))
    ]
    head = (("mode", ""), ("frequency", unit), ("error", unit), ("damping", ""), ("what moves", ""))
    where = ", ".join(f"{name} = {value:.6g}" for name, value in list(at.items())[:NAMED])
    more = ", ..." if len(at) > NAMED else ""
    return FoundModes(
        study="modes",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"{kind}, at {where}{more}",
        errors_from=ERRORS[real],
        remarks=remarks,
        tables=(Table("", head, tuple(rows)),),
        panels=_panels(names, frequencies, shapes, unit),
        details={
            "modes": [
                {
                    "frequency": float(frequencies[k]),
                    "error": modes.errors[k],
                    "damping": float(dampings[k]),
                    "eigenvalue": [float(values[k].real), float(values[k].imag)],
                    "shape": {name: _plain(shapes[j, k]) for j, name in enumerate(names)},
                }
                for k in range(len(values))
            ],
            "at": at,
            "degenerate": [[k + 1 for k in group] for group in modes.groups],
            "accuracy": {
                "errors": {"frequencies": list(modes.errors)},
                "errors_from": ERRORS[real],
                "equilibrium": {"residual": rest.residual, "condition": rest.condition},
            },
        },
        arrays={"frequencies": frequencies, "dampings": dampings, "eigenvalues": values, "shapes": shapes},
        frequencies=frequencies,
        dampings=dampings,
        eigenvalues=values,
        shapes=shapes,
        names=names,
        at=at,
    )


ERRORS = {
    True: "rounding of the entries of mass and stiffness, weighed by the shape, and the error of the equilibrium",
    False: "rounding of the entries times the condition of each eigenvalue",
}


def _plain(value: complex) -> float | list[float]:
    return [float(value.real), float(value.imag)] if isinstance(value, complex) else float(value)


def _moves(chart: Chart, shape: Any) -> str:
    """Name what moves, the largest part first, as shares of it."""
    sizes = np.abs(shape)
    if not sizes.any():
        return ""
    units = chart.units[: len(shape)]
    order = np.argsort(-sizes, kind="stable")[: int((sizes > MOVES * sizes.max()).sum())]
    largest = shape[order[0]]
    parts = []
    for k in order[:NAMED]:
        share = shape[k] / largest
        size = (
            f"{share.real:.3g}"
            if abs(share.imag) < 1e-9
            else f"{abs(share):.3g} at {np.degrees(np.angle(share)):.3g} deg"
        )
        unit = "" if units[k] == units[order[0]] else f" {units[k]}/{units[order[0]]}"
        parts.append(f"{chart.names[k]} {size}{unit}")
    return ", ".join(parts) + (f", and {len(order) - NAMED} more" if len(order) > NAMED else "")


def _panels(names: tuple[str, ...], frequencies: Array, shapes: Any, unit: str) -> tuple[Panel, ...]:
    """Return the first shapes over the number of the coordinate, each with its largest part at 1."""
    places = np.arange(1, len(names) + 1, dtype=float)
    curves = []
    for k in range(min(DRAWN, len(frequencies))):
        shape = np.real(shapes[:, k])
        size = float(np.abs(shape).max(initial=0.0)) or 1.0
        label = f"{frequencies[k]:.4g} {unit}".rstrip()
        curves.append(Curve(label, places, shape / size, colour=k))
        curves.append(Curve("", places, shape / size, style="points", colour=k))
    return (
        Panel(
            "shapes", "", "", "displacement over the largest", "", tuple(curves), x_names=names,
            tall=len(names) > FEW,
        ),
    )  # fmt: skip
