"""What a run says where a check contradicts its estimated errors: what disagrees, and what is likely to be the cause."""

from __future__ import annotations

from msgspec import Struct

_FORCES = (
    "the equations of motion or a reaction are wrong, which is a fault of mechc: please report it with the model. "
    "Reactions may be wrong in a motion that is right. Or the mechanism stays near a position in which its "
    "constraints depend on each other"
)
_JOINTS = (
    "the method does not keep the constraints of the loop that this joint closes, or an equation of the joint is missing, "
    "which is a fault of mechc: please report it with the model"
)
CAUSES: dict[tuple[str, bool | None], str] = {
    ("energy", True): (
        "a tighter run is off as much, so that it is not the steps: a force or a jump whose work is counted wrongly, "
        "a kink or an event that was passed over, or equations that are wrong. Compare a model that says the same in "
        "other words; if that agrees with this one, the motion may be right and its account of energy is not"
    ),
    ("momentum", True): (
        "a tighter run is off as much, so that it is not the steps: a kink or an event that was passed over, an "
        "impulse of an event, or equations that are wrong"
    ),
    ("closed solution", True): (
        "a tighter run is off as much: the closed solution belongs to other values or to a simpler model, or a kink or "
        "an event was passed over"
    ),
    ("work", None): (
        "the estimated errors say so, too: of two runs one has passed over work that the other has seen, as of something short "
        "between their steps; a tighter tolerance or a closer 'every' shows it"
    ),
    ("", False): (
        "a tighter run is off less: the steps were too long for something that both runs felt, so that the errors are "
        "larger than estimated; a tighter tolerance, or a closer 'every', shows it"
    ),
    ("work", True): (
        "steps of one size have supplied or lost it, and no account holds it: stiff forces that bend within a step, as of a spring that is not "
        "linear, or bodies that turn far in one; a smaller step shows it"
    ),
    ("force", None): _FORCES,
    ("moment", None): _FORCES,
    ("place", None): _JOINTS,
    ("direction", None): _JOINTS,
    ("constraints", None): (
        "the mechanism is near a position in which its constraints depend on each other, or it was not projected"
    ),
}
"""By kind of the check, and whether a tighter run is off as much; "" for any kind."""

ALLOWS = {
    **dict.fromkeys(("force", "moment"), "rounding allows"),
    **dict.fromkeys(("place", "direction"), "a closed loop allows"),
    "work": "1 % of the energies is",
}
"""What says how much a check may be off by that holds whatever the errors of the motion."""


class Contradiction(Struct, frozen=True):
    """A check that disagrees with the estimated errors. ``kind``: energy, momentum, closed solution, constraints; work, of a balance of
    energy that is off by a share of it, as the estimated errors tell, and by steps of one size where that ``persists``; force and moment of a body, and place and direction of a joint, which hold at each instant.

    ``found``: its largest size in SI, beyond what is ``allowed`` by the estimates from the time ``since`` on.
    ``persists``: a run at a tighter tolerance is off as much; None where that is not known.
    """

    kind: str
    name: str
    unit: str
    found: float
    allowed: float
    since: float | None
    persists: bool | None

    @property
    def subject(self) -> str:
        match self.kind:
            case "momentum":
                return f"'{self.name}', which ought to stay,"
            case "closed solution":
                return f"'{self.name}', against its closed solution,"
            case "constraints":
                return f"the constraints of {self.name}"
            case "force":
                return f"Newton's law of '{self.name}'"
            case "moment":
                return f"Euler's law of '{self.name}'"
            case "place" | "direction":
                return f"the {self.kind} of the end of joint '{self.name}'"
            case _:
                return f"the {self.name}"

    @property
    def causes(self) -> str:
        """Name what is likely to be the cause."""
        persists = self.persists
        return CAUSES["", False] if persists is False else CAUSES[self.kind, persists]

    def text(self, unit: str | None = None, factor: float = 1.0, time_unit: str = "") -> str:
        """Say what disagrees, in SI or in another ``unit``, which is ``factor`` times as small."""
        verb = "are" if self.kind == "constraints" else "is"
        unit = self.unit if unit is None else unit
        unit = f" {unit}" if unit and unit != "1" else ""
        begin = "" if self.since is None else f" from t = {self.since:.6g}{time_unit} on"
        found, allowed = self.found * factor, self.allowed * factor
        allows = ALLOWS.get(self.kind, "the estimated errors allow")
        return f"{self.subject} {verb} off by {found:.2g}{unit}{begin}, and {allows} {allowed:.2g}{unit}"
