"""The C target: one C11 file for a model, to be compiled with ``model.h`` of the kernel."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Final

from msgspec.structs import replace

from ..interpreter import compiling
from ..program import Program, ProgramFunction
from ..program.branches import mostly_branches
from ..program.model import SERIES_NEXT, SERIES_START, Body, Load, Store, codes_of, identifiers
from ..verification import verified
from . import c_tables
from .c_blocks import are_apart
from .c_data import (
    CROWD_FUNCTIONS,
    CROWD_INCLUDED,
    MODEL_AHEAD,
    SERIES_INCLUDED,
    SHARES_INCLUDED,
    record_text,
)
from .c_forms import CALLED, DIALECT, LIBRARY, NEEDED_BY_OWN, OWN, TURNING, TURNS_INCLUDED, literal
from .c_header import comment, header
from .c_loops import (
    SIDE_BY_SIDE,
    THREADS,
    loop_lines,
    loop_tables,
    loops_of,
    needs_threads,
    touched,
)
from .c_sincos_batch import are_turned
from .expressions import lines
from .literal import PI_DIGITS
from .model_data import MODEL_FUNCTIONS, OF_SHARES, is_emitted, model_data, readers
from .sincos_batch import turn_groups, with_turns_ahead

if TYPE_CHECKING:
    from ..program.loops.rolled import Rolled

NAMED_LOADS: Final = 150
"""Longest function, in operations, whose arguments get names of the model."""

_WORDS: Final = (
    "auto break case char const continue default do double else enum extern float for goto if inline int long"
    " register restrict return short signed sizeof static struct switch typedef union unsigned void volatile"
    " while asm typeof real ratio PI mech_real mech_model lookup element cell sought NULL EXPORT NOINLINE"
)
_MACROS: Final = (
    "INFINITY NAN HUGE_VAL HUGE_VALF HUGE_VALL math_errhandling MATH_ERRNO MATH_ERREXCEPT"
    " FP_NAN FP_INFINITE FP_ZERO FP_SUBNORMAL FP_NORMAL FP_FAST_FMA FP_FAST_FMAF FP_FAST_FMAL FP_ILOGB0 FP_ILOGBNAN"
    " M_E M_LOG2E M_LOG10E M_LN2 M_LN10 M_PI M_PI_2 M_PI_4 M_1_PI M_2_PI M_2_SQRTPI M_SQRT2 M_SQRT1_2"
    " DOMAIN SING OVERFLOW UNDERFLOW PLOSS TLOSS HUGE MAXFLOAT linux unix"
    " MECH_REAL MECH_LANES MECH_QUAD MECH_LONG MECH_MODEL_H MECH_MODEL_VERSION"
)
"""Macros of the headers that a model includes, of the C standard and beyond, and of compilers."""

_ARGUMENTS: Final = (
    "mech_real t, const mech_real *y, const mech_real *u, const mech_real *z,",
    "const mech_real *p, {w}mech_real *restrict out)",
)
_GIVEN: Final = "    const mech_real *g = u + {inputs};"
"""Where a function of a crowd finds what it is given."""

_PARAMETERS_ARGUMENTS: Final = "mech_real *restrict p, const unsigned char *set{w})"

_PRELUDE: Final = """\
#include <stddef.h>

#include "model.h"

