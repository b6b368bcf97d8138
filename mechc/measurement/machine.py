"""What measurements are made on, in words."""

from __future__ import annotations

import platform
from datetime import datetime
from pathlib import Path

from ..runtime.native.build import find_compiler


def described() -> str:
    """Say date, processor, system, C compiler and Python in one line."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        names = [
            r.partition(":")[2].strip() for r in info.read_text().splitlines() if r.startswith("model name")
        ]
        cpu = f"{len(names)} x {names[0]}" if names else cpu
    compiler = find_compiler()
    cc = compiler.version.splitlines()[0] if compiler else "no C compiler"
    date = datetime.now().astimezone().date().isoformat()
    return f"{date}; {cpu}; {platform.system()}; {cc}; Python {platform.python_version()}"
