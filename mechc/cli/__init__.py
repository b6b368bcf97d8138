"""The command line: one module for each command, imported when it is asked for."""

from __future__ import annotations

from .main import main

__all__ = ["main"]
