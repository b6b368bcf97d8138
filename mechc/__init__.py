"""Mechanics as energies, bodies and joints in; verified motion out.

``load`` reads a model; see ``Model`` and ``Solution``. Names are imported when first used, so that
``import mechc`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .api import Model as Model
    from .api import load as load
    from .api import loads as loads
    from .lang.diagnostics import CompileError as CompileError
    from .presentation.render import render as render
    from .requests.parse_values import UsageMistake as UsageMistake
    from .requests.tables import table_file as table_file
    from .runtime.outcome import SimulationError as SimulationError
    from .solution import Solution as Solution

__version__ = "0.2.0"

__all__ = [
    "CompileError",
    "Model",
    "SimulationError",
    "Solution",
    "UsageMistake",
    "__version__",
    "load",
    "loads",
    "render",
    "table_file",
]

_HOMES = {
    "load": "mechc.api",
    "loads": "mechc.api",
    "Model": "mechc.api",
    "Solution": "mechc.solution",
    "CompileError": "mechc.lang.diagnostics",
    "render": "mechc.presentation.render",
    "SimulationError": "mechc.runtime.outcome",
    "UsageMistake": "mechc.requests.parse_values",
    "table_file": "mechc.requests.tables",
}


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'mechc' has no attribute '{name}'")
    value: object = getattr(import_module(home), name)
    globals()[name] = value
    return value


def load_ipython_extension(shell: object) -> None:
    """Answer ``%load_ext mechc``: cells that begin with ``%%mech`` hold models."""
    from .presentation.magic import register

    register(shell, import_module(_HOMES["loads"]).loads)


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(_HOMES))
