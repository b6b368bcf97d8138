"""A model that moves while it is typed: what the playground of the documentation (``docs/website/playground``) asks of the compiler.

It runs in the browser, by Pyodide, so nothing here imports NumPy. A text is compiled to a module, the page runs it, and from what
that run has found its facts are formed, without a native run. What the run lacked it is compiled with again, as
``session.py`` does: with the Jacobian where the motion is stiff, with compliant multipliers at singular positions.
"""

from __future__ import annotations

import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from ..compiler.targets.wasm.link import Linked
from ..display import Display, choose
from ..exporting import refuse_driving_inputs
from ..lang.diagnostics import CompileError, Diagnostic, Reporter
from ..lang.read import decode
from ..model import CompiledModel, model_of
from ..presentation.extents import Errors, Extents
from ..presentation.render import render, render_failed
from ..presentation.run_failure import render_error
from ..requests.parse_values import UsageMistake
from ..runtime.interface import COMPLIANCE, interface_of
from ..runtime.limits_of_time import no_stop
from ..runtime.methods import KERNEL_METHODS, check_step, unknown_method
from ..runtime.native.status import NEEDS
from ..runtime.outcome import SimulationError
from ..runtime.problem import Problem
from ..web.facts import PageFacts, RunFigures, RunSpan, Settings
from ..web.page import as_json, joined, module_of, program_of, refuse_curve
from .completion import completions
from .document import Document

FILE = "playground.mech"
"""What messages call the text."""

LIBRARIES = {"numpy": "NumPy", "scipy": "SciPy"}

WAYS = ("plain", "stiff", "compliant")
"""How a text is compiled: the first way, then what a run turned out to lack."""


class Playground:
    """One text after another; answers are texts in JSON, as they go to JavaScript."""

    def __init__(self) -> None:
        self._document = Document(Path(FILE))
        self._model: CompiledModel | None = None
        self._facts: PageFacts | None = None
        self._linked: Linked | None = None

    def compile(self, text: str) -> str:
        """Compile a text; return what is said of it and, where it can move, what its run needs to know (``PageFacts.of_run``)."""
        self._model = self._facts = self._linked = None
        try:
            source = decode(FILE, text.encode(), Reporter())
            self._model = model_of(CompiledModel, source, Path(), None, {}, ("scene",))
            return self._ready(self._model, "plain")
        except CompileError as error:
            return _said(render_failed(error.diagnostics), error.diagnostics)
        except Exception as error:
            return _said(_message(error))

    def again(self, way: str) -> str:
        """Compile the last text in another of the ``WAYS``."""
        assert self._model is not None
        try:
            return self._ready(self._model, way)
        except Exception as error:
            return _said(_message(error))

    def _ready(self, model: CompiledModel, way: str) -> str:
        refuse_curve(model)
        refuse_driving_inputs(model, "a page")
        if way == "compliant":
            model = model.keeping({*model.compilation.parts, COMPLIANCE})
        self._facts = facts = facts_before_run(model, "auto" if way == "stiff" else "")
        self._linked = module_of(facts, program_of(facts))
        said = model.diagnostics
        run = facts.of_run()
        failures = run["failures"]
        assert isinstance(failures, dict)
        refused = {str(int(status)): f"'{facts.method}' {words}" for status, words in NEEDS.items()}
        more = {
            "run": {**run, "failures": {**failures, **refused}},
            "inputs": self._linked.entries.get("inputs"),
            "nu": len(facts.problem.inputs),
            "asksMethod": bool(model.method(None)),
            "constrained": bool(facts.problem.constraints),
        }
        return _said(render(said), said, **more)

    def module(self) -> bytes:
        """Return the module of the last text."""
        assert self._linked is not None
        return self._linked.module

    def page(self, told: str) -> str:
        """Return the page of the last text without the module, from what its run has found: see ``_found``."""
        assert self._facts is not None and self._linked is not None
        run = msgspec.json.decode(told)
        span = RunSpan(**{**run["span"], "max_step": self._facts.span.max_step})
        facts = msgspec.structs.replace(self._facts, span=span)
        return joined(facts, facts.info(_found(facts.problem, run)), {})

    def complete(self, text: str, offset: int) -> str:
        """Return what may be written at a place, as in editors."""
        if text != self._document.text:
            self._document.change(text)
        try:
            offers = completions(self._document, offset)
        except ModuleNotFoundError:  # the names of studies come with NumPy, and nothing here answers studies
            offers = []
        return msgspec.json.encode(offers).decode()


