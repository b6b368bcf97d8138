"""From the file of a robot to the text of a model."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path

from msgspec import Struct

from ..diagnostics import Reporter
from ..parser import parse
from ..printing.printer import format_file
from ..source import SourceFile
from .mjcf import read_mjcf
from .urdf import read_urdf
from .writing import Parts, Wishes, Writer
from .xml import NotRead, XmlElement, read_xml


class Imported(Struct, frozen=True):
    """``text``: the model; ``left_out``: what it does not hold; ``copies``: files that belong beside it, from where they are."""

    text: str
    name: str
    left_out: tuple[str, ...]
    copies: Mapping[str, Path]


Reader = Callable[[XmlElement, Wishes], tuple[Writer, Parts]]
READERS: Mapping[str, tuple[str, Reader]] = {"robot": ("URDF", read_urdf), "mujoco": ("MJCF", read_mjcf)}
"""By the first element of a file: the format, and what reads it."""


def imported(text: str, wishes: Wishes, reporter: Reporter) -> Imported:
    """Make a model of the text of a robot. Raises CompileError for a file that is none, or is wrong."""
    try:
        root = read_xml(expanded(text, wishes))
        format_, reader = READERS[root.tag]
        writer, parts = reader(root, wishes)
    except NotRead as wrong:
        place = f"line {wrong.line} of " if wrong.line else ""
        raise reporter.fail(
            "E0101", f"{place}'{wishes.source}': {wrong.message}", None, help=wrong.help
        ) from None
    name = _model_name(root.attributes.get("name") or root.attributes.get("model") or wishes.source.stem)
    while any(name in names for names in parts.values()):
        name += "Robot"
    left_out = writer.left_out()
    head = [f"{wishes.source.name}, {format_}, as a model."]
    if writer.changed:
        head += ["Names that changed:", *(f"  {old}: {new}" for old, new in writer.changed.items())]
    if left_out:
        head += ["The file says more than the model holds:", *(f"  {one}" for one in left_out)]
    lines = [
        *(f"// {line}" for line in head),
        *(f"import mech.{file}.{{{', '.join(names)}}};" for file, names in parts.items() if names),
        "",
        f"model {name}",
        *writer.statements,
        "experiment(stop = 1 s);",
        f"end {name};",
    ]
    made = "\n".join(lines) + "\n"
    return Imported(
        format_file(parse(SourceFile(f"{name}.mech", made), reporter)), name, tuple(left_out), writer.copies
    )


def expanded(text: str, wishes: Wishes) -> str:
    """Return a text without macros of xacro. Raises NotRead."""
    if "<xacro:" not in re.sub(r"<!--.*?-->", "", text, flags=re.S):
        return text
    try:
        import xacrodoc
    except ImportError:
        raise NotRead(
            "the file is written with xacro",
            help="pip install xacrodoc; or write it out: xacro FILE > robot.urdf",
        ) from None
    xacrodoc.packages.look_in([str(path) for path in wishes.packages])
    try:
        return str(xacrodoc.XacroDoc.from_file(str(wishes.source), resolve_packages=False).to_urdf_string())
    except Exception as error:  # of the macros, in any way
        raise NotRead(f"xacro cannot write it out: {error}") from None


def _model_name(given: str) -> str:
    """Make the name of a model: ``my-robot`` gives ``MyRobot``."""
    name = "".join(word[:1].upper() + word[1:] for word in re.split(r"[^A-Za-z0-9]+", given) if word)
    return name if name[:1].isalpha() else f"Robot{name}"
