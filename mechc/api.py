"""The Python interface: load a model, run it, write it as code.

>>> model = mechc.load("pendulum.mech")
>>> solution = model.simulate(stop="10 s", set={"l": "80 cm"})
>>> solution["theta"], solution.unit("theta"), solution(0.5)["theta"]
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

from .compiled import Code, Exact, compiled_again, exact_value, structural_literal, structural_names
from .compiler.flat.model import Experiment
from .compiler.flat.model import Literal as LiteralValue
from .compiler.pipeline import Compilation, program_with
from .lang.diagnostics import Diagnostic
from .lang.read import read_source
from .lang.source import SourceFile
from .settings import Given, UsageMistake, elements_of, settings_in_si, tidy, unknown_name

if TYPE_CHECKING:
    from .compiler.equations.model import Entry
    from .runtime.problem import Problem
    from .runtime.studies.stepwise import Stepper
    from .simulation import Request, Sweep
    from .solution import Solution

Structural = Mapping[str, Exact]
Target = Literal["auto", "c", "python"]


class Options(TypedDict, total=False):
    """Options of a run. Times are numbers in SI or texts such as ``"250 ms"``.

    ``every`` is the spacing of the output, ``step`` that of a fixed-step method; ``inputs`` CSV files by the
    name of the input; ``progress`` is called with the fraction done.
    """

    stop: float | str | None
    start: float | str | None
    step: float | str | None
    every: float | str | None
    tolerance: float | None
    method: str | None
    inputs: Mapping[str, str | Path]
    estimate_error: bool
    reproducible: bool
    target: Target
    progress: Callable[[float], None] | None


def load(
    path: str | Path,
    *,
    model: str | None = None,
    set: Mapping[str, Given] | None = None,
    keep: Collection[str] = (),
) -> Model:
    """Compile a model file.

    ``model`` names one of several models of the file (the last that can be run, if not given). ``set``
    changes parameters, structural ones too, and initial values for every run of this model. ``keep`` names parts
    that are built whether they are needed or not (``PARTS`` of the compiler). Raises CompileError with all diagnostics.
    """
    source = read_source(path)
    return _compile(source, Path(path).parent, model, dict(set or {}), keep)


def loads(
    text: str, *, name: str = "model.mech", model: str | None = None, keep: Collection[str] = ()
) -> Model:
    """Compile a model given as text; ``name`` stands for the file in messages. ``keep``: see ``load``."""
    return _compile(SourceFile(name, text.replace("\r\n", "\n")), Path(), model, {}, keep)


class Model:
    """A compiled model with the values that were set. Immutable; ``with_values`` gives a changed one."""

    def __init__(self, code: Code, settings: dict[str, Given]) -> None:
        self._code = code
        self._settings = settings

    def __repr__(self) -> str:
        return f"<mechc model {self.name}>"

    def __reduce__(self) -> tuple[Callable[..., Model], tuple[object, ...]]:
        """Pickle as the source text and the values that were set; it is compiled again where it arrives."""
        code = self._code
        structural = tuple(sorted(code.structural.items()))
        return _arrived, (
            code.source.name,
            code.source.text,
            code.folder.absolute(),
            code.model,
            structural,
            code.keep,
            self._settings,
        )

    @property
    def compilation(self) -> Compilation:
        """What every stage of the compiler made of the model."""
        return self._code.compilation

    @property
    def name(self) -> str:
        return self.compilation.flat.name

    @property
    def doc(self) -> str:
        return self.compilation.flat.doc

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The warnings and notes of the compiler."""
        return self.compilation.diagnostics

    @property
    def parameters(self) -> tuple[Entry, ...]:
        return self.compilation.equations.parameters

    @property
    def structural_parameters(self) -> Structural:
        return self.compilation.flat.structural

    @property
    def coordinates(self) -> tuple[Entry, ...]:
        return tuple(entry for entry in self.compilation.equations.states if entry.kind == "coordinate")

    @property
    def states(self) -> tuple[Entry, ...]:
        """The first-order states; ``coordinates`` has the others."""
        return tuple(entry for entry in self.compilation.equations.states if entry.kind == "state")

    @property
    def inputs(self) -> tuple[Entry, ...]:
        return self.compilation.equations.inputs

    @property
    def outputs(self) -> tuple[Entry, ...]:
        return self.compilation.equations.outputs

    @property
    def experiments(self) -> tuple[str, ...]:
        """The names of the experiments in their order; the default one has the name ``""``."""
        return tuple(experiment.name for experiment in self.compilation.flat.experiments)

    def simulate(
        self,
        *,
        set: Mapping[str, Given] | None = None,
        experiment: str | None = None,
        **options: Unpack[Options],
    ) -> Solution:
        """Run the model and return its motion with the report of its accuracy.

        ``set`` holds parameters, structural ones too, and initial values; ``experiment`` names one of the
        model (without it the unnamed one, else the first). See ``Options`` for the rest. Raises
        UsageMistake for names, units and options that do not fit, CompileError if a structural parameter
        makes the model wrong, SimulationError if the run cannot begin. A run that fails on its way
        returns the part that it computed, with ``outcome`` and ``message``.
        """
        from .simulation import simulate

        changed = self.with_values(set or {}).for_experiment(experiment)
        return simulate(changed, _request(experiment, options))

    def start(
        self,
        *,
        set: Mapping[str, Given] | None = None,
        experiment: str | None = None,
        tolerance: float | None = None,
    ) -> Stepper:
        """Begin a run that goes on step by step: ``sim.step(0.01)`` to a time, ``sim["torque"] = 2.0``, ``sim["theta"]``.

        Values are in SI, times too. Raises SimulationError if the run cannot begin.
        """
        from .simulation import start

        changed = self.with_values(set or {}).for_experiment(experiment)
        return start(changed, _request(experiment, {"tolerance": tolerance}))

    def sweep(
        self,
        *,
        set: Mapping[str, Given] | None = None,
        experiment: str | None = None,
        **options: Unpack[Options],
    ) -> Sweep:
        """Run an experiment that sweeps parameters: once for each combination of their values."""
        from .simulation import sweep

        changed = self.with_values(set or {}).for_experiment(experiment)
        return sweep(changed, _request(experiment, options))

    def with_values(self, values: Mapping[str, Given]) -> Model:
        """Return this model with other values of parameters; structural ones compile it again."""
        if not values:
            return self
        values = {tidy(name): value for name, value in values.items()}
        known = self.structural_parameters
        structural = {name: exact_value(name, value) for name, value in values.items() if name in known}
        settings = {name: value for name, value in values.items() if name not in known}
        changed = Model(self._code.variant(self._code.structural | structural), self._settings)
        new = changed._in_si(settings)  # a mistake is told here, not when the run begins
        units = changed.settable_units()
        kept = {n: v for n, v in self._settings.items() if not new.keys() >= set(elements_of(n, units))}
        return Model(changed._code, kept | settings)

    def for_experiment(self, name: str | None) -> Model:
        """Return this model with the structural parameters that an experiment sets.

        Raises UsageMistake for an unknown experiment.
        """
        chosen = self._experiment(name)
        if chosen is None or not chosen.structural:
            return self
        return Model(self._code.variant({**chosen.structural, **self._code.structural}), self._settings)

    def structural_points(self, experiment: str | None) -> list[tuple[dict[str, float | bool | str], Model]]:
        """Return the combinations of structural values that an experiment sweeps, each with its model."""
        plan = self._experiment(experiment)
        swept = {s.target: s.values for s in plan.sweeps if s.structural} if plan else {}
        points: list[tuple[dict[str, float | bool | str], Model]] = []
        for row in product(*swept.values()):
            values = {name: structural_literal(value) for name, value in zip(swept, row, strict=True)}
            model = Model(self._code.variant({**self._code.structural, **values}), self._settings)
            points.append(({n: float(v) if isinstance(v, Fraction) else v for n, v in values.items()}, model))
        return points

    def _experiment(self, name: str | None) -> Experiment | None:
        """Find an experiment. Raises UsageMistake for an unknown name."""
        experiments = self.compilation.flat.experiments
        if name is None:
            return next((e for e in experiments if not e.name), experiments[0] if experiments else None)
        for experiment in experiments:
            if experiment.name == name:
                return experiment
        if experiments and not any(e.name for e in experiments):
            raise UsageMistake(
                f"the model has no experiment '{name}'", "its only one has no name: leave the name out"
            )
        raise unknown_name("experiment", name, [e.name for e in experiments if e.name])

    def settable_units(self) -> dict[str, str]:
        """Return the SI unit of everything that may be set: parameters, initial values, constant inputs."""
        equations = self.compilation.equations
        settable = (*equations.parameters, *equations.states, *equations.inputs)
        return {entry.name: entry.unit for entry in settable if entry.kind != "account"}

    @property
    def settings(self) -> dict[str, float]:
        """The changed values, in SI."""
        return self._in_si(self._settings)

    def _in_si(self, settings: Mapping[str, Given]) -> dict[str, float]:
        rotations = {c.variable.name for c in self.compilation.system.symbols.coordinates if c.is_rotation}
        return settings_in_si(settings, self.settable_units(), rotations)

    def problem(self, target: Target = "auto", *, method: str = "", reproducible: bool = False) -> Problem:
        """Return the functions of the model ready to be called, compiled by the C compiler if there is one.

        ``target="python"`` does without. ``method`` names an integrator that works on further functions: the
        Jacobian (radau5, auto, gauss), momenta (rattle, lobatto). Raises CompilerMissing, BuildError.
        """
        from .runtime.methods import parts_for

        parts = parts_for(method)
        problems, key = self._code.problems, (target, reproducible, parts)
        if key not in problems:
            from .compiler.problem import make_problem

            program = program_with(self.compilation, parts)
            problems[key] = make_problem(program, target, reproducible=reproducible)
        return problems[key]

    def method(self, experiment: str | None) -> str:
        """Return the method that an experiment asks for, or an empty text."""
        plan = self._experiment(experiment)
        said = plan.options.get("method") if plan else None
        return str(said.value) if isinstance(said, LiteralValue) else ""

    def keeping(self, parts: Collection[str]) -> Model:
        """Return this model with parts built whether they are needed or not."""
        code, wanted = self._code, frozenset(parts)
        if wanted not in code.kept:
            code.kept[wanted] = Code.make(code.source, code.folder, code.model, code.structural, wanted)
        return Model(code.kept[wanted], self._settings)

    def compile(self, target: str = "python", output: str | Path | None = None) -> tuple[Path, ...]:
        """Write the model as code and return the files: a Python module, or C with the kernel beside it.

        ``output`` is the module or the folder; without it they are named after the model.
        """
        from .exporting import export

        return export(self, target, Path(output) if output is not None else None)


def _compile(
    source: SourceFile, folder: Path, model: str | None, given: dict[str, Given], keep: Collection[str]
) -> Model:
    given = {tidy(name): value for name, value in given.items()}
    declared = structural_names(source) if given else ()
    early = {name: exact_value(name, given.pop(name)) for name in declared if name in given}
    return Model(Code.make(source, folder, model, early, frozenset(keep)), {}).with_values(given)


def _arrived(
    name: str,
    text: str,
    folder: Path,
    model: str | None,
    structural: tuple[tuple[str, Exact], ...],
    keep: frozenset[str],
    settings: dict[str, Given],
) -> Model:
    return Model(compiled_again(name, text, folder, model, structural, keep), settings)


def _request(experiment: str | None, options: Options) -> Request:
    from .simulation import Request

    known = Options.__annotations__
    for name in options:
        if name not in known:
            raise UsageMistake(
                f"there is no option '{name}' of a run",
                f"values of the model are given as set={{'{name}': ...}}; the options are {', '.join(known)}",
            )
    return Request(experiment=experiment, **options)
