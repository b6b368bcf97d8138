"""What switches: modes of rows, branches of events, clocks."""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

from ..flat.model import Origin
from ..graph import Node


class Regularized(Struct, frozen=True):
    """Friction as a smooth force: ``side`` tanh(s/v_stick) times its limit. ``creep``: the speed of sliding where it
    is below v_stick, and so takes the place of sticking, else 0; None with the second direction of a surface; ``unit``
    its unit. ``sticks``: 1 where nothing slips, of a slip that is prescribed or of what has no mass; else None. ``force`` of a friction on
    what has no mass, instead of side and limit; ``slides``: the direction of its slip, -1, 0 or 1 in z, where that is remembered."""

    side: Node
    creep: Node | None
    unit: str
    sticks: Node | None = None
    force: Node | None = None
    slides: Node | None = None


class Mode(Struct, frozen=True):
    """How the rows of a constraint are switched; every symbol is a number in z.

    ``kind``: contact, friction, freewheel (a friction that never gives way backwards), constraint. ``flag`` is 1 while the rows hold (a contact presses, friction sticks);
    ``sign`` is the direction of slip, -1, 0 or 1; ``enabled`` 0 for what was released. A friction has the limits
    ``kinetic`` and ``static`` of its force (``backward`` and ``static_backward`` against a motion backwards, if these are others), or is in the contact ``contact`` with these as coefficients. ``smooth``
    takes the place of flag and sign where the law is regularized. ``rest``: approach below which a contact rests,
    negative for the default. ``whole``: the name of the contact, of whose gap this may be a part, or of its friction.
    ``begins``: whether a constraint holds, or a contact may press, at the start; ``unless``: it does but where this is true, and is engaged
    then.
    """

    kind: Literal["contact", "friction", "freewheel", "constraint"]
    flag: Node
    impulses: tuple[Node, ...]
    sign: Node | None = None
    enabled: Node | None = None
    contact: str = ""
    kinetic: Node | None = None
    static: Node | None = None
    backward: Node | None = None
    static_backward: Node | None = None
    smooth: Regularized | None = None
    restitution: Node | None = None
    rest: Node | None = None
    whole: str = ""
    begins: bool = True
    unless: Node | None = None


class SetAction(Struct, frozen=True):
    """New values of symbols: reinit, ':=', release and engage. ``moves``: coordinates or rates are among them."""

    targets: tuple[Node, ...]
    values: tuple[Node, ...]
    moves: bool
    origin: Origin


class ImpulseAction(Struct, frozen=True):
    """Impulses by virtual work: pairs of (rate, impulse)."""

    pairs: tuple[tuple[Node, Node], ...]
    origin: Origin


class CheckAction(Struct, frozen=True):
    condition: Node
    message: str
    origin: Origin


class EndAction(Struct, frozen=True):
    message: str
    origin: Origin


class BranchRow(Struct, frozen=True):
    """One branch of a ``when``; branches of one ``event`` exclude each other, that with a negative one acts before all at the start. ``text``: the condition as written. ``leads``: it acts
    before others are asked, as what decides whether a friction sticks."""

    event: int
    condition: Node
    actions: tuple[SetAction | ImpulseAction | CheckAction | EndAction, ...]
    text: str
    origin: Origin
    leads: bool = False


class Clock(Struct, frozen=True):
    """A ``sample(period, start)``: 1 at the instants start + count period, for ``pulse`` and ``count`` in z."""

    period: Node
    start: Node
    pulse: Node
    count: Node
