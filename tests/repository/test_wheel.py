"""What is built holds what the sources hold, and nothing that an earlier build left."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_what_an_earlier_build_left_goes(tmp_path: Path) -> None:
    stale = tmp_path / "lib" / "mechc" / "no_longer.py"
    stale.parent.mkdir(parents=True)
    stale.write_text("")
    command = [sys.executable, "setup.py", "-q", "build_py", "--build-lib", str(tmp_path / "lib")]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    assert (tmp_path / "lib" / "mechc" / "api.py").exists()
    assert not stale.exists()
