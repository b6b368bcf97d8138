"""A compiled model: its names and units, its values, and the questions that are put to it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Self, TypeVar

from msgspec.structs import replace

from .compiler.compilation import Compilation, Request
from .compiler.compilation_cache import compiled, compiled_once, formed_of, variant
from .compiler.outline import Exact
from .lang.diagnostics import Diagnostic
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
    tidy,
    unknown_name,
)
from .runtime.memo import once

if TYPE_CHECKING:
    from .compiler.flat.model import FlatModel
    from .compiler.outline import ExperimentOutline, StatedStudy
    from .compiler.program.model import Program
    from .runtime.ensembles.lanes import Wanted
    from .runtime.interface import Quantity
    from .runtime.problem import Problem

Structural = Mapping[str, Exact]


Made = TypeVar("Made")


def _as_allowed(method: str, parts: Collection[str], make: Callable[[frozenset[str]], Made]) -> Made:
    """Return what is made of the parts that a method works on beside ``parts``. ``auto`` does without a Jacobian of which a formula
    has no derivative. Raises CompileError."""
    from .lang.diagnostics import CompileError
    from .runtime.methods import parts_for

    try:
        return make(parts_for(method).union(parts))
    except CompileError as error:
        if method != "auto" or all(d.code != "E0729" for d in error.diagnostics):
            raise
    return make(frozenset(parts))


class CompiledModel:
    """A compiled model with the values that were set: what questions are put to. Immutable; ``with_values`` gives a changed
    one."""

    def __init__(self, compilation: Compilation, settings: dict[str, Given]) -> None:
        self.compilation = compilation
        """The model after every stage of the compiler, and what was made of it."""
        self._settings = settings
        self._given_in_si: dict[str, float] | None = None

    def __repr__(self) -> str:
        return f"<mechc model {self.name}>"

    def __reduce__(self) -> tuple[Callable[..., CompiledModel], tuple[object, ...]]:
        """Pickle as the source text and the values that were set; it is compiled again where it arrives."""
        asked = self.compilation.request
        here = replace(asked, search=tuple(folder.absolute() for folder in asked.search), remembered=False)
        return _arrived, (type(self), replace(here, formulas=()), self._settings)

    @property
    def stated(self) -> dict[str, Given]:
        """The changed values as they were written."""
        return dict(self._settings)

    @property
    def name(self) -> str:
        return self.compilation.outline.name

    @property
    def doc(self) -> str:
        return self.compilation.outline.doc

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The warnings and notes of the compiler."""
        return self.compilation.diagnostics

    @property
    def is_curve(self) -> bool:
        """Whether it is a curve, which does not move."""
        return self.compilation.summary.description.curve is not None

    @property
    def parameters(self) -> tuple[Quantity, ...]:
        return self.compilation.equations.parameters

    @property
    def structural_parameters(self) -> Structural:
        return self.compilation.outline.structural

    @property
    def coordinates(self) -> tuple[Quantity, ...]:
        return tuple(entry for entry in self.compilation.equations.states if entry.kind == "coordinate")

    @property
    def states(self) -> tuple[Quantity, ...]:
        """The first-order states; ``coordinates`` has the others."""
        return tuple(entry for entry in self.compilation.equations.states if entry.kind == "state")

    @property
    def inputs(self) -> tuple[Quantity, ...]:
        return self.compilation.equations.inputs

    @property
    def outputs(self) -> tuple[Quantity, ...]:
        return self.compilation.equations.outputs

    @property
    def experiments(self) -> tuple[str, ...]:
        """The names of the experiments in their order; the default one has the name ``""``."""
        return tuple(experiment.name for experiment in self.compilation.outline.experiments)

    @property
    def studies(self) -> Mapping[str, StatedStudy]:
        """The questions that the file puts, by name: kinds and settings (``study NAME = KIND(settings);``)."""
        return {study.name: study for study in self.compilation.outline.studies}

    def with_values(self, values: Mapping[str, Given]) -> Self:
        """Return this model with other values of parameters; structural ones compile it again."""
        if not values:
            return self
        if not self._settings and {float}.issuperset(map(type, values.values())):  # mostly
            numbers: dict[str, float] = {**values}  # type: ignore[dict-item]
            if numbers.keys() <= set_singly(self.compilation) and all(map(math.isfinite, numbers.values())):
                model = type(self)(self.compilation, numbers)  # type: ignore[arg-type]
                model._given_in_si = numbers
                return model
        values = {tidy(name): value for name, value in values.items()}
        changed, settings = self, values
        while structural := {
            n: exact_value(n, value)
            for n, value in settings.items()
            if elements_of(n, changed.structural_parameters)
        }:  # the components that a new size adds have such parameters, too
            settings = {name: value for name, value in settings.items() if name not in structural}
            changed = type(self)(changed._variant(structural), self._settings)
        new = changed._in_si(settings)  # a mistake is told here, not when the run begins
        units = changed.settable_units() if self._settings else {}
        kept = {n: v for n, v in self._settings.items() if not new.keys() >= set(elements_of(n, units))}
        model = type(self)(changed.compilation, kept | settings)
        if not kept:
            model._given_in_si = new
        return model

    def _variant(self, structural: Structural) -> Compilation:
        """Return the compilation with other structural values."""
        return self._compiled(_over(dict(self.compilation.request.structural), structural))

    def _compiled(self, structural: Structural) -> Compilation:
        """Return the compilation with these structural values and no others."""
        if dict(self.compilation.request.structural) == structural:
            return self.compilation
        if self.compilation.derived:
            raise UsageMistake("a model that was made of another has its structural parameters from there")
        return variant(self.compilation, structural=tuple(sorted(structural.items())))

    def for_experiment(self, name: str | None) -> Self:
        """Return this model with the structural parameters that an experiment sets.

        Raises UsageMistake for an unknown experiment.
        """
        chosen = self.experiment(name)
        if chosen is None or not chosen.structural:
            return self
        return self._settled(name, dict(self.compilation.request.structural))

    def _settled(self, name: str | None, own: Structural) -> Self:
        """Return this model with its ``own`` structural values, and those of an experiment, which may depend on all of them."""
        found = type(self)(self._compiled(own), self._settings)
        stated: Structural = {}
        for _ in range(_ROUNDS):
            fitting = found.experiment(name)
            if fitting is None or stated == fitting.structural:
                break
            stated = {**fitting.structural}  # which may name components of the sizes that it sets
            found = type(self)(self._compiled(_over(stated, own)), self._settings)
        else:
            raise UsageMistake(
                f"the settings of {f'experiment {chr(39)}{name}{chr(39)}' if name else 'the experiment'} "
                "do not settle: they depend on each other",
                "give their structural parameters numbers",
            )
        if fitting is not None and fitting.unfit:
            sizes = ", ".join(f"{n} = {own[n]}" for n in (*fitting.structural, *fitting.swept) if n in own)
            raise UsageMistake(
                f"the experiment{f' {chr(39)}{fitting.name}{chr(39)}' if fitting.name else ''} sets "
                f"'{fitting.unfit[0]}', which the model does not have in this size where {sizes}",
                "leave the structural value to the experiment, or choose another experiment",
            )
        return found

    def structural_points(self, experiment: str | None) -> list[tuple[dict[str, float | bool | str], Self]]:
        """Return the combinations of structural values that an experiment sweeps, each with its model."""
        plan = self.experiment(experiment)
        if plan is None or not plan.swept:
            return [({}, self)]
        given = self.compilation.request.structural
        own = {name: value for name, value in given if plan.structural.get(name) != value}
        points: list[tuple[dict[str, float | bool | str], Self]] = []
        for row in product(*plan.swept.values()):
            values = dict(zip(plan.swept, row, strict=True))
            model = self._settled(experiment, own | values)
            points.append(({n: float(v) if isinstance(v, Fraction) else v for n, v in values.items()}, model))
        return points

    def swept_structural(self, experiment: str | None) -> Mapping[str, tuple[Exact, ...]]:
        """Return the structural values that an experiment sweeps, by their names."""
        plan = self.experiment(experiment)
        return plan.swept if plan else {}

    def ensemble_settings(self, experiment: str | None) -> dict[str, str]:
        """Return what an experiment says of many runs: random values, what is kept, and how many, as texts."""
        from .runtime.interface import OF_ENSEMBLES

        plan = self.experiment(experiment)
        return {name: plan.words[name] for name in OF_ENSEMBLES if name in plan.words} if plan else {}

    def experiment(self, name: str | None) -> ExperimentOutline | None:
        """Find an experiment. Raises UsageMistake for an unknown name."""
        if name is None:
            return self.compilation.outline.experiment()
        experiments = self.compilation.outline.experiments
        for experiment in experiments:
            if experiment.name == name:
                return experiment
        if experiments and not any(e.name for e in experiments):
            raise UsageMistake(
                f"the model has no experiment '{name}'", "its only one has no name: leave the name out"
            )
        raise unknown_name("experiment", name, [e.name for e in experiments if e.name])

    def sweeps(self, experiment: str | None) -> bool:
        """Tell whether an experiment gives several values to something."""
        plan = self.experiment(experiment)
        return plan is not None and plan.sweeps

    def settable_units(self) -> Mapping[str, str]:
        """Return the SI unit of everything that may be set: parameters, initial values, constant inputs."""
        return self.compilation.settable_units

    @property
    def settings(self) -> dict[str, float]:
        """The changed values, in SI."""
        if self._given_in_si is None:
            self._given_in_si = self._in_si(self._settings)
        return dict(self._given_in_si)

    def _in_si(self, settings: Mapping[str, Given]) -> dict[str, float]:
        if not settings:
            return {}
        from .requests.in_si import settings_in_si

        driven, units = self.compilation.drives, self.settable_units()
        for name in (driven.keys() & settings.keys()) - units.keys() if driven else ():
            raise UsageMistake(
                f"'{name}' is prescribed by 'drive' (line {driven[name]})",
                "change a quantity that the drive depends on",
            )
        for name in settings.keys() - units.keys() - driven.keys():
            if any(
                entry.name == name and entry.kind == "coordinate"
                for entry in self.compilation.equations.outputs
            ):
                raise UsageMistake(
                    f"'{name}' has no mass: the balance of forces decides it, and it has no initial value of its own",
                    "set those of the others, or say in the model where it starts: the others follow",
                )
        return settings_in_si(self._truths_as_numbers(settings), units, self.compilation.rotations)

    def _truths_as_numbers(self, settings: Mapping[str, Given]) -> Mapping[str, Given]:
        """Write 1 and 0 for true and false where a parameter is one of these."""
        if not any(what in ("true", "false") for what in settings.values() if isinstance(what, str)):
            return settings
        truths = [q.name for q in self.compilation.equations.parameters if q.type == "boolean"]
        return {
            name: float(what == "true") if what in ("true", "false") and elements_of(name, truths) else what
            for name, what in settings.items()
        }

    def problem(
        self,
        *,
        method: str = "",
        reproducible: bool = False,
        quick: bool = False,
        parts: Collection[str] = (),
    ) -> Problem:
        """Return the functions of the model ready to be called, compiled by a C compiler; ``quick``: by libtcc, whose code is
        ready at once, where better code would not pay.

        ``method`` names an integrator that works on further functions: the
        Jacobian (radau5, auto, gauss), momenta (rattle, lobatto); ``parts`` are those that a study works on
        (``PARTS`` of the compiler). Raises CompilerMissing, BuildError.
        """
        from .compiler.problem import problem_with

        check_parts(parts)

        def made(wanted: frozenset[str]) -> Problem:
            return problem_with(self.compilation, wanted, reproducible=reproducible, quick=quick)

        return _as_allowed(method, parts, made)

    def lanes(self, method: str, parts: Collection[str], wanted: Wanted, by: str) -> Path:
        """Return the library in which several members of an ensemble run side by side: of the program that ``problem`` with
        this method and these parts is made of, stepped ``by`` another name of it. Raises NoLanes and BuildError.
        """
        needed = self.parts_of(method, parts)
        made, key = self.compilation.lanes, (needed, wanted, by)
        if key not in made:
            from .compiler import lanes

            made[key] = lanes.build_lanes(self.program(needed), wanted, by)
        return made[key]

    def parts_of(self, method: str, parts: Collection[str]) -> frozenset[str]:
        """Return ``parts`` and those that a method works on, as far as the model has them. Raises CompileError."""

        def formed(wanted: frozenset[str]) -> frozenset[str]:
            self.program(wanted)
            return wanted

        return _as_allowed(method, parts, formed)

    def program(self, parts: frozenset[str]) -> Program:
        if parts <= self.compilation.parts:
            return self.compilation.program
        from .compiler.pipeline import program_with

        return program_with(self.compilation, parts)

    def method(self, experiment: str | None) -> str:
        """Return the method that an experiment asks for, or an empty text."""
        plan = self.experiment(experiment)
        return plan.words.get("method", "") if plan else ""

    @property
    def angles(self) -> str:
        """The unit in which pictures show angles that state none: ``deg`` where the text writes degrees and no radians."""
        return _angles(self.compilation)

    def keeping(self, parts: Collection[str]) -> Self:
        """Return this model with parts built whether they are needed or not."""
        check_parts(parts)
        kept = variant(self.compilation, parts=frozenset(parts))
        return type(self)(kept, self._settings)

    def of(self, flat: FlatModel, settings: Mapping[str, float]) -> Self:
        """Return a flat model that was made of this one's as a model, with its own settings. Raises CompileError."""
        return type(self)(formed_of(self.compilation, flat), {}).with_values(settings)

    def with_formulas(self, formulas: Mapping[str, str]) -> Self:
        """Return this model with further outputs: texts by their names."""
        if not formulas:
            return self
        if self.compilation.derived:
            raise UsageMistake("a model that was made of another takes no further formulas")
        wanted = variant(self.compilation, formulas=tuple(formulas.items()))
        return type(self)(wanted, self._settings)


