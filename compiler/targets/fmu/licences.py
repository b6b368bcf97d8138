"""Licences of what an FMU holds: the kernel in its sources, and the headers of the standard."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path

FIRST = """\
This FMU was made from a model. The rights to the model are those of its author.

Code of others in this file, as source text and in the binaries:

- the integration kernel and the interface, sources/*.c and *.h other than model.c and description.c:
  MIT licence, see mechc.txt
- the headers of the Functional Mock-up Interface, fmi{fmi}*.h: 2-Clause BSD licence, see fmi.txt
"""


def header_folder() -> Path:
    """Return where fmpy keeps the headers; it is not imported, which fails on machines that FMI has no name for."""
    spec = find_spec("fmpy")
    assert spec is not None and spec.submodule_search_locations, "mechc depends on fmpy"
    return Path(spec.submodule_search_locations[0]) / "c-code"


def licences(fmi: int) -> dict[str, str]:
    """Return the texts by file name; ``license.txt`` is the one to begin with."""
    import mechc.runtime

    own = Path(mechc.runtime.__file__).parent / "kernel" / "LICENSE"
    header = header_folder() / f"fmi{fmi}Functions.h"
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