def facts_before_run(model: CompiledModel, method: str) -> PageFacts:
    """Return the facts of a model that has not run; ``method``: instead of that of the experiment. Raises SimulationError."""
    model = model.for_experiment(None)
    problem = Problem(**interface_of(model.compilation.program))
    plan = model.experiment(None)
    experiment = next((e for e in problem.experiments if plan is not None and e.name == plan.name), None)
    if experiment is None or "stop" not in experiment.options:
        raise no_stop(problem)
    method = method or model.method(None) or "dop853"
    if method not in KERNEL_METHODS:
        raise unknown_method(method)
    check_step(
        model.method(None) or "auto",
        fixed=KERNEL_METHODS[method].fixed_step,
        given="step" in experiment.options,
    )
    words = experiment.words.get("display", "")
    display = choose(words) if words else Display()
    known = list(problem.known)
    for setting in experiment.settings:
        if setting.array == "y":
            known[setting.index] = not setting.guess
    return PageFacts(
        model=model,
        problem=problem,
        experiment=experiment,
        method=method,
        display=display,
        pictured=choose(model.angles) if model.angles and not display.chosen else display,
        span=RunSpan(),
        settings=Settings(),
        known=known,
    )


def _found(problem: Problem, run: Mapping[str, Any]) -> RunFigures:
    """Read what a run has found: ``p``, ``y0``, ``u``, ``nominal``; ``low`` and ``high`` of states and outputs; ``errors`` of states
    and the ``largest`` of them, None where they are unknown. None stands for what is not a finite number."""
    columns = (*problem.states, *problem.outputs)
    ends = {
        q.name: (_number(a), _number(b)) for q, a, b in zip(columns, run["low"], run["high"], strict=True)
    }
    errors = None
    if run["errors"] is not None:
        kept = [(q.name, k) for k, q in enumerate(problem.states) if q.kind != "account"]
        errors = Errors(
            {name: _number(run["errors"][k]) for name, k in kept},
            {name: _number(run["nominal"][k]) for name, k in kept},
            _number(run["largest"]),
        )
    p, y0, u, nominal = ([_number(x) for x in run[name]] for name in ("p", "y0", "u", "nominal"))
    return RunFigures(p, y0, u, nominal, Extents({q.name: q.unit for q in columns}, ends, errors))


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _said(message: str, diagnostics: tuple[Diagnostic, ...] = (), **more: object) -> str:
    """Return an answer: the message as the command writes it, and where in the text its parts are."""
    marks = [
        {
            "start": d.span.start,
            "end": d.span.end,
            "kind": d.severity.value,
            "code": d.code,
            "text": d.message,
        }
        for d in diagnostics
        if d.span is not None and d.span.file.name == FILE
    ]
    return as_json({"message": message, "marks": marks, "codes": [d.code for d in diagnostics], **more})


def _message(error: Exception) -> str:
    """Return an exception as the command tells it."""
    match error:
        case SimulationError():
            return render_error(error)
        case UsageMistake() | OSError():
            return f"error: {error}"
        case ModuleNotFoundError():
            name = (error.name or "").partition(".")[0]
            name = LIBRARIES.get(name, name)
            return f"error: this model is compiled with the help of {name}, which the playground does not hold; 'mechc view' shows it"
        case _:
            trace = "".join(traceback.format_exception(error))
            return f"error: this is a bug in mechc: {type(error).__name__}: {error}\n\n{trace}"
