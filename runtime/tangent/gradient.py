"""The gradient of one number of a motion in many parameters, backwards along the steps of the run (discrete adjoint).

>>> plan = plan_run(problem, options)
>>> found = gradient(plan.case, plan.nominal, "energy.total", ["m", "l", "theta"])
>>> found.value, found.derivatives         # [3]
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..case import Case, input_values, inputs_at
from ..functions import load_functions
from ..outcome import SimulationError
from ..problem import Adjoint, Array, Problem
from .augmented import BEHIND
from .backwards import METHOD, BackwardSweep, address, call, steps
from .directions import Direction, chosen, named
from .start import assembled


class Gradient(Struct, frozen=True, eq=False):
    """``value`` of the goal and its ``derivatives`` [k] in the ``directions``, in SI, with their units; ``steps`` of the
    run, ``memory`` in bytes of the states that were kept; ``end``: the last state."""

    value: float
    unit: str
    directions: tuple[Direction, ...]
    units: tuple[str, ...]
    derivatives: Array
    steps: int
    memory: int
    end: Array


class Gradients:
    """A case whose goal is differentiated, made ready once: ``at`` runs it and goes back."""

    def __init__(self, case: Case, goal: str, directions: Sequence[str], *, integral: bool = False) -> None:
        problem = case.problem
        _check(case)
        self.case, self.integral = case, integral
        self.directions = named(case, directions)
        by_caller, by_experiment = chosen(case)
        arrays = {a: tuple(d.index for d in self.directions if d.array == a) for a in "ypu"}
        stated = {s.index for s in by_caller if s.array == "y"}
        set_late = {s.index for s in by_experiment if s.array == "y"}
        for d in self.directions:
            if d.array == "y" and d.index in set(problem.dependent) - stated - set_late:
                raise SimulationError(
                    f"'{d.name}' begins with a value that is stated with those of others: no direction by itself",
                    help=f"give it a value of its own, as in set={{'{d.name}': ...}}",
                )
        asked = Adjoint(
            goal=_place_of(problem, goal),
            integral=integral,
            parameters=arrays["p"],
            inputs=arrays["u"],
            given=tuple(sorted({s.index for s in by_caller | by_experiment if s.array == "p"})),
            tables=tuple(sorted(case.tables)),
            stated=tuple(sorted(stated)),
            settled=tuple(sorted((s.array, s.index) for s in by_caller if s.array != "y")),
            experiment=case.experiment if case.asked is not None else "",
        )
        assert problem.adjoints is not None
        try:
            self.problem = problem.adjoints(asked)
        except ValueError as error:
            raise SimulationError(str(error), help="give it a number, as in set={'name': ...}") from None
        self.functions = load_functions(self.problem)
        self.p = np.concatenate([case.p[: len(problem.parameters)], np.full(self.problem.nh, np.nan)])
        self.functions.parameters(self.p, np.ones(len(problem.parameters), dtype=np.uint8))
        self.free = len(self.directions) - sum(d.array == "y" for d in self.directions)
        count = {"y": 0, "p": problem.ny, "u": problem.ny + len(arrays["p"])}
        places = []
        for d in self.directions:
            places.append(d.index if d.array == "y" else count[d.array])
            count[d.array] += 1
        self.places = np.array(places, dtype=np.intp)
        rows = self.problem.offers[1].rows
        self.units = tuple(rows[k][1] for k in places)
        seeds = len(self.problem.discretes)
        self.sweep = BackwardSweep(case, self.functions, self.p, seeds, self.free, float(integral))
        self.addresses = {f: address(self.functions, f) for f in ("goal", "pull_back", "start_pull_back")}
        if problem.assembly:
            self.addresses["pull_back_assembly"] = address(self.functions, "pull_back_assembly")
        self.start = self._assembled() if case.assembled is not None else None

    def at(self, nominal: Array, tolerance: float) -> Gradient:
        """Run the case and differentiate its goal. Raises SimulationError where the run does not reach its end."""
        found = self._back(self.case, nominal, tolerance)
        if np.isfinite(found.value) and not np.isfinite(found.derivatives).all():
            found = self._back(self._behind(tolerance), nominal, tolerance)
        return found

    def _behind(self, tolerance: float) -> Case:
        """Give the case just after its start, where a formula may have no derivative, as |v| v at rest."""
        case = self.case
        rates = case.functions.rhs(case.begin, case.y0, inputs_at(case, case.begin), case.z, case.p)
        dt = BEHIND * tolerance * (case.stop - case.begin)
        return replace(case, begin=case.begin + dt, y0=case.y0 + dt * rates)

    def _back(self, case: Case, nominal: Array, tolerance: float) -> Gradient:
        """Run and go back; ``case`` may begin somewhat later than that whose start is differentiated."""
        ny = self.case.problem.ny
        t, h, y = steps(case, nominal, tolerance)
        end, value = y[-1], 0.0
        pulled = np.zeros(ny + self.free)
        if not self.integral:
            value = float(self._call("goal", case.stop, end, np.empty(0), 1)[0])
            pulled = self._call("pull_back", case.stop, end, self._unit(ny), pulled.size)
        back, total = pulled[:ny].copy(), pulled[ny:].copy()
        memory = self.sweep.back(t, h, y, back, total)
        if self.start is None:
            pulled = self._call("start_pull_back", self.case.begin, self.case.y0, back, pulled.size)
            pulled[ny:] += total
            derivatives = pulled[self.places]
        else:
            derivatives = np.concatenate([np.zeros(ny), total])[self.places] + back @ self.start
        return Gradient(
            value=float(self.sweep.integral[0]) if self.integral else value,
            unit=self.problem.offers[0].rows[0][1],
            directions=self.directions,
            units=self.units,
            derivatives=derivatives,
            steps=t.size,
            memory=memory,
            end=end,
        )

    def _call(self, name: str, t: float, y: Array, seeds: Array, size: int) -> Array:
        """Call a function of the adjoint; ``seeds`` are followed by zeros."""
        case, z = self.case, np.zeros(len(self.problem.discretes))
        z[: seeds.size] = seeds
        u = input_values(self.functions, case.tables, t, self.p, len(case.problem.inputs))
        return call(self.addresses[name], t, y, u, z, self.p, size)

    def _unit(self, k: int) -> Array:
        """Give seeds of which one is 1."""
        unit = np.zeros(k + 1)
        unit[k] = 1.0
        return unit

    def _assembled(self) -> Array:
        """Give the derivatives of an assembled start in the directions, [ny, k]."""
        case, problem = self.case, self.case.problem
        size, ny = problem.ny + self.free, problem.ny
        stated = [
            self._call("start_pull_back", case.begin, case.wanted, self._unit(k), size) for k in range(ny)
        ]
        w = np.stack(stated)[:, self.places]
        for i in problem.rotations:  # the stated numbers are scaled to unit length
            q = case.wanted[i : i + 4]
            w[i : i + 4] -= np.outer(q, q @ w[i : i + 4])
        rows = [
            self._call("pull_back_assembly", case.begin, case.y0, self._unit(k), size)
            for k in range(len(problem.assembly))
        ]
        left = np.stack(rows) if rows else np.empty((0, size))
        moved = np.array([d.array == "y" for d in self.directions])
        own = np.where(moved, 0.0, left[:, self.places])
        return assembled(case, self.directions, w, lambda w: left[:, :ny] @ w + own)


def _check(case: Case) -> None:
    """Refuse what has no such gradient, or none that is built."""
    problem = case.problem
    instead = "derivatives along the motion go through that: sensitivity=[...] of a run"
    if problem.adjoints is None:
        raise SimulationError(
            f"the functions of '{problem.name}' were not made by the compiler, which alone differentiates them"
        )
    if problem.hybrid is not None:
        raise SimulationError(
            f"'{problem.name}' has events or laws that switch, at which the backward sweep would have to jump: gradients are "
            "for motions that are smooth",
            help=instead,
        )
    if problem.dependent and problem.assembly:
        raise SimulationError(
            f"initial values of '{problem.name}' are stated with others that the start moves: these are not pulled back",
            help=instead,
        )
    if problem.discretes:
        raise SimulationError(
            f"'{problem.name}' has discrete variables, which are not pulled back", help=instead
        )
    if case.method not in ("auto", METHOD):
        raise SimulationError(
            f"the gradient is that of a run by {METHOD}; the steps of '{case.method}' are not pulled back",
            help=f"leave the method out, or say method = {METHOD}; " + instead,
        )


def _place_of(problem: Problem, goal: str) -> tuple[str, int]:
    for array, quantities in (("out", problem.outputs), ("y", problem.states)):
        for k, quantity in enumerate(quantities):
            if quantity.name == goal:
                return array, k
    raise SimulationError(f"'{problem.name}' has no state and no output '{goal}'")
