"""Tables of a crowd of contacts, whose forces are found by numbers (rows/crowd.py)."""

from __future__ import annotations

from msgspec import Struct

from mechc.lang.source import Span


class CrowdKind(Struct, frozen=True):
    """Contacts whose formulas differ only in what they read: the function of their values, and how many numbers it is given.

    Its results: gap, the part of its rate free of velocities, the part of its second derivative free of accelerations,
    restitution, approach below which it rests; K for each of ``normal`` velocities, bounds of |K| (negative: unknown);
    with friction the same two parts of the slip, the coefficients at rest and while sliding, and K for each of ``slip``
    velocities; with friction in two directions these two parts and K of the second. ``friction``: the directions, 0 to 2.
    ``normal`` and ``slip``: which of what it is given these velocities are. The first ``one`` of that are common to the contacts
    of a line.
    """

    function: str
    leaves: int
    one: int
    normal: tuple[int, ...]
    slip: tuple[int, ...]
    friction: int


def crowd_values(kind: CrowdKind) -> int:
    """Return how many values the function of a kind gives."""
    return 5 + 2 * len(kind.normal) + (0, 4 + len(kind.slip), 6 + 2 * len(kind.slip))[kind.friction]


class CrowdColumns(Struct, frozen=True):
    """What contacts of lines differ in: what each reads, and a part of its name.

    What is read is an index in y, or after these in p, or after these in z.
    """

    labels: tuple[str, ...]
    leaves: tuple[tuple[int, ...], ...]


class CrowdLine(Struct, frozen=True):
    """Contacts of one kind with numbers from ``first`` on: one thing, which is at ``one``, with each of ``columns`` from ``start``
    to ``stop``. They are called by ``head``, the label of the column and ``end``."""

    first: int
    kind: int
    one: tuple[int, ...]
    columns: int
    start: int
    stop: int
    head: str
    end: str
    span: Span | None = None


class CrowdPlan(Struct, frozen=True):
    """Contacts that are found by numbers (rows/crowd.py). From z[``first``] on there are ``capacity`` places for those that
    are closed, and behind these ``told`` numbers about their forces, where steps find them (model.h). ``groups``: of each velocity,
    the group within which forces act. ``efforts``: whether outputs are given the forces along the velocities after the accelerations.
    ``asked``: what they are given after these, as (contact, 0: its force, 1 and 2:
    those of its friction, 3: whether it is closed). ``stepped``: whether only steps solve for them. ``supplies``: whether what they do to
    the energy follows from accelerations, since what moves by itself takes part."""

    kinds: tuple[CrowdKind, ...]
    lines: tuple[CrowdLine, ...]
    columns: tuple[CrowdColumns, ...]
    first: int
    capacity: int
    groups: tuple[int, ...]
    asked: tuple[tuple[int, int], ...]
    told: int = 0
    stepped: bool = False
    efforts: bool = False
    supplies: bool = False

    @property
    def count(self) -> int:
        """How many contacts there are."""
        last = self.lines[-1]
        return last.first + last.stop - last.start

    @property
    def places(self) -> range:
        """The places in z of what is closed, and of what is told."""
        return range(self.first, self.first + self.capacity + self.told)

    def results(self, nv: int) -> dict[str, int]:
        """Return how many results each function has."""
        supply = {"crowd_supply": 1} if self.supplies else {}
        return {**{kind.function: crowd_values(kind) for kind in self.kinds}, "crowd_push": nv, **supply}