M = TypeVar("M", bound=CompiledModel)


def _arrived(kind: type[M], request: Request, settings: dict[str, Given]) -> M:
    return kind(compiled_once(request), settings)


@once
def set_singly(compilation: Compilation) -> frozenset[str]:
    """Return the names of numbers that may be set each by itself: none of rotations, none that compiles the model again."""
    units = compilation.settable_units
    whole = {one for name in compilation.rotations for one in elements_of(name, units)}
    return frozenset(units.keys() - whole - compilation.outline.structural.keys())


@once
def _angles(compilation: Compilation) -> str:
    text = re.sub(r"//[^\n]*", "", compilation.source.text)
    return "deg" if re.search(r"\d\s*deg\b", text) and not re.search(r"\d\s*rad\b(?!/)", text) else ""


_ROUNDS = 6
"""How often structural settings of an experiment may follow from each other before they are said not to settle."""


def _over(values: Structural, later: Structural) -> dict[str, Exact]:
    """Return structural values with later ones, of which ``arm.n`` goes before what was said of ``arm[2].n``."""
    return {n: v for n, v in values.items() if not any(elements_of(one, (n,)) for one in later)} | {**later}


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
    """Raise UsageMistake for a name that is not a part of a model."""
    if not parts:
        return
    from .compiler.equations.needs import PARTS
    from .runtime.interface import COMPLIANCE

    if isinstance(parts, str):
        raise UsageMistake(f"parts are a collection of names, not the text '{parts}'", f'as in {{"{parts}"}}')
    for part in parts:
        one_of(part, (*PARTS, COMPLIANCE), "part")


def model_of(
    kind: type[M],
    source: SourceFile,
    folder: Path,
    model: str | None,
    given: Mapping[str, Given],
    keep: Collection[str],
    *,
    remembered: bool = False,
) -> M:
    """Compile a source text with the values that are given, structural ones first; its imports are looked for in ``folder``.

    ``remembered``: keep what is formed for other processes, and take what they kept.
    """
    check_parts(keep)
    values = {tidy(name): value for name, value in given.items()}
    declared = structural_names(source) if values else ()
    early = {name: exact_value(name, values.pop(name)) for name in declared if name in values}
    structural = tuple(sorted(early.items()))
    request = Request(source, (folder,), model, structural, frozenset(keep), remembered=remembered)
    return kind(compiled(request), {}).with_values(values)


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
