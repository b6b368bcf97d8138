"""Solving: a ``Problem`` in, a ``Solution`` out. Knows nothing of the language."""

from __future__ import annotations

from .case import SimulationOptions
from .native.build import BuildError, CompilerMissing
from .outcome import Outcome, SimulationError
from .problem import Problem
from .results.quantities import Results
from .results.solution import Solution
from .studies.kinds.motion import Simulate, simulate
from .studies.kinds.sweep import Runs, Sweep
from .studies.study import Answer, Study, solve

__all__ = [
    "Answer",
    "BuildError",
    "CompilerMissing",
    "Outcome",
    "Problem",
    "Results",
    "Runs",
    "Simulate",
    "SimulationError",
    "SimulationOptions",
    "Solution",
    "Study",
    "Sweep",
    "simulate",
    "solve",
]
