"""The linear systems along a run: x' = A(t) x + B(t) u, y = C(t) x + D(t) u for small displacements from the motion itself.

The same independent coordinates at all times, from the exact derivatives of the equations at each state of the run.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec.structs import replace

from ...case import inputs_at
from ...driving_inputs import derived
from ...interface import Quantity
from ...local.chart import chart_of
from ...local.linear_system import linear_system
from ...local.operating_point import PART, Site
from ...outcome import ENDED, Outcome, SimulationError, time_text
from ...problem import Array, Problem
from ...settings import settable
from ..findings import Curve, Findings, Panel, Table
from ..runs.simulate import plan_run, run
from ..study import Study, left_out
from .linearize import chosen_inputs, chosen_outputs, moving, observed, observed_followers

ERRORS = "rounding of the entries, which are exact derivatives at states of the run"
WORST = 1e6
"""Condition of the independent coordinates from which on others ought to be taken."""


class Along(Findings, frozen=True, eq=False, kw_only=True):
    """``A`` [t][n][n], ``B`` [t][n][m], ``C`` [t][k][n], ``D`` [t][k][m] in SI at the times ``time``, of displacements of the
    ``states`` from the motion ``at`` [t][ny] and of the inputs from theirs; rates and accelerations of inputs that drive
    coordinates are inputs of their own, after the others."""

    time: Array
    at: Array
    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]


class LinearizeAlong(Study, frozen=True, kw_only=True):
    """Linearise the motion along its run, at each time of its output (``every``), between inputs and outputs: all inputs, and
    the outputs of the model (coordinates where it has none) unless they are named."""

    needs: ClassVar[frozenset[str]] = frozenset({PART, "projection"})

    driven: Annotated[tuple[str, ...], settable("Inputs that act on it.", "names", option="inputs")] = ()
    outputs: Annotated[tuple[str, ...], settable("Quantities that are observed.", "names")] = ()

    def solve(self, problem: Problem) -> Along:
        """Run, then linearise. Raises SimulationError where derivatives do not exist."""
        if problem.hybrid is not None:
            raise SimulationError(
                f"'{problem.name}' switches, and a linear system does not",
                help="mechc run --sensitivity goes through events; linearize is for a state between them",
            )
        solution = run(problem, self)
        if solution.outcome not in ENDED:
            raise SimulationError(f"the run did not reach its end: {solution.message}")
        case = plan_run(problem, self).case
        states = np.array([solution[q.name] for q in problem.states]).T.reshape(len(solution.time), -1)
        outputs = chosen_outputs(problem, self.outputs)
        following = observed_followers(problem, outputs)
        chart = chart_of(problem, following)
        start = Site(case, chart, case.begin, inputs_at(case, case.begin), case.z, case.y0, case.p)
        sites = [
            replace(start, t=float(t), u=inputs_at(case, float(t)), y=y)
            for t, y in zip(solution.time, states, strict=True)
        ]
        left = left_out(problem, following)
        return _along(self, sites, outputs, [left] if left else [])


def _along(
    study: LinearizeAlong,
    sites: list[Site],
    outputs: list[tuple[Quantity, tuple[str, int]]],
    remarks: list[str],
) -> Along:
    problem, chart = sites[0].problem, sites[0].chart
    inputs = chosen_inputs(problem, study.driven)
    if not study.driven:
        inputs, staying = moving(sites[0], sites[0].derivatives(sites[0].y), inputs)
        remarks = [*remarks, *staying]
    systems: list[tuple[Array, ...]] = []
    chosen = None
    worst = 1.0
    for site in sites:
        found = site.derivatives(site.y)
        system = linear_system(site, found, inputs, observed(site, site.y, outputs, found), chosen)
        chosen = system.chosen
        if system.condition > worst:
            worst, when = system.condition, site.t
        systems.append((system.a, system.beside(system.b), system.c, system.beside(system.d)))
    assert chosen is not None
    if worst > WORST:
        remarks.append(
            f"the states hardly determine the configuration at t = {time_text(problem, when)}: they multiply errors by {worst:.0e} there"
        )
    names = tuple(Quantity(chart.names[int(j)], "state", chart.units[int(j)]) for j in chosen)
    if not names:
        remarks.append("nothing is free to move here: the systems have no states")
    following = [derived(problem)[k] for k in inputs if k in derived(problem)]
    columns = [*inputs, *(first for first, _ in following), *(second for _, second in following)]
    return _answer(study, sites, systems, names, tuple(problem.inputs[k] for k in columns), outputs, remarks)


def _answer(
    study: LinearizeAlong,
    sites: list[Site],
    systems: list[tuple[Array, ...]],
    states: tuple[Quantity, ...],
    inputs: tuple[Quantity, ...],
    outputs: list[tuple[Quantity, tuple[str, int]]],
    remarks: list[str],
) -> Along:
    problem = sites[0].problem
    time = np.array([site.t for site in sites])
    a, b, c, d = (np.array(rows) for rows in zip(*systems, strict=True))
    told = tuple(q for q, _ in outputs)
    per = f"1/{problem.time.unit}" if problem.time.unit else ""
    growth = np.array([np.linalg.eigvals(x).real for x in a]) if states else np.zeros((len(time), 0))
    growth = np.sort(growth, axis=1)[:, ::-1]
    rows = tuple((float(t), *(float(x) for x in g)) for t, g in _some(list(zip(time, growth, strict=True))))
    head = ((problem.time.name, problem.time.unit), *((f"pole {k + 1}", per) for k in range(len(states))))
    arrays = {"time": time, "A": a, "B": b, "C": c, "D": d}
    details: dict[str, Any] = {
        **{name: value.tolist() for name, value in arrays.items()},
        "states": [q.name for q in states],
        "inputs": [q.name for q in inputs],
        "outputs": [q.name for q in told],
        "units": {q.name: q.unit for q in (*states, *inputs, *told)},
        "at": {
            q.name: [float(site.y[k]) for site in sites]
            for k, q in enumerate(problem.states)
            if q.kind != "account"
        },
        "accuracy": {"errors": {}, "errors_from": ERRORS},
    }
    curves = tuple(Curve(f"pole {k + 1}", time, growth[:, k]) for k in range(len(states)))
    return Along(
        study="along",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"{len(time)} systems: states {len(states)}, inputs {len(inputs)}, outputs {len(told)}",
        errors_from=ERRORS,
        remarks=(
            *remarks,
            "real parts of frozen poles tell nothing certain about growth where A changes as fast",
        ),
        tables=(Table("real parts of the poles, each time by itself", head, rows),) if states else (),
        panels=(Panel("poles", problem.time.name, problem.time.unit, "real part", per, curves),)
        if states
        else (),
        details=details,
        arrays=arrays,
        time=time,
        at=np.array([site.y for site in sites]),
        A=a,
        B=b,
        C=c,
        D=d,
        states=states,
        inputs=inputs,
        outputs=told,
    )


def _some(rows: list[Any], most: int = 11) -> list[Any]:
    """Return the first, the last and some rows between."""
    return [
        rows[k] for k in np.unique(np.linspace(0, len(rows) - 1, min(most, len(rows))).round().astype(int))
    ]
