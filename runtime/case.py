"""One run made ready: options and experiment resolved, parameters, initial state, inputs and output times.

Order of precedence: the caller's options and values, then the experiment, then the defaults. Settings of an
experiment may depend on parameters that the experiment sets; they are evaluated until nothing changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated

import numpy as np
from msgspec import Struct, field
from msgspec.structs import asdict, replace
from numpy.typing import NDArray

from mechc.suggest import suggest

from .allowed_values import check_inputs, check_parameters, check_state
from .driving_inputs import begin_of, check_set, with_derivatives
from .functions import Functions
from .inputs import Signal, Table, constant
from .interface import OF_ENSEMBLES, Experiment, ModelInterface, Setting
from .limits_of_time import (
    DEFAULT_TOLERANCE,
    TimeSpan,
    check_finite,
    check_size,
    check_stated_stop,
    no_stop,
)
from .memo import once
from .methods import SOLVING_CONTACTS
from .outcome import SimulationError
from .problem import Array, Problem
from .rows import AT_ONCE, IN_MEMORY, Follower, Storage, output_times
from .settings import settable

if TYPE_CHECKING:
    from .start.initial import Assembled

Progress = Callable[[float], None]
"""Called between slices of a run with the fraction that is done."""

LOWEST_TOLERANCE = 1e-14
TOLERANCE_OF_CROWDS = 1e-5
"""Of steps that solve for contacts too many for formulas, as a part of the largest rate."""
MOST_FORMULAS = 64
"""Rows of contacts that have formulas at most: MOST_ROWS of the compiler."""
DEFAULT_POINTS = 500
METHODS = "auto, dop853, radau5, taylor; with a fixed step rk4, gauss2 to gauss8, verlet, rattle, lobatto4, lobatto6, moreau."

NUMBERS = ("start", "stop", "every", "step", "tolerance")
WORDS = ("method", "display")
KNOWN = frozenset((*NUMBERS, *WORDS, *OF_ENSEMBLES))
"""Options of experiments."""


def part_of(progress: Progress | None, begin: float, end: float) -> Progress | None:
    """Progress of one part of the work, told as progress of the whole."""
    if progress is None:
        return None
    return lambda fraction: progress(begin + (end - begin) * fraction)


class SimulationOptions(Struct, frozen=True, kw_only=True):
    """What the caller wants; None leaves it to the experiment or the default. Everything is in SI.

    ``values``: parameters, initial values and constant inputs by name. ``start`` is the first output time: the motion itself
    begins at ``begin``; without it at 0, or at ``start`` where that is negative or a table has no rows before it. ``step`` belongs to fixed-step methods. ``every``: output spacing; else
    ``points`` output times are spread evenly. ``dense`` keeps the polynomials of all steps for ``Solution(t)``. ``max_step``: the
    longest step, else a tenth of the run: no motion is jumped over. ``max_steps`` bounds steps, ``stiff_after`` those of the stiff.
    """

    experiment: str | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    inputs: Mapping[str, Table | Signal] = field(default_factory=dict)
    start: Annotated[float | None, settable("First output time.", "time")] = None
    begin: float | None = None
    stop: Annotated[
        float | None, settable('When to stop: "10 s", "2 min"; a bare number is seconds.', "time")
    ] = None
    every: Annotated[
        float | None, settable(f"Spacing of the output, instead of {DEFAULT_POINTS} points.", "time")
    ] = None
    points: int = DEFAULT_POINTS
    step: Annotated[float | None, settable("Step of a fixed-step method.", "time")] = None
    tolerance: Annotated[
        float | None, settable("Relative tolerance of a step (default: 1e-8).", "number")
    ] = None
    method: Annotated[str | None, settable(METHODS, "text")] = None
    max_step: float | None = None
    max_steps: int | None = None
    stiff_after: int | None = None
    estimate_error: Annotated[
        bool, settable("Make a second, tighter run that estimates the error.", "flag")
    ] = True
    dense: bool = True
    follower: Follower | None = None
    reproducible: Annotated[bool, settable("Make results bit-for-bit the same on every machine.", "flag")] = (
        False
    )
    progress: Progress | None = None

    @property
    def storage(self) -> Storage:
        """Where the rows of the run lie."""
        return IN_MEMORY if self.follower is None else self.follower.storage


class Case(TimeSpan, frozen=True, kw_only=True, eq=False):
    """A problem whose run can begin: p, z and y0 filled, times checked. ``tables``: by index in u. ``wanted``: the initial state as given and guessed, of which the ``known`` entries are
    given; ``assembled`` tells how y0 was made from it, None where nothing constrains it."""

    problem: Problem
    functions: Functions
    experiment: str
    p: Array
    z: Array
    y0: Array
    known: NDArray[np.bool_]
    wanted: Array
    assembled: Assembled | None
    tables: Mapping[int, Table]
    method: str
    asked: SimulationOptions | None = None
    """The options that it was made from."""


def start_remarks(case: Case) -> tuple[str, ...]:
    """Say what there is to say of a start: another position close by, and the parameters that it found."""
    remarks = () if case.assembled is None else case.assembled.remarks
    listed = []
    for k in case.problem.found[:8]:
        q = case.problem.parameters[k]
        listed.append(f"{q.name} = {case.p[k]:.9g} {q.unit}".rstrip())
    if len(case.problem.found) > len(listed):
        listed.append("and more")
    return (*remarks, f"the start finds {', '.join(listed)}") if listed else remarks


def find_experiment(problem: ModelInterface, name: str | None) -> Experiment | None:
    """Give the experiment ``name``; without a name the unnamed one, else the first, else None."""
    if name is not None:
        for experiment in problem.experiments:
            if experiment.name == name:
                return experiment
        names = [experiment.name for experiment in problem.experiments]
        raise SimulationError(f"'{problem.name}' has no experiment '{name}'" + suggest(name, names))
    for experiment in problem.experiments:
        if not experiment.name:
            return experiment
    return problem.experiments[0] if problem.experiments else None


@once
def _settings(problem: Problem) -> dict[str, Setting]:
    """List what can be set, by name: of equal names the first one counts."""
    found: dict[str, Setting] = {}
    for array, quantities in (("p", problem.parameters), ("y", problem.states), ("u", problem.inputs)):
        for index, quantity in enumerate(quantities):
            found.setdefault(quantity.name, Setting(array, index))
    return found


def find_setting(problem: Problem, name: str) -> Setting:
    """Find what a value by this name sets: a parameter, an initial value or a constant input."""
    found = _settings(problem).get(name)
    if found is not None:
        if found.array == "u":
            check_set(problem, found.index)
        _refuse_found(problem, found)
        return found
    if any(quantity.name == name for quantity in problem.outputs):
        raise SimulationError(f"'{name}' is an output of '{problem.name}': it follows from the motion")
    known = [q.name for q in (*problem.parameters, *problem.states, *problem.inputs)]
    raise SimulationError(
        f"'{problem.name}' has no parameter, state or input '{name}'" + suggest(name, known)
    )


def _refuse_found(problem: Problem, setting: Setting) -> None:
    """Refuse a value of what the start finds: a condition on the start would be left unfulfilled. Raises SimulationError."""
    if setting.array == "p" and setting.index in problem.found:
        quantity, noun = problem.parameters[setting.index], "parameter"
    elif setting.array == "y" and setting.index in problem.found_states:
        quantity, noun = problem.states[setting.index], "state"
    else:
        return
    raise SimulationError(
        f"the start of '{problem.name}' finds the {noun} '{quantity.name}', so it cannot be set",
        quantity.origin,
        help=f"write '{quantity.name} = ..' in the model for a value that is known, and leave out an initial condition",
    )


def prepare(problem: Problem, functions: Functions, options: SimulationOptions) -> Case:
    """Make a run ready. Raises ``SimulationError``."""
    wanted = {find_setting(problem, name): float(value) for name, value in options.values.items()}
    experiment = find_experiment(problem, options.experiment)
    p, chosen, numbers, words, started = _settle(problem, functions, experiment, wanted)
    check_parameters(problem, p)
    span = _time_span(problem, options, numbers, options.method or words.get("method", "auto"))
    begin = span.begin
    tables: dict[int, Table] = {}
    if problem.inputs or options.inputs:
        tables = _tables(problem, options, span, {s.index: v for s, v in chosen.items() if s.array == "u"})
        tables = with_derivatives(problem, tables, begin, span.stop)
    if started is None or begin != 0 or tables:
        started = initial_state(problem, functions, begin, p, tables)
    z, y0 = started
    known = _blank(problem).known.copy()
    guesses = {s.index for s in experiment.settings if s.guess and s.array == "y"} if experiment else ()
    for setting, value in chosen.items():
        _refuse_found(problem, setting)
        if setting.array == "y":
            y0[setting.index] = value
            known[setting.index] = setting in wanted or setting.index not in guesses
    u = input_values(functions, tables, begin, p, len(problem.inputs))
    check_inputs(problem, u)

    def put_others(y: Array) -> None:
        if functions.initial_of_others is None:
            return
        free = [k for k, i in enumerate(problem.dependent) if Setting("y", i) not in chosen]
        places = [problem.dependent[k] for k in free]
        for _ in places:  # one of them may be stated with another
            y[places] = functions.initial_of_others(begin, y, u, z, p)[free]

    put_others(y0)
    check_state(problem, y0)
    wanted_state, assembled = y0, None
    if problem.assembly:
        from .start.initial import assemble

        for _ in range(AGAIN):  # what is stated with others follows them
            assembled = assemble(
                problem, functions, begin, wanted_state, known, u, z, p, reproducible=options.reproducible
            )
            y0 = assembled.y
            if functions.initial_of_others is None:
                break
            after = y0.copy()
            put_others(after)
            wanted_state = wanted_state.copy()
            wanted_state[list(problem.dependent)] = after[list(problem.dependent)]
            if same_start(problem, after, y0):
                break
        else:
            raise SimulationError(
                "initial values that are stated with those of others do not settle: the assembly moves these each time",
                code="E0605",
                help="state one of them as a guess, with '~'",
            )
        y0 = after if functions.initial_of_others is not None else y0
    if functions.found is not None:
        p = _found(problem, functions, begin, y0, u, z, p, chosen)
        check_parameters(problem, p)
    if problem.hybrid is not None and problem.hybrid.delays:
        from .delays import as_at_the_start

        z = as_at_the_start(functions, begin, y0, u, z, p)
    return Case(
        problem=problem,
        functions=functions,
        experiment=experiment.name if experiment else "",
        p=p,
        z=z,
        y0=y0,
        known=known,
        wanted=wanted_state,
        assembled=assembled,
        tables=tables,
        method=options.method or words.get("method", "auto"),
        asked=options,
        **asdict(span),
    )


@once
def _spans(problem: Problem) -> dict[tuple[object, ...], TimeSpan]:
    """The times of the last run."""
    return {}


def _time_span(
    problem: Problem, options: SimulationOptions, numbers: Mapping[str, float], method: str
) -> TimeSpan:
    """Check times, tolerance and steps, or take those of the run before, if it asked for the same."""
    start = (numbers.get("start") if options.start is None else options.start) or 0.0
    begin = begin_of(problem, options.inputs, start) if options.begin is None else options.begin
    known, own = _spans(problem), (begin, options.start, options.stop, options.every, options.points)
    asked = (
        *own,
        method in SOLVING_CONTACTS,
        options.tolerance,
        options.step,
        options.max_step,
        *numbers.items(),
    )
    found = known.get(asked) if options.follower is None else None
    if found is not None:
        return replace(found, grid=found.grid.copy())
    made = _checked_span(problem, options, numbers, method, start, begin)
    if options.follower is None and made.grid.size <= AT_ONCE:
        known.clear()
        known[asked] = replace(made, grid=made.grid.copy())
    return made


def _checked_span(
    problem: Problem,
    options: SimulationOptions,
    numbers: Mapping[str, float],
    method: str,
    start: float,
    begin: float,
) -> TimeSpan:
    """Check times, tolerance and steps. ``numbers`` are those of the experiment, after those of the caller."""

    def number(name: str, given: float | None) -> float | None:
        return numbers.get(name) if given is None else float(given)

    every = number("every", options.every)
    stop = number("stop", options.stop)
    if stop is None:
        raise no_stop(problem)
    check_finite({n: v for n, v in (("start", start), ("stop", stop)) if getattr(options, n) is None})
    if options.start is not None and options.stop is None:
        check_stated_stop(problem, start, stop)
    if options.follower is None:
        check_size(problem, start, stop, every, options.points)
    step = number("step", options.step)
    spacing = every
    if every is None and step is not None and step > 0 and method in SOLVING_CONTACTS and options.points >= 2:
        spacing = step * max(1, math.ceil((stop - start) / (options.points - 1) / step * (1 - 1e-9)))
    grid = output_times(start, stop, spacing, options.points, options.storage)
    tolerance = number("tolerance", options.tolerance)
    if tolerance is None:
        tolerance = (
            TOLERANCE_OF_CROWDS if method in SOLVING_CONTACTS and is_crowd(problem) else DEFAULT_TOLERANCE
        )
    if not LOWEST_TOLERANCE <= tolerance < 1:
        raise SimulationError(f"the tolerance lies between {LOWEST_TOLERANCE:g} and 1, it is {tolerance:g}")
    if step is not None and not (math.isfinite(step) and step > 0):
        raise SimulationError(f"the step is positive, it is {step:g}")
    max_step = options.max_step if options.max_step is not None else (stop - begin) / 10
    if not max_step > 0 and stop > begin:
        raise SimulationError(f"the largest step is positive, it is {max_step:g}")
    return TimeSpan(begin, stop, grid, every, tolerance, step, max_step)


def is_crowd(problem: Problem) -> bool:
    """Tell whether the contacts are too many for formulas of their forces."""
    return problem.hybrid is not None and problem.hybrid.n_rows > MOST_FORMULAS


AGAIN = 20
"""How often a start is assembled where initial values that are stated with those of others move these."""


def same_start(problem: Problem, a: Array, b: Array) -> bool:
    """Tell whether initial values that are stated with those of others are what the assembly took them for."""
    places = [i for i in problem.dependent if i < problem.nq + problem.nv]
    size = 1e-14 * (np.abs(a[places]) + np.abs(b[places]))
    return bool((np.abs(a[places] - b[places]) <= size).all())


def _found(
    problem: Problem,
    functions: Functions,
    t: float,
    y: Array,
    u: Array,
    z: Array,
    p: Array,
    chosen: Mapping[Setting, float],
) -> Array:
    """Give the parameters with those that the start finds."""
    assert functions.found is not None
    values = functions.found(t, y, u, z, p)
    for k, value in zip(problem.found, values, strict=True):
        if not math.isfinite(value):
            name = problem.parameters[k].name
            raise SimulationError(
                f"no value of '{name}' is found that fulfils the initial conditions",
                problem.parameters[k].origin,
                code="E0611",
                help="guess closer, or look at the initial conditions",
            )
    given = {Setting("p", k): float(v) for k, v in zip(problem.found, values, strict=True)}
    return _parameters(problem, functions, {**chosen, **given})


class _Blank(Struct, frozen=True):
    """What the arrays of a case begin as: copies of these."""

    p: Array
    given: NDArray[np.uint8]
    y: Array
    known: NDArray[np.bool_]


@once
def _blank(problem: Problem) -> _Blank:
    count = len(problem.parameters)
    return _Blank(
        np.full(count + problem.nh, np.nan),
        np.zeros(count, dtype=np.uint8),
        np.full(problem.ny, np.nan),
        np.array(problem.known, dtype=bool),
    )


def input_values(functions: Functions, tables: Mapping[int, Table], t: float, p: Array, nu: int) -> Array:
    """Inputs at time t, continuous from the right."""
    if functions.inputs is None:
        return np.empty(0)
    u = functions.inputs(t, np.empty(0), np.empty(nu), np.empty(0), p).copy()
    for index, table in tables.items():
        u[index] = table(np.array([t]))[0]
    return u


def inputs_at(case: Case, t: float) -> Array:
    """Inputs of a case at time t, continuous from the right."""
    return input_values(case.functions, case.tables, t, case.p, len(case.problem.inputs))


def initial_state(
    problem: Problem, functions: Functions, t: float, p: Array, tables: Mapping[int, Table]
) -> tuple[Array, Array]:
    """Discrete variables and initial state as the model gives them."""
    u = input_values(functions, tables, t, p, len(problem.inputs))
    unknown = _blank(problem).y
    if functions.discretes is None:
        z = np.empty(0)
    else:
        z = functions.discretes(t, unknown, u, np.full(len(problem.discretes), np.nan), p).copy()
    return z, functions.initial(t, unknown, u, z, p).copy()


def _settle(
    problem: Problem, functions: Functions, experiment: Experiment | None, wanted: Mapping[Setting, float]
) -> tuple[Array, dict[Setting, float], dict[str, float], Mapping[str, str], tuple[Array, Array] | None]:
    """Parameters with all settings applied, the settings, and the options of the experiment; the discrete variables and the state
    at time 0 without tables, where they were needed on the way."""
    chosen = dict(wanted)
    p = _parameters(problem, functions, chosen)
    if experiment is None:
        return p, chosen, {}, {}, None
    if not KNOWN.issuperset(experiment.options) or not KNOWN.issuperset(experiment.words):
        name = next(n for n in (*experiment.options, *experiment.words) if n not in KNOWN)
        raise SimulationError(f"experiment '{experiment.name}' has the option '{name}', which no run knows")
    settings = [Setting(s.array, s.index) for s in experiment.settings]
    tables: dict[int, Table] = {}
    for _ in range(len(settings) + 2):
        if problem.inputs:
            tables = {s.index: constant(value) for s, value in chosen.items() if s.array == "u"}
        z, y = initial_state(problem, functions, 0.0, p, tables)
        u = input_values(functions, tables, 0.0, p, len(problem.inputs))
        values = functions.experiments[experiment.function](0.0, y, u, z, p).tolist()
        numbers = dict(zip(experiment.options, values, strict=False))
        if not settings:
            return p, chosen, numbers, experiment.words, (z, y)
        before = dict(chosen)
        for setting, value in zip(settings, values[len(experiment.options) :], strict=True):
            if setting not in wanted:
                chosen[setting] = value
        if chosen == before:
            return p, chosen, numbers, experiment.words, (z, y)
        p = _parameters(problem, functions, chosen)
    raise SimulationError(
        f"the settings of experiment '{experiment.name}' do not settle: they depend on each other"
    )


def _parameters(problem: Problem, functions: Functions, chosen: Mapping[Setting, float]) -> Array:
    """Give the parameters where these are set, and what is computed of them."""
    blank = _blank(problem)
    p, given = blank.p.copy(), blank.given.copy()
    for setting, value in chosen.items():
        if setting.array == "p":
            p[setting.index] = value
            given[setting.index] = 1
    functions.parameters(p, given)
    return p


SHARE = 0.01
"""Of the tolerance: how closely functions that are given as inputs are followed."""


def _is_constant(table: Table | Signal) -> bool:
    return isinstance(table, Table) and table.ends is None and bool((table.values == table.values[0]).all())


def _tables(
    problem: Problem, options: SimulationOptions, span: TimeSpan, constants: Mapping[int, float]
) -> dict[int, Table]:
    tables = {index: constant(value) for index, value in constants.items()}
    for name, table in options.inputs.items():
        setting = find_setting(problem, name)
        if setting.array != "u":
            raise SimulationError(f"'{name}' is not an input of '{problem.name}'")
        if setting.index in problem.held_inputs and not _is_constant(table):
            raise SimulationError(
                f"the equations need the rate of the input '{name}', which they take to be zero, as its default is a constant",
                problem.inputs[setting.index].origin,
                help=f"let formulas read it through a filter, which has rates: {name}(filter = 1 ms)",
            )
        if name in options.values:
            raise SimulationError(f"the input '{name}' is given twice: as a value and as a table")
        if isinstance(table, Signal):
            table = table.table(name, span.begin, span.stop, SHARE * span.tolerance)
        tables[setting.index] = table
    return tables
