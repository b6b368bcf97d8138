"""Models with events, or with constraints through singular positions, as peers get them: as the FMU for Model Exchange that mechc writes, in this process.

The peer integrates and looks for roots; what happens at an event, and the way back onto the constraints, is the unit's.
"""

from __future__ import annotations

import ctypes
from ctypes import POINTER, Structure, byref, c_char_p, c_double, c_int, c_long, c_void_p
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...compiler.targets.fmu.export import make_package, start_of
from ...lang.diagnostics import CompileError
from ...runtime.methods import SOLVING_CONTACTS
from ...runtime.native.build import build_shared, kernel_flags
from ...runtime.native.contract import Signatures, declare, fields
from ...runtime.outcome import SimulationError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ...model import CompiledModel
    from ...runtime.case import Case
    from ...runtime.integrate.solver import SolverOptions
    from ...runtime.problem import Array

SOURCE = Path(__file__).parent / "exchange.c"
METHOD = "auto"
"""Of the solver in the unit, which serves for instants alone: with it the unit has the Jacobian."""
CLOSE = 1e-9
"""By how much, over nominal + |value|, the state in which a unit begins may differ from that of the runs that are compared."""
ROOM = 100.0
"""By how many times its tolerance a multi-step method may leave what holds before it must begin again, at order one: with less it
would after each step."""
REACHED, HAPPENS, RUNNING = 0, 1, 3
"""What ``peer_unit_advance`` returns."""


def exchanged(case: Case) -> bool:
    """Return whether peers get a model as a unit: it has events, or inputs, or passes singular positions, where a state that has left
    its constraints a little goes on elsewhere. Other constraints hold as well as the method integrates their second derivatives."""
    problem = case.problem
    return problem.hybrid is not None or bool(problem.inputs) or bool(case.functions.struct.closeness)


class Stopped(Exception):
    """A unit cannot go on from ``time``."""

    def __init__(self, time: float, said: str) -> None:
        super().__init__(said)
        self.time = time


class CvodeStruct(Structure):
    """peer_cvode of exchange.c"""

    _fields_ = fields("pointer memory, state, row, step, between")


_SIGNATURES: Signatures = {
    "peer_unit_new": (c_void_p, (c_double, c_double, c_double)),
    "peer_unit_free": (None, (c_void_p,)),
    "peer_unit_said": (c_char_p, (c_void_p,)),
    "peer_unit_next": (c_double, (c_void_p,)),
    "peer_unit_ended": (c_int, (c_void_p,)),
    "peer_unit_evaluations": (c_long, (c_void_p,)),
    "peer_unit_steps": (c_long, (c_void_p,)),
    "peer_unit_indicator_count": (c_int, (c_void_p,)),
    "peer_unit_indicator_places": (POINTER(c_int), (c_void_p,)),
    "peer_unit_has_jacobian": (c_int, (c_void_p,)),
    "peer_unit_read": (None, (c_void_p, c_void_p)),
    "peer_unit_serve": (None, (c_void_p,) * 3),
    "peer_unit_happen": (c_int, (c_void_p, c_double, c_void_p)),
    "peer_unit_rates": (c_int, (c_double, *(c_void_p,) * 3)),
    "peer_unit_indicators": (c_int, (c_double, *(c_void_p,) * 3)),
    "peer_unit_completed": (c_int, (c_double, *(c_void_p,) * 2)),
    "peer_unit_project": (c_int, (c_double, *(c_void_p,) * 2)),
    "peer_unit_modes": (None, (c_void_p, c_int, *(c_void_p,) * 3)),
    "peer_unit_advance": (
        c_int,
        (
            *(c_void_p, POINTER(CvodeStruct), c_double, POINTER(c_double), c_long, c_void_p, c_long),
            *(POINTER(c_long), c_void_p),
        ),
    ),
}


