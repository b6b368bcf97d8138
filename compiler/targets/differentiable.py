"""Modules for libraries that differentiate: the statements of a program on the symbols of CasADi, or on arrays of JAX."""

from __future__ import annotations

import inspect
import keyword
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from msgspec import Struct, field
from msgspec.structs import replace

from ..graph.operation import Operation, form_of
from ..graph.operations import LOOKUP, OPERATIONS
from ..program import Program, ProgramFunction
from ..program.model import Literal, Load, Operate, ProgramSolution, Store, identifiers, operands_of
from . import python_forms
from .alone import check_nothing_found
from .c_tables import FUNCTIONS as TABLE_FUNCTIONS
from .c_tables import asked_of, questions, used_tables
from .expressions import Dialect
from .literal import LiteralForm as LiteralForm
from .literal import constant
from .python_forms import table_text
from .python_text import function_lines, quantities, quoted, string, strings


class LibraryForms(Struct, frozen=True):
    """``functions``: by operation, those of the library, of the common part of its modules, or own ones of Python; all else is written
    with the signs of Python. ``copied``: own functions of Python that hold for this library, too."""

    dialect: Dialect
    functions: Mapping[int, str]
    copied: Mapping[int, python_forms.NamedForm]


def _forms(number: str, named: Callable[[Operation], str | None]) -> LibraryForms:
    """Return the forms of a library. ``number``: what makes a number of it; ``named``: its function for an operation, None where that
    of Python holds."""
    rows = [row for row in OPERATIONS if row.arity and row.code != LOOKUP]
    copied = {row.code: python_forms.FUNCTIONS[row.code] for row in OPERATIONS if named(row) is None}
    functions = {row.code: named(row) or copied[row.code].name for row in rows if not row.form}
    forms = {row.code: form_of(row, functions.get(row.code, "").rpartition(".")[2]) for row in rows}
    dialect = replace(python_forms.DIALECT, forms=forms, number=number, quiet="", branch=None)
    return LibraryForms(dialect, functions, copied)


def _casadi(row: Operation) -> str | None:
    return None if row.casadi is None else row.casadi or row.name


def _jax(row: Operation) -> str | None:
    return None if row.jax is None else row.jax or (row.array or f"np.{row.name}").removeprefix("np.")


CASADI_FORMS: Final = _forms("SX", _casadi)
JAX_FORMS: Final = _forms("jnp.float64", _jax)


EXPORTED: Final = (
    "rhs",
    "outputs",
    "initial",
    "inputs",
    "assertions",
    "constraints",
    "constraint_jacobian",
    "project_position",
    "project_velocity",
    "displace",
)
"""The functions that a module holds, as far as the model has them."""

_COPIED: Final = "# ---- copied "


class DifferentiatingLibrary(Struct, frozen=True):
    """What one library needs: its ``forms``, what it is called and imported from, and the module with the common part.

    ``always``: what is imported from ``package`` in every module; ``needed``: by each function of its own.
    ``before``: what stands in the line above each function; ``collected``: functions are gathered by name.
    """

    name: str
    forms: LibraryForms
    imports: tuple[str, ...]
    package: str
    always: tuple[str, ...]
    needed: Mapping[str, tuple[str, ...]]
    common: str
    use: tuple[str, ...]
    before: str = ""
    collected: bool = False


CASADI: Final = DifferentiatingLibrary(
    "CasADi",
    CASADI_FORMS,
    ("from collections.abc import Mapping, Sequence", "{pi}from typing import Any\n"),
    "casadi",
    ("Function", "SX", "reshape", "sumsqr", "vertcat", "vertsplit"),
    {
        "modulo": ("fmod", "if_else", "logic_and"),
        "lookup": ("if_else",),
        "element": ("if_else",),
        "cell": ("if_else",),
    },
    "casadi_module.py",
    (
        "``functions()`` gives a ``casadi.Function`` of (t, y, u, p) for each of rhs, accelerations, outputs and so on; the",
        "functions of this module themselves compute with numbers or symbols. START is the state at which a run begins.",
    ),
    collected=True,
)

JAX: Final = DifferentiatingLibrary(
    "JAX",
    JAX_FORMS,
    (
        "from collections.abc import Callable, Mapping",
        "from functools import wraps",
        "{pi}from typing import Any\n",
        "import jax",
        "import jax.numpy as jnp",
    ),
    "jax.numpy",
    (),
    {},
    "jax_module.py",
    (
        "Every function of (t, y, u, p) can be given to ``jax.jit``, ``jax.vmap``, ``jax.grad`` and ``jax.jacobian``; p comes",
        "from ``all_parameters``, through which derivatives by parameters go too. START is the state at which a run begins.",
    ),
    before="@compiled",
)


