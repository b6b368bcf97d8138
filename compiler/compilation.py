"""A model after every stage: formed now, or read from bytes that were kept."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from mechc.lang import ast
    from mechc.lang.diagnostics import Diagnostic
    from mechc.lang.source import SourceFile

    from .equations.model import Equations
    from .flat.model import FlatModel
    from .mechanics.system import MechanicalSystem
    from .outline import Outline, Summary
    from .program.model import Program


class Compilation(Protocol):
    """One model after every stage, with the warnings and notes found on the way."""

    @property
    def source(self) -> SourceFile: ...
    @property
    def ast(self) -> ast.File: ...
    @property
    def outline(self) -> Outline: ...
    @property
    def summary(self) -> Summary: ...
    @property
    def flat(self) -> FlatModel: ...
    @property
    def system(self) -> MechanicalSystem: ...
    @property
    def equations(self) -> Equations: ...
    @property
    def program(self) -> Program: ...
    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]: ...
    @property
    def parts(self) -> frozenset[str]: ...
    @property
    def kept_as(self) -> str: ...  # what tells its program from all others; empty where it was formed


class StoredCompilation:
    """A compilation without warnings whose stages are read when they are asked for (stored.py), so that the compiler is
    not even imported where nobody asks. What is not stored is formed of what is."""

    diagnostics: tuple[Diagnostic, ...] = ()

    def __init__(
        self, source: SourceFile, stages: Mapping[str, bytes], parts: frozenset[str], kept_as: str = ""
    ) -> None:
        self.source = source
        self.parts = parts
        self.kept_as = kept_as
        self._stages = stages

    @cached_property
    def outline(self) -> Outline:
        from .outline import read_outline

        return read_outline(self._stages["outline"])

    @cached_property
    def summary(self) -> Summary:
        from .outline import read_summary

        return read_summary(self._stages["summary"])

    @cached_property
    def flat(self) -> FlatModel:
        from .flat.model import FlatModel
        from .stored import read

        return read(self._stages["flat"], FlatModel)

    @cached_property
    def equations(self) -> Equations:
        from .equations.model import Equations
        from .stored import read

        return read(self._stages["equations"], Equations)

    @cached_property
    def program(self) -> Program:
        from .program.model import Program
        from .stored import read

        return read(self._stages["program"], Program)

    @cached_property
    def ast(self) -> ast.File:
        from mechc.lang.diagnostics import Reporter
        from mechc.lang.parser import parse

        return parse(self.source, Reporter())

    @cached_property
    def system(self) -> MechanicalSystem:
        from mechc.lang.diagnostics import Reporter

        from .gc_pause import uncollected
        from .mechanics.build import build
        from .recursion import deep_recursion
        from .verification import verified

        with uncollected(), deep_recursion():
            return verified(build(self.flat, Reporter()))


def stages_of(compilation: Compilation) -> dict[str, bytes]:
    """Return the stages as bytes, for ``StoredCompilation``."""
    from . import outline
    from .stored import write

    told = {name: outline.write(getattr(compilation, name)) for name in ("outline", "summary")}
    return told | {name: write(getattr(compilation, name)) for name in ("flat", "equations", "program")}
