"""The motion near a state as a linear system: A, B, C, D in independent coordinates, poles, zeros, Bode, step response.

x' = A x + B u, y = C x + D u for small displacements x of independent coordinates, their velocities and states; from the
exact derivatives of the equations. Coordinates that constraints tie to these are eliminated by the derivative of the
constraints. An input that drives a coordinate is one column all the same: see ``local/linear_system.py``. Delays are Padé
approximations, see ``local/linear_delays.py``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from ...case import SimulationOptions
from ...delays import U, Y, Z
from ...driving_inputs import derived
from ...interface import Quantity
from ...local.chart import chart_of
from ...local.equilibrium import resting
from ...local.equilibrium_feasibility import arrived
from ...local.frequency_response import Continuous, Sampled, Transfer, held
from ...local.linear_delays import HIGHEST, LinearDelays, bound, right_up_to
from ...local.linear_system import LinearSystem, OutputForm, linear_system, proper_form, that_stay
from ...local.operating_point import (
    PART,
    Derivatives,
    Site,
    moving_inputs,
    pattern_of,
    refuse_edges,
    rows_of,
    site_of,
)
from ...local.zeros import Complex, poles, zeros
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...settings import EQUILIBRIUM, Place, settable
from ..findings import Cell, Curve, Findings, Panel, Table
from ..flow.linear_pictures import Shown, bode, seen_over, step_responses
from ..flow.sampled_loop import held_samples
from ..study import OF_A_MOTION, Study, left_out

PADE = 3
"""Order of approximations of delays."""
SHARE = 0.01
"""Error of such an approximation up to which it is told how far it goes."""
ERRORS = "rounding of the entries, which are exact derivatives, times the condition of each pole"


class Linearization(Findings, frozen=True, eq=False, kw_only=True):
    """``A`` [n][n], ``B`` [n][m], ``C`` [k][n], ``D`` [k][m] in SI with the names of states, inputs, outputs, which are
    displacements from ``at``; ``poles``, and ``zeros``, None where inputs and outputs are different in number.
    ``period``: of a sampled system x[k+1] = A x[k] + B u[k], else None.

    Where inputs drive coordinates, y = C x + D u + ``D1`` u' + ``D2`` u'', and the states are the displacements less
    ``S0`` u + ``S1`` u'; all four are zero otherwise.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    at: dict[str, float]
    poles: Complex
    zeros: Complex | None
    D1: Array
    D2: Array
    S0: Array
    S1: Array
    period: float | None = None

    def control(self) -> Any:
        """Return the system as python-control knows it. Raises SimulationError where that is not installed, and where an
        output follows derivatives of an input at once."""
        self._refuse_derivatives("python-control")
        try:
            import control  # type: ignore[import-not-found, import-untyped, unused-ignore]
        except ImportError:
            raise SimulationError(
                "python-control is not installed", help="pip install control; .signal() gives that of SciPy"
            ) from None
        names = {
            "states": [q.name for q in self.states],
            "inputs": [q.name for q in self.inputs],
            "outputs": [q.name for q in self.outputs],
        }
        return control.ss(self.A, self.B, self.C, self.D, self.period or 0, name=self.model, **names)

    def signal(self) -> Any:
        """Return the system as ``scipy.signal`` knows it. Raises SimulationError where an output follows derivatives of an
        input at once."""
        from scipy.signal import StateSpace

        self._refuse_derivatives("scipy.signal")

        matrices = (self.A, self.B, self.C, self.D)
        return StateSpace(*matrices) if self.period is None else StateSpace(*matrices, dt=self.period)

    def _refuse_derivatives(self, program: str) -> None:
        names = [q.name for q, *rows in zip(self.outputs, self.D1, self.D2, strict=True) if np.any(rows)]
        if names:
            raise SimulationError(
                f"{_quoted(names)}: a derivative of an input reaches this output directly, which a state space of {program} "
                "cannot hold",
                help="D1 and D2 hold it: y = C x + D u + D1 u' + D2 u''; or observe other outputs",
            )