class Begin(Struct, frozen=True):
    """Where a run of the model begins: time, consistent state and inputs; the parameters by name that are set. When it ends, the
    sizes of its states that tolerances refer to, and the inputs by index that it holds; its tolerance, whether it is stiff, and
    whether it passes singular positions."""

    time: float
    state: Sequence[float]
    inputs: Sequence[float]
    settings: Mapping[str, float]
    stop: float = 0.0
    nominal: Sequence[float] = ()
    held: Mapping[int, float] = field(default_factory=dict)
    tolerance: float = 1e-8
    stiff: bool = False
    singular: bool = False


def emit_differentiable(
    program: Program, library: DifferentiatingLibrary, begin: Begin, exported: Sequence[str] = EXPORTED
) -> str:
    """Return the text of a module with the functions of a model for one library."""
    check_nothing_found(program, library.name)
    functions = [f for name in exported if (f := program.function(name)) is not None and f.n_out]
    return "\n".join(_lines(program, library, begin, functions)) + "\n"


def emit_casadi(program: Program, begin: Begin) -> str:
    """Return the text of a module for CasADi."""
    return emit_differentiable(program, CASADI, begin)


def emit_jax(program: Program, begin: Begin) -> str:
    """Return the text of a module for JAX."""
    return emit_differentiable(program, JAX, begin)


def _lines(
    program: Program, library: DifferentiatingLibrary, begin: Begin, functions: Sequence[ProgramFunction]
) -> Iterator[str]:
    solving = [f for s in program.solutions for f in (s.guess, s.rows)]
    whole = (program.parameters_function, *functions, *solving)
    statements = [s for f in whole for body in f.bodies for s in body]
    found = {(s.array, s.index) for s in statements if type(s) is Load and s.array == "s"}
    codes = {s.code for s in statements if type(s) is Operate}
    parts = dict(_parts(library))
    copied = [library.forms.copied[code] for code in sorted(codes & library.forms.copied.keys())]
    named = [
        library.forms.functions[code]
        for code in sorted(codes & library.forms.functions.keys() - library.forms.copied.keys())
    ]
    named += questions(asked_of(program))
    own = [name for name in named if f"where {name} is called" in parts]
    reserved = frozenset(
        (
            *keyword.kwlist,
            *keyword.softkwlist,
            "pi",
            "jnp",
            *library.always,
            *map(_last, library.forms.functions.values()),
            *TABLE_FUNCTIONS,
        )
    )
    if program.solutions:
        reserved |= {"s", "numbers", "solution", "solutions", *(f"{a}{i}" for a, i in found)}
    names = dict(identifiers(program, reserved))
    names |= {(a, i): f"{a}{i}" for a, i in found}

    yield from _docstring(program, library)
    yield "from __future__ import annotations\n"
    with_pi = any("pi" in f.calls for f in copied) or any(
        type(s) is Literal and constant(s.number).form is LiteralForm.PI for s in statements
    )
    yield "\n".join(library.imports).replace("{pi}", "from math import pi\n" if with_pi else "")
    yield from _imports(
        library.package,
        {
            *library.always,
            *(name for name in named if name not in own),
            *(x for name in own for x in library.needed.get(name, ())),
            *(x for f in copied for x in f.calls if x != "pi"),
        },
    )
    yield ""
    yield from _tables(program, begin)
    yield from (parts[where] for where in ("before the functions",) if where in parts)
    yield from (parts[f"where {name} is called"] for name in own)
    yield from (inspect.getsource(f.own) + "\n" for f in copied if f.own)
    for i, rows in used_tables(program):
        yield f"TABLE_{i} = {table_text(rows)}"
    yield ""
    yield from function_lines(program.parameters_function, "p, given", library.forms.dialect, names)
    # where a line before makes arrays of what a function is given, it need not
    dialect = replace(library.forms.dialect, number="") if library.before else library.forms.dialect
    if program.solutions:
        yield from _solutions(program.solutions, dialect, names)
        yield parts["where there are solutions"]
    for function in functions:
        if library.before:
            yield library.before
        needed = _needed(function, program.solutions)
        solved = f"solutions({needed}, t, y, u, p)" if needed else ""
        yield from function_lines(function, "t, y, u, p", dialect, names, solved=solved)
    if library.collected:
        yield f"FUNCTIONS = {{{', '.join(f'{string(f.name)}: {f.name}' for f in functions)}}}\n\n"
    yield parts["from here"]
    if _energies(program):
        yield parts.get("where there are energies", "")
    if program.constraints:
        yield parts.get("where there are constraints", "")


