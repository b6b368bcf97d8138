"""The Python target: a readable module that needs NumPy only, and the same functions in memory."""

from __future__ import annotations

import inspect
import json
import keyword
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from types import ModuleType
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechc.runtime import nominal
from mechc.runtime.interface import Experiment, Setting
from mechc.runtime.problem import Array, ModelFunction
from mechc.runtime.start import facts as start_data
from mechc.runtime.start import free_state, gauss_newton, second_order, stages
from mechc.runtime.start.facts import start_facts

from ..graph.table import Samples
from ..program import Program, ProgramFunction
from ..program.model import Literal, Operate
from ..program.names import identifiers
from . import standalone, standalone_start
from .alone import standing_alone
from .c_tables import asked_of, questions, used_tables
from .literal import Form as LiteralForm
from .literal import constant
from .python_forms import DIALECT, FUNCTIONS, TABLES
from .python_text import function_lines, quantities, quoted, string, strings

ALWAYS: Final = ("rhs", "initial", "inputs", "discretes", "outputs", "assertions")
"""Functions that the standalone part calls; where the model has none they return an empty list."""

_RESERVED: Final = frozenset(
    (
        *keyword.kwlist,
        *keyword.softkwlist,
        "abs",
        "pi",
        "np",
        "math",
        "given",
        *(f.name for f in FUNCTIONS.values()),
    )
)

_COPIED: Final = "# ---- copied "
"""Begins a part of the standalone source: ``from here`` to all modules, ``where`` to some."""

_EVENT_FUNCTIONS: Final = ("indicators", "conditions", "row_values", "crossing_times")
"""Only models with events have one of these."""


def emit_python(program: Program, settings: Mapping[str, float] | None = None) -> str:
    """Return the text of a module that simulates the model and needs NumPy only; ``settings`` in SI before its own."""
    return "\n".join(_File(standing_alone(program), settings or {}).lines()) + "\n"


def load_python(
    program: Program,
) -> tuple[dict[str, ModelFunction], Callable[[Array, NDArray[np.uint8]], None]]:
    """Return the functions of a program by name, and the one that completes p in place."""
    namespace: dict[str, Any] = {"__name__": "generated"}
    text = "\n".join(_File(program, {}).functions())
    exec(compile(text, f"<generated: {program.name}>", "exec"), namespace)
    checked = namespace["checked"]
    complete = checked(namespace["parameters"])

    def parameters(p: Array, given: NDArray[np.uint8]) -> None:
        p[:] = complete(p.tolist(), given.tolist())

    return {f.name: _over_lists(checked(namespace[f.name])) for f in program.functions}, parameters


def load_arrays(
    program: Program,
) -> tuple[dict[str, ModelFunction], Callable[[Array, NDArray[np.uint8]], None]]:
    """Return the functions of a program for many places at once, and the one that completes p in place.

    t has n values, y the shape (ny, n); u, z and p are numbers. The result has the shape (n_out, n).
    """
    written = _File(program, {})
    names: dict[str, Any] = {"np": np, "pi": np.pi}
    names |= {f.name: f.own or getattr(math, f.name) for f in written.used}
    over_arrays = {f.name: eval(f.array, names) for f in written.used}
    tables = {
        f"TABLE_{i}": t.values if isinstance(t, Samples) else (t.points, t.values, t.slopes)
        for i, t in used_tables(program)
    }
    namespace: dict[str, Any] = names | over_arrays | tables
    text = [line for f in (program.parameters_function, *program.functions) for line in written.function(f)]
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


def _over_lists(function: Callable[..., list[float]]) -> ModelFunction:
    """Return the function for arrays; it computes with Python's floats, which are faster than NumPy's."""

    def evaluate(t: float, y: Array, u: Array, z: Array, p: Array) -> Array:
        return np.array(function(t, y.tolist(), u.tolist(), z.tolist(), p.tolist()))

    return evaluate


