"""The kinds of studies: one row each, through which the command line, Python and files reach them."""

from __future__ import annotations

import functools
from importlib import import_module

from msgspec import Struct

from .study import Study


class Kind(Struct, frozen=True):
    """One kind: its name, what it asks in one line, and where its question is defined (``module:class``)."""

    name: str
    asks: str
    home: str

    def question(self) -> type[Study]:
        """Import the question; the others stay unread."""
        return _imported(self.home)

    def unused(self, setting: str) -> str:
        """Say why a setting cannot be given, or nothing where it is none of a run that the question does not use."""
        if setting not in self.question().unused:
            return ""
        return f"'{setting}' is a setting of a run, and would change nothing in the answer of the study '{self.name}'"


@functools.cache
def _imported(home: str) -> type[Study]:
    module, _, name = home.partition(":")
    found: object = getattr(import_module(f".{module}", __package__), name)
    assert isinstance(found, type) and issubclass(found, Study)
    return found


def kind_of(question: type[Study]) -> Kind:
    """Give the kind that a question is of."""
    home = f"{question.__module__.removeprefix(f'{__package__}.')}:{question.__name__}"
    (kind,) = (one for one in STUDIES.values() if one.home == home)
    return kind


STUDIES = {
    kind.name: kind
    for kind in (
        Kind("simulate", "How does it move, and how accurate is that?", "kinds.motion:Simulate"),
        Kind("sweep", "How does it move for each of several values?", "kinds.sweep:Sweep"),
        Kind(
            "ensemble",
            "What do thousands of runs give, over ranges, random values or a list of members?",
            "kinds.ensemble:EnsembleOf",
        ),
        Kind(
            "task",
            "Which reinforcement learning task does it pose, and what return do unchanged inputs give?",
            "kinds.task:Task",
        ),
        Kind(
            "linearize",
            "Which linear system approximates it near a state, between inputs and outputs?",
            "kinds.linearize:Linearize",
        ),
        Kind(
            "response",
            "With which gain and phase does it respond to sines, between inputs and outputs?",
            "kinds.response:Response",
        ),
        Kind("along", "Which linear systems approximate it along a run?", "kinds.along:LinearizeAlong"),
        Kind(
            "equilibria",
            "Where are its equilibria, are they stable, and how do they change with a parameter?",
            "kinds.equilibria:FindEquilibria",
        ),
        Kind(
            "curves",
            "Which curves make an integral stationary as a parameter varies, and where do they end?",
            "kinds.curves:FollowCurves",
        ),
        Kind(
            "steady",
            "Which motions are steady, with all but cyclic coordinates at rest, and are they stable?",
            "kinds.steady:Steady",
        ),
        Kind(
            "modes",
            "What are the frequencies, dampings and shapes of small motions?",
            "kinds.modes:FindModes",
        ),
        Kind(
            "fit",
            "Which parameters and initial values reproduce measured data, and which of them remain undetermined?",
            "kinds.fit:Fit",
        ),
        Kind(
            "virial",
            "What are the averages over a long motion, of energies and of named quantities?",
            "kinds.virial:Virial",
        ),
        Kind("orbit", "Which periodic motion is near the start, and is it stable?", "kinds.orbit:Orbit"),
        Kind(
            "floquet",
            "How do small changes of a periodic motion grow over a period? Is it stable?",
            "kinds.floquet:Floquet",
        ),
        Kind(
            "scattering",
            "By what angle is it deflected, as a function of the impact parameter?",
            "kinds.scattering:Scattering",
        ),
        Kind(
            "gradient",
            "How does a goal of a smooth motion change with many parameters at once?",
            "kinds.gradient:FindGradient",
        ),
        Kind(
            "optimum", "Which values make a goal of the motion greatest, or least?", "kinds.optimum:Optimum"
        ),
        Kind(
            "spectrum",
            "Which frequencies does a motion contain, and with which amplitudes?",
            "kinds.spectrum:Spectrum",
        ),
        Kind(
            "rainflow",
            "How many load cycles of which range occur, for fatigue?",
            "kinds.rainflow:Rainflow",
        ),
        Kind("diagram", "What does it settle to as a parameter varies?", "kinds.diagram:Diagram"),
        Kind(
            "hysteresis",
            "How does a motion follow a parameter that goes slowly up and down: where does it jump?",
            "kinds.hysteresis:Hysteresis",
        ),
        Kind(
            "threshold", "From which parameter value on does something happen?", "kinds.threshold:Threshold"
        ),
        Kind(
            "lyapunov", "How fast do neighbouring motions diverge: is it chaotic?", "kinds.lyapunov:Lyapunov"
        ),
        Kind(
            "volume",
            "Does the flow preserve the volume of phase space, or how fast does it shrink?",
            "kinds.volume:Volume",
        ),
        Kind("period", "How long does one swing last, as a function of the energy?", "kinds.period:Period"),
        Kind(
            "section",
            "Where does it cross a surface, or where is it once in every period?",
            "kinds.section:Section",
        ),
        Kind(
            "symmetries",
            "Which transformations leave it unchanged, and which quantities do they conserve?",
            "kinds.symmetries:Symmetries",
        ),
        Kind(
            "invariants",
            "Which polynomials in velocities or momenta are constant along every motion?",
            "kinds.invariants:Invariants",
        ),
        Kind(
            "brackets",
            "What are the Poisson brackets of quantities, and is a transformation canonical?",
            "kinds.brackets:Brackets",
        ),
        Kind(
            "dimensions",
            "What do the units allow, and on which dimensionless groups does it depend?",
            "kinds.dimensions:Dimensions",
        ),
        Kind("hamilton", "What are Hamilton's function and Hamilton's equations?", "kinds.hamilton:Hamilton"),
        Kind(
            "field",
            "Is a force field conservative, and what are its curl, circulation and potential?",
            "kinds.field:Field",
        ),
        Kind(
            "inertia",
            "What are mass, centre, inertia tensor and principal axes of bodies and of all together?",
            "kinds.inertia:InertiaOf",
        ),
        Kind(
            "kinematics",
            "How does a point move, in which components, and what is a rotation's axis and angle?",
            "kinds.kinematics:Kinematics",
        ),
        Kind(
            "action",
            "What is the action of the path, and the action variable of a swing?",
            "kinds.action:Action",
        ),
        Kind("energy", "Where can a motion of a given energy go?", "kinds.energy:Energy"),
        Kind(
            "portrait",
            "What do its paths in the phase plane look like: equilibria, separatrices?",
            "kinds.portrait:Portrait",
        ),
    )
}