class Linearize(Study, frozen=True, kw_only=True):
    """Linearise the motion at a state, between inputs and outputs: all inputs, and the outputs of the model (coordinates
    where it has none) unless they are named."""

    unused = OF_A_MOTION
    of_past = True
    needs: ClassVar[frozenset[str]] = frozenset({PART, "projection"})

    at: Annotated[
        Place, settable("Where: the start, the equilibrium reached from it, or other values.", "place")
    ] = field(default_factory=Place)
    driven: Annotated[tuple[str, ...], settable("Inputs that act on it.", "names", option="inputs")] = ()
    outputs: Annotated[tuple[str, ...], settable("Quantities that are observed.", "names")] = ()
    sample: Annotated[
        float | None,
        settable("Period of a sampled system whose inputs are constant between samples.", "time"),
    ] = None
    pade: Annotated[
        int | None, settable(f"Order of the Padé approximations of delays (default: {PADE}).", "count")
    ] = None

    def solve(self, problem: Problem) -> Linearization:
        """Linearise. Raises SimulationError at states where derivatives do not exist."""
        return _linearized(self, point_of(problem, self, self.at, self.driven, self.outputs))


class OperatingLinearization(Struct, frozen=True, eq=False):
    """A linear system at a state ``y``: between ``inputs``, by their indices, and ``outputs``; with what there is to say of it. Of a model
    with delays ``system`` is that between them and what is delayed, and ``past`` knows how these hang together."""

    site: Site
    y: Array
    system: LinearSystem
    inputs: list[int]
    outputs: list[tuple[Quantity, tuple[str, int]]]
    remarks: tuple[str, ...]
    past: LinearDelays | None = None


def point_of(
    problem: Problem,
    options: SimulationOptions,
    at: Place,
    driven: tuple[str, ...],
    observing: tuple[str, ...],
) -> OperatingLinearization:
    """Return the linear system at a place. Raises SimulationError at states where derivatives do not exist."""
    site = site_of(problem, options, at)
    remarks = list(moving_inputs(site))
    y = site.y
    if at.word == EQUILIBRIUM:
        site, rest = arrived(site, y)
        y = rest.y
    remarks += refuse_edges(site, y, "linearisation")
    if at.word != EQUILIBRIUM and resting(site, y) is None:
        remarks.append(
            "this state is not an equilibrium: the system describes how nearby motions diverge from this one"
        )
    inputs, outputs = chosen_inputs(problem, driven), chosen_outputs(problem, observing)
    following = observed_followers(problem, outputs)
    site = replace(site, chart=chart_of(problem, following))
    found = site.derivatives(y, apart=True)
    if not driven:
        inputs, staying = moving(site, found, inputs)
        remarks += staying
    rows, direct = observed(site, y, outputs, found)
    sources = delayed(site, y, found.rates_by_inputs.shape[1])
    if sources is not None:
        _, times, past, past_direct = sources
        inner = [len(problem.inputs) + k for k in range(len(times))]
        seen = np.vstack([rows, past]), np.vstack([direct, past_direct])
        system = linear_system(site, found, inputs + inner, seen)
    else:
        system = linear_system(site, found, inputs, (rows, direct))
    remarks += [left] if (left := left_out(problem, following)) else []
    if found.moves_by_itself:
        remarks.append(f"the system depends on time: it is that of t = {site.t:g}")
    looking = None if sources is None else LinearDelays(system, sources[1], sources[0])
    return OperatingLinearization(site, y, system, inputs, outputs, tuple(remarks), looking)


def moving(site: Site, found: Derivatives, inputs: list[int]) -> tuple[list[int], list[str]]:
    """Return the inputs that may change during a run, and what there is to say of the others."""
    fixed = that_stay(site, found, inputs)
    names = _quoted([site.problem.inputs[k].name for k in fixed])
    words = (
        "moves a constraint and keeps its value"
        if len(fixed) == 1
        else "move constraints and keep their values"
    )
    return [k for k in inputs if k not in fixed], [
        f"{names} {words}: no input of the linear system"
    ] if fixed else []


def delayed(site: Site, y: Array, columns: int) -> tuple[tuple[Quantity, ...], Array, Array, Array] | None:
    """Return what is delayed with names and units, its delays, and the derivatives of its sources by displacements and by
    ``columns`` inputs; None where nothing is."""
    past, problem = site.past, site.problem
    if past is None:
        return None
    entries, count = site.chart.of_entries(y), len(past.delayed)
    rows, direct = np.zeros((count, site.chart.size)), np.zeros((count, columns))
    names = []
    for row, (_, source, k) in enumerate(past.delayed.tolist()):
        array, index = past.sources[source].tolist()
        of = Quantity("time", "time", problem.time.unit)
        if array == Y:
            rows[row], of = entries[index], problem.states[index]
        elif array == U:
            direct[row, index], of = 1.0, problem.inputs[index]
        elif array == Z:
            of = problem.discretes[index]
        names.append(Quantity(f"delay({of.name}, {past.times[k]:g})", "state", of.unit))
    return tuple(names), past.times[past.delayed[:, 2]], rows, direct


