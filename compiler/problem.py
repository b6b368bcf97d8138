"""From a program to something that can be run: through the C compiler where there is one."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from msgspec.structs import replace

from mechc.runtime.native.build import build_shared, built_once, find_compiler, model_flags
from mechc.runtime.problem import Problem

from .program.model import Program
from .program.series import without_series
from .targets import description
from .targets.alone import check_stands_alone
from .targets.balls import enclosure
from .targets.c import emit_c
from .targets.c_forms import TURNS_INCLUDED
from .targets.c_plans import CROWD_INCLUDED

HEADER = "model.h"
TURNS = ("turns.h", "turn.h")
"""What code for this processor may include, too."""

CROWD = ("crowd.h", "envelope.h", "real.h")
"""What code with a crowd of contacts includes, too."""


def make_problem(
    program: Program,
    target: Literal["auto", "c", "python"] = "auto",
    *,
    reproducible: bool = False,
    kept_as: str = "",
) -> Problem:
    """Return the functions of a program, ready to be called.

    ``auto`` compiles C if there is a compiler and falls back on Python, which every report then says. ``kept_as`` tells the
    program from all others: its code is found by that, without being written again. Raises CompilerMissing (target ``c``) and
    BuildError.
    """
    made = _made(program, target, reproducible, kept_as)
    return replace(made, enclosure=enclosure(program)) if program.function("bias") is not None else made


def _made(
    program: Program, target: Literal["auto", "c", "python"], reproducible: bool, kept_as: str
) -> Problem:
    if program.curve is not None:
        from .targets.python import load_arrays

        functions, parameters = load_arrays(program)
        return description.make_problem(program, functions=functions, parameters_function=parameters)
    if target == "python" or (target == "auto" and find_compiler() is None):
        check_stands_alone(program.hybrid)
        from .targets.python import load_python

        program = without_series(program)
        functions, parameters = load_python(program)
        return description.make_problem(program, functions=functions, parameters_function=parameters)
    flags = model_flags(reproducible, program.long)

    def written() -> dict[str, str]:
        text = emit_c(program, turns=not reproducible)
        headers = [
            HEADER,
            *(TURNS if TURNS_INCLUDED in text else ()),
            *(CROWD if CROWD_INCLUDED in text else ()),
        ]
        return {"model.c": text, **{name: header(name) for name in headers}}

    if kept_as:
        known = {"program": kept_as, **{name: header(name) for name in (HEADER, *TURNS, *CROWD)}}
        library = built_once(known, flags, lambda: build_shared(written(), flags))
    else:
        library = build_shared(written(), flags)
    return description.make_problem(program, library=library)


def header(name: str = HEADER) -> str:
    """Return the text of a header that generated C code includes; the contract, if nothing is said."""
    import mechc.runtime

    return (Path(mechc.runtime.__file__).parent / "kernel" / name).read_text(encoding="utf-8")