class Exchange:
    """The unit of a model, built once for each experiment."""

    def __init__(self, model: CompiledModel) -> None:
        self._model = model
        self._built: dict[str, ctypes.CDLL | SimulationError] = {}

    def unit(self, case: Case, options: SolverOptions, *, multi_step: bool) -> ExchangeUnit:
        """Return a unit at the start of a case. Raises SimulationError for a model that no importer can integrate."""
        if case.experiment not in self._built:
            try:
                self._built[case.experiment] = self._library(case, options.nominal)
            except SimulationError as refused:
                self._built[case.experiment] = refused
            except CompileError as refused:
                self._built[case.experiment] = SimulationError(refused.diagnostics[0].message)
        library = self._built[case.experiment]
        if isinstance(library, SimulationError):
            raise library
        return ExchangeUnit(library, case, options, ROOM if multi_step else 1.0)

    def _library(self, case: Case, nominal: Array) -> ctypes.CDLL:
        from ...fmu.export import equations_for

        model, problem = self._model, case.problem
        if any(np.ptp(table.values) > 0 for table in case.tables.values()):
            raise SimulationError("is compared on models whose inputs no table moves")
        if case.functions.struct.hybrid and "delays" in model.compilation.equations.needs:
            raise SimulationError("cannot run delays, which look back at the motion")
        if model.method(case.experiment) in SOLVING_CONTACTS:
            raise SimulationError(f"cannot solve for contacts at the ends of steps, as '{METHOD}' does")
        sizes = {q.name: float(v) for q, v in zip(problem.states, nominal, strict=True)}
        start = start_of(model.problem(method=METHOD), case.experiment or None, model.settings, sizes)
        package = make_package(
            equations_for(model, METHOD),
            start,
            fmi=2,
            kinds=("me",),
            method=METHOD,
            platforms=(),
            parts=model.compilation.parts,
        )
        folder = "sources/"
        texts = {
            name.removeprefix(folder): data for name, data in package.files.items() if name.startswith(folder)
        }
        sources = {name: data.decode() for name, data in texts.items()}
        own = {SOURCE.name: SOURCE.read_text(encoding="utf-8")}
        unit = build_shared(sources | own, kernel_flags(), name="peer-unit")
        return declare(ctypes.CDLL(str(unit)), _SIGNATURES)


class ExchangeUnit:
    """One unit at a time of its run."""

    def __init__(self, library: ctypes.CDLL, case: Case, options: SolverOptions, room: float) -> None:
        self.library = library
        self._case = case
        self.address = library.peer_unit_new(case.begin, case.stop, room * options.tolerance)
        if not self.address:
            raise MemoryError("a unit could not be allocated")
        if said := self.said:
            raise SimulationError(f"as a unit for Model Exchange: {said}")
        self.count: int = library.peer_unit_indicator_count(self.address)
        self.places: list[int] = library.peer_unit_indicator_places(self.address)[: self.count]
        self.y = np.empty(case.y0.size)
        library.peer_unit_read(self.address, self.y.ctypes.data)
        apart = np.abs(self.y - case.y0) / (options.nominal + np.abs(case.y0))
        if not float(apart.max(initial=0.0)) <= CLOSE and case.problem.hybrid is None:
            raise SimulationError("as a unit for Model Exchange begins in another state than runs do")

    def __del__(self) -> None:
        if getattr(self, "address", None):
            self.library.peer_unit_free(self.address)

    @property
    def said(self) -> str:
        """Why the last call failed."""
        text: bytes = self.library.peer_unit_said(self.address)
        return text.decode(errors="replace")

    @property
    def evaluations(self) -> int:
        """How often rates were asked for."""
        return int(self.library.peer_unit_evaluations(self.address))

    @property
    def steps(self) -> int:
        """How many steps ``advance`` has taken."""
        return int(self.library.peer_unit_steps(self.address))

    @property
    def next(self) -> float:
        """Time up to which the unit may be integrated: that of an event which is known before, or the end."""
        return min(float(self.library.peer_unit_next(self.address)), self._case.stop)

    @property
    def ended(self) -> bool:
        """Whether the model has ended its run."""
        return bool(self.library.peer_unit_ended(self.address))

    def happen(self, t: float, y: NDArray[np.float64]) -> Array:
        """Let happen what is due; return the state after it. Raises Stopped."""
        y = np.array(y, dtype=np.float64)
        if self.library.peer_unit_happen(self.address, t, y.ctypes.data):
            raise Stopped(t, self.said)
        return y

    def completed(self, t: float, y: Array) -> bool:
        """Return whether a step ends so far off that the unit wants to be told."""
        y = np.ascontiguousarray(y)
        return bool(self.library.peer_unit_completed(t, y.ctypes.data, self.address))

    def project(self, t: float, y: Array) -> Array:
        """Return the state on the constraints; as it is where that fails."""
        y = np.array(y, dtype=np.float64)
        self.library.peer_unit_project(t, y.ctypes.data, self.address)
        return y

    def modes(self) -> tuple[Array, Array, Array]:
        """Return discrete variables, then sign of each indicator and what is added to it."""
        z, sign, added = np.zeros(self._case.z.size), np.ones(self.count), np.zeros(self.count)
        self.library.peer_unit_modes(self.address, z.size, z.ctypes.data, sign.ctypes.data, added.ctypes.data)
        return z, sign, added

    def advance(
        self,
        cvode: CvodeStruct,
        end: float,
        t: c_double,
        steps: int,
        times: Array,
        written: c_long,
        rows: Array,
    ) -> int:
        """Take CVODE on: REACHED, HAPPENS, RUNNING, or what it returned."""
        status: int = self.library.peer_unit_advance(
            self.address,
            byref(cvode),
            end,
            byref(t),
            steps,
            times.ctypes.data,
            times.size,
            byref(written),
            rows.ctypes.data,
        )
        return status