def _linearized(study: Linearize, point: OperatingLinearization) -> Linearization:
    site, y, system, inputs, outputs = point.site, point.y, point.system, point.inputs, point.outputs
    problem, chart, remarks = site.problem, point.site.chart, list(point.remarks)
    if point.past is not None:
        order = study.pade if study.pade is not None else PADE
        remarks.append(_approximated(point.past, order, problem.time.unit))
        system = point.past.approximated(order)
    elif study.pade is not None:
        raise SimulationError(
            f"'{problem.name}' has no delays that 'pade' could approximate", help="leave 'pade' out"
        )
    form = proper_form(system)
    remarks += held_samples(problem)
    states = tuple(Quantity(chart.names[int(j)], "state", chart.units[int(j)]) for j in system.chosen)
    states += system.behind
    units = [q.unit for q in states]
    values, errors = poles(form.a, units)
    nulls = system.zeros()
    told = tuple(q for q, _ in outputs)
    driven = tuple(problem.inputs[k] for k in inputs)
    if study.sample is not None:
        form, values, errors, nulls = _sampled(form, told, study.sample, units)
    bounds = [None if error is None else max(1.0, system.condition) * error for error in errors]
    if not states:
        remarks.append("nothing is free to move here: the system has no states")
    if nulls is None:
        remarks.append("zeros are those of systems with as many outputs as inputs")
    remarks += _driving(form, driven, told, system)
    matrices = _matrices(form, system)
    return Linearization(
        study="linearize",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"states {len(states)}, inputs {len(driven)}, outputs {len(told)}"
        + ("" if study.sample is None else f", sampled every {study.sample:g} {problem.time.unit}".rstrip()),
        errors_from=ERRORS,
        remarks=tuple(remarks),
        tables=_tables(
            states, driven, told, matrices, values, bounds, nulls, problem.time.unit, study.sample
        ),
        panels=_pictures(driven, told, system, form, study.sample, problem.time),
        details=_details(site, y, states, driven, told, matrices, values, bounds, nulls, study.sample),
        arrays=matrices,
        A=form.a,
        B=form.b,
        C=form.c,
        D=form.d,
        D1=form.d1,
        D2=form.d2,
        S0=form.s0,
        S1=form.s1,
        states=states,
        inputs=driven,
        outputs=told,
        at=_at(problem, y),
        poles=values,
        zeros=nulls,
        period=study.sample,
    )


def _approximated(past: LinearDelays, order: int, time: str) -> str:
    """Say what the states of delays are, and up to which frequency they are right."""
    if not 1 <= order <= HIGHEST:
        raise SimulationError(f"the order of a Padé approximation is 1 to {HIGHEST}, it is {order}")
    longest = float(past.times.max())
    per = f" rad/{time}" if time else ""
    return (
        f"delays are Padé approximations of order {order}: exp(-i w T) is off by at most {bound(order, 1.0):.3g} (w T)^{2 * order + 1}, "
        f"which is {SHARE:.0%} at w = {right_up_to(order, SHARE) / longest:.4g}{per} for T = {longest:g} {time}".rstrip()
        + "; the study 'response' takes delays as they are"
    )


def _matrices(form: OutputForm, system: LinearSystem) -> dict[str, Array]:
    """Return what is shown and written: those of driving inputs only where there are such."""
    found = {"A": form.a, "B": form.b, "C": form.c, "D": form.d}
    if system.drives.any():
        found |= {"D1": form.d1, "D2": form.d2, "S0": form.s0, "S1": form.s1}
    return found


def _driving(
    form: OutputForm, inputs: tuple[Quantity, ...], outputs: tuple[Quantity, ...], system: LinearSystem
) -> list[str]:
    """Say what inputs that drive do to states and outputs."""
    remarks = []
    if form.s0.any() or form.s1.any():
        names = [q.name for q, drives in zip(inputs, system.drives, strict=True) if drives]
        remarks.append(
            f"{_quoted(names)} {'drives a coordinate' if len(names) == 1 else 'drive coordinates'}: rates and accelerations count; "
            "the states are the displacements less S0 u + S1 u'"
        )
    for order, matrix in (("rate", form.d1), ("acceleration", form.d2)):
        for j, q in enumerate(inputs):
            reached = [out.name for out, entry in zip(outputs, matrix[:, j], strict=True) if entry]
            if reached:
                remarks.append(
                    f"the {order} of '{q.name}' reaches {_quoted(reached)} at once: y = C x + D u + D1 u' + D2 u''"
                )
    return remarks


