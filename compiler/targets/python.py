"""The Python target: a short module of plain functions over NumPy, and the same functions in memory."""

from __future__ import annotations

import inspect
import keyword
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from mechc.runtime.problem import Array, ModelFunction

from ..graph.table import Samples
from ..program import Program, ProgramFunction
from ..program.model import Literal, Load, Operate, Store, identifiers
from ..program.series import without_series
from .alone import check_stands_alone, standing_alone
from .c_tables import asked_of, questions, used_tables
from .differentiable import Begin
from .expressions import lines
from .literal import LiteralForm as LiteralForm
from .literal import constant
from .python_forms import DIALECT, FUNCTIONS, TABLES, NamedForm, table_text
from .python_text import function_lines, made, partial, quantities, quoted, returned, string, strings

_RESERVED: Final = frozenset(
    (*keyword.kwlist, *keyword.softkwlist, "abs", "pi", "np", "math", "values", "given")
) | {f.name for f in (*FUNCTIONS.values(), *TABLES.values())}

_OF_RUNS: Final = frozenset(
    ("initial_of_others", "found", "assembly_jacobian", "project_position", "project_velocity", "displace")
)
"""Functions that only a run of mechc calls: they find a start, and lead back onto constraints."""


def emit_python(program: Program, begin: Begin) -> str:
    """Return the text of a module: names and units, the functions of the model, and ``simulate``. Raises CompileError."""
    check_stands_alone(program.switching)
    program = standing_alone(without_series(program))
    return "\n".join(_lines(program, begin)) + "\n"


def load_arrays(
    program: Program,
) -> tuple[dict[str, ModelFunction], Callable[[Array, NDArray[np.uint8]], None]]:
    """Return the functions of a program for many places at once, and the one that completes p in place.

    t has n values, y the shape (ny, n); u, z and p are numbers. The result has the shape (n_out, n).
    """
    names: dict[str, Any] = {"np": np, "pi": np.pi}
    used = _called(program, (program.parameters_function, *program.functions))
    names |= {f.name: f.own or getattr(math, f.name) for f in used}
    over_arrays = {f.name: eval(f.array, names) for f in used}
    tables = {
        f"TABLE_{i}": t.values if isinstance(t, Samples) else (t.points, t.values, t.slopes)
        for i, t in used_tables(program)
    }
    namespace: dict[str, Any] = names | over_arrays | tables
    own = identifiers(program, _RESERVED)
    text = [*function_lines(program.parameters_function, "p, given", DIALECT, own)]
    for f in program.functions:
        text += function_lines(f, "t, y, u, z, p", DIALECT, own, program.size("u"), program.size("y"))
    exec(compile("\n".join(text), f"<generated: {program.name}>", "exec"), namespace)

    def parameters(p: Array, given: NDArray[np.uint8]) -> None:
        with np.errstate(all="ignore"):
            p[:] = namespace["parameters"](p, given)

    return {f.name: _over_places(namespace[f.name]) for f in program.functions}, parameters


def _over_places(function: Callable[..., list[Any]]) -> ModelFunction:
    def evaluate(t: Any, y: Array, u: Array, z: Array, p: Array) -> Array:
        shape = np.shape(t)
        with np.errstate(all="ignore"):
            out = function(t, y, u, z, p)
            found = np.empty((len(out), *shape))
            for k, value in enumerate(out):
                found[k] = value
        return found

    return evaluate


def _called(program: Program, functions: Sequence[ProgramFunction]) -> list[NamedForm]:
    """Return what functions call by a name."""
    statements = [s for f in functions for body in f.bodies for s in body]
    used = {s.code for s in statements if type(s) is Operate}
    called = [FUNCTIONS[code] for code in sorted(used & FUNCTIONS.keys())]
    return called + [TABLES[name] for name in questions(asked_of(program))]


def _lines(program: Program, begin: Begin) -> Iterator[str]:
    functions = [
        f
        for f in program.functions
        if f.n_out and f.name not in _OF_RUNS and not f.name.startswith("experiment_")
    ]
    arguments = "t, y, u, z, p" if program.size("z") else "t, y, u, p"
    names = identifiers(program, _RESERVED)
    yield from _docstring(program, arguments)
    yield from _imports(program, functions)
    yield from _tables(program, functions, begin)
    yield from _parameters(program, begin.settings, names)
    for function in functions:
        yield from function_lines(function, arguments, DIALECT, names, program.size("u"), program.size("y"))
    yield from _simulate(program, begin)


