"""What is said of solutions of equations for outputs: of further ones, and of jumps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..interface import array_of
from ..outcome import time_text
from ..problem import Problem
from .branch_jumps import Jump, JumpKind
from .further_solutions import Several

TOLD_TIMES, TOLD_SOLUTIONS = 4, 3
JUMP_DIGITS = 5
"""In a fold the last ones come from the root of a small time."""

WORDS = {
    JumpKind.JUMP: "the solution that it followed goes on, and the guess leads to another one",
    JumpKind.FOLD: "the solution that it followed ends there, in a fold, and the guess leads to another one",
    JumpKind.MEETING: "two solutions meet there, and the guess decides, not the equations, which one goes on",
    JumpKind.LOST: "the solution that it followed goes on, but is not found from the guess",
}
ENDS = "the solution that it followed ends there, in a fold, and none is found from the guess"


def several_text(problem: Problem, one: Several) -> str:
    """Tell of further solutions at the start."""
    shown = [_values(problem, one.names, x) for x in one.others[:TOLD_SOLUTIONS]]
    others = " or ".join(shown) + (" and more" if len(one.others) > TOLD_SOLUTIONS else "")
    taken = f"{named(one.names)} = {_values(problem, one.names, one.taken)} at {time_text(problem, one.time)}"
    if one.outside:
        return (
            f"{taken} lies outside of the range that the model states; its equations hold within it for {others}: "
            "state a guess nearer to that"
        )
    return (
        f"{taken} is one of several solutions of its equations, beside {others}: the guess chooses; "
        "'min' and 'max' of the output say which one is meant"
    )


def jumps_text(problem: Problem, jumps: Sequence[Jump]) -> str:
    """Tell of jumps of the same outputs, of one kind."""
    first = jumps[0]
    before, after = (_values(problem, first.names, x, JUMP_DIGITS) for x in (first.before, first.after))
    ends = not np.isfinite(first.after).all()
    at = f"at {time_text(problem, first.time)}"
    if ends:
        words = ENDS if first.kind is JumpKind.FOLD else WORDS[first.kind]
        said = f"{named(first.names)} = {before} is the last value before {at.removeprefix('at ')}: {words}"
    elif first.kind is JumpKind.MEETING:
        said = f"{named(first.names)} {at}: {WORDS[first.kind]}"
    else:
        verb = "jumps" if len(first.names) == 1 else "jump"
        said = f"{named(first.names)} {verb} {at} from {before} to {after}: {WORDS[first.kind]}"
    again = [f"{jump.time:.10g}" for jump in jumps[1:TOLD_TIMES]]
    if again:
        rest = len(jumps) - TOLD_TIMES
        said += f"; again at {', '.join(again)}" + (f" and {rest} times more" if rest > 0 else "")
    return said


def named(names: Sequence[str]) -> str:
    """Name outputs, an array by its own name."""
    return ", ".join(f"'{name}'" for name in dict.fromkeys(array_of(name)[0] for name in names))


def _values(problem: Problem, names: Sequence[str], values: Sequence[float], digits: int = 6) -> str:
    units = {q.name: q.unit for q in problem.outputs if q.name in names}
    shown = [f"{0.0 if abs(x) < 1e-300 else x:.{digits}g}" for x in values]
    if len({units[n] for n in names}) == 1:
        text = shown[0] if len(shown) == 1 else f"({', '.join(shown)})"
        return f"{text} {units[names[0]]}".rstrip()
    return f"({', '.join(f'{x} {units[n]}'.rstrip() for x, n in zip(shown, names, strict=True))})"
