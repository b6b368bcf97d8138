"""Integrators of others beside the kernel, in one process and on the same model: one file each, one row of the table each."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from ...runtime.outcome import SimulationError
from ...suggest import suggest
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
    name: f"{program} takes bodies, joints and contacts of its own, and no equations (bench/peers compares with it on models written for it)"
    for name, program in {"mujoco": "MuJoCo", "exudyn": "Exudyn"}.items()
}
"""Why others are not among them."""
LIBRARY_OF = {"cvode": "sundials"}
"""Libraries by names of their methods."""
UNIT = "integrates and finds events itself; what happens at one, and what brings a state back onto constraints, it asks the FMU for Model Exchange that mechc writes"


def installed(library: Library) -> bool:
    return importlib.util.find_spec(library.package) is not None


def libraries_of(methods: Iterable[str]) -> list[Library]:
    """Return the libraries of methods."""
    names = {LIBRARY_OF.get(name, name) for method in methods for name in (method.partition(":")[0],)}
    return [row for row in LIBRARIES.values() if row.name in names]


def absent() -> list[str]:
    """Return the libraries that are not installed."""
    return [row.name for row in LIBRARIES.values() if not installed(row)]


def left_out(names: Iterable[str]) -> dict[str, str]:
    """Return why libraries among the names are not measured: not installed, or of another kind."""
    found = {}
    for name in names:
        library = name.partition(":")[0]
        row = LIBRARIES.get(LIBRARY_OF.get(library, library))
        if row is not None and not installed(row):
            found[name] = f"is not installed (pip install {row.package})"
        elif library in OTHERS:
            found[name] = OTHERS[library]
    return found


def peers(
    model: CompiledModel, names: Iterable[str] | None = None, parts: frozenset[str] = JACOBIAN
) -> dict[str, Peer]:
    """Return the runs of a model by libraries, by the names of their methods: all that are installed without ``names``.

    ``parts``: those that the case has been compiled with. A name is that of a library, or of one method as in ``scipy:Radau``; those
    that are ``left_out`` have none. Raises SimulationError for others.
    """
    if names is None:
        return {
            name: peer
            for row in LIBRARIES.values()
            if installed(row)
            for name, peer in row.runs(model, parts).items()
        }
    names = list(names)
    absent_ones = left_out(names)
    made: dict[str, Peer] = {}
    for name in (name for name in names if name not in absent_ones):
        library, _, method = name.partition(":")
        row = LIBRARIES.get(LIBRARY_OF.get(library, library))
        if row is None:
            raise SimulationError(
                f"there is no peer '{library}': {', '.join(LIBRARIES)} are known{suggest(library, LIBRARIES)}"
            )
        runs = row.runs(model, parts)
        wanted = [found for found in runs if not method or found.partition(":")[2] == method]
        if not wanted:
            raise SimulationError(f"there is no peer '{name}': {row.name} has {', '.join(runs)}")
        made |= {found: runs[found] for found in wanted}
    return made


def modes_of(methods: Iterable[str], by_unit: bool) -> dict[str, str]:
    """Return how the libraries of methods are set up; ``by_unit``: of a model that they get as one (exchange.py)."""
    rows = libraries_of(methods)
    if not by_unit:
        return {row.name: row.mode for row in rows}
    modes = {row.name: f"{row.mode}; {row.by_unit}" if row.by_unit else row.mode for row in rows}
    return modes | ({"each of them": UNIT} if modes else {})