def _quoted(names: list[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def chosen_inputs(problem: Problem, names: tuple[str, ...]) -> list[int]:
    """Return the inputs that are named, or all; derivatives of inputs that drive are none of their own."""
    following = {k for pair in derived(problem).values() for k in pair}
    free = [k for k in range(len(problem.inputs)) if k not in following]
    places = {q.name: k for k, q in enumerate(problem.inputs)}
    for name in names:
        if name not in places:
            known = ", ".join(problem.inputs[k].name for k in free) or "none"
            raise SimulationError(
                f"'{name}' is not an input of '{problem.name}'", help=f"its inputs: {known}"
            )
        for k, pair in derived(problem).items():
            if places[name] in pair:
                own = problem.inputs[k].name
                raise SimulationError(
                    f"'{name}' follows from '{own}'",
                    help=f"name '{own}': rate and acceleration count with it",
                )
    return [places[name] for name in names] if names else free


def chosen_outputs(problem: Problem, names: tuple[str, ...]) -> list[tuple[Quantity, tuple[str, int]]]:
    """Return what is observed, each with its place: an output, a number of the state, or an input."""
    everything = [
        *((q, ("out", k)) for k, q in enumerate(problem.outputs)),
        *((q, ("y", k)) for k, q in enumerate(problem.states) if q.kind != "account"),
        *((q, ("u", k)) for k, q in enumerate(problem.inputs)),
    ]
    by_name = {q.name: (q, place) for q, place in everything}
    if names:
        return [by_name[name] for name in names]
    return [one for one in everything if one[0].kind == "output"] or [
        one for one in everything if one[0].kind == "coordinate"
    ]


def observed_followers(problem: Problem, chosen: list[tuple[Quantity, tuple[str, int]]]) -> set[int]:
    """Return the states that follow the motion and that something observed depends on, by their indices."""
    chart, pattern = chart_of(problem), pattern_of(problem)
    states, outputs = chart.nd - problem.nq, chart.nd + problem.ny - problem.nq
    following = {states + k: k for k in problem.followers}
    waiting = [outputs + k for _, (array, k) in chosen if array == "out"]
    waiting += [states + k for _, (array, k) in chosen if array == "y" and k in problem.followers]
    seen: set[int] = set()
    while waiting:
        row = waiting.pop()
        if row not in seen:
            seen.add(row)
            waiting += [column for column in pattern[pattern[:, 0] == row, 1].tolist() if column in following]
    return {following[row] for row in seen if row in following}


def observed(
    site: Site, y: Array, chosen: list[tuple[Quantity, tuple[str, int]]], found: Any
) -> tuple[Array, Array]:
    """Return the derivatives of what is observed by displacements and by inputs."""
    chart = site.chart
    entries = chart.of_entries(y)
    rows, direct = (
        np.zeros((len(chosen), chart.size)),
        np.zeros((len(chosen), found.rates_by_inputs.shape[1])),
    )
    for row, (quantity, (array, k)) in enumerate(chosen):
        match array:
            case "out":
                rows[row], direct[row] = found.outputs[k], found.outputs_by_inputs[k]
                for column in np.flatnonzero(~np.isfinite(rows[row])):
                    raise site.undefined(f"'{quantity.name}'", int(rows_of(chart)[column]))
                if found.outputs_by_others[k].any():
                    raise SimulationError(
                        f"the output '{quantity.name}' counts energy from the start on: it is not a function of the state",
                        help="observe other quantities with outputs = ...",
                    )
            case "y":
                rows[row] = entries[k]
            case _:
                direct[row, k] = 1.0
    return rows, direct


def _sampled(
    form: OutputForm, outputs: tuple[Quantity, ...], period: float, units: Sequence[str]
) -> tuple[OutputForm, Complex, list[float | None], Complex | None]:
    """Return the system from one sample to the next, for inputs that are held, with poles and zeros of that."""
    form = held_form(form, outputs, period)
    return form, *poles(form.a, units), zeros(form.a, form.b, form.c, form.d)


def held_form(form: OutputForm, outputs: tuple[Quantity, ...], period: float) -> OutputForm:
    """Return the system from one sample to the next, for inputs that are held. Raises SimulationError where they jump as they are."""
    if not period > 0:
        raise SimulationError(f"the period of sampling is positive, it is {period:g}")
    if form.improper:
        names = [q.name for q, *rows in zip(outputs, form.d1, form.d2, strict=True) if np.any(rows)]
        raise SimulationError(
            f"an input that is held between samples jumps at each of them, and {_quoted(names)} follows its derivatives",
            help="leave out 'sample', or observe other outputs",
        )
    a, b = held(form.a, form.b, period)
    return replace(form, a=a, b=b)


def _pictures(
    inputs: tuple[Quantity, ...],
    outputs: tuple[Quantity, ...],
    system: LinearSystem,
    form: OutputForm,
    period: float | None,
    time: Quantity,
) -> tuple[Panel, ...]:
    """Return gain and phase over frequency and the response to a step of each input, of every pair; where there is no
    input, the poles. ``form`` is that of the sampled system where there is a ``period``."""
    values, _ = poles(form.a)
    if not inputs or not outputs:
        dots = Curve("poles", values.real.astype(float), values.imag.astype(float), style="points")
        per = f"1/{time.unit}" if time.unit else ""
        return (Panel("poles", "real part", per, "imaginary part", per, (dots,)),)
    transfer: Transfer = Continuous(system) if period is None else Sampled(form, period, system.condition)
    w = seen_over([(transfer, values)])
    return (
        *bode([Shown("", transfer, w)], inputs, outputs, time),
        step_responses(inputs, outputs, form, period, values, time),
    )


def _at(problem: Problem, y: Array) -> dict[str, float]:
    return {q.name: float(v) for q, v in zip(problem.states, y, strict=True) if q.kind != "account"}


def _pairs(values: Complex) -> list[list[float]]:
    return [[float(v.real), float(v.imag)] for v in values]


def _details(
    site: Site,
    y: Array,
    states: tuple[Quantity, ...],
    inputs: tuple[Quantity, ...],
    outputs: tuple[Quantity, ...],
    matrices: dict[str, Array],
    values: Complex,
    bounds: list[float | None],
    nulls: Complex | None,
    period: float | None,
) -> dict[str, Any]:
    return {
        **{name: matrix.tolist() for name, matrix in matrices.items()},
        "states": [q.name for q in states],
        "inputs": [q.name for q in inputs],
        "outputs": [q.name for q in outputs],
        "units": {q.name: q.unit for q in (*states, *inputs, *outputs)},
        "at": _at(site.problem, y),
        "poles": _pairs(values),
        "zeros": None if nulls is None else _pairs(nulls),
        "period": period,
        "accuracy": {"errors": {"poles": bounds}, "errors_from": ERRORS},
    }


def _tables(
    states: tuple[Quantity, ...],
    inputs: tuple[Quantity, ...],
    outputs: tuple[Quantity, ...],
    matrices: dict[str, Array],
    values: Complex,
    bounds: list[float | None],
    nulls: Complex | None,
    time: str,
    sample: float | None,
) -> tuple[Table, ...]:
    per = f"1/{time}" if time else ""

    def table(
        title: str, columns: tuple[Quantity, ...], rows: tuple[Quantity, ...], matrix: Array, dash: str
    ) -> Table:
        head = (("", ""), *((q.name, "") for q in columns))
        body: list[tuple[Cell, ...]] = [
            (q.name + dash, *(float(x) for x in row)) for q, row in zip(rows, matrix, strict=True)
        ]
        return Table(title, head, tuple(body))

    head = [("pole", "" if sample else per), ("error", "" if sample else per)]
    rows: list[tuple[Cell, ...]] = [(complex(z), bound) for z, bound in zip(values, bounds, strict=True)]
    if sample is None:
        head += [("frequency", f"rad/{time}" if time else ""), ("damping", "")]
        rows = [(*row, abs(z), -z.real / abs(z) if z else 0.0) for row, z in zip(rows, values, strict=True)]
    found = [Table("", tuple(head), tuple(rows)), table("A", states, states, matrices["A"], "'")]
    if inputs:
        found.append(table("B", inputs, states, matrices["B"], "'"))
    found.append(table("C", states, outputs, matrices["C"], ""))
    for name, told in (("D", outputs), ("D1", outputs), ("D2", outputs), ("S0", states), ("S1", states)):
        if name in matrices and matrices[name].any():
            found.append(table(name, inputs, told, matrices[name], ""))
    if nulls is not None and len(nulls):
        found.append(Table("", (("zero", head[0][1]),), tuple((complex(z),) for z in nulls)))
    return tuple(one for one in found if one.rows and len(one.head) > 0)
