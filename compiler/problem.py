"""From a program to something that can be run, by a C compiler."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec.structs import replace

from mechc.runtime.functions import with_code
from mechc.runtime.native.build import (
    build_shared,
    built_once,
    find_quick_compiler,
    known_compiler,
    model_flags,
)
from mechc.runtime.problem import Problem

from .outline import Summary, summary_of

if TYPE_CHECKING:
    from mechc.runtime.problem import Adjoint, Directions

    from .compilation import Compilation
    from .program.model import Program

MOST_WHOLE = 200_000
"""Operations of a function that stays in one piece, whose values lie on the stack: at most 1.6 MB."""

MOST_LINES = 20_000
"""Lines of a text that loops have shortened: chains of 1000 links have 7000."""

HEADER = "model.h"
TURNS = ("sincos_batch.h", "sincos.h")
"""What code for this processor may include, too."""

CROWD = ("crowd.h", "crowd_response.h", "envelope.h", "real.h")
"""What code with a crowd of contacts includes, too."""

SHARES = ("shares.h", "real.h")
"""What code with loads that rigid bodies do not determine includes, too."""

SERIES = ("series.h",)
"""What code with Taylor series of few slots includes, too."""


def problem_with(
    compilation: Compilation, parts: frozenset[str], *, reproducible: bool = False, quick: bool = False
) -> Problem:
    """Return the functions of a model with these parts, ready to be called; ``quick``: see ``make_problem``. Raises CompilerMissing
    and BuildError."""
    quick = quick and find_quick_compiler() is not None  # without one, the same code answers both questions
    key = reproducible, quick, parts
    if key in compilation.problems:
        return compilation.problems[key]

    def made(program: Program) -> Problem:
        return make_problem(program, reproducible=reproducible, quick=quick)

    if parts <= compilation.parts:
        problem = problem_of(
            compilation.summary,
            lambda: compilation.program,
            reproducible=reproducible,
            quick=quick,
            stored_as=compilation.stored_as,
        )
    else:
        from .pipeline import program_with

        problem = made(program_with(compilation, parts))

    @functools.cache
    def tangents(directions: Directions) -> Problem:
        from .pipeline import tangent_program

        return made(tangent_program(compilation, directions, parts))

    @functools.cache
    def adjoints(goal: Adjoint) -> Problem:
        from .pipeline import adjoint_program

        return made(adjoint_program(compilation, goal))

    compilation.problems[key] = replace(problem, tangents=tangents, adjoints=adjoints)
    return compilation.problems[key]


def make_problem(
    program: Program,
    *,
    reproducible: bool = False,
    quick: bool = False,
) -> Problem:
    """Return the functions of a program, ready to be called; ``quick``: soon, where better code would not pay. Raises CompilerMissing
    and BuildError."""
    return problem_of(summary_of(program), lambda: program, reproducible=reproducible, quick=quick)


def problem_of(
    summary: Summary,
    program: Callable[[], Program],
    *,
    reproducible: bool = False,
    quick: bool = False,
    stored_as: str = "",
) -> Problem:
    """Return the same of a program that is read when it is needed. ``stored_as`` tells it from all others: its code is found by
    that, without being written again, and without the program."""
    made = _made(summary, program, reproducible, quick, stored_as)
    if not summary.offers:
        return made
    from .targets.balls import enclosure

    return replace(made, enclosure=enclosure(program()))


def _made(
    summary: Summary,
    program: Callable[[], Program],
    reproducible: bool,
    quick: bool,
    stored_as: str,
) -> Problem:
    if summary.description.curve is not None:
        from .targets.python import load_arrays

        functions, parameters = load_arrays(program())
        return with_code(summary.description, functions=functions, parameters_function=parameters)
    compiler = find_quick_compiler() if quick else None
    by = compiler or known_compiler()
    in_process = by is not None and by.in_process
    strict = reproducible or in_process  # libtcc gains nothing from sines in groups
    flags = model_flags(strict, summary.loops)

    def build() -> Path:
        written = _written(program(), strict, in_process)
        return build_shared(written, flags_for(written["model.c"], strict, summary.loops), compiler=compiler)

    if stored_as:
        known = {
            "program": stored_as,
            **{name: header(name) for name in (HEADER, *TURNS, *CROWD, *SHARES, *SERIES)},
        }
        library = built_once(known, flags, build, compiler)
    else:
        library = build()
    return with_code(summary.description, library=library, quick=compiler is not None)


def flags_for(text: str, reproducible: bool, loops: bool) -> tuple[str, ...]:
    """Return the flags for a text in which loops were looked for: where none were found it is long, and takes -O3 minutes."""
    return model_flags(reproducible, loops and text.count("\n") <= MOST_LINES)


def _written(program: Program, reproducible: bool, in_process: bool = False) -> dict[str, str]:
    """Return the C text of a program and the headers that it includes, by their names. libtcc, which compiles ``in_process``, takes
    no longer for long functions, whose pieces it makes slower."""
    from .targets.c import emit_c
    from .targets.c_data import CROWD_INCLUDED, SERIES_INCLUDED, SHARES_INCLUDED
    from .targets.c_forms import TURNS_INCLUDED

    whole = in_process and max(f.operations for f in program.functions) <= MOST_WHOLE
    text = emit_c(program, 0 if whole else None, turns=not reproducible)
    headers = [
        HEADER,
        *(TURNS if TURNS_INCLUDED in text else ()),
        *(CROWD if CROWD_INCLUDED in text else ()),
        *(SHARES if SHARES_INCLUDED in text else ()),
        *(SERIES if SERIES_INCLUDED in text else ()),
    ]
    return {"model.c": text, **{name: header(name) for name in headers}}


def header(name: str = HEADER) -> str:
    """Return the text of a header that generated C code includes; the contract, if nothing is said."""
    import mechc.runtime

    return (Path(mechc.runtime.__file__).parent / "kernel" / name).read_text(encoding="utf-8")
