"""Licences of what an FMU holds: the kernel in its sources, and the headers of the standard."""

from __future__ import annotations

import re
from pathlib import Path

FIRST = """\
This FMU was made from a model. The rights to the model are those of its author.

Code of others in this file, as source text and in the binaries:

- the integration kernel and the interface, sources/*.c and *.h other than model.c and description.c:
  MIT licence, see mechc.txt
- the headers of the Functional Mock-up Interface, fmi{fmi}*.h: 2-Clause BSD licence, see fmi.txt
"""


def licences(fmi: int) -> dict[str, str]:
    """Return the texts by file name; ``license.txt`` is the one to begin with."""
    import fmpy

    import mechc.runtime

    own = Path(mechc.runtime.__file__).parent / "kernel" / "LICENSE"
    header = Path(fmpy.__file__).parent / "c-code" / f"fmi{fmi}Functions.h"
    return {
        "license.txt": FIRST.format(fmi=fmi),
        "mechc.txt": own.read_text(encoding="utf-8"),
        "fmi.txt": bsd_notice(header.read_text(encoding="utf-8")),
    }


def bsd_notice(header: str) -> str:
    """Cut the copyright lines and the licence out of a header. Raises ValueError if there are none."""
    found = re.search(r"^[ \t]*Copyright.*?POSSIBILITY\s+OF\s+SUCH\s+DAMAGE\.", header, re.S | re.M)
    if not found:
        raise ValueError("the header of the standard holds no licence")
    rows = [re.sub(r"^\s*\*? ?", "", row).rstrip() for row in found[0].splitlines()]
    return "\n".join(rows) + "\n"