def _docstring(program: Program, arguments: str) -> Iterator[str]:
    yield f'"""{quoted(program.name)}: a mechanical model, written by mechc.'
    if program.doc.strip():
        yield ""
        yield from (quoted(line.rstrip()) for line in program.doc.strip().splitlines())
    yield ""
    yield f"Functions of ({arguments}) give lists; numbers are in SI, in the order of the lists below, and may be arrays."
    yield '``parameters`` gives p from values by name. NumPy is needed, and SciPy for ``simulate``.\n"""\n'


def _imports(program: Program, functions: Sequence[ProgramFunction]) -> Iterator[str]:
    """Yield imports, and the functions that libraries lack."""
    used = _called(program, (program.parameters_function, *functions))
    one_by_one = [f for f in used if "vectorize(" in f.array]
    texts = [inspect.getsource(f.own) for f in one_by_one if f.own]
    of_numpy = [(f.array.removeprefix("np."), f.name) for f in used if f not in one_by_one]
    taken = sorted(a if a == b else f"{a} as {b}" for a, b in of_numpy)
    statements = (s for f in (program.parameters_function, *functions) for body in f.bodies for s in body)
    if any(type(s) is Literal and constant(s.number).form is LiteralForm.PI for s in statements):
        taken = sorted((*taken, "pi"))
    if any("math." in text for text in texts):
        yield "import math"
    if any("bisect_right" in text for text in texts):
        yield "from bisect import bisect_right"
    of_math = {f.name for f in one_by_one if not f.own}.union(*(f.calls for f in one_by_one))
    if of_math:
        yield f"from math import {', '.join(sorted(of_math))}\n"
    yield "import numpy as np"
    if taken:
        yield f"from numpy import {', '.join(taken)}"
    yield ""
    for text in texts:
        yield f"\n{text}"
    for f in one_by_one:
        yield f"{f.name} = {f.array}"


def _tables(program: Program, functions: Sequence[ProgramFunction], begin: Begin) -> Iterator[str]:
    for i, table in used_tables(program):
        yield f"TABLE_{i} = {table_text(table)}"
    yield "# name and unit"
    lists = (("STATES", "y"), ("PARAMETERS", "p"), ("INPUTS", "u"), ("DISCRETES", "z"), ("OUTPUTS", "out"))
    for title, array in lists:
        if program.arrays[array]:
            yield from quantities(title, program.arrays[array])
    if program.assertions:
        yield from strings("ASSERTIONS", [a.message for a in program.assertions])
    patterns = {"jacobian": program.jacobian_pattern, **program.patterns}
    given = {f.name: patterns[f.name] for f in functions if patterns.get(f.name)}
    if given:
        yield "# (row, column) of each result of functions that give the entries of a matrix that are not zero"
        yield f"PATTERNS = { ({name: list(places) for name, places in given.items()})!r}"
    yield "# the first experiment: where it begins and ends, and the sizes that tolerances refer to"
    yield f"TIME, STOP, START = {begin.time!r}, {begin.stop!r}, {list(begin.state)!r}"
    yield f"NOMINAL = {list(begin.nominal)!r}"
    if program.arrays["u"]:
        yield f"HELD = {dict(begin.held)!r}  # inputs that it sets, by index"
    yield "\n"


