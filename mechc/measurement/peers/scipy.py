"""Methods of SciPy, on compiled functions (``runtime/integrate/scipy_compiled.py``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...runtime.integrate.scipy_compiled import METHODS, run_peer
from ...runtime.integrate.scipy_methods import PREFIX
from .shared import Library

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...model import CompiledModel
    from ...runtime.reference.work_precision import Peer


def _runs(_model: CompiledModel, _parts: frozenset[str]) -> Mapping[str, Peer]:
    return {PREFIX + name: run_peer for name in METHODS}


SCIPY = Library(
    "scipy", "scipy", "solve_ivp on compiled functions, one ctypes call for each evaluation", _runs
)
