"""The Python interface: load a model, ask it, write it as code.

>>> model = mechc.load("pendulum.mech")
>>> solution = model.simulate(stop="10 s", set={"l": "80 cm"})
>>> solution["theta"], solution.unit("theta"), solution(0.5)["theta"]
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import cache, cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from .lang.read import read_model
from .lang.source import SourceFile
from .model import CompiledModel, model_of
from .requests.parse_values import Given, UsageMistake
from .suggest import closest

if TYPE_CHECKING:
    from .functions import Functions
    from .inverse_kinematics import Reached
    from .requests.request import Asked
    from .runtime.ensembles.result import Ensemble
    from .runtime.results.streamed import Streamed
    from .runtime.studies.environments.environment import Environment
    from .runtime.studies.environments.environments import Environments
    from .runtime.studies.environments.stepper import Stepper
    from .runtime.studies.findings import Findings
    from .runtime.studies.kinds.sweep import Runs
    from .runtime.studies.study import Answer
    from .solution import Solution
    from .web.view import View


class Options(TypedDict, total=False):
    """Options of a run. Times are numbers in SI or texts such as ``"250 ms"``.

    ``sensitivity`` names parameters, initial values and inputs in which the motion is differentiated
    (``Solution.sensitivity``); with ``condition`` the run tells how small changes of its start grow
    (``Solution.condition``); with ``constants`` constants of the motion are found and checked like the energy. ``every`` is the spacing of the output, ``step`` that of a fixed-step method; ``inputs`` tables by the
    name of the input: CSV files, frames of pandas, ``(times, values)``, or functions of the time; ``progress`` is called with the fraction done. ``to``: a CSV, NPZ or JSON file for results that are too many to
    be kept in memory: it is written while the run goes on, and the rows of the run lie in files beside it.
    """

    stop: float | str | None
    start: float | str | None
    step: float | str | None
    every: float | str | None
    tolerance: float | None
    method: str | None
    inputs: Mapping[str, Any]
    estimate_error: bool
    sensitivity: str | Collection[str] | None
    condition: bool
    constants: bool
    reproducible: bool
    progress: Callable[[float], None] | None
    to: str | Path | Streamed | None


NOT_SEEN = ("sensitivity", "estimate_error", "progress", "to")
"""Options of a run that change nothing on its page."""


def _seen(options: Options) -> dict[str, Any]:
    return {name: value for name, value in options.items() if name not in NOT_SEEN}


@cache
def _asking() -> tuple[Callable[..., Any], Callable[..., Any], Mapping[str, Any]]:
    """Import what answers, what takes questions apart, and the kinds, when the first question is put."""
    from .requests.request import asked
    from .runtime.studies.table import STUDIES
    from .session import answer

    return answer, asked, STUDIES


def load(
    path: str | Path,
    *,
    model: str | None = None,
    set: Mapping[str, Given] | None = None,
    keep: Collection[str] = (),
    remembered: bool = False,
) -> Model:
    """Compile a model file.

    ``model`` names one of several models of the file (the last that can be run, if not given). ``set``
    changes parameters, structural ones too, and initial values for every run of this model. ``keep`` names parts
    that are built whether they are needed or not (``PARTS`` of the compiler). ``remembered`` keeps what was formed beside
    compiled code, and takes it from there while nothing has changed. Raises CompileError with all diagnostics.
    """
    source = read_model(path)
    return model_of(Model, source, Path(path).parent, model, dict(set or {}), keep, remembered=remembered)


def loads(
    text: str, *, name: str = "model.mech", model: str | None = None, keep: Collection[str] = ()
) -> Model:
    """Compile a model given as text; ``name`` stands for the file in messages. ``keep``: see ``load``."""
    return model_of(Model, SourceFile(name, text.replace("\r\n", "\n")), Path(), model, {}, keep)


class Model(CompiledModel):
    """A compiled model with the values that were set. Immutable; ``with_values`` gives a changed one.

    Every kind of study is a method, too: ``model.virial(stop="100 s")`` is ``model.study("virial", stop="100 s")``.
    """

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
        solution: Solution = self._answer("simulate", set, {"experiment": experiment, **options})
        solution.angles = self.angles
        solution.viewer = partial(self._viewed, set, experiment, options)
        if "scene" not in self.compilation.parts:
            solution.pictured_again = partial(self._pictured, set, experiment, options)
        return solution

    def _viewed(
        self, set: Mapping[str, Given] | None, experiment: str | None, options: Options, **of_the_page: Any
    ) -> View:
        """Return the page of a run."""
        return self.view(set=set, experiment=experiment, **_seen(options), **of_the_page)

    def _pictured(
        self, set: Mapping[str, Given] | None, experiment: str | None, options: Options
    ) -> Solution:
        """Return the same run with the numbers of what is drawn."""
        drawn = self.keeping({*self.compilation.parts, "scene"})
        return drawn.simulate(set=set, experiment=experiment, **_seen(options), estimate_error=False)

    def solve(
        self,
        *,
        set: Mapping[str, Given] | None = None,
        experiment: str | None = None,
        tolerance: float | None = None,
        all: bool = False,
    ) -> Any:
        """Find the curve of a model with a range (``independent x from a to b``) and return it: a ``CurveSolution``.

        With ``all``, or where the experiment sweeps, ``Curves`` holds what was found. ``set``: parameters, and constants
        as guesses of coordinates. Raises UsageMistake, SimulationError where no stationary curve is found.
        """
        from .curves import curves_of

        found = curves_of(self.with_values(set or {}).for_experiment(experiment), experiment, tolerance, all)
        return found.solutions[0][0] if len(found.solutions) == 1 and not all else found

    def sweep(
        self,
        *,
        set: Mapping[str, Given] | None = None,
        experiment: str | None = None,
        **options: Unpack[Options],
    ) -> Runs[Solution]:
        """Run an experiment that sweeps parameters: once for each combination of their values."""
        runs: Runs[Solution] = self._answer("sweep", set, {"experiment": experiment, **options})
        return runs

    def ensemble(
        self, vary: Any = (), keep: Any = None, *, set: Mapping[str, Given] | None = None, **settings: Any
    ) -> Ensemble:
        """Run the model many times: over a product of values, random values, or a list of members.

        ``vary``: a text such as ``"l = 0.5 m .. 2 m, 200, theta ~ normal(1 rad, 0.01 rad)"``, a mapping from names to such texts
        or to values in SI, or a CSV file. ``keep``: what to keep of each, as ``"max(theta), final(energy.total)"``;
        a formula alone is kept over time. ``settings``: ``samples``, ``seed``, ``sampling``, ``covariance``, ``errors``,
        ``threads``, ``lanes``, ``device``, and those of a run. Raises UsageMistake and SimulationError for what does not fit the model.
        """
        from .requests.members import refuse_structural

        refuse_structural(vary, self.structural_parameters)
        given = {"vary": vary or None, "keep": keep, **settings}
        found: Ensemble = self._answer("ensemble", set, given)
        return found

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
        from .session import begin

        model, asked = self._asked("simulate", set, {"experiment": experiment, "tolerance": tolerance})
        return begin(model, asked)

    def env(
        self,
        dt: float | str,
        *,
        method: str | None = None,
        substeps: int = 1,
        tolerance: float | None = None,
        max_steps: int = 10_000,
        set: Mapping[str, Given] | None = None,
        experiment: str | None = None,
        reproducible: bool = False,
    ) -> Environment:
        """Return the model as an environment: ``env.u[:] = action``, ``env.step()``, ``env.q``, ``env.reset(q=...)``.

        Each step lasts ``dt``, holds the inputs, and takes ``max_steps`` steps of the integrator at most: as many as ``tolerance``
        needs, or ``substeps`` of a method with steps of one size, as ``method="rk4"``. Events are located in both cases. Arrays
        hold SI. Raises UsageMistake, and SimulationError if the motion cannot begin.
        """
        env: Environment = self._environments(
            None, dt, method, substeps, tolerance, max_steps, set, experiment, reproducible
        )
        return env

    def batch(
        self,
        n: int,
        dt: float | str,
        *,
        method: str | None = None,
        substeps: int = 1,
        tolerance: float | None = None,
        max_steps: int = 10_000,
        threads: int = 1,
        lanes: str = "auto",
        set: Mapping[str, Given] | None = None,
        experiment: str | None = None,
        reproducible: bool = False,
    ) -> Environments:
        """Return ``n`` environments (``env``) with one face: arrays have a row for each, and one that fails ends alone.

        ``lanes``: whether smooth models move by vectors in steps of ``rk4`` (``auto``: batches from 1000 on, or ``on``, ``off``); their
        bits differ in the last digits from those of solvers, and neither depends on ``n`` or ``threads``.
        """
        if not isinstance(n, int) or n < 1:
            raise UsageMistake(f"'n' counts environments, it is {n!r}")
        many: Environments = self._environments(
            n, dt, method, substeps, tolerance, max_steps, set, experiment, reproducible, threads, lanes
        )
        return many

    def gym(
        self,
        task: str,
        n: int | None = None,
        *,
        threads: int = 1,
        lanes: str = "auto",
        set: Mapping[str, Given] | None = None,
        **settings: Any,
    ) -> Any:
        """Return a task of the file, ``study NAME = task(...)``, as an environment of Gymnasium, or ``n`` as a ``VectorEnv``.

        ``settings`` come before those of the file. Actions are the inputs in SI, between the bounds that they declare. Needs the package
        ``gymnasium`` (``pip install 'mechc[gym]'``). Raises UsageMistake, SimulationError for what does not fit the model.
        """
        try:
            from .gym import ManyEnvs, OneEnv
        except ImportError:
            raise UsageMistake(
                "tasks are learnt through the package gymnasium, which is not installed",
                "pip install 'mechc[gym]'",
            ) from None
        from .session import episodes

        stated = self.studies.get(task)
        if stated is None or stated.kind != "task":
            tasks = [name for name, study in self.studies.items() if study.kind == "task"]
            raise UsageMistake(
                f"'{self.name}' states no task '{task}'",
                f"there are {', '.join(tasks)}"
                if tasks
                else 'as in study swing = task(observe = "sin(a)", reward = "cos(a)", every = 20 ms, stop = 10 s);',
            )
        model, asked = self._asked("task", set, {**stated.settings, **settings})
        begun = episodes(model, asked, n or 1, lanes if n else "off", threads)
        return OneEnv(begun) if n is None else ManyEnvs(begun)

    def _environments(
        self,
        n: int | None,
        dt: float | str,
        method: str | None,
        substeps: int,
        tolerance: float | None,
        max_steps: int,
        set: Mapping[str, Given] | None,
        experiment: str | None,
        reproducible: bool,
        threads: int = 1,
        lanes: str = "off",
    ) -> Any:
        from .session import environments

        given = {"every": dt, "method": method, "tolerance": tolerance, "reproducible": reproducible}
        model, asked = self._asked("simulate", set, {"experiment": experiment, **given})
        return environments(model, asked, n, substeps, lanes, max_steps=max_steps, threads=threads)

    def study(self, kind: str, *, set: Mapping[str, Given] | None = None, **settings: Any) -> Answer:
        """Answer one of the questions that ``mechc study`` lists, or one of ``studies``, those of the file, by its name.

        ``settings``: those of the kind, beside ``set``, ``experiment`` and ``inputs``; before those of the file.

        Raises UsageMistake for a kind or a setting that does not exist, else what ``simulate`` raises.
        """
        if kind in self.studies:
            stated = self.studies[kind]
            kind, settings = stated.kind, {**stated.settings, **settings}
        answer: Answer = self._answer(kind, set, settings)
        return answer

    def fit(
        self, data: Any, vary: Any, *, set: Mapping[str, Given] | None = None, **settings: Any
    ) -> Findings:
        """Find the values with which the model moves as it was measured (``runtime/studies/kinds/fit.py``).

        ``data``: one or several measured motions: CSV files, mappings from names to arrays [n] in SI with ``time`` among
        them, or tables of pandas. ``vary``: names of parameters and initial values, or a mapping from names to bounds
        ``(low, high)`` or None. ``settings``: ``outputs``, ``noise``, ``shared``, ``loss``, ``starts``, and those of a run.
        Raises UsageMistake and SimulationError for what does not fit the model.
        """
        found: Findings = self._answer("fit", set, {"data": data, "vary": vary, **settings})
        return found

    @cached_property
    def functions(self) -> Functions:
        """The functions of the model for programs of your own: mass matrix, bias, accelerations, inverse dynamics, constraints,
        energies, outputs and Jacobians, of states y in SI (``print(model.functions)`` lists them). Raises SimulationError."""
        from .functions import Functions

        return Functions(self)

    def ik(self, frame: str, position: Any = None, rotation: Any = None, **settings: Any) -> Reached:
        """Find coordinates that bring a frame or point to a ``position`` [m], a ``rotation`` (matrix), or both, in the world.

        ``limits``: coordinates by their names between two values, beside those that they declare (``min``, ``max``); ``held``:
        coordinates that stay; ``start``: where to begin, then ``starts`` - 1 more at random (``seed``); ``tolerance`` in m and
        rad. Loops stay closed. ``found.reached`` tells whether it is there. Raises UsageMistake.
        """
        from .inverse_kinematics import find_pose

        return find_pose(self.functions, frame, position, rotation, **settings)

    def gradient(
        self,
        goal: str,
        to: str | Collection[str],
        *,
        integral: bool = False,
        set: Mapping[str, Given] | None = None,
        **settings: Any,
    ) -> Findings:
        """Differentiate a goal, a formula at the end of the motion or its ``integral`` over the time, in parameters, initial
        values and inputs, for the price of a few runs whatever their number. ``found.details["gradient"]``: by name, in SI.
        Raises UsageMistake for names that do not fit, SimulationError for motions that are not smooth.
        """
        found: Findings = self._answer(
            "gradient", set, {"goal": goal, "to": to, "integral": integral, **settings}
        )
        return found

    def view(
        self,
        *,
        set: Mapping[str, Given] | None = None,
        experiment: str | None = None,
        recorded: bool = False,
        height: int = 640,
        **options: Unpack[Options],
    ) -> View:
        """Return the page on which the model moves, to be shown in a notebook, saved (``.save("m.html")``) or opened.

        Its sliders integrate again, unless it is ``recorded``: of one motion, without the model; ``height`` in pixels. Raises
        what ``simulate`` raises.
        """
        from .web.view import view

        return view(self, recorded=recorded, set=set, experiment=experiment, height=height, options=options)

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, Any]:
        """Return tables of quantities and the equations: the name is IPython's."""
        from .presentation.bundles import model_bundle

        return model_bundle(self)

    def __getattr__(self, name: str) -> Any:
        from .runtime.studies.table import STUDIES

        if name in STUDIES:
            return partial(self._asked_kind, name)
        raise AttributeError(f"'{type(self).__name__}' object has no attribute '{name}'")

    def _asked_kind(self, kind: str, *, set: Mapping[str, Given] | None = None, **settings: Any) -> Answer:
        answer: Answer = self._answer(kind, set, settings)
        return answer

    def _asked(
        self, kind: str, values: Mapping[str, Given] | None, given: Mapping[str, Any]
    ) -> tuple[Model, Asked]:
        _, asked, kinds = _asking()
        if kind not in kinds:
            near = closest(kind, list(kinds))
            help = f"did you mean '{near}'?" if near else f"the kinds are {', '.join(kinds)}"
            raise UsageMistake(f"there is no study '{kind}'", help)
        if type(values) is not dict and not isinstance(values or {}, Mapping):
            raise UsageMistake(
                f"'set' holds values by their names, not {values!r}", 'as in set={"l": "80 cm"}'
            )
        question = asked(kinds[kind].question(), given)
        return self.with_values(values or {}).for_experiment(question.experiment), question

    def _answer(self, kind: str, values: Mapping[str, Given] | None, given: Mapping[str, Any]) -> Any:
        return _asking()[0](*self._asked(kind, values, given))

    def compile(self, target: str = "python", output: str | Path | None = None) -> tuple[Path, ...]:
        """Write the model as code and return the files: a Python module, or C with the kernel beside it.

        ``output`` is the module or the folder; without it they are named after the file.
        """
        from .exporting import export

        return export(self, target, Path(output) if output is not None else None)
