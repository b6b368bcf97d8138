"""Integrators of others beside the kernel, in one process and on the same model: one file each, one row of the table each."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from ...runtime.outcome import SimulationError
from .diffrax import DIFFRAX
from .diffsol import DIFFSOL
from .heyoka import HEYOKA
from .numbalsoda import NUMBALSODA
from .scipy import SCIPY
from .shared import Library
from .sundials import SUNDIALS

if TYPE_CHECKING:
    from ...model import CompiledModel
    from ...runtime.reference.work_precision import Peer

LIBRARIES: Mapping[str, Library] = MappingProxyType(
    {row.name: row for row in (SCIPY, SUNDIALS, NUMBALSODA, HEYOKA, DIFFSOL, DIFFRAX)}
)
JACOBIAN = frozenset({"jacobian"})
OTHERS = {
    "mujoco": "MuJoCo takes bodies, joints and contacts of its own, and no equations",
    "exudyn": "Exudyn takes bodies, joints and contacts of its own, and no equations",
}
"""Why others are not among them."""


def installed(library: Library) -> bool:
    return importlib.util.find_spec(library.package) is not None


def libraries_of(methods: Iterable[str]) -> list[Library]:
    """Return the libraries of methods."""
    names = {"sundials" if (name := method.partition(":")[0]) == "cvode" else name for method in methods}
    return [row for row in LIBRARIES.values() if row.name in names]


def absent() -> list[str]:
    """Return the libraries that are not installed."""
    return [row.name for row in LIBRARIES.values() if not installed(row)]


def peers(
    model: CompiledModel, names: Iterable[str] | None = None, parts: frozenset[str] = JACOBIAN
) -> dict[str, Peer]:
    """Return the runs of a model by libraries, by the names of their methods: all that are installed without ``names``.

    ``parts``: those that the case has been compiled with. A name is that of a library, or of one method as in ``scipy:Radau``. Raises SimulationError for others, and for what is not
    installed.
    """
    if names is None:
        return {
            name: peer
            for row in LIBRARIES.values()
            if installed(row)
            for name, peer in row.runs(model, parts).items()
        }
    made: dict[str, Peer] = {}
    for name in names:
        library, _, method = name.partition(":")
        row = LIBRARIES.get("sundials" if library == "cvode" else library)
        if row is None:
            known = ", ".join(LIBRARIES)
            raise SimulationError(
                f"there is no peer '{library}': {OTHERS.get(library) or f'{known} are known'}"
            )
        if not installed(row):
            raise SimulationError(f"'{row.name}' is not installed", help=f"pip install {row.package}")
        runs = row.runs(model, parts)
        wanted = [found for found in runs if not method or found.partition(":")[2] == method]
        if not wanted:
            raise SimulationError(f"there is no peer '{name}': {row.name} has {', '.join(runs)}")
        made |= {found: runs[found] for found in wanted}
    return made