/* real(0.1) is the decimal 0.1 in the working precision; a plain 0.1 is that number in double precision. */
#if defined(MECH_QUAD)
#include <quadmath.h>
#define real(decimal) decimal##Q
{quad}#elif defined(MECH_LONG)
#include <math.h>
#define real(decimal) decimal##L
{long}#else
#include <math.h>
#define real(decimal) decimal
#endif
#define ratio(a, b) ((mech_real)(a) / (mech_real)(b))
#define PI real({pi})

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#if defined(_MSC_VER)
#define NOINLINE __declspec(noinline)
#else
#define NOINLINE __attribute__((noinline))
#endif
"""


def emit_c(
    program: Program, chunk_size: int | None = None, *, turns: bool = False, double_double: bool = False
) -> str:
    """Return the C text of a program.

    Long functions are split (``chunk_size`` operations a piece; None: the usual size; 0: never). ``sincos_batch``: sines and
    cosines stand in groups, which ``sincos_batch.h`` of the kernel forms at once; else the text needs ``model.h`` alone, and
    ``series.h`` where it holds Taylor series of few slots. ``double_double``: those of a program that
    ``c_double_double.with_series`` gives have 106 bits, and need ``double_double.h``. Compiled with ``-ffp-contract=off
    -frounding-math`` (no fused products and sums, no function of a constant evaluated by the compiler) it gives the same bits as
    the scalar Python text on the same C library.
    """
    with compiling():
        loops: Mapping[str, Rolled] = {}
        if chunk_size is None:
            loops = loops_of(program)
        program = _with_turns(program, loops) if turns else program
        if chunk_size != 0:
            from ..program.chunk import CHUNK, chunk

            whole = {*loops, *(f.name for f in program.functions if mostly_branches(f))}
            if program.few_slots or double_double:
                whole.add(SERIES_NEXT)
            program = chunk(program, chunk_size or CHUNK, whole=whole)
            # pieces read their angles again, in between
            program = verified(_with_turns(program, loops) if turns else program)
        return "\n".join(_File(program, loops, turns, double_double).lines()) + "\n"


def emit_functions(program: Program) -> str:
    """Return the C text of the functions of a program alone, each exported, without the struct of a model."""
    file = _File(program, {}, turns=False)
    return (
        "\n".join((*file.beginning(), *(line for f in program.functions for line in file.function(f)))) + "\n"
    )


def _with_turns(program: Program, loops: Collection[str]) -> Program:
    functions = (f if f.name in loops else with_turns_ahead(f) for f in program.functions)
    return replace(program, functions=tuple(functions))


class _File:
    def __init__(
        self, program: Program, loops: Mapping[str, Rolled], turns: bool, double_double: bool = False
    ) -> None:
        self.program = program
        self.double_double = double_double
        self.expanded = self.double_double or program.few_slots
        self.dialect = TURNING if turns else DIALECT
        self.loops = loops
        self.crowd = program.switching is not None and program.switching.crowd is not None
        self.readers = readers(program)
        self.used = _operations(program)
        library = {name for code, name in LIBRARY.items() if code in self.used}
        for code in self.used & NEEDED_BY_OWN.keys():
            library.update(NEEDED_BY_OWN[code])
        self.library = sorted(library)
        self.names = identifiers(program, {*_WORDS.split(), *_MACROS.split(), *library, *CALLED.values()})

    def lines(self) -> Iterator[str]:
        yield from self.beginning()
        yield from self.code()
        yield from self.model()

    def beginning(self) -> Iterator[str]:
        """Yield what functions call."""
        program = self.program
        yield from header(program)
        if self.double_double:
            from .c_double_double import included

            yield included(program)  # before functions of the library get other names
        yield _PRELUDE.format(
            quad="".join(f"#define {name} {name}q\n" for name in self.library),
            long="".join(f"#define {name} {name}l\n" for name in self.library),
            pi=PI_DIGITS,
        )
        if self.dialect is TURNING and self.has_turns():
            yield TURNS_INCLUDED
        if any(map(needs_threads, self.loops.values())):
            yield THREADS
        if any(map(are_apart, self.loops.values())):
            yield SIDE_BY_SIDE
        for code in sorted(self.used & OWN.keys()):
            yield OWN[code]
        yield from (c_tables.FUNCTIONS[name] for name in c_tables.questions(c_tables.asked_of(program)))
        for i, table in c_tables.used_tables(program):
            yield f"enum {{ n_table_{i} = {len(table.values)} }};"
            yield f"static const mech_real table_{i}[n_table_{i}]{c_tables.width(table)} = {{"
            yield from c_tables.rows(table, literal)
            yield "};\n"

    def code(self) -> Iterator[str]:
        """Yield the functions of a model."""
        program = self.program
        if self.crowd:
            yield CROWD_INCLUDED
        if self.readers:
            yield SHARES_INCLUDED
            yield MODEL_AHEAD
        if program.few_slots and not self.double_double:
            yield SERIES_INCLUDED
        yield from self.function(program.parameters_function)
        for function in program.functions:
            if self.expanded and function.name == SERIES_NEXT:
                yield from self.series()
            elif is_emitted(function):
                yield from self.function(function)
                if function.name in self.readers:
                    yield from self.reader(function)
        if self.crowd:
            yield MODEL_AHEAD
            yield CROWD_FUNCTIONS

    def series(self) -> Iterator[str]:
        """Return the lines of the function that forms all orders of Taylor series."""
        if self.double_double:
            from . import c_double_double

            return c_double_double.expansion(self.program)
        from .c_series import expansion

        return expansion(self.program, self.dialect)

    def has_turns(self) -> bool:
        """Whether sines and cosines stand in groups somewhere."""
        straight = (f for f in self.program.functions if f.name not in self.loops)
        return any(turn_groups(b) for f in straight for b in f.bodies) or any(
            map(are_turned, self.loops.values())
        )

    def function(self, function: ProgramFunction) -> Iterator[str]:
        """Yield one function, and before it its bodies where it has several."""
        parameters = function is self.program.parameters_function
        static = (
            parameters or function.name in MODEL_FUNCTIONS or function.name in (SERIES_START, SERIES_NEXT)
        )
        several = len(function.bodies) > 1
        rolled = self.loops.get(function.name)
        if rolled is not None:
            yield from loop_tables(function.name, rolled)
        if several:
            for k, body in enumerate(function.bodies):
                yield from _head("static NOINLINE", f"{function.name}_{k + 1}", parameters, workspace=True)
                yield from self.body(body, parameters, workspace=True, named=False)
        yield f"/* {comment(sentence(function.doc))} */"
        if function.name in self.readers:
            yield from _head("static", f"{function.name}{OF_SHARES}", parameters, workspace=False)
        else:
            yield from _head("static" if static else "EXPORT", function.name, parameters, workspace=False)
        if rolled is not None:
            yield from self.rolled(function.name, rolled, parameters)
            return
        if not several:
            named = function.operations <= NAMED_LOADS and function.name != SERIES_NEXT
            yield from self.body(function.bodies[0], parameters, workspace=False, named=named)
            return
        arguments = "p, set, w" if parameters else "t, y, u, z, p, w, out"
        yield "{"
        yield f"    mech_real w[{max(1, function.workspace)}];"
        for k in range(len(function.bodies)):
            yield f"    {function.name}_{k + 1}({arguments});"
        yield "}\n"

    def reader(self, function: ProgramFunction) -> Iterator[str]:
        """Yield the function that is called instead of one that reads shares of loads."""
        yield "/* The same with the shares of loads that rigid bodies do not determine. */"
        static = function.name in MODEL_FUNCTIONS
        yield from _head("static" if static else "EXPORT", function.name, parameters=False, workspace=False)
        yield "{"
        yield f"    mech_shares_call(&model, {function.name}{OF_SHARES}, {self.readers[function.name]}, t, y, u, z, p, out);"
        yield "}\n"

    def rolled(self, name: str, rolled: Rolled, parameters: bool) -> Iterator[str]:
        """Yield the body of a function as loops."""
        yield "{"
        arrays = touched(rolled.items)
        yield from self.unused({*arrays, "u"} if "g" in arrays else arrays, parameters)
        if "g" in arrays:
            yield _GIVEN.format(inputs=self.program.size("u"))
        sizes = {array: self.program.size(array) for array in ("y", "u", "z")}
        for line in loop_lines(name, rolled, sizes, self.dialect is TURNING):
            yield f"    {line}"
        yield "}\n"

    @staticmethod
    def unused(touched: Collection[str], parameters: bool, workspace: bool = False) -> Iterator[str]:
        given = ("p", "set") if parameters else ("t", "y", "u", "z", "p", "out")
        unused = [a for a in (*given, *(("w",) if workspace else ())) if a not in touched]
        if unused:
            yield f"    {' '.join(f'(void){a};' for a in unused)}"

    def body(self, body: Body, parameters: bool, *, workspace: bool, named: bool) -> Iterator[str]:
        body = tuple(body)  # each look at a long one makes its statements again
        loads = {(s.array, s.index) for s in body if type(s) is Load}
        touched = {array for array, _ in loads} | {s.array for s in body if type(s) is Store}
        if any(type(s) is Store and s.guarded for s in body):
            touched.add("set")
        if "g" in touched:
            touched.add("u")
        yield "{"
        yield from self.unused(touched, parameters, workspace)
        if "g" in touched:
            yield _GIVEN.format(inputs=self.program.size("u"))
        names: Mapping[tuple[str, int], str]
        if named and not parameters:
            names = {k: self.names[k] for k in loads}
            for array, index in sorted(loads, key=_load_order):
                if array != "t":
                    yield f"    const mech_real {names[array, index]} = {array}[{index}];"
        else:
            names = {k: "t" if k[0] == "t" else f"{k[0]}[{k[1]}]" for k in loads if k[0] != "w"}
        for line in lines(body, self.dialect, names):
            yield f"    {line}"
        yield "}\n"

    def model(self) -> Iterator[str]:
        yield from record_text(model_data(self.program, self.expanded))
        yield "EXPORT const mech_model *mech_model_get(void);"
        yield "const mech_model *mech_model_get(void)"
        yield "{"
        yield "    return &model;"
        yield "}"


def _head(kind: str, name: str, parameters: bool, *, workspace: bool) -> Iterator[str]:
    """Yield the lines of a signature."""
    start = f"{kind} void {name}("
    if parameters:
        yield start + _PARAMETERS_ARGUMENTS.format(w=", mech_real *restrict w" if workspace else "")
    else:
        yield start + _ARGUMENTS[0]
        yield " " * len(start) + _ARGUMENTS[1].format(w="mech_real *restrict w, " if workspace else "")


def sentence(doc: str) -> str:
    """Return a description that begins with a capital letter and ends with a full stop."""
    text = doc.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def _operations(program: Program) -> set[int]:
    """Return the codes of all operations that the program uses."""
    functions = (program.parameters_function, *program.functions)
    return {code for f in functions for body in f.bodies for code in codes_of(body)}


def _load_order(load: tuple[str, int]) -> tuple[int, int]:
    return "tyuzpwg".index(load[0]), load[1]
