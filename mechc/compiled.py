"""A source text compiled: the problems made of it, and the same text with other structural parameters."""

from __future__ import annotations

import functools
from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct, field

from .compiler.compilation import Compilation
from .lang.source import SourceFile
from .requests.parse_values import (
    Given,
    Scalar,
    UsageMistake,
    elements_of,
    one_of,
    plain,
    read_value,
    structural_value,
)

if TYPE_CHECKING:
    from .compiler.flat.model import FlatModel
    from .compiler.outline import Plan
    from .requests.request import Asked
    from .runtime.problem import Problem
    from .runtime.studies.study import Study

Exact = Fraction | bool | str
"""A structural value: numbers exactly, in SI."""


class Code(Struct, eq=False):
    """One compilation with the problems made of it, and the same source with other structural parameters."""

    source: SourceFile
    folder: Path
    model: str | None
    structural: dict[str, Exact]
    compilation: Compilation
    keep: frozenset[str] = frozenset()
    remembered: bool = False
    """Whether compilations are kept for other processes (compilation_cache.py)."""
    formulas: tuple[tuple[str, str], ...] = ()
    """Outputs that a question adds: names and texts."""
    twin: bool = False
    """Whether it is no longer what the text says: a flat model that was made of another one."""
    problems: dict[tuple[bool, bool, frozenset[str]], Problem] = field(default_factory=dict)
    lanes: dict[tuple[object, ...], Path] = field(default_factory=dict)
    variants: dict[tuple[tuple[str, object], ...], Code] = field(default_factory=dict)
    kept: dict[frozenset[str], Code] = field(default_factory=dict)
    asked: dict[tuple[tuple[str, str], ...], Code] = field(default_factory=dict)
    plans: dict[str | None, Plan | None] = field(default_factory=dict)
    """Experiments by the names that were asked for."""
    posed: dict[tuple[int, str | None, bool], tuple[Asked, Problem, Study]] = field(default_factory=dict)
    """The last questions that were put, by their identity, with what answers them, without values."""
    single: frozenset[str] = frozenset()
    """What ``freely`` gives, once somebody has asked for it."""
    units: dict[str, str] = field(default_factory=dict)
    """The SI unit of everything that may be set, once somebody has asked for it."""
    mechanical: tuple[frozenset[str], dict[str, int]] | None = None
    """What ``rotations_and_drives`` gives, once somebody has asked for it."""
    angles: str | None = None
    """The unit in which pictures show angles that state none, once somebody has asked for it."""

    @staticmethod
    def make(
        source: SourceFile,
        folder: Path,
        model: str | None,
        structural: dict[str, Exact],
        keep: frozenset[str],
        formulas: tuple[tuple[str, str], ...] = (),
        *,
        remembered: bool = False,
    ) -> Code:
        def form() -> Compilation:
            from .compiler.pipeline import compile_source

            return compile_source(
                source, model=model, structural=structural, search=(folder,), parts=keep, formulas=formulas
            )

        if remembered:
            from .compilation_cache import kept_or_formed

            asked = (str(folder), model, sorted(structural.items()), sorted(keep), formulas)
            compilation = kept_or_formed(source, asked, keep, form)
        else:
            compilation = form()
        return Code(source, folder, model, structural, compilation, keep, remembered, formulas)

    def of(self, flat: FlatModel, parts: frozenset[str] = frozenset()) -> Code:
        """Return the code of a flat model that was made of this one's, which stands in no text. Raises CompileError."""
        from .compiler.pipeline import compile_flat

        made = compile_flat(self.compilation, flat, parts)
        return Code(self.source, self.folder, self.model, self.structural, made, parts, twin=True)

    def rotations_and_drives(self) -> tuple[frozenset[str], dict[str, int]]:
        """Return the names of rotations, and those of prescribed coordinates with the lines of their drives."""
        if self.mechanical is None:
            system = self.compilation.system
            driven: dict[str, int] = {}
            for row in system.drives:
                line = row.origin.span.file.position(row.origin.span.start)[0]
                driven |= {system.q[k].name: line for k in row.q if system.q[k].name not in driven}
            rotations = (c.variable.name for c in system.symbols.coordinates if c.is_rotation)
            self.mechanical = frozenset(rotations), driven
        return self.mechanical

    def settable_units(self) -> Mapping[str, str]:
        """Return the SI unit of everything that may be set."""
        if not self.units:
            equations = self.compilation.equations
            settable = (*equations.parameters, *equations.states, *equations.inputs)
            settable += tuple(entry for entry in equations.discretes if entry.kind == "end")
            self.units.update((e.name, e.unit) for e in settable if e.kind not in ("account", "internal"))
        return self.units

    def freely(self) -> frozenset[str]:
        """Return the names of numbers that may be set each by itself: none of rotations, none that compiles the model again."""
        if not self.single:
            units, (rotations, _) = self.settable_units(), self.rotations_and_drives()
            whole = {one for name in rotations for one in elements_of(name, units)}
            self.single = frozenset(units.keys() - whole - self.compilation.outline.structural.keys())
        return self.single

    def with_parts(self, parts: frozenset[str]) -> Code:
        """Return the same with parts built whether they are needed or not."""
        if parts == self.compilation.parts:
            return self
        if parts not in self.kept:
            self.kept[parts] = (
                self.of(self.compilation.flat, parts)
                if self.twin
                else Code.make(self.source, self.folder, self.model, self.structural, parts, self.formulas)
            )
        return self.kept[parts]

    def variant(self, structural: dict[str, Exact]) -> Code:
        if structural == self.structural:
            return self
        if self.twin:
            raise UsageMistake("a model that was made of another has its structural parameters from there")
        key = tuple(sorted(structural.items()))
        if key not in self.variants:
            self.variants[key] = Code.make(
                self.source,
                self.folder,
                self.model,
                structural,
                self.keep,
                self.formulas,
                remembered=self.remembered,
            )
        return self.variants[key]


