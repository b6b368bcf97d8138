"""Pages are made from the mechc beside them, and from no other that happens to be installed."""

from __future__ import annotations

import sys
from pathlib import Path

import mechc

ROOT = Path(__file__).resolve().parent.parent


def require_own_installation() -> None:
    """End the process if the mechc that is imported lies elsewhere."""
    if not Path(mechc.__file__).resolve().is_relative_to(ROOT):
        sys.exit(
            f"this page would be made from another mechc, {mechc.__file__}: "
            "install this one (pip install -e .), or put its folder into PYTHONPATH"
        )
