"""What the FMU of a model is made of, beside that of ``--keep-all``: files, functions and capabilities."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from msgspec import Struct

from ..compiler.equations.needs import EVERYTHING
from ..compiler.targets.fmu.export import make_package, start_of
from ..exporting import ready_code
from ..presentation.style import Style
from .export import equations_for

if TYPE_CHECKING:
    from ..model import CompiledModel

INTERFACES = ("ModelExchange", "CoSimulation")
WIDTH = 100


class FmuAccount(Struct, frozen=True):
    """Bytes of the binary and of the source files by name; operations of the functions; true flags."""

    binary: int
    sources: Mapping[str, int]
    functions: Mapping[str, int]
    capabilities: tuple[str, ...]


def account(model: CompiledModel) -> FmuAccount:
    """Build an FMU without running it. Raises CompileError, SimulationError, BuildError, CompilerMissing."""
    chosen = model.for_experiment(None)
    said = chosen.method(None)
    method = said if said and said != "auto" else "dop853"
    start = start_of(ready_code(chosen), None, chosen.settings)
    parts = chosen.compilation.parts
    files = make_package(equations_for(chosen, method), start, fmi=3, method=method, parts=parts).files
    description = ElementTree.fromstring(files["modelDescription.xml"])
    flags = [(name, value) for e in description if e.tag in INTERFACES for name, value in e.items()]
    return FmuAccount(
        sum(len(data) for name, data in files.items() if name.startswith("binaries/")),
        {n.removeprefix("sources/"): len(data) for n, data in files.items() if n.endswith((".c", ".h"))},
        {f.name: f.operations for f in chosen.compilation.program.functions},
        tuple(sorted({name for name, value in flags if value == "true"})),
    )


def fmu_rows(model: CompiledModel, style: Style) -> list[str]:
    """Say what is in the FMU of a model and what was left out, with sizes."""
    lean = account(model.keeping(()))
    full = account(model.keeping(EVERYTHING))
    rows = [style.bold("  files of the FMU, in bytes")]
    rows += _listed("kept", _sized(lean.sources))
    rows += _listed("left out", _sized(_absent(full.sources, lean.sources)))
    rows += ["", style.bold("  functions of the model, in operations")]
    rows += _listed("kept", _sized(lean.functions))
    rows += _listed("left out", _sized(_absent(full.functions, lean.functions)))
    rows += ["", style.bold("  capabilities")]
    rows += _listed("kept", lean.capabilities)
    rows += _listed("left out", [name for name in full.capabilities if name not in lean.capabilities])
    return rows


def fmu_summary(model: CompiledModel) -> dict[str, Any]:
    """Return the same as plain data."""
    lean = account(model.keeping(()))
    full = account(model.keeping(EVERYTHING))
    return {
        "files": dict(lean.sources),
        "files_left_out": _absent(full.sources, lean.sources),
        "functions": dict(lean.functions),
        "functions_left_out": _absent(full.functions, lean.functions),
        "capabilities": list(lean.capabilities),
        "binary": lean.binary,
        "binary_keep_all": full.binary,
    }


def _absent(full: Mapping[str, int], lean: Mapping[str, int]) -> dict[str, int]:
    return {name: size for name, size in full.items() if name not in lean}


def _sized(sizes: Mapping[str, int]) -> list[str]:
    return [f"{name} {size}" for name, size in sizes.items()]


def _listed(word: str, items: Iterable[str]) -> list[str]:
    """Return ``word`` in the margin and the items beside it, without breaks within an item."""
    text = ", ".join(item.replace(" ", "\u00a0") for item in items) or "nothing"
    lines = textwrap.wrap(text, WIDTH - 12)
    return [f"  {word if i == 0 else '':<10}{line}".replace("\u00a0", " ") for i, line in enumerate(lines)]
