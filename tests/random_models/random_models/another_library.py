"""The same model with another library: the parts that it imports stand in its own file, as a second text has them.

What a part of the library says wrongly, a moment of inertia, a sign, a default, is read by the compiler and by the definition
alike; only parts that were written again, from their documentation alone, can tell.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from random import Random

from random_models.tree import Model, S, statement
from random_models.twins import Twin

FOLDER = Path(__file__).with_name("library")
_MODEL = r"^(?:partial )?model (?P<model>\w+)$.*?^end (?P=model);$"
_FUNCTION = r"^function (?P<function>\w+)\([^)]*\)(?:\s*(?:-> \w+\s*)?=.*?;$|.*?^end (?P=function);$)"
_DEFINITION = re.compile(f"{_MODEL}|{_FUNCTION}", re.MULTILINE | re.DOTALL)
_IMPORT = re.compile(r"import mech\.(\w+)\.\*;")

_TOLD_BY_FORM = tuple(f"{d}energy.{account}" for d in ("", "d ") for account in ("supplied", "dissipated"))
"""Whether a force brakes whatever the motion is seen by its form, which is another one here; what both accounts leave is the energy,
which is compared, and each text's own balance."""


def another_library(model: Model, random: Random) -> Twin | None:
    """Write the parts that a model needs before it, in any order, instead of importing them."""
    imports = [s for s in model.items if s.kind == "import"]
    packages = [found[1] for s in imports if (found := _IMPORT.fullmatch(str(s.parts[0])))]
    if not packages or len(packages) < len(imports):
        return None
    there = {name: text for package in packages for name, text in definitions(package).items()}
    items = [s for s in model.items if s.kind != "import"]
    parts = [_stated(name, there[name]) for name in _needed(items, there)]
    random.shuffle(parts)
    return Twin("another library", Model((*parts, *items)), _TOLD_BY_FORM) if parts else None


@cache
def definitions(package: str) -> dict[str, str]:
    """Return the text of each model and function of a package by its name."""
    text = (FOLDER / f"{package}.mech").read_text(encoding="utf-8")
    return {m["model"] or m["function"]: m[0] for m in _DEFINITION.finditer(text)}


def _needed(items: list[S], there: dict[str, str]) -> list[str]:
    """Return the names of the definitions that statements name, and of those that these name."""
    known = there.keys() - {s.name for s in items}
    needed: set[str] = set()
    texts = [s.text() for s in items]
    while texts:
        new = (known - needed).intersection(re.findall(r"\w+", texts.pop()))
        needed |= new
        texts += [there[name] for name in new]
    return sorted(needed)


def _stated(name: str, text: str) -> S:
    return statement("definition", text, name=name)
