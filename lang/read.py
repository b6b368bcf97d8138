"""Files to source text."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

from mechc.suggest import closest

from .diagnostics import Reporter
from .source import SourceFile

IMPORTED = ("robot", "mujoco")
"""Formats that ``mechc import`` turns into models, by their first element."""
_XML = {
    "robot": "a robot in URDF",
    "mujoco": "a robot in MJCF",
    "sdf": "a robot in SDF",
    "fmiModelDescription": "the description of an FMU",
}
"""Formats by their first element."""
LARGEST = 10_000_000
"""Most bytes of a source file."""


def read_source(path: Path | str, reporter: Reporter | None = None) -> SourceFile:
    """Read a file as UTF-8, with or without byte-order mark, and normalise its line ends.

    Raises CompileError for a file that is missing, unreadable, too large, binary or empty.
    """
    reporter = reporter or Reporter()
    return decode(str(path), _bytes(Path(path), reporter), reporter)


def read_model(path: Path | str) -> SourceFile:
    """Read a model, or a robot in another format as one, with a warning that says so. Raises CompileError."""
    reporter = Reporter()
    path = Path(path)
    data = _bytes(path, reporter)
    if _root(data.decode("utf-8", errors="ignore").removeprefix("\ufeff")) not in IMPORTED:
        return decode(str(path), data, reporter)
    from .importing import Wishes, imported

    model = imported(_text(str(path), data, reporter), Wishes(path, path.parent), reporter)
    left = ", and its head lists what the model does not hold" if model.left_out else ""
    warnings.warn(f"{path.name} is read as a model; 'mechc import' writes it as text{left}", stacklevel=2)
    return SourceFile(f"{path} as a model", model.text)


def read_robot(path: Path, reporter: Reporter) -> str:
    """Read the text of a robot in another format. Raises CompileError for what is none."""
    data = _bytes(path, reporter)
    text = _text(str(path), data, reporter)
    if _root(text) not in IMPORTED:
        foreign = _foreign(str(path), text) or "not a robot in URDF or MJCF"
        raise reporter.fail("E0101", f"'{path}' is {foreign}, which is not imported", None)
    return text


def _bytes(path: Path, reporter: Reporter) -> bytes:
    name = str(path)
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)  # a device may be endless, and tells no size
    except OSError as error:
        near = _near(path) if isinstance(error, FileNotFoundError) else ""
        help = f"did you mean '{near}'?" if near else ""
        raise reporter.fail(
            "E0101", f"cannot read '{name}': {_reason(path, error)}", None, help=help
        ) from None
    if len(data) > LARGEST:
        help = "a model is text; large tables belong in a data file"
        raise reporter.fail("E0101", f"'{name}' is too large: more than 10 MB", None, help=help)
    return data


def decode(name: str, data: bytes, reporter: Reporter) -> SourceFile:
    """Turn the bytes of a file into source text. Raises CompileError as ``read_source`` does."""
    text = _text(name, data, reporter)
    foreign = _foreign(name, text)
    if foreign:
        help = "mechc reads models in its own language; 'mechc new NAME' writes one to begin with"
        if _root(text) in IMPORTED:
            help = f"'mechc import {name}' writes it as a model"
        raise reporter.fail("E0101", f"'{name}' is {foreign}, not a model of mechc", None, help=help)
    return SourceFile(name, text)


def _text(name: str, data: bytes, reporter: Reporter) -> str:
    """Return the text of a file with plain line ends. Raises CompileError."""
    if b"\0" in data:
        help = "a model is plain text, written with an editor"
        raise reporter.fail("E0101", f"'{name}' is binary, not text", None, help=help)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        message = f"'{name}' is not UTF-8: byte {data[error.start]:#04x} in line {line}"
        raise reporter.fail("E0101", message, None, help="save it in the encoding UTF-8") from None
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if not text.strip():
        help = "'mechc new NAME' writes a model to begin with"
        raise reporter.fail("E0101", f"'{name}' is empty", None, help=help)
    return text


def _foreign(name: str, text: str) -> str:
    """Say which other format a text is in; empty if it may be a model."""
    if name.endswith(".mo"):
        return "a Modelica file"
    if not text.lstrip().startswith("<"):
        return ""
    return _XML.get(_root(text), "an XML file")


def _root(text: str) -> str:
    """Return the name of the first element of a text in XML."""
    if not text.lstrip().startswith("<"):
        return ""
    root = re.search(r"<([A-Za-z][\w:]*)", re.sub(r"<!--.*?-->", "", text, flags=re.S))
    return root[1] if root else ""


def _near(path: Path) -> str:
    """Return the model beside a missing file that was probably meant."""
    models = sorted(path.parent.glob("*.mech")) if path.parent.is_dir() else []
    named = path.name if path.suffix == ".mech" else f"{path.name}.mech"
    names = [model.name for model in models]
    near = named if named in names else closest(named, names)
    return str(path.with_name(near)) if near else ""


def _reason(path: Path, error: OSError) -> str:
    """Say in plain words why a file cannot be read."""
    match error:
        case FileNotFoundError():
            return "there is no such file"
        case PermissionError():
            return "you are not allowed to"
        case IsADirectoryError():
            return "it is a folder"
    return (error.strerror or str(error)).casefold() if not path.is_dir() else "it is a folder"
