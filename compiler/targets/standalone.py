"""The part that is the same in every generated Python module: everything below the marker is copied.

What stands above it here is a model of nothing, in the place of the generated part.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import math
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechc.runtime.nominal import Sizes, nominal_values

NAME = "empty"
STATES: list[tuple[str, str]] = []
PARAMETERS: list[tuple[str, str]] = []
INPUTS: list[tuple[str, str]] = []
OUTPUTS: list[tuple[str, str]] = []
N_CONSTANTS = 0
NQ = NV = N_CONSTRAINTS = 0
EVENTS = False
ROTATIONS: list[int] = []
ASSERTIONS: list[str] = []
SETTINGS: dict[str, float] = {}
SIZES = Sizes(0, 0, (), (), (), (), (), (), (), ())
EXPERIMENTS: dict[str, dict[str, Any]] = {}
ARRAY_FUNCTIONS: dict[str, Callable[..., Any]] = {}
CONDITIONS: set[str] = set()


def start_state(t: float, y: Any, known: Mapping[int, bool], u: Any, z: Any, p: Any) -> tuple[Any, Any]:
    return y, y


def nothing(*arguments: Any) -> list[float]:
    return []


parameters = rhs = initial = inputs = discretes = outputs = assertions = nothing
project_position = project_velocity = displace = nothing

# ---- copied from here


def _careful(name: str) -> Callable[..., Any]:
    """Return a function by its name; where ``math`` raises, it gives what NumPy does: NaN or infinity."""
    function, fallback = globals()[name], ARRAY_FUNCTIONS[name]

    def evaluate(*arguments: Any) -> Any:
        try:
            value = function(*arguments)
        except (ArithmeticError, ValueError):
            value = fallback(*arguments)
        return np.bool_(value) if name in CONDITIONS else np.float64(value)

    return evaluate


def checked(function: Callable[..., list[float]]) -> Callable[..., list[float]]:
    """Return a function of this module that never raises: undefined values become NaN, as they do in C.

    Where Python raises an exception, the same text is evaluated with NumPy's numbers.
    """
    again = types.FunctionType(function.__code__, {**globals(), **{n: _careful(n) for n in ARRAY_FUNCTIONS}})

    def evaluate(*arguments: Any) -> list[float]:
        try:
            return function(*arguments)
        except (ArithmeticError, ValueError):
            converted = [[np.float64(v) for v in a] if np.ndim(a) else np.float64(a) for a in arguments]
            with np.errstate(all="ignore"):
                return [float(v) for v in again(*converted)]

    return evaluate


def vectorised(function: Callable[..., list[float]]) -> Callable[..., Any]:
    """Return a function of this module for many states at once: y of shape (ny, n) gives (n_out, n).

    Any of t and the rows of y, u, z and p may be a number or have n values.
    """
    over_arrays = types.FunctionType(function.__code__, {**globals(), **ARRAY_FUNCTIONS})

    def evaluate(t: Any, y: Any, u: Any = (), z: Any = (), p: Any = ()) -> Any:
        t, y, u, z, p = (np.asarray(a, float) for a in (t, y, u, z, p))
        with np.errstate(all="ignore"):
            out = over_arrays(t, y, u, z, p)
        shape = np.broadcast_shapes(t.shape, *(a.shape[1:] for a in (y, u, z, p)))
        return np.array([np.broadcast_to(v, shape) for v in out])

    return evaluate


PLACES = {
    **{name: ("u", i) for i, (name, _) in enumerate(INPUTS)},
    **{name: ("y", i) for i, (name, _) in enumerate(STATES)},
    **{name: ("p", i) for i, (name, _) in enumerate(PARAMETERS)},
}


def all_parameters(values: Mapping[int, float]) -> list[float]:
    """Return p: the given parameters by index, defaults for all others, and the constants of the run."""
    p = [values.get(i, math.nan) for i in range(len(PARAMETERS))] + [math.nan] * N_CONSTANTS
    return checked(parameters)(p, [i in values for i in range(len(PARAMETERS))])


MOST = 2.5e8
"""Numbers of a table that are kept: 2 GB."""


def _times(start: float, stop: float, every: float | None, points: int) -> Any:
    """Return the times of the rows: ``points`` of them, or one in each ``every`` and one at the end."""
    if not (math.isfinite(start) and math.isfinite(stop) and stop >= start):
        raise ValueError(f"the stop time {stop:g} is no time from {start:g} on")
    if stop == start:
        return np.array([stop])
    if every is None:
        return np.linspace(start, stop, points)
    if not every > 0:
        raise ValueError(f"the time between two rows is positive, it is {every:g}")
    if not ((stop - start) / every + 2) * (1 + len(STATES) + len(OUTPUTS)) <= MOST:
        raise ValueError(f"a row every {every:g} of {stop - start:g} are too many")
    return np.append(np.arange(start, stop - 1e-9 * every, every), stop)


def simulate(
    stop: float | None = None,
    tolerance: float | None = None,
    *,
    every: float | None = None,
    points: int = 501,
    experiment: str | None = None,
    values: Mapping[str, float] | None = None,
    signals: Mapping[str, Callable[[float], float]] | None = None,
) -> dict[str, Any]:
    """Return the motion: arrays by name, of the time, all states and all outputs.

    ``values`` sets parameters, initial states and inputs by name, in SI units, and goes before the settings
    of the experiment (by default the first one); ``signals`` gives inputs as functions of time.
    """
    if EVENTS:
        raise RuntimeError("the model has events, which this module does not treat: use mechc run")
    plan = EXPERIMENTS[experiment] if experiment is not None else next(iter(EXPERIMENTS.values()), None)
    own = {PLACES[name]: float(value) for name, value in {**SETTINGS, **(values or {})}.items()}
    known = dict.fromkeys(own, True)
    chosen, options = dict(own), {}
    driven = {PLACES[name][1]: signal for name, signal in (signals or {}).items()}
    default_inputs = checked(inputs)

    def inputs_at(t: float) -> list[float]:
        u = default_inputs(t, (), (), (), p) if INPUTS else []
        return [driven[i](t) if i in driven else chosen.get(("u", i), value) for i, value in enumerate(u)]

    for _ in range(len(plan["settings"]) + 2 if plan else 1):
        p = all_parameters({i: value for (array, i), value in chosen.items() if array == "p"})
        z = checked(discretes)(0.0, (), inputs_at(0.0), (), p)
        y = checked(initial)(0.0, (), inputs_at(0.0), z, p)
        if plan:
            results = checked(plan["function"])(0.0, y, inputs_at(0.0), z, p)
            options = dict(zip(plan["options"], results, strict=False))
            chosen = {**dict(zip(plan["settings"], results[len(options) :], strict=True)), **own}
            known = {**dict(zip(plan["settings"], plan["known"], strict=True)), **known}
    stop = options.get("stop") if stop is None else stop
    every = options.get("every") if every is None else every
    tolerance = options.get("tolerance", 1e-8) if tolerance is None else tolerance
    if stop is None:
        raise ValueError("give a stop time: the model has none")
    start = options.get("start", 0.0)
    times = _times(start, stop, every, points)
    if not 1e-14 <= tolerance <= 1:
        raise ValueError(f"the tolerance lies between 1e-14 and 1, it is {tolerance:g}")
    begin = min(0.0, start)
    z = checked(discretes)(begin, (), inputs_at(begin), (), p)
    given = {i: value for (array, i), value in chosen.items() if array == "y"}
    y = [given.get(i, value) for i, value in enumerate(checked(initial)(begin, (), inputs_at(begin), z, p))]
    y, plain = start_state(begin, y, {i: known["y", i] for i in given}, inputs_at(begin), z, p)
    rate, report, hold = checked(rhs), checked(outputs), checked(assertions)
    nominal = np.ones(len(y))

    def accept(t: float, y: Any) -> Any:
        for i in ROTATIONS:
            y[i : i + 4] /= math.sqrt(sum(y[i : i + 4] ** 2))
        if N_CONSTRAINTS:
            _project(t, y, inputs_at(t), z, p, nominal)
        for holds, message in zip(hold(t, y.tolist(), inputs_at(t), z, p), ASSERTIONS, strict=True):
            if not holds > 0.5:
                raise RuntimeError(f"at t = {t:g}: {message}")
        return y

    def slope(t: float, y: Any) -> Any:
        return np.array(rate(t, y.tolist(), inputs_at(t), z, p))

    def motion(times: Any, tolerance: float) -> Iterator[Any]:
        return _dormand_prince(slope, begin, accept(begin, y.copy()), times, tolerance, nominal, accept)

    def reached(provisional: Any) -> Any:
        """The largest sizes in a first run; of one that fails, before it does."""
        nonlocal nominal
        nominal, largest = provisional, abs(y)
        try:
            for state in motion(np.linspace(begin, stop, 200), 1e-6):
                largest = np.maximum(largest, abs(state))
        except RuntimeError:
            pass
        return largest

    energies = [report(begin, y.tolist(), inputs_at(begin), z, p)[k] for k in SIZES.energies]
    nominal = nominal_values(SIZES, plain, slope(begin, y), np.array(p), energies, stop - begin, reached)
    states = list(motion(times, tolerance))
    rows = [report(t, s.tolist(), inputs_at(t), z, p) for t, s in zip(times, states, strict=True)]
    names = [name for name, _ in STATES] + [name for name, _ in OUTPUTS]
    table = np.hstack([np.array(states), np.array(rows).reshape(len(rows), -1)])
    return {"time": times, **dict(zip(names, table.T, strict=True))}


# ---- copied where there are constraints


def _project(t: float, y: Any, u: list[float], z: list[float], p: list[float], nominal: Any) -> None:
    """Move y onto the constraints: coordinates by Newton's method in the mass metric, then velocities."""
    for _ in range(11):
        d = checked(project_position)(t, y.tolist(), u, z, p)[:NV]
        change = np.array(checked(displace)(t, [*y[:NQ].tolist(), *d, *y[NQ + NV :].tolist()], u, z, p))
        size = np.max(abs(change) / (nominal + abs(y))[:NQ], initial=0.0)
        y[:NQ] += change
        for i in ROTATIONS:
            y[i : i + 4] /= math.sqrt(sum(y[i : i + 4] ** 2))
        if size <= 2e-10:  # the error left is its square
            break
    else:
        raise RuntimeError(f"at t = {t:g}: the constraints cannot be met")
    for _ in range(2):
        y[NQ : NQ + NV] += checked(project_velocity)(t, y.tolist(), u, z, p)[:NV]


