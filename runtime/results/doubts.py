"""What a run says where a check contradicts its estimated errors: what disagrees, and what is likely to be the cause."""

from __future__ import annotations

from msgspec import Struct

_FORCES = (
    "the equations of motion or a reaction are wrong, which is a fault of mechc: please report it with the model. "
    "The motion may be correct and only the reactions wrong. Or the mechanism stays near a position in which its "
    "constraints depend on each other"
)
_JOINTS = (
    "the method does not keep the constraints of the loop that this joint closes, or an equation of the joint is missing, "
    "which is a fault of mechc: please report it with the model"
)
CAUSES: dict[tuple[str, bool | None], str] = {
    ("energy", True): (
        "a tighter run is off as much, so the steps are not the cause: a force or a jump whose work is counted wrongly, "
        "a kink or an event that was passed over, or wrong equations. Compare with a model that states the same in "
        "another way; if both agree, the motion may be correct and only its energy account wrong"
    ),
    ("momentum", True): (
        "a tighter run is off as much, so the steps are not the cause: a kink or an event that was passed over, an "
        "impulse of an event, or wrong equations"
    ),
    ("closed solution", True): (
        "a tighter run is off as much: the closed solution belongs to other values or to a simpler model, or a kink or "
        "an event was passed over"
    ),
    ("work", None): (
        "the estimated errors show it, too: one of two runs has stepped over work that the other has seen, such as that of a short "
        "pulse; a tighter tolerance or a closer 'every' resolves it"
    ),
    ("", False): (
        "a tighter run is off less: the steps were too long for something that affected both runs, so the errors are "
        "larger than estimated; a tighter tolerance, or a closer 'every', resolves it"
    ),
    ("work", True): (
        "steps of one size have supplied or lost it, and no account contains it: stiff forces that change nonlinearly within a step, such as those of "
        "nonlinear springs, or bodies that turn far in one step; a smaller step reduces it"
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
