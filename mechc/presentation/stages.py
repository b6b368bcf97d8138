"""The texts of ``mechc show``: what each stage of the compiler made of a model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from fractions import Fraction
from pathlib import Path

from msgspec import Struct

from ..lang.source import SourceFile, Span
from ..requests.parse_values import Given


def show(stage: str, file: str, model: str | None, settings: Mapping[str, Given]) -> str:
    """Return a model as text after a stage: ast, flat, system, equations or program."""
    from ..lang.read import read_model

    if stage == "ast":
        from ..lang.diagnostics import Reporter
        from ..lang.parser import parse

        return tree(parse(read_model(file), Reporter()))
    from ..model import CompiledModel, model_of

    text = read_model(file)
    compilation = model_of(CompiledModel, text, Path(file).parent, model, settings, ()).compilation
    match stage:
        case "flat":
            from ..compiler.flat.show import show as show_flat

            return show_flat(compilation.flat).rstrip("\n")
        case "system":
            from ..compiler.mechanics.show import show as show_system

            return show_system(compilation.system).rstrip("\n")
        case "equations":
            from ..compiler.equations.show import show as show_equations

            return show_equations(compilation.equations).rstrip("\n")
        case "program":
            from ..compiler.program.show import show as show_program

            return show_program(compilation.program).rstrip("\n")
    raise AssertionError(f"unknown stage {stage}")


def tree(node: object) -> str:
    """Return a syntax tree as indented text: one line for each node, its plain values after its name."""
    return "\n".join(_tree(node, "", 0))


def _tree(node: object, label: str, depth: int) -> Iterator[str]:
    """Yield the lines of a node. Places in the text are left out, and what is empty."""
    lead = "  " * depth + (f"{label}: " if label else "")
    if not isinstance(node, Struct):
        yield lead + _plain(node)
        return
    plain: list[str] = []
    deeper: list[tuple[str, object]] = []
    for name in node.__struct_fields__:
        value = getattr(node, name)
        if isinstance(value, (Span, SourceFile)) or value is None or value in ((), "", False):
            continue
        if isinstance(value, Struct) or (
            isinstance(value, tuple) and any(isinstance(item, Struct) for item in value)
        ):
            deeper.append((name, value))
        else:
            plain.append(f"{name}={_plain(value)}")
    yield lead + " ".join([type(node).__name__, *plain])
    for name, value in deeper:
        if isinstance(value, tuple):
            for i, item in enumerate(value, start=1):
                yield from _tree(item, f"{name}[{i}]", depth + 1)
        else:
            yield from _tree(value, name, depth + 1)


def _plain(value: object) -> str:
    match value:
        case Fraction():
            return str(value)
        case Enum():
            return value.name.lower()
        case tuple():
            return "(" + ", ".join(_plain(item) for item in value) + ")"
        case _:
            return repr(value)
