"""From a program to lanes, by which ensembles run several members of the model at once: a library, or the text of a device."""

from __future__ import annotations

import re
from pathlib import Path

from mechc.runtime.ensembles.lanes import NoLanes, Wanted
from mechc.runtime.native.build import build_shared, find_compiler, lane_flags
from mechc.runtime.native.kernel import kernel_sources

from .program.model import Program
from .targets.lanes import DEVICE, emit_lanes

ROOMS = (".", "run", "methods", "ensemble")
"""Of the kernel: whose headers the text includes."""


def build_lanes(program: Program, wanted: Wanted, method: str, width: int | None = None) -> Path:
    """Return the library. ``width``: lanes side by side; without it as many as the processor has.

    Raises NoLanes, BuildError, CompilerMissing.
    """
    text, compiler = emit_lanes(program, wanted, method), find_compiler()
    if compiler is not None and compiler.in_process:
        raise NoLanes("gcc or clang compiles them, and neither was found")
    flags = lane_flags() if width is None else (*lane_flags(), f"-DMECH_LANE_WIDTH={width}")
    return build_shared(lane_sources(text), flags, name="lanes")


def lane_sources(text: str) -> dict[str, str]:
    """Return a file of lanes with the headers of the kernel that it includes."""
    headers = {name: text for name, text in kernel_sources(ROOMS).items() if name.endswith(".h")}
    return {"lanes.c": text, **headers}


def item_text(program: Program, wanted: Wanted, method: str) -> str:
    """Return the text of a model for devices, in OpenCL C: one member in each work item. Raises NoLanes."""
    return _inlined("lanes.c", lane_sources(emit_lanes(program, wanted, method, DEVICE)))


_INCLUDE = re.compile(r'^#include "([^"]+)"\n', re.M)


def _inlined(name: str, sources: dict[str, str], within: frozenset[str] = frozenset()) -> str:
    """Return a file with what it includes in its place; the guards of headers leave out what comes twice."""

    def content(found: re.Match[str]) -> str:
        return "" if found[1] in within else _inlined(found[1], sources, within | {found[1]})

    return _INCLUDE.sub(content, sources[name])
