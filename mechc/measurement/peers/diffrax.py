"""Methods of diffrax, on the module for JAX that mechc writes of the model."""

from __future__ import annotations

import functools
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from ...runtime.outcome import SimulationError
from .shared import LATE, Library, found, refuse, times_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.integrate.solver import SolverOptions
    from ...runtime.integrate.trajectory import Trajectory
    from ...runtime.reference.work_precision import Peer

METHODS = ("Dopri8", "Tsit5", "Kvaerno5")
MOST_STEPS = 100_000


class Diffrax:
    """Runs of a model by one method, compiled by XLA for each set of output times, which is not a part of a run."""

    def __init__(self, model: CompiledModel, method: str) -> None:
        self._model = model
        self._method = method
        self._made: dict[bytes, Any] = {}

    @functools.cached_property
    def _module(self) -> dict[str, Any]:
        """What the module holds. Raises UsageMistake for what JAX cannot differentiate."""
        import jax

        from ...compiler.targets.differentiable import JAX, emit_differentiable
        from ...exporting import begin_of

        jax.config.update("jax_enable_x64", True)
        names: dict[str, Any] = {"__name__": "model"}
        exec(emit_differentiable(self._model.compilation.program, JAX, begin_of(self._model)), names)
        return names

    def __call__(self, case: Case, options: SolverOptions) -> Trajectory:
        refuse(case, events=True)
        if case.problem.constraints:
            raise SimulationError("is compared on models without constraints")
        import jax

        names = self._module
        times = times_of(case)
        key = times.tobytes() + options.atol.tobytes()
        if key not in self._made:
            self._made[key] = self._solve(case, options, times)
        solve = self._made[key]
        given = {q.name: float(v) for q, v in zip(case.problem.parameters, case.p, strict=False)}
        free = {name: given[name] for name in names["INDEPENDENT"]}
        state, p = jax.numpy.asarray(case.y0), names["all_parameters"](free)
        jax.block_until_ready(solve(state, p, options.tolerance))  # compiles
        begun, clock = time.thread_time(), time.perf_counter()
        rows, steps, failed = jax.block_until_ready(solve(state, p, options.tolerance))
        # XLA may work in threads of its own, whose time the processor's clock of this one does not count
        taken = max(time.thread_time() - begun, time.perf_counter() - clock)
        end = "the most steps are reached" if bool(failed) else ""
        return found(
            case, options, np.asarray(rows), int(steps), 0, taken, LATE if taken > options.seconds else end
        )

    def _solve(self, case: Case, options: SolverOptions, times: Any) -> Any:
        import diffrax
        import jax

        names = self._module

        def rates(t: Any, y: Any, p: Any) -> Any:
            return jax.numpy.asarray(names["rhs"](t, y, (), p))

        def run(y: Any, p: Any, tolerance: Any) -> Any:
            made = diffrax.diffeqsolve(
                diffrax.ODETerm(rates),
                getattr(diffrax, self._method)(),
                case.begin,
                case.stop,
                None,
                y,
                p,
                saveat=diffrax.SaveAt(ts=jax.numpy.asarray(times)),
                stepsize_controller=diffrax.PIDController(
                    rtol=tolerance, atol=tolerance * jax.numpy.asarray(options.nominal), dtmax=case.max_step
                ),
                max_steps=MOST_STEPS,
                throw=False,
            )
            return made.ys, made.stats["num_steps"], made.result != diffrax.RESULTS.successful

        return jax.jit(run)


def _runs(model: CompiledModel, _parts: frozenset[str]) -> Mapping[str, Peer]:
    return {f"diffrax:{method}": Diffrax(model, method) for method in METHODS}


DIFFRAX = Library(
    "diffrax",
    "diffrax",
    "the module for JAX that mechc writes, in double precision, compiled by XLA before the run",
    _runs,
)
