"""A prefix for the names of sources that are linked into one program with those of other FMUs.

The functions of the standard take ``FMI3_FUNCTION_PREFIX`` (or that of FMI 2) by its headers. What else is visible
from one file to another takes it by macros: of the kernel in ``names.h``, the same for all models, and of the model
at the head of the files that use it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

HEADER = "names.h"
MODEL_FILES = ("model.c", "description.c")

_MODEL_FUNCTION = re.compile(r"^EXPORT void (\w+)\(", re.M)
_PREFIX = """\
/* -DFMI3_FUNCTION_PREFIX=Model_ (FMI2_FUNCTION_PREFIX): all names that the linker sees begin so. */
#if defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX)
#define MECH_PREFIX FMI3_FUNCTION_PREFIX
#elif defined(FMI2_FUNCTION_PREFIX) && !defined(FMI2_OVERRIDE_FUNCTION_PREFIX)
#define MECH_PREFIX FMI2_FUNCTION_PREFIX
#endif
"""
_JOIN = """\
#define MECH_JOIN(prefix, name) prefix##name
#define MECH_JOINED(prefix, name) MECH_JOIN(prefix, name)
#define MECH_NAME(name) MECH_JOINED(MECH_PREFIX, name)
"""


def with_prefix(texts: Mapping[str, str], kernel: Iterable[str]) -> dict[str, str]:
    """Return sources whose global names can take a prefix. ``kernel``: the names in all files that are no model's."""
    found = dict(texts)
    own = _macros(_MODEL_FUNCTION.findall(texts["model.c"]))
    for name, text in texts.items():
        if name.endswith(".c"):
            macros = f"#ifdef MECH_PREFIX\n{own}#endif\n" if own and name in MODEL_FILES else ""
            found[name] = f'#include "{HEADER}"\n{macros}{text}'
    found[HEADER] = f"{_PREFIX}\n#ifdef MECH_PREFIX\n{_JOIN}{_macros(kernel)}#endif\n"
    return found


def _macros(names: Iterable[str]) -> str:
    return "".join(f"#define {name} MECH_NAME({name})\n" for name in sorted(set(names)))
