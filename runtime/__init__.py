"""Solving: a ``Problem`` in, a ``Solution`` out. Knows nothing of the language."""

from __future__ import annotations

from .build import BuildError, CompilerMissing
from .case import SimulationOptions
from .outcome import Outcome, SimulationError
from .problem import Problem
from .results import Results
from .simulate import Sweep, simulate, simulate_sweep
from .solution import Solution

__all__ = [
    "BuildError",
    "CompilerMissing",
    "Outcome",
    "Problem",
    "Results",
    "SimulationError",
    "SimulationOptions",
    "Solution",
    "Sweep",
    "simulate",
    "simulate_sweep",
]