# ---- copied from here


# J. R. Dormand, P. J. Prince, J. Comp. Appl. Math. 6 (1980) 19: fifth order, error of the embedded fourth
_NODES = [0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0]
_STAGES = [
    [],
    [1 / 5],
    [3 / 40, 9 / 40],
    [44 / 45, -56 / 15, 32 / 9],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
]
_ERRORS = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


def _dormand_prince(
    slope: Callable[[float, Any], Any],
    t: float,
    y: Any,
    times: Any,
    tolerance: float,
    nominal: Any,
    accept: Callable[[float, Any], Any],
) -> Iterator[Any]:
    """Yield the state at each of the times; steps end there, and ``accept`` may correct their result.

    The error of a step stays below ``tolerance`` times (nominal value + size) of each state.
    """
    k = np.empty((7, len(y)))
    k[0] = slope(t, y)
    dt = (
        0.01
        * tolerance**0.2
        * max(1e-6, np.max(nominal + abs(y)) / max(1e-6, np.max(abs(k[0]), initial=0.0)))
    )
    for end in times:
        while t < end:
            step = min(dt, end - t)
            for i in range(1, 7):
                new = y + step * (np.array(_STAGES[i]) @ k[:i])
                k[i] = slope(t + _NODES[i] * step, new)
            scale = tolerance * (nominal + np.maximum(abs(y), abs(new)))
            error = np.sqrt(np.mean((step * (_ERRORS @ k) / scale) ** 2)) if len(y) else 0.0
            factor = (
                min(5.0, max(0.2, 0.9 * error**-0.2))
                if 0.0 < error < math.inf
                else 5.0
                if error == 0.0
                else 0.2
            )
            if error <= 1.0:
                t = end if step == end - t else t + step
                y = accept(t, new)
                k[0] = slope(t, y) if ROTATIONS or N_CONSTRAINTS else k[6]
                # a step cut short by an output time says little about the next one
                dt = max(dt, step * factor) if step < dt else step * factor
            else:
                dt = step * factor
                if not t + 1e-3 * dt > t:
                    bad = [name for (name, _), v in zip(STATES, k[6], strict=True) if not math.isfinite(v)]
                    what = f"the rate of {bad[0]} is undefined" if bad else "the step size vanishes"
                    raise RuntimeError(f"at t = {t:g}: {what}")
        yield y.copy()


