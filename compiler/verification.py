"""Verification of what each stage returns, where it is asked for: ``--verify``, and in all tests."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar, assert_never

if TYPE_CHECKING:
    from .equations.model import Equations
    from .flat.model import FlatModel
    from .mechanics.system import MechanicalSystem
    from .program.model import Program

    Stage = FlatModel | MechanicalSystem | Equations | Program

Value = TypeVar("Value", bound="Stage")

_asked = 0


@contextmanager
def verifying() -> Iterator[None]:
    """Verify the value of every stage as long as this lasts, in all threads of the process."""
    global _asked
    _asked += 1
    try:
        yield
    finally:
        _asked -= 1


def is_asked() -> bool:
    """Whether what stages return is verified now."""
    return _asked > 0


def verified(value: Value) -> Value:
    """Return the value of a stage. Raises Malformed where it is asked for and the value breaks the stage's rules."""
    if _asked:
        _verify(value)
    return value


def _verify(value: Stage) -> None:
    # imported where it is asked for: a run without it does not read these modules
    from .equations.model import Equations
    from .equations.verify import verify as verify_equations
    from .flat.model import FlatModel
    from .flat.verify import verify as verify_flat
    from .mechanics.system import MechanicalSystem
    from .mechanics.verify import verify as verify_system
    from .program.model import Program
    from .program.verify import verify as verify_program

    match value:
        case FlatModel():
            verify_flat(value)
        case MechanicalSystem():
            verify_system(value)
        case Equations():
            verify_equations(value)
        case Program():
            verify_program(value)
        case _:
            assert_never(value)
