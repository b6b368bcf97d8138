"""Straight-line functions over arrays, ready to be printed in any target language."""

from .lower import lower
from .model import Program, ProgramFunction

__all__ = ["Program", "ProgramFunction", "lower"]