@functools.lru_cache(maxsize=8)
def compiled_again(
    name: str,
    text: str,
    folder: Path,
    model: str | None,
    structural: tuple[tuple[str, Exact], ...],
    keep: frozenset[str],
) -> Code:
    """Compile what came from another process, once for all tasks that it sends."""
    return Code.make(SourceFile(name, text), folder, model, dict(structural), keep)


def structural_names(source: SourceFile) -> Sequence[str]:
    """Return the structural parameters of all models of a file: they must be known before it is compiled."""
    from .lang import ast
    from .lang.diagnostics import Reporter
    from .lang.parser import parse

    names: list[str] = []
    pending: list[object] = list(parse(source, Reporter()).items)
    while pending:
        item = pending.pop()
        match item:
            case ast.Model():
                pending.extend(item.body)
            case ast.Parameter(structural=True):
                names.append(item.name)
    return names


def exact_value(name: str, value: Given) -> Exact:
    """Return a structural value as the compiler wants it: numbers exactly, in SI."""
    value = plain(value)
    if not isinstance(value, (str, int, float)):
        raise UsageMistake(f"the structural parameter '{name}' takes one value, not {value!r}")
    scalar: Scalar = structural_value(value)
    if isinstance(scalar, str) and scalar[:1].isdigit():
        number = read_value(scalar)
        return Fraction(number.numbers[0]) * (number.unit.factor if number.unit else 1)
    return scalar if isinstance(scalar, (bool, str)) else Fraction(scalar)


def check_parts(parts: Collection[str]) -> None:
    """Raise UsageMistake for a name that is no part of a model."""
    if not parts:
        return
    from .compiler.equations.compliance import COMPLIANCE
    from .compiler.equations.needs import PARTS

    if isinstance(parts, str):
        raise UsageMistake(f"parts are a collection of names, not the text '{parts}'", f'as in {{"{parts}"}}')
    for part in parts:
        one_of(part, (*PARTS, COMPLIANCE), "part")