def _solutions(
    solutions: Sequence[ProgramSolution], dialect: Dialect, names: Mapping[tuple[str, int], str]
) -> Iterator[str]:
    """Yield what the common part finds solutions with: functions, and the table of them."""
    for s in solutions:
        solved = f"solutions({list(s.inner)}, t, y, u, p, s)" if s.inner else ""
        yield from function_lines(s.guess, "t, y, u, p, s", dialect, names)
        yield from function_lines(s.rows, "t, y, u, p, s", dialect, names, solved=solved)
    yield "# from where, rows, how many, places of their derivatives (row, unknown), first index of what is found"
    yield "SOLUTIONS = ["
    for s in solutions:
        count = (s.rows.n_out - len(s.places)) // 2
        yield f"    ({s.guess.name}, {s.rows.name}, {count}, {list(s.places)}, {s.begin}),"
    yield "]\n\n"


def _needed(function: ProgramFunction, solutions: Sequence[ProgramSolution]) -> list[int]:
    """Return the solutions, by index, that a function reads, and those that these do, in the order in which they are found."""
    of = {s.begin + i: k for k, s in enumerate(solutions) for i in range(s.count)}
    pending = [of[s.index] for body in function.bodies for s in body if type(s) is Load and s.array == "s"]
    found: set[int] = set()
    while pending:
        if (k := pending.pop()) not in found:
            found.add(k)
            pending += solutions[k].needs
    return sorted(found)


def _last(name: str) -> str:
    return name.rpartition(".")[2]


def _imports(package: str, names: Iterable[str]) -> Iterator[str]:
    """Yield the lines that import functions of a package, or of others where their whole names say so."""
    modules: dict[str, list[str]] = {}
    for name in sorted(names):
        module, _, function = name.rpartition(".")
        modules.setdefault(module or package, []).append(function)
    for module, functions in sorted(modules.items()):
        yield f"from {module} import {', '.join(functions)}"


def _parts(library: DifferentiatingLibrary) -> Iterator[tuple[str, str]]:
    """Yield the parts of the common module by what their markers say."""
    text = Path(__file__).with_name(library.common).read_text(encoding="utf-8")
    for part in text.split(_COPIED)[1:]:
        where, _, lines = part.partition("\n")
        yield where, lines.strip("\n") + "\n\n"


def _docstring(program: Program, library: DifferentiatingLibrary) -> Iterator[str]:
    yield f'"""{quoted(program.name)}: a mechanical model, generated by mechc. Needs {library.name}.'
    if program.doc.strip():
        yield ""
        yield from (quoted(line.rstrip()) for line in program.doc.strip().splitlines())
    yield ""
    yield "Its functions read time, states, inputs and parameters in SI units, in the order of the lists below."
    yield from library.use
    yield '"""\n'


def _tables(program: Program, begin: Begin) -> Iterator[str]:
    yield f"NAME = {string(program.name)}"
    yield "# name and unit"
    yield from quantities("STATES", program.arrays["y"])
    yield from quantities("PARAMETERS", program.arrays["p"])
    yield from quantities("INPUTS", program.arrays["u"])
    yield from quantities("OUTPUTS", program.arrays["out"])
    yield from strings("CONSTRAINTS", [row.name for row in program.constraints])
    yield from strings("ASSERTIONS", [a.message for a in program.assertions])
    yield "# parameters that do not follow from others"
    yield from strings("INDEPENDENT", _independent(program, begin.settings))
    yield f"N_CONSTANTS = {program.nh}  # computed by parameters(), after the parameters in p"
    yield f"NQ, NV = {program.nq}, {program.nv}  # coordinates and velocities, with which the states begin"
    yield f"ROTATIONS = {list(program.rotations)}  # index of the first of four entries of a unit quaternion"
    yield f"ENERGIES = {_energies(program)}  # indices of outputs"
    yield f"SETTINGS = {dict(begin.settings)!r}  # values that are set unless a call says otherwise"
    yield "# where the run of the first experiment begins"
    yield f"TIME, START, INPUT = {begin.time!r}, {list(begin.state)!r}, {list(begin.inputs)!r}\n"


def _energies(program: Program) -> list[int]:
    return [i for i, entry in enumerate(program.arrays["out"]) if entry.kind == "energy"]


def _independent(program: Program, settings: Mapping[str, float]) -> list[str]:
    """Return the parameters whose values are numbers: no other parameter stands in their formulas."""
    (body,) = program.parameters_function.bodies
    reads: list[bool] = []
    follows = set()
    for statement in body:
        reads.append(
            (type(statement) is Load and statement.array == "p")
            or any(reads[operand] for operand in operands_of(statement))
        )
        if type(statement) is Store and reads[-1]:
            follows.add(statement.index)
    return [e.name for i, e in enumerate(program.arrays["p"]) if i not in follows or e.name in settings]
