"""Solving: a ``Problem`` in, a ``Solution`` out. Knows nothing of the language."""

from __future__ import annotations

from .case import SimulationOptions
from .native.build import BuildError, CompilerMissing
from .outcome import Outcome, SimulationError
from .problem import Problem
from .results.quantities import Results
from .results.solution import Solution
from .studies.simulate import Sweep, simulate, simulate_sweep

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
