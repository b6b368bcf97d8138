"""The stages in order: one line for each."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.source import SourceFile

from .compilation import Compilation, Request
from .equations.assemble import assemble
from .equations.model import Equations
from .equations.rows.crowd import check_forces_have_formulas
from .equations.solve.shares import check_derivatives
from .flat.flatten import flat_model_of
from .flat.model import FlatModel, Unlike
from .interpreter import compiling
from .mechanics.build import build
from .mechanics.system import MechanicalSystem
from .outline import outline_of
from .program.lower import lower
from .program.model import Program
from .verification import verified

if TYPE_CHECKING:
    from mechc.runtime.problem import Adjoint, Directions

    from .outline import Exact


def compile_source(
    source: SourceFile,
    *,
    model: str | None = None,
    structural: Mapping[str, Exact] | None = None,
    search: Sequence[Path] = (),
    by_value: bool = True,
    parts: Collection[str] = (),
    formulas: Collection[tuple[str, str]] = (),
) -> Compilation:
    """Compile one model of a source text: see ``Request``. Raises CompileError with every diagnostic found so far."""
    values = tuple(sorted((structural or {}).items()))
    request = Request(source, tuple(search), model, values, frozenset(parts), tuple(formulas))
    return form(request, by_value=by_value)


def form(request: Request, *, by_value: bool = True) -> Compilation:
    """Form every stage of what is asked for; unless ``by_value``, equal expressions of a text are nodes of their own. Raises
    CompileError with every diagnostic found so far."""
    with compiling():
        try:
            return _of_text(request, by_value)
        except Unlike:
            return _of_text(request, by_value, each_pair=True)


def _of_text(request: Request, by_value: bool, each_pair: bool = False) -> Compilation:
    """Form every stage; ``each_pair``: no contacts are families. Raises Unlike where some were, and are none."""
    reporter = Reporter()
    try:
        tree, flat = flat_model_of(
            request.source,
            reporter,
            model=request.model,
            structural=request.structural,
            search=request.search,
            formulas=request.formulas,
            each_pair=each_pair,
        )
        return _formed(request, tree, flat, reporter, by_value=by_value)
    except RecursionError:
        raise reporter.fail(
            "E0207",
            f"definitions in '{request.source.name}' depend on each other in too long a chain",
            None,
            help="leave out steps between them",
        ) from None


def compile_flat(made_of: Compilation, flat: FlatModel, parts: Collection[str] = ()) -> Compilation:
    """Compile a flat model that was made of that of another compilation. Raises CompileError."""
    request = replace(made_of.request, parts=frozenset(parts))
    reporter = Reporter()
    with compiling():
        try:
            return _formed(request, made_of.ast, flat, reporter, derived=True)
        except Unlike:
            raise reporter.fail(
                "E0722",
                "contacts that were of one formula are not in what was made of the model",
                None,
                help="state them outside of loops, each by itself",
            ) from None


def _formed(
    request: Request,
    tree: ast.File,
    flat: FlatModel,
    reporter: Reporter,
    *,
    by_value: bool = True,
    derived: bool = False,
) -> Compilation:
    system = verified(build(verified(flat), reporter, by_value=by_value))
    outline = outline_of(flat)
    parts = request.parts | outline.parts
    equations = _assembled(system, reporter, parts)
    stages = {"ast": tree, "flat": flat, "outline": outline, "system": system, "equations": equations}
    stages["program"] = _lowered(equations, parts)
    return Compilation(request, stages, diagnostics=reporter.diagnostics, derived=derived)


def _assembled(system: MechanicalSystem, reporter: Reporter, parts: Collection[str]) -> Equations:
    equations = verified(assemble(system, reporter, parts))
    if "growth" not in parts:
        return equations
    from .equations.growth import growth_equations

    return verified(growth_equations(_forked(equations)))


def program_with(compilation: Compilation, parts: Collection[str]) -> Program:
    """Return the program with further parts (equations/needs.py)."""
    wanted = compilation.parts.union(parts)
    if wanted == compilation.parts:
        return compilation.program
    return _lowered(equations_with(compilation, parts), wanted)


def _lowered(equations: Equations, parts: Collection[str]) -> Program:
    program = lower(
        equations, hoist="constants" not in parts, formulas="formulas" in parts, loops="loops" in parts
    )
    if "series" in parts:
        from .program.series import with_series

        program = with_series(program)
    return verified(program)


def tangent_program(compilation: Compilation, directions: Directions, parts: Collection[str] = ()) -> Program:
    """Return the program of the motion together with its derivatives (equations/tangents.py)."""
    with compiling():
        from .equations.tangents import tangent_equations

        _check_differentiable(compilation.equations)
        equations = verified(tangent_equations(_forked(equations_with(compilation, parts)), directions))
        return verified(lower(equations))


def adjoint_program(compilation: Compilation, asked: Adjoint) -> Program:
    """Return the program that pulls a goal back to the start and to parameters (equations/adjoints.py)."""
    with compiling():
        from .equations.adjoints import adjoint_equations

        _check_differentiable(compilation.equations)
        return verified(lower(verified(adjoint_equations(_forked(compilation.equations), asked))))


def _check_differentiable(equations: Equations) -> None:
    """Report forces that numbers find where the motion is to be differentiated. Raises CompileError."""
    check_forces_have_formulas(equations)
    rates = [f for f in equations.functions if f.name == "rhs"]
    check_derivatives(
        equations.graph, equations.switching, equations.layout, rates, "a derivative of the motion"
    )


def _forked(equations: Equations) -> Equations:
    """Return the same equations on a graph of their own: what others have added to it would stand for equal values."""
    return replace(equations, graph=equations.graph.fork())


def equations_with(compilation: Compilation, parts: Collection[str]) -> Equations:
    """Return the equations with further parts (equations/needs.py)."""
    wanted = compilation.parts.union(parts)
    if wanted == compilation.parts:
        return compilation.equations
    return _assembled(compilation.system, Reporter(), wanted)
