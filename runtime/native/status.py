"""How a call of the kernel may end."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """How a call of ``mech_advance`` ended: enum mech_status of ``solver.h``, which says what each one means."""

    RUNNING = 0
    REACHED = 1
    RECORD_FULL = 2
    TERMINATED = 3
    EVENTS_FULL = 4
    AT_EVENT = 5
    STEP_TOO_SMALL = -1
    NOT_FINITE = -2
    ASSERTION = -3
    NOT_CONVERGED = -4
    OFF_CONSTRAINTS = -5
    NEEDS_JACOBIAN = -6
    NEEDS_SEPARABLE = -7
    NEEDS_MOMENTA = -8
    NEEDS_SERIES = -10
    NEEDS_ROWS = -12
    NEEDS_STEPS = -13
    NO_SERIES = -11
    JUMPING = -9
    EVENT_LOOP = -20
    ZENO = -21
    PENETRATION = -22
    ENERGY_RAISED = -23
    CHATTER = -24
    BRANCH_ASSERTION = -25
    APART = -26
    NO_MODE = -27
    NO_IMPACT = -28
    OUT_OF_RANGE = -29
    UNDEFINED_JUMP = -30
    NO_PERIOD = -31
    NO_DELAY = -32
    NO_MEMORY = -33


NEEDS = {
    Status.NEEDS_JACOBIAN: "needs the Jacobian of the model, which its code does not hold",
    Status.NEEDS_SEPARABLE: "is for models whose accelerations depend on positions and time alone",
    Status.NEEDS_ROWS: "is for models with contacts, dry friction on what has mass, or constraints that switch",
    Status.NEEDS_STEPS: "cannot run more than 64 rows of contacts with friction in two directions, or with gaps made of pieces, as by 'min': "
    "'method = \"moreau\"' with a 'step' does",
    Status.NEEDS_SERIES: "needs the Taylor series of the rates, which the code of the model does not hold",
    Status.NEEDS_MOMENTA: "needs the momenta and forces of the model, which its code does not hold",
}
"""What is said of a method with which no run of a model begins, where no closer reason is known."""