class _File:
    def __init__(self, program: Program, settings: Mapping[str, float]) -> None:
        self.program = program
        self.settings = settings
        self.names = identifiers(program, _RESERVED)
        functions = (program.parameters_function, *program.functions)
        statements = [s for f in functions for body in f.bodies for s in body]
        used = {s.code for s in statements if type(s) is Operate}
        self.used = [FUNCTIONS[code] for code in sorted(used & FUNCTIONS.keys())]
        self.used += [TABLES[name] for name in questions(asked_of(program))]
        self.uses_pi = any(
            type(s) is Literal and constant(s.number).form is LiteralForm.PI for s in statements
        )

    def lines(self) -> Iterator[str]:
        """Yield the whole module."""
        yield from _docstring(self.program)
        yield from self.imports()
        yield from _copied(nominal)
        yield from self.start()
        yield from _tables(self.program, self.settings)
        yield from self.definitions()
        yield from _experiments(self.program.experiments)
        for part in inspect.getsource(standalone).split(_COPIED)[1:]:
            where, _, text = part.partition("\n")
            if where == "from here" or self.program.constraints:
                yield text.strip("\n") + "\n\n"

    def functions(self) -> Iterator[str]:
        """Yield what is needed to call the functions of the model."""
        yield from self.imports()
        yield from self.definitions()
        yield inspect.getsource(standalone._careful)
        yield inspect.getsource(standalone.checked)

    def definitions(self) -> Iterator[str]:
        """Yield the functions of the model and what they call."""
        program = self.program
        for f in self.used:
            if f.own:
                yield inspect.getsource(f.own) + "\n"
        for i, table in used_tables(program):
            if isinstance(table, Samples):
                yield f"TABLE_{i} = {table.values!r}"
                continue
            yield f"TABLE_{i} = ("
            for row in (table.points, table.values, table.slopes):
                yield f"    {row!r},"
            yield ")"
        yield "# functions with their form for arrays, and those that yield truth values"
        yield "ARRAY_FUNCTIONS = {"
        for f in self.used:
            yield f'    "{f.name}": {f.array},'
        yield "}"
        yield f"CONDITIONS = {{{', '.join(string(f.name) for f in self.used if f.condition)}}}".replace(
            "{}", "set()"
        )
        yield "\n"
        yield from self.function(program.parameters_function)
        given = {f.name for f in program.functions}
        for function in program.functions:
            yield from self.function(function)
        for name in ALWAYS:
            if name not in given:
                yield f"def {name}(t, y, u, z, p):"
                yield '    """The model has none."""'
                yield "    return []\n\n"

    def start(self) -> Iterator[str]:
        """Yield what an initial state must fulfil, and the functions that find one."""
        facts = start_facts(self.program)
        if facts is None:
            yield _named(standalone_start.stated, "start_state")
            return
        for part in (start_data, gauss_newton, second_order, free_state, stages):
            yield from _copied(part)
        yield "# what an initial state must fulfil: stage, whether it must hold, 1: a pure number, 2: a length"
        yield from _named_tuple("START", facts)
        yield from strings("START_ROWS", [row.name for row in self.program.assembly])
        yield "\n"
        chain = [standalone_start.assembled]
        if facts.dependent and facts.rows:
            chain.append(standalone_start.followed)
        if self.program.found:
            chain.append(standalone_start.with_parameters)
            yield f"FOUND = {self.program.found!r}\n\n"
        for function, above in pairwise(chain):
            name = "before_parameters" if above is standalone_start.with_parameters else function.__name__
            yield _named(function, name)
        yield _named(chain[-1], "start_state")

    def imports(self) -> Iterator[str]:
        called = {f.name for f in self.used if not f.own}.union(*(f.calls for f in self.used))
        names = sorted(called | ({"pi"} if self.uses_pi else set()))
        yield "from __future__ import annotations\n"
        yield "import argparse\nimport csv\nimport itertools\nimport math\nimport types"
        if any(f.name in ("lookup", "cell") for f in self.used):
            yield "from bisect import bisect_right"
        yield "from collections.abc import Callable, Iterator, Mapping, Sequence"
        if names:
            yield f"from math import {', '.join(names)}"
        yield "from typing import Any, NamedTuple\n"
        yield "import numpy as np"
        yield "from numpy.typing import NDArray\n"
        yield "Array = NDArray[np.float64]"
        yield "Flags = NDArray[np.bool_]"
        yield "ModelFunction = Callable[[float, Array, Array, Array, Array], Array]\n"

    def function(self, function: ProgramFunction) -> Iterator[str]:
        """Yield one function; it reads sequences of numbers and returns a list."""
        arguments = "p, given" if function is self.program.parameters_function else "t, y, u, z, p"
        yield from function_lines(function, arguments, DIALECT, self.names, self.program.size("u"))


