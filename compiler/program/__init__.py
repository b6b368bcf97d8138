"""Straight-line functions over arrays, ready to be printed in any target language."""

from .chunk import chunk
from .lower import lower
from .model import Program, ProgramFunction
from .show import show
from .verify import verify

__all__ = ["Program", "ProgramFunction", "chunk", "lower", "show", "verify"]
