"""The runtime imports what it uses, when it uses it."""

from __future__ import annotations

import subprocess
import sys

HEAVY = ("scipy", "sympy", "matplotlib", "pandas", "platformdirs", "mechc.compiler", "mechc.lang")


def test_importing_the_runtime_loads_nothing_heavy() -> None:
    script = f"import sys, mechc.runtime; print([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