def _parameters(
    program: Program, settings: Mapping[str, float], names: Mapping[tuple[str, int], str]
) -> Iterator[str]:
    """Yield the function that gives p: what is set, what the model states for all others, and constants made of both."""
    (body,) = program.parameters_function.bodies
    entries = program.arrays["p"]
    ruled = {s.index for s in body if type(s) is Store}
    number = DIALECT.number if partial(body) else ""

    def store(statement: Store, expression: str) -> str:
        name = names["p", statement.index]
        if not statement.guarded:
            return f"{name} = {expression}"
        given = f"values.get({string(entries[statement.index].name)}, {expression})"
        return f"{name} = {made(given, number)}"

    if number:
        yield DIALECT.quiet
    yield "def parameters(values={}):"
    yield '    """Return p: parameters by name, what the model states for all others, and constants made of them."""'
    if not entries and not program.nh:
        yield "    return []\n\n"
        return
    if entries:
        yield "    if unknown := values.keys() - dict(PARAMETERS):"
        yield '        raise KeyError(f"no parameter {sorted(unknown)}")'
    if settings:
        yield f"    values = {{**{dict(settings)!r}, **values}}"
    for i, entry in enumerate(entries):
        if i not in ruled:
            yield f"    {names['p', i]} = {made(f'values[{string(entry.name)}]', number)}"
    loaded = {(s.array, s.index): names[s.array, s.index] for s in body if type(s) is Load}
    for line in lines(body, replace(DIALECT, store=store), loaded):
        yield f"    {line}"
    yield from returned([names["p", i] for i in range(len(entries) + program.nh)])


def _simulate(program: Program, begin: Begin) -> Iterator[str]:
    """Yield the function that gives a motion; of a model whose motion takes more than SciPy, one that says what gives it."""
    beyond = ""
    if program.switching is not None:
        beyond = "the model switches; its events are found by mechc run, a C program (--target c) or an FMU"
    elif begin.singular:
        beyond = (
            "the model passes positions in which its constraints depend on each other, and nothing projects the steps of SciPy; "
            "mechc run, a C program (--target c), an FMU or a page follows it"
        )
    if beyond:
        yield "def simulate(*given, **named):"
        yield '    """Say what gives the motion: this module does not."""'
        yield f"    raise RuntimeError({string(beyond)})"
        return
    reads = {
        s.array
        for name in ("initial", "assembly", "initial_of_others")
        if (f := program.function(name)) is not None
        for body in f.bodies
        for s in body
        if type(s) is Load
    }
    driven, reported = bool(program.arrays["u"]), program.function("outputs") is not None
    moving = [what for array, what in (("p", "values"), ("u", "signals")) if array in reads]
    u, signals = ("u(t)", "signals={}, ") if driven else ("()", "")
    method = '"Radau"' if begin.stiff else '"DOP853"'
    also = "; signals: inputs as functions of time" if driven else ""
    yield f"def simulate(stop=STOP, values={{}}, start=START, {signals}points=501, tolerance={begin.tolerance!r}, method={method}):"
    yield f'    """Return the motion by SciPy, arrays by name; values: parameters, start: a state{also}."""'
    yield "    from scipy.integrate import solve_ivp\n"
    if moving:
        yield f"    if start is START and ({' or '.join(moving)}):"
        yield """        raise ValueError("other values may move the start: give it, as 'mechc init' tells it")"""
    yield "    p = parameters(values)\n"
    if driven:
        yield "    def u(t):"
        yield "        given = {i: signals[name](t) for i, (name, _) in enumerate(INPUTS) if name in signals}"
        yield "        return [{**HELD, **given}.get(i, value) for i, value in enumerate(inputs(t, (), (), p))]\n"
    yield f"    def rate(t, y):\n        return rhs(t, y, {u}, p)\n"
    yield "    sizes = tolerance * np.array(NOMINAL)"
    yield "    times = np.linspace(TIME, stop, points)"
    yield "    found = solve_ivp(rate, (TIME, stop), start, method, times, rtol=tolerance, atol=sizes)"
    yield "    if not found.success:\n        raise RuntimeError(found.message)"
    if program.assertions:
        yield "    for t, y in zip(found.t, found.y.T):"
        yield f"        for holds, message in zip(assertions(t, y, {u}, p), ASSERTIONS):"
        yield '            if not holds > 0.5:\n                raise RuntimeError(f"at t = {t:g}: {message}")'
    rows = f", *outputs(t, y, {u}, p)" if reported else ""
    yield f"    rows = [[t, *y{rows}] for t, y in zip(found.t, found.y.T)]"
    names = '[("time", "s"), *STATES, *OUTPUTS]' if reported else '[("time", "s"), *STATES]'
    yield f"    return {{name: column for (name, _), column in zip({names}, np.transpose(rows))}}"
