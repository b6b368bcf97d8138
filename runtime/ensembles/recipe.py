"""How members of a question are made: the problem, what is kept, and who follows members that the problem cannot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from ..case import SimulationOptions
from ..problem import Problem
from .batches import Batches, Other
from .device import MakeItems
from .kept import Kept
from .kernel_arguments import Posed
from .lanes import Maker, Wanted
from .members import Members


class Recipe(Struct, frozen=True, eq=False):
    """``few_steps``: after so many a member that ``others`` may follow better is given to them, before it goes on without a
    bound. ``share``: of the members that get a companion run; ``limit``: seconds that a member may take."""

    problem: Problem
    options: SimulationOptions
    kept: tuple[Kept, ...]
    share: float
    limit: float | None = None
    others: tuple[Other, ...] = ()
    few_steps: int | None = None
    make_lanes: Callable[[Wanted, str], Path] | None = None
    lanes: str = "auto"
    make_items: MakeItems | None = None
    device: str | None = None

    def posed(self, members: Members) -> Posed:
        """Make an ensemble ready. Whether a member gets another try does not depend on the other members."""
        maker = None if self.make_lanes is None else Maker(self.make_lanes, self.lanes)
        bounded = replace(self.options, max_steps=self.few_steps or self.options.max_steps)
        device = (self.device, self.make_items) if self.device and self.make_items else None
        return Posed(self.problem, bounded, members, self.kept, maker, device)

    def batches(self, first: Posed, threads: int) -> Batches:
        """Give what makes batches of the members."""
        return Batches(first, self.options, self.others, self.few_steps, threads, self.share)


Make = Callable[[], Recipe]
"""What is sent to other processes, pickled."""
