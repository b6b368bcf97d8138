"""From a program to a library of lanes, which ensembles run several members of the model with at once."""

from __future__ import annotations

from pathlib import Path

from mechc.runtime.ensembles.lanes import Wanted
from mechc.runtime.native.build import build_shared, lane_flags
from mechc.runtime.native.kernel import kernel_sources

from .program.model import Program
from .targets.lanes import emit_lanes

ROOMS = (".", "run", "methods", "ensemble")
"""Of the kernel: whose headers the text includes."""


def build_lanes(program: Program, wanted: Wanted, method: str, width: int | None = None) -> Path:
    """Return the library. ``width``: lanes side by side; without it as many as the processor has.

    Raises NoLanes, BuildError, CompilerMissing.
    """
    flags = lane_flags() if width is None else (*lane_flags(), f"-DMECH_LANE_WIDTH={width}")
    return build_shared(lane_sources(emit_lanes(program, wanted, method)), flags, name="lanes")


def lane_sources(text: str) -> dict[str, str]:
    """Return a file of lanes with the headers of the kernel that it includes."""
    headers = {name: text for name, text in kernel_sources(ROOMS).items() if name.endswith(".h")}
    return {"lanes.c": text, **headers}
