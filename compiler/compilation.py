"""A model after every stage, with room for all that is made of it: problems, libraries, the same text compiled in other ways."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from mechc.lang import ast
    from mechc.lang.diagnostics import Diagnostic
    from mechc.lang.source import SourceFile
    from mechc.runtime.problem import Problem

    from .equations.model import Equations
    from .flat.model import FlatModel
    from .mechanics.system import MechanicalSystem
    from .outline import Exact, Outline, Summary
    from .program.model import Program


class Request(Struct, frozen=True):
    """What is asked of the compiler: one model of a text. ``search``: folders of imports; ``structural``: values by name, in the
    order of names; ``parts`` that are built whether they are needed or not (equations/needs.py); ``formulas``: names and texts of
    further outputs; ``remembered``: other processes may take what is formed (compilation_cache.py)."""

    source: SourceFile
    search: tuple[Path, ...] = ()
    model: str | None = None
    structural: tuple[tuple[str, Exact], ...] = ()
    parts: frozenset[str] = frozenset()
    formulas: tuple[tuple[str, str], ...] = ()
    remembered: bool = False


class Compilation:
    """A model after every stage, with the warnings and notes found on the way.

    Stages were ``formed``, or are read from the bytes ``stored`` when somebody asks (stored.py), so that the compiler is not even
    imported where nobody does; what is in neither is formed of what is. ``stored_as`` tells its program from all others, and is empty
    where it was formed. ``derived``: of a flat model that was made of another one, so that no text says it.
    """

    def __init__(
        self,
        request: Request,
        formed: Mapping[str, object] | None = None,
        *,
        stored: Mapping[str, bytes] | None = None,
        stored_as: str = "",
        diagnostics: tuple[Diagnostic, ...] = (),
        derived: bool = False,
    ) -> None:
        self.request = request
        self.stored_as = stored_as
        self.diagnostics = diagnostics
        self.derived = derived
        self.is_stored = stored is not None
        self.variants: dict[Request, Compilation] = {}
        """The same model compiled in other ways (compilation_cache.py); all of them share it."""
        self._stored = stored or {}
        self.problems: dict[tuple[bool, bool, frozenset[str]], Problem] = {}
        self.lanes: dict[tuple[object, ...], Path] = {}
        vars(self).update(formed or {})

    @property
    def source(self) -> SourceFile:
        return self.request.source

    @cached_property
    def parts(self) -> frozenset[str]:
        """The parts that were built whether they are needed or not."""
        return self.request.parts | self.outline.parts

    @cached_property
    def outline(self) -> Outline:
        from .outline import outline_of, read_outline

        return read_outline(self._stored["outline"]) if self._stored else outline_of(self.flat)

    @cached_property
    def summary(self) -> Summary:
        from .outline import read_summary, summary_of

        return read_summary(self._stored["summary"]) if self._stored else summary_of(self.program)

    @cached_property
    def flat(self) -> FlatModel:
        if "flat" in self._stored:
            from .flat.model import FlatModel
            from .stored import read

            return read(self._stored["flat"], FlatModel)
        from mechc.lang.diagnostics import Reporter

        from .flat.flatten import flat_model_of
        from .interpreter import compiling

        asked = self.request
        with compiling():
            return flat_model_of(
                asked.source,
                Reporter(),
                model=asked.model,
                structural=asked.structural,
                search=asked.search,
                formulas=asked.formulas,
            )[1]

    @cached_property
    def equations(self) -> Equations:
        from .equations.model import Equations
        from .stored import read

        return read(self._stored["equations"], Equations)

    @cached_property
    def program(self) -> Program:
        from .program.model import Program
        from .stored import read

        return read(self._stored["program"], Program)

    @cached_property
    def ast(self) -> ast.File:
        from mechc.lang.diagnostics import Reporter
        from mechc.lang.parser import parse

        return parse(self.source, Reporter())

    @cached_property
    def system(self) -> MechanicalSystem:
        from mechc.lang.diagnostics import Reporter

        from .interpreter import compiling
        from .mechanics.build import build
        from .verification import verified

        with compiling():
            return verified(build(self.flat, Reporter()))

    def stages(self, *, alone: bool = False) -> dict[str, bytes]:
        """Return the stages as bytes, of which another process makes the same compilation. ``alone``: without the files that the text
        imports, so the flat model is among them; with them, to form it again takes no longer than to read it."""
        from . import outline
        from .stored import write

        written = {name: outline.write(getattr(self, name)) for name in ("outline", "summary")}
        names = ("flat", "equations", "program") if alone else ("equations", "program")
        return written | {name: write(getattr(self, name)) for name in names}

    @cached_property
    def rotations(self) -> frozenset[str]:
        """The names of rotations."""
        return frozenset(c.variable.name for c in self.system.symbols.coordinates if c.is_rotation)

    @cached_property
    def drives(self) -> Mapping[str, int]:
        """The names of prescribed coordinates with the lines of their drives."""
        driven: dict[str, int] = {}
        for row in self.system.drives:
            line = row.origin.span.file.position(row.origin.span.start)[0]
            driven |= {self.system.q[k].name: line for k in row.q if self.system.q[k].name not in driven}
        return driven

    @cached_property
    def settable_units(self) -> Mapping[str, str]:
        """The SI unit of everything that may be set."""
        equations = self.equations
        settable = (*equations.parameters, *equations.states, *equations.inputs)
        settable += tuple(entry for entry in equations.discretes if entry.kind == "end")
        return {e.name: e.unit for e in settable if e.kind not in ("account", "internal")}
