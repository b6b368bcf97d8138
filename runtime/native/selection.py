"""Which files of the kernel are needed for what: by the symbols that they use, and by those they define."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

from ..methods import KERNEL_METHODS

METHOD_FILES = {name: row.file for name, row in KERNEL_METHODS.items() if row.file}
"""Where methods are defined whose names a macro puts together."""

_DEFINITION = re.compile(r"^(?!static|typedef|extern|#|\s)[\w\s*]*?\b(mech_\w+|fmu_\w+)\s*(?:\(|=|\[)", re.M)
_USE = re.compile(r"\b(?:mech|fmu)_\w+\b")
_TABLE = re.compile(r"(const mech_method \*const mech_methods\[\] = \{)[^}]*(\};)")
_NO_EVENTS = """\
/* Nothing switches in this model: the files that events take are left out. */
#include "events.h"

const mech_event_support *const mech_events = NULL;
"""
_COMMENT = re.compile(r"/\*.*?\*/", re.S)


def fitted(
    kernel: Mapping[str, str], *, methods: Sequence[str] | None, states: int, switches: bool
) -> dict[str, str]:
    """Return the files of the kernel as they are for models of so many states: with these methods (None: all, for any
    number of states), and without what only events take where nothing switches."""
    files = dict(kernel)
    if methods is not None:
        files["methods.c"] = _methods(files["methods.c"], methods)
        files["explicit_step.h"] = f"#define MECH_STATES {states}\n{files['explicit_step.h']}"
    if not switches:
        files["events.c"] = _NO_EVENTS
    return files


def defined(texts: Iterable[str]) -> Iterator[str]:
    """Yield what files define for others, and what they declare."""
    for text in texts:
        yield from (found[1] for found in _DEFINITION.finditer(_COMMENT.sub("", text)))


def needed(kernel: Mapping[str, str], users: Iterable[str]) -> dict[str, str]:
    """Return the files of the kernel that the texts of its ``users`` need, directly or not."""
    plain = {name: _COMMENT.sub("", text) for name, text in kernel.items()}
    where = {f"mech_{method}": file for method, file in METHOD_FILES.items()}
    for name, text in plain.items():
        if name.endswith(".c"):
            for found in _DEFINITION.finditer(text):
                if found[0].endswith("=") or not _declares(text, found.end()):
                    where[found[1]] = name
    reached: set[str] = set()
    pending = [_COMMENT.sub("", text) for text in users]
    while pending:
        text = pending.pop()
        used = {where[s] for s in _USE.findall(text) if s in where}
        used |= {h for h in re.findall(r'#include "([^"]+)"', text) if h in kernel}
        for name in used - reached:
            reached.add(name)
            # a header offers more than a file uses: only its own includes count
            pending.append(
                "\n".join(re.findall(r"#include.*", plain[name])) if name.endswith(".h") else plain[name]
            )
    return {name: kernel[name] for name in reached}


def _methods(text: str, names: Sequence[str]) -> str:
    entries = ", ".join(f"&mech_{name}" for name in names)
    changed, count = _TABLE.subn(rf"\1 {entries} \2", text)
    if count != 1:
        raise RuntimeError("methods.c does not list the methods in one table")
    return changed


def _declares(text: str, position: int) -> bool:
    """Whether a semicolon comes before any brace: a prototype."""
    return min(text.find(";", position) % (1 << 60), 1 << 59) < min(
        text.find("{", position) % (1 << 60), 1 << 59
    )
