"""Mutation testing of the checks of runs: faults in mechc, one at a time: does a run speak up that moves energy, and does stress call it right?"""

from __future__ import annotations

from .page import main as main
