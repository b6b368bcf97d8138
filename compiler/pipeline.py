"""The stages in order: one line for each."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.diagnostics import Diagnostic, Reporter
from mechc.lang.grammar.keywords import KEYWORDS
from mechc.lang.parser import parse
from mechc.lang.source import SourceFile

from .compilation import Compilation
from .equations.adjoints import adjoint_equations
from .equations.assemble import assemble
from .equations.model import Equations
from .equations.rows.crowd import check_forces_have_formulas
from .equations.solve.shares import check_derivatives
from .equations.tangents import tangent_equations
from .flat.flatten import flatten
from .flat.model import FlatModel
from .gc_pause import uncollected
from .mechanics.build import build
from .mechanics.system import MechanicalSystem
from .program.lower import lower
from .program.model import Program
from .program.series import with_series
from .recursion import deep_recursion
from .verification import verified

if TYPE_CHECKING:
    from mechc.runtime.problem import Adjoint, Directions

    from .outline import Outline, Summary

Structural = Mapping[str, Fraction | bool | str]


class Formed(Struct, frozen=True, dict=True):
    """A compilation that was formed just now."""

    source: SourceFile
    ast: ast.File
    flat: FlatModel
    system: MechanicalSystem
    equations: Equations
    program: Program
    diagnostics: tuple[Diagnostic, ...]
    parts: frozenset[str] = frozenset()
    kept_as: str = ""

    @cached_property
    def outline(self) -> Outline:
        from .outline import outline_of

        return outline_of(self.flat)

    @cached_property
    def summary(self) -> Summary:
        from .outline import summary_of

        return summary_of(self.program)


def compile_source(
    source: SourceFile,
    *,
    model: str | None = None,
    structural: Structural | None = None,
    search: Sequence[Path] = (),
    by_value: bool = True,
    parts: Collection[str] = (),
    formulas: Collection[tuple[str, str]] = (),
) -> Formed:
    """Compile one model of a source text. Raises CompileError with every diagnostic found so far.

    ``parts`` are built whether the equations need them or not (equations/needs.py). ``formulas``: names and texts of
    outputs that are asked for beside those of the model.
    """
    reporter = Reporter()
    with uncollected(), deep_recursion():
        try:
            tree = parse(source, reporter)
            further = tuple(_output(name, text, reporter) for name, text in formulas)
            flat = verified(
                flatten(
                    tree,
                    reporter,
                    model=model,
                    structural=structural or {},
                    search=tuple(search),
                    further=further,
                )
            )
            return _formed(source, tree, flat, reporter, by_value=by_value, parts=parts)
        except RecursionError:
            raise reporter.fail(
                "E0207",
                f"definitions in '{source.name}' depend on each other in too long a chain",
                None,
                help="leave out steps between them",
            ) from None


def compile_flat(made_of: Compilation, flat: FlatModel, parts: Collection[str] = ()) -> Formed:
    """Compile a flat model that was made of that of another compilation. Raises CompileError."""
    with uncollected(), deep_recursion():
        return _formed(made_of.source, made_of.ast, verified(flat), Reporter(), by_value=True, parts=parts)


def _formed(
    source: SourceFile,
    tree: ast.File,
    flat: FlatModel,
    reporter: Reporter,
    *,
    by_value: bool,
    parts: Collection[str],
) -> Formed:
    system = verified(build(flat, reporter, by_value=by_value))
    equations = verified(assemble(system, reporter, parts))
    program = _lowered(equations, parts)
    return Formed(source, tree, flat, system, equations, program, reporter.diagnostics, frozenset(parts))


def _output(name: str, text: str, reporter: Reporter) -> ast.Statement:
    """Read a formula from outside, which holds no semicolon, as an output of the model. Raises CompileError."""
    shown = name.removeprefix("asked_")  # messages show it as it was asked for
    if shown in KEYWORDS:
        shown = name
    (statement,) = parse(SourceFile(shown, f"output {shown} = {text};"), reporter).items
    assert isinstance(statement, ast.Output)
    return replace(statement, name=name)


def program_for(compilation: Compilation, *, implicit: bool = False, momenta: bool = False) -> Program:
    """Return the program with what certain methods work on beside the right-hand side.

    ``implicit``: the Jacobian; ``momenta``: momenta and their rates, for constrained structure-preserving methods.
    """
    wanted = {"jacobian"} if implicit else set()
    wanted |= {"momenta"} if momenta else set()
    return program_with(compilation, wanted)


def program_with(compilation: Compilation, parts: Collection[str]) -> Program:
    """Return the program with further parts (equations/needs.py)."""
    wanted = compilation.parts.union(parts)
    if wanted == compilation.parts:
        return compilation.program
    return _lowered(equations_with(compilation, parts), wanted)


def _lowered(equations: Equations, parts: Collection[str]) -> Program:
    program = lower(equations, hoist="constants" not in parts)
    return verified(with_series(program) if "series" in parts else program)


def tangent_program(compilation: Compilation, directions: Directions, parts: Collection[str] = ()) -> Program:
    """Return the program of the motion together with its derivatives (equations/tangents.py)."""
    with uncollected(), deep_recursion():
        _check_differentiable(compilation.equations)
        equations = verified(tangent_equations(_apart(equations_with(compilation, parts)), directions))
        return verified(lower(equations))


def adjoint_program(compilation: Compilation, asked: Adjoint) -> Program:
    """Return the program that pulls a goal back to the start and to parameters (equations/adjoints.py)."""
    with uncollected(), deep_recursion():
        _check_differentiable(compilation.equations)
        return verified(lower(verified(adjoint_equations(_apart(compilation.equations), asked))))


def _check_differentiable(equations: Equations) -> None:
    """Report forces that numbers find where the motion is to be differentiated. Raises CompileError."""
    check_forces_have_formulas(equations)
    rates = [f for f in equations.functions if f.name == "rhs"]
    check_derivatives(
        equations.graph, equations.switching, equations.layout, rates, "a derivative of the motion"
    )


def _apart(equations: Equations) -> Equations:
    """Return the same equations on a graph of their own: what others have added to it would stand for equal values."""
    return replace(equations, graph=equations.graph.fork())


def equations_with(compilation: Compilation, parts: Collection[str]) -> Equations:
    """Return the equations with further parts (equations/needs.py)."""
    wanted = compilation.parts.union(parts)
    if wanted == compilation.parts:
        return compilation.equations
    return verified(assemble(compilation.system, Reporter(), wanted))
