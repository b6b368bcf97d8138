"""What code that stands alone cannot hold yet."""

from __future__ import annotations

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ..equations.model import BALANCE, SOUGHT, HybridPlan
from ..program import Program


def standing_alone(program: Program) -> Program:
    """Return a program without what only runs here and now ask for: the equations of outputs, which they follow, and the
    laws of the bodies, which they check."""
    if not (program.sought or program.balance):
        return program
    functions = tuple(f for f in program.functions if f.name not in (SOUGHT, BALANCE))
    return replace(
        program,
        given=() if program.sought else program.given,
        functions=functions,
        sought=(),
        balance=(),
    )


def check_nothing_found(program: Program, library: str) -> None:
    """Report parameters that the start finds: a module of functions makes no start. Raises CompileError."""
    if not program.found:
        return
    entry = program.arrays["p"][program.found[0]]
    raise Reporter().fail(
        "E0909",
        f"the parameter '{entry.name}' is found at the start of a run, and a module for {library} finds no start",
        None,
        help=f"write the value that 'mechc init' prints into the model, '{entry.name} = ..', and leave out the initial condition",
    )


def check_stands_alone(hybrid: HybridPlan | None) -> None:
    """Report forces that are found by numbers, which the kernel does: a module of functions has none. Raises CompileError."""
    crowd = hybrid.crowd if hybrid is not None else None
    if crowd is None:
        return
    raise Reporter().fail(
        "E0722",
        f"the forces of {crowd.count} contacts are found by numbers, which a module of functions does not",
        crowd.lines[0].span,
        caption="the first of these contacts",
        help="'mechc run', the target 'c' and FMUs for Co-Simulation do; modules take up to 64 rows of contacts and friction",
    )