def main() -> None:
    """Run an experiment, or all values of its sweeps; print a table, write a CSV file."""
    parser = argparse.ArgumentParser(description=f"simulate {NAME}")
    parser.add_argument(
        "--experiment", choices=list(EXPERIMENTS), help="settings of the model (default: first)"
    )
    parser.add_argument("--stop", type=float, help="end of the run in s")
    parser.add_argument("--every", type=float, help="time between two rows in s")
    parser.add_argument("--tolerance", type=float, help="relative tolerance of a step (default 1e-8)")
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="a value in SI units"
    )
    parser.add_argument("-o", "--output", metavar="FILE.csv", help="write all rows and columns")
    options = parser.parse_args()
    values = {}
    for setting in options.set:
        name, _, value = setting.partition("=")
        if name not in PLACES:
            parser.error(f"no parameter, state or input {name!r}; there are: {', '.join(PLACES)}")
        try:
            values[name] = float(value)
        except ValueError:
            parser.error(f"{value!r} is no number")
    plan = EXPERIMENTS.get(options.experiment) or next(iter(EXPERIMENTS.values()), {})
    names = {place: name for name, place in PLACES.items()}
    sweeps = [[(names[place], v) for v in numbers] for place, numbers in plan.get("sweeps", [])]
    columns = [("time", "s"), *STATES]
    columns += [output for output in OUTPUTS if output not in columns]
    rows = []
    for combination in itertools.product(*sweeps):
        try:
            motion = simulate(
                options.stop,
                options.tolerance,
                every=options.every,
                experiment=options.experiment,
                values={**dict(combination), **values},
            )
        except (RuntimeError, ValueError) as failure:
            raise SystemExit(str(failure)) from None
        swept = [v for _, v in combination]
        rows += [[*swept, *row] for row in zip(*(motion[name] for name, _ in columns), strict=True)]
        _print_table(", ".join(f"{name} = {v:g}" for name, v in combination), columns, motion)
    if options.output:
        heads = [*(place for place, _ in plan.get("sweeps", []))]
        with open(options.output, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            titles = [*((names[place], "") for place in heads), *columns]
            writer.writerow([f"{name} [{unit}]" if unit else name for name, unit in titles])
            writer.writerows([repr(float(v)) for v in row] for row in rows)


def _print_table(title: str, columns: Sequence[tuple[str, str]], motion: Mapping[str, Any]) -> None:
    """Print at most 11 rows and 7 columns."""
    shown, count = columns[:7], len(motion["time"])
    heads = {name: f"{name} [{unit}]" if unit else name for name, unit in shown}
    widths = {name: max(15, len(head)) for name, head in heads.items()}
    if title:
        print(title)
    print("  ".join(f"{head:>{widths[name]}}" for name, head in heads.items()))
    for i in sorted({round(j * (count - 1) / 10) for j in range(11)}):
        print("  ".join(f"{motion[name][i]:{width}.9g}" for name, width in widths.items()))
    if len(columns) > len(shown):
        print(f"{len(columns) - len(shown)} more columns: -o FILE.csv writes all")


if __name__ == "__main__":
    main()
