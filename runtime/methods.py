"""The methods of the kernel, one row each: what is known of them without a compiler or a kernel.

All else stands in the constant struct of each (``kernel/methods/method.h``), of which this is a part: a test compares.
"""

from __future__ import annotations

from collections.abc import Collection

from msgspec import Struct

from mechc.suggest import suggest

from .outcome import SimulationError


class KernelMethod(Struct, frozen=True):
    """``parts``: what it works on beside the rates, by the names of the compiler's ``PARTS`` (equations/needs.py)."""

    name: str
    parts: frozenset[str] = frozenset()
    consists_of: tuple[str, ...] = ()
    fixed_step: bool = True
    """Whether the user gives the step."""
    solves_contacts: bool = False
    """Whether its steps solve for contacts and friction: values between their ends are chords, and the output is at ends."""
    file: str = ""
    """Where a macro makes it; empty: a file of its own name."""


CONTACT_STEPS = "contact_steps"

_JACOBIAN, _MOMENTA = frozenset({"jacobian"}), frozenset({"momenta"})

KERNEL_METHODS = {
    row.name: row
    for row in (
        KernelMethod("auto", _JACOBIAN, consists_of=("dop853", "radau5"), fixed_step=False),
        KernelMethod("dop853", fixed_step=False),
        KernelMethod("rk4"),
        KernelMethod("radau5", _JACOBIAN, fixed_step=False),
        KernelMethod("gauss2", _JACOBIAN, file="gauss.c"),
        KernelMethod("gauss4", _JACOBIAN, file="gauss.c"),
        KernelMethod("gauss6", _JACOBIAN, file="gauss.c"),
        KernelMethod("gauss8", _JACOBIAN, file="gauss.c"),
        KernelMethod("verlet"),
        KernelMethod("rattle", _MOMENTA, file="lobatto.c"),
        KernelMethod("lobatto4", _MOMENTA, file="lobatto.c"),
        KernelMethod("lobatto6", _MOMENTA, file="lobatto.c"),
        KernelMethod("moreau", frozenset({CONTACT_STEPS}), solves_contacts=True),
        KernelMethod("taylor", frozenset({"series"}), fixed_step=False),
    )
}

SOLVING_CONTACTS = frozenset(name for name, row in KERNEL_METHODS.items() if row.solves_contacts)


def unknown_method(wanted: str, known: Collection[str] = tuple(KERNEL_METHODS)) -> SimulationError:
    """Return what is said of a method that there is not."""
    return SimulationError(
        f"there is no method '{wanted}' (there are {', '.join(known)}){suggest(wanted, known)}"
    )


def check_step(name: str, *, fixed: bool, given: bool) -> None:
    """Refuse a method of fixed step without a step, and a step for one that chooses its own. Raises SimulationError."""
    if fixed and not given:
        raise SimulationError(
            f"'{name}' takes steps of one size",
            help='give a step: step = 1 ms in the experiment, --step "1 ms" to the command, or step="1 ms" in Python',
        )
    if given and not fixed:
        raise SimulationError(
            f"'{name}' chooses its steps itself, 'step' is for methods of fixed step; "
            "the spacing of the output is 'every'"
        )


RUNS_ALL = "leave the method out: 'auto' takes one that the model allows"
"""What is said where a method that chooses its steps cannot run a model."""

FIXED_RUNS_ALL = (
    "'rk4' takes steps of one size too, and runs every model; 'gauss4' does where formulas have derivatives"
)
"""The same for methods of fixed step."""


def refuse_contact_steps(method: str) -> None:
    """Refuse to differentiate steps that solve for contacts. Raises SimulationError."""
    if method in SOLVING_CONTACTS:
        raise SimulationError(
            f"the steps of '{method}' solve for contacts as they are at their ends: they have no derivatives, and those of the "
            "motion with exact events are of another run",
            help="take a method with events for this question: --method dop853",
        )


def parts_for(method: str) -> frozenset[str]:
    """Return the parts that a method works on; none for methods that are not the kernel's."""
    row = KERNEL_METHODS.get(method)
    return row.parts if row is not None else frozenset()


def with_components(method: str) -> tuple[str, ...]:
    """Return a method and those it consists of."""
    return (method, *KERNEL_METHODS[method].consists_of)


def methods_for(parts: Collection[str]) -> list[str]:
    """Return the methods that work on one of the parts, each followed by those it consists of."""
    working = (row.name for row in KERNEL_METHODS.values() if row.parts.intersection(parts))
    return list(dict.fromkeys(name for method in working for name in with_components(method)))
