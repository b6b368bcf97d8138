"""Mutants that show that an expectation can fail: in the sources of the kernel or in its callers, never in the
product itself. The reference in higher precision is compiled before, from the true sources."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mechc.runtime.reference.high_precision import best_precision


def _module(name: str) -> Any:
    """Return a module as something whose parts can be exchanged."""
    return import_module(f"mechc.{name}")


def _put(owner: Any, name: str, instead: Any) -> None:
    """Exchange a part of a module or a type, which must be there."""
    assert hasattr(owner, name), f"{owner} has no {name}"
    setattr(owner, name, instead)


accuracy, case, inputs = (
    _module("runtime.results.accuracy"),
    _module("runtime.case"),
    _module("runtime.inputs"),
)
kernel_run, native = _module("runtime.integrate.kernel_run"), _module("runtime.native.kernel")
simulate, companion = _module("runtime.studies.runs.simulate"), _module("runtime.studies.runs.companion")
solver = _module("runtime.integrate.solver")


class Fault(Struct, frozen=True):
    text: str
    plant: Callable[[], None]


class KernelEdit(Struct, frozen=True):
    """Replaces a piece of one source of the kernel, which must be there once."""

    file: str
    there: str
    instead: str

    def edited(self) -> dict[str, str]:
        """Return the sources of the kernel with the mutation."""
        sources = native.kernel_sources()
        count = sources[self.file].count(self.there)
        assert count == 1, f"{self.there!r} is {count} times in {self.file}"
        return {**sources, self.file: sources[self.file].replace(self.there, self.instead)}

    def __call__(self) -> None:
        best_precision()
        changed = self.edited()
        _put(native, "kernel_sources", lambda: dict(changed))
        state = f"{native._kernel_state()}, {self.file}: {self.instead}"  # by which built kernels are found
        _put(native, "_kernel_state", lambda: state)


def _loosened() -> None:
    make = solver.Solver.__init__

    def loose(
        self: Any,
        kernel: Any,
        case: Any,
        method: Any,
        tolerance: float,
        atol: Any,
        step: float = 0.0,
        *rest: Any,
        **more: Any,
    ) -> None:
        factor = min(1e5, 0.1 / tolerance)
        make(self, kernel, case, method, factor * tolerance, factor * atol, 10 * step, *rest, **more)

    _put(solver.Solver, "__init__", loose)


def _failures_swallowed() -> None:
    _put(kernel_run, "_failure", lambda *_: None)


def _start_moved() -> None:
    make = case.initial_state

    def moved(*given: Any) -> Any:
        z, y = make(*given)
        return z, y + 1e-3

    _put(case, "initial_state", moved)


def _not_assembled() -> None:
    make, error = case.assemble, _module("runtime.outcome").SimulationError
    Assembled = _module("runtime.start.initial").Assembled

    def as_wanted(problem: Any, functions: Any, t: float, wanted: Any, *rest: Any) -> Any:
        try:
            return replace(make(problem, functions, t, wanted, *rest), y=wanted)
        except error:
            return Assembled(wanted, np.ones(problem.nv), np.zeros(len(problem.assembly)), (0, 0), ())

    _put(case, "assemble", as_wanted)


def _estimate_understated() -> None:
    make = accuracy.compare

    def small(*given: Any) -> Any:
        made = make(*given)
        tiny = dict.fromkeys(made.by_state, 1e-16)
        return replace(made, largest=1e-16, at_end=1e-16, by_state=tiny, by_state_at_end=tiny)

    _put(companion, "compare", small)


def _nominal_one() -> None:
    _put(simulate, "nominal_of", lambda case: np.ones(case.problem.ny))


def _kinks_ignored() -> None:
    _put(inputs.Table, "kinks", lambda self: np.empty(0))


def _checks_ignored() -> None:
    _put(case, "check_parameters", lambda *_: None)
    _put(case, "check_state", lambda *_: None)


def _masses_unchecked() -> None:
    accelerations = _module("compiler.equations.solve.accelerations")
    _put(accelerations, "massless", lambda *_: ZeroDivisionError("a pivot is zero"))
    balances = _module("compiler.equations.rows.without_mass")._Work
    _put(balances, "_held", lambda _, block, *__: list(range(len(block))))


def _massless_starts_unchecked() -> None:
    _put(_module("compiler.equations.reported.assembly"), "_no_coordinate", lambda *_: None)


def _tables_unchecked() -> None:
    make = inputs.make_table

    def spread(times: Any, values: Any, *rest: Any, **more: Any) -> Any:
        rising = np.maximum.accumulate(np.array(times, float)) + 1e-6 * np.arange(len(times))
        return make(rising, values, *rest, **more)

    _put(inputs, "make_table", spread)


def _checks_silent() -> None:
    _put(companion, "contradictions", lambda *_, **__: ())


def _not_repeated(*looks: str) -> Callable[[], None]:
    def plant() -> None:
        for look in looks:
            _put(simulate, look, lambda plan, main, progress: (plan, main, ()))

    return plant


def _one_gap() -> None:
    _put(_module("compiler.mechanics.contacts"), "hollow_parts", lambda graph, gap: (gap,))


FAULTS = {
    "sign": Fault(
        "the first acceleration has the wrong sign",
        KernelEdit(
            "run.h",
            "    s->model->rhs(t, y, s->u, s->o.z, s->o.p, out);\n",
            "    s->model->rhs(t, y, s->u, s->o.z, s->o.p, out);\n"
            "    out[s->model->nq % s->ny] = -out[s->model->nq % s->ny];\n",
        ),
    ),
    "pushed": Fault(
        "every acceleration is larger by 1",
        KernelEdit(
            "run.h",
            "    s->model->rhs(t, y, s->u, s->o.z, s->o.p, out);\n",
            "    s->model->rhs(t, y, s->u, s->o.z, s->o.p, out);\n"
            "    for (int i = s->model->nq; i < s->model->nq + s->model->nv; i++) out[i] += 1;\n",
        ),
    ),
    "loose": Fault("tolerances are 1e5 times looser, fixed steps 10 times longer", _loosened),
    "no projection": Fault(
        "states are not projected onto their constraints",
        KernelEdit(
            "projection.c",
            "int mech_project(mech_solver *s, mech_real t, mech_real *y)\n{\n",
            "int mech_project(mech_solver *s, mech_real t, mech_real *y)\n{\n    if (s) return MECH_RUNNING;\n",
        ),
    ),
    "missed events": Fault(
        "events within a step are not seen",
        KernelEdit(
            "locate.c",
            "int mech_locate(mech_solver *s, mech_real h, int *hit, mech_real *part, int *hidden)\n{\n",
            "int mech_locate(mech_solver *s, mech_real h, int *hit, mech_real *part, int *hidden)\n{\n"
            "    *hit = -1;\n    *part = 1;\n    *hidden = 0;\n    if (s) return MECH_RUNNING;\n",
        ),
    ),
    "not normalised": Fault(
        "rotations are not normalised",
        KernelEdit("rotations.c", "k < model->n_rotations; k++) {", "k < 0 * model->n_rotations; k++) {"),
    ),
    "not switched": Fault(
        "stiffness is not detected",
        KernelEdit("stability.c", "++run->stiff_hits == STIFF_HITS", "(run->stiff_hits = 0) == STIFF_HITS"),
    ),
    "no refusal": Fault("failures of a run are swallowed", _failures_swallowed),
    "moved start": Fault("initial states are off by 0.001", _start_moved),
    "not assembled": Fault("initial states stay as they are guessed", _not_assembled),
    "understated": Fault("the estimated error is always 1e-16", _estimate_understated),
    "no nominal": Fault("all nominal values are 1", _nominal_one),
    "kinks ignored": Fault("steps go across the kinks of inputs", _kinks_ignored),
    "checks ignored": Fault("values out of range begin a run", _checks_ignored),
    "masses unchecked": Fault("a zero pivot is not explained", _masses_unchecked),
    "massless starts unchecked": Fault("starts may contradict balances", _massless_starts_unchecked),
    "tables unchecked": Fault("times of tables are made to increase", _tables_unchecked),
    "checks silent": Fault("no check is compared with the estimated errors", _checks_silent),
    "own size ignored": Fault(
        "states that stay small are measured by the sizes of others", _not_repeated("by_own_size")
    ),
    "passed over": Fault("nothing is looked for between steps", _not_repeated("_looked_at", "seen_between")),
    "one gap": Fault("a gap that is the least of several is one", _one_gap),
    "first come": Fault(
        "of contacts that depend on each other the first ones carry all",
        KernelEdit("rows.c", "if (shared && rank && rank < n)", "if (shared < 0)"),
    ),
    "missed times": Fault(
        "events at known times are not seen",
        KernelEdit(
            "schedule.c",
            "int mech_schedule_set(mech_solver *s, int ticks)\n{\n",
            "int mech_schedule_set(mech_solver *s, int ticks)\n{\n    if (s->run->report.t > s->o.t0) return 0;\n",
        ),
    ),
}