def _docstring(program: Program) -> Iterator[str]:
    yield f'"""{quoted(program.name)}: a mechanical model, generated by mechc. Needs NumPy only.'
    if program.doc.strip():
        yield ""
        yield from (quoted(line.rstrip()) for line in program.doc.strip().splitlines())
    yield ""
    yield "Run it as a program, or call ``simulate``. The model is in the functions of (t, y, u, z, p), all in SI units:"
    yield "time, states, inputs, discrete variables and parameters, in the order of the lists below. ``vectorised(rhs)``"
    yield "computes many states at once. Of the options of an experiment start, stop, every and tolerance count; there is"
    yield "one method, an adaptive Runge-Kutta method of order five."
    yield '"""\n'


def _copied(module: ModuleType) -> Iterator[str]:
    """Yield what stands between the markers of a module."""
    text = inspect.getsource(module).partition(f"{_COPIED}from here\n")[2]
    yield text.partition("# ---- to here\n")[0].strip("\n") + "\n\n"


def _named(function: Callable[..., Any], name: str) -> str:
    return inspect.getsource(function).replace(f"def {function.__name__}(", f"def {name}(", 1) + "\n"


def _named_tuple(name: str, values: NamedTuple) -> Iterator[str]:
    yield f"{name} = {type(values).__name__}("
    for field, value in values._asdict().items():
        shown = value if isinstance(value, int) else list(value)
        yield f"    {field}={shown!r},"
    yield ")"


def _tables(program: Program, settings: Mapping[str, float]) -> Iterator[str]:
    yield f"NAME = {string(program.name)}"
    yield "# name and unit"
    yield from quantities("STATES", program.arrays["y"])
    yield from quantities("PARAMETERS", program.arrays["p"])
    yield from quantities("INPUTS", program.arrays["u"])
    yield from quantities("DISCRETES", program.arrays["z"])
    yield from quantities("OUTPUTS", program.arrays["out"])
    yield f"N_CONSTANTS = {program.nh}  # computed by parameters(), behind the parameters in p"
    yield f"NQ, NV, N_CONSTRAINTS = {program.nq}, {program.nv}, {len(program.constraints)}"
    yield f"EVENTS = {any(f.name in _EVENT_FUNCTIONS for f in program.functions)}"
    yield f"ROTATIONS = {list(program.rotations)}  # index of the first of four entries of a unit quaternion"
    patterns = {"jacobian": program.jacobian_pattern, **program.patterns}
    if any(patterns.values()):
        yield "# (row, column) of each result of functions that give the entries of a matrix that are not zero"
        yield "PATTERNS = {"
        for name, pattern in patterns.items():
            if pattern:
                yield f"    {string(name)}: {list(pattern)},"
        yield "}"
    yield from strings("ASSERTIONS", [a.message for a in program.assertions])
    yield f"SETTINGS = {dict(settings)!r}  # values that are set unless a call says otherwise"
    yield "# what nominal values are made from: the sizes that tolerances refer to"
    yield from _named_tuple("SIZES", nominal.sizes_of(program))
    yield "\n"


def _experiments(experiments: Sequence[Experiment]) -> Iterator[str]:
    yield "# what an experiment's function returns: first its options, then the values of its settings"
    yield "EXPERIMENTS = {"
    unnamed = "" if any(e.name == "default" for e in experiments) else "default"
    for e in experiments:
        if "vary" in e.words:  # many runs with random values, which a module alone does not make
            continue
        yield f"    {string(e.name or unnamed)}: {{"
        yield f'        "function": {e.function},'
        yield f'        "options": {json.dumps(e.options)},'
        yield f'        "settings": [{", ".join(map(_place, e.settings))}],'
        yield f'        "known": {[not s.guess for s in e.settings]},'
        yield f'        "sweeps": [{", ".join(f"({_place(s)}, {list(values)})" for s, values in e.sweeps)}],'
        yield "    },"
    yield "}\n\n"


def _place(target: Setting) -> str:
    return f'("{target.array}", {target.index})'
