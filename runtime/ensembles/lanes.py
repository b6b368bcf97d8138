"""Members side by side in vectors: whether that is done, and the library of a model's lanes (``kernel/ensemble/lanes.h``)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from ctypes import c_char_p
from pathlib import Path

from msgspec import Struct

from ..native.build import BuildError
from ..native.contract import ModelStruct, fields
from ..outcome import SimulationError
from ..problem import Problem

CHOICES = ("auto", "on", "off")
ENOUGH = 1000
"""Members from which on lanes are compiled without being asked for: it takes about a second."""

LANES_VERSION = 1
METHODS = ("dop853", "taylor")
"""Those of which there are lanes; ``auto`` begins as the first."""

Wanted = tuple[tuple[str, int], ...]
"""Numbers of "y" and "outputs" that are kept along each step; ("", 0) for none."""


class NoLanes(Exception):
    """Members of this model cannot run side by side. The message says why."""


class Maker(Struct, frozen=True, eq=False):
    """What compiles the lanes of a model: ``make(wanted, method)`` gives the library. Raises NoLanes and BuildError."""

    make: Callable[[Wanted, str], Path]
    asked: str = "auto"

    def wanted_for(self, members: int) -> bool:
        return self.asked == "on" or (self.asked == "auto" and members >= ENOUGH)


class LanesStruct(ctypes.Structure):
    """mech_lanes"""

    _fields_ = fields(
        "int version, width, groups, fused, ny, n_all, nz, nu, n_kept, n_dense, n_extra, plain",
        ("build", c_char_p),
        "int look_every; double stiffness_bound; pointer begin, attempt",
    )


class Lanes(Struct, frozen=True, eq=False):
    """A loaded library of lanes. ``sincos_batch``: members that turn out stiff need the other part of the method."""

    library: ctypes.CDLL
    struct: LanesStruct
    turns: bool

    @property
    def build(self) -> str:
        return bytes(self.struct.build).decode()


def check_asked(tables: Sequence[int], reproducible: bool) -> None:
    """Raise NoLanes for what is asked of members that lanes, and devices, cannot do."""
    if reproducible:
        raise NoLanes("'reproducible' asks for the bits of the scalar kernel")
    if any(rows > 1 for rows in tables):
        raise NoLanes("its inputs follow tables over time")


def stepped_by(method: str) -> str:
    return "dop853" if method == "auto" else method


def turns(method: str, model: ModelStruct) -> bool:
    """Tell whether members that turn out stiff go to the other part of the method."""
    return method == "auto" and bool(model.jacobian)


def find_lanes(
    maker: Maker,
    problem: Problem,
    model: ModelStruct,
    method: str,
    wanted: Wanted,
    tables: Sequence[int],
    reproducible: bool,
) -> Lanes:
    """Give the lanes of a model; ``tables``: rows of those that inputs follow. Raises NoLanes, saying why there are none."""
    check_asked(tables, reproducible)
    try:
        path = maker.make(wanted, stepped_by(method))
    except BuildError as error:
        raise NoLanes(f"their C was not compiled: {error.output.strip().splitlines()[0]}") from None
    library = ctypes.CDLL(str(path))
    library.mech_lanes_get.restype = ctypes.POINTER(LanesStruct)
    struct: LanesStruct = library.mech_lanes_get().contents
    found = (struct.version, struct.ny, struct.nz, struct.nu, struct.n_all)
    sizes = (problem.ny, len(problem.discretes), len(problem.inputs), len(problem.parameters) + problem.nh)
    if found != (LANES_VERSION, *sizes):
        raise RuntimeError(f"the lanes of '{problem.name}' have the sizes {found}, not {sizes}")
    return Lanes(library, struct, turns(method, model))


def refuse_lanes(why: NoLanes) -> SimulationError:
    """Return the error for lanes that were asked for."""
    return SimulationError(
        f"members cannot run side by side: {why}",
        help="lanes = auto takes them where they can be had, and one member after the other elsewhere",
    )
