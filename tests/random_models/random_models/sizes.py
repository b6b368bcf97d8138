"""What is very small beside what is very large: oscillators from a nanometre to a hundred kilometres, none of which feels another.

Each is compared over its own size, as runs promise.
"""

from __future__ import annotations

from random_models.lists import Chain
from random_models.scope import Scope
from random_models.tree import Model

SHARE = 0.05
"""Of the models."""
_SIZES = {"1 nm": 9000, "40 nm": 4000, "1 um": 9000, "3e-5 m": 400, "2 km": 4, "1e5 m": 4}
"""With stiffnesses [N/m]: what is small moves faster, so that steps that are good enough for the large are not for it."""
_ASKED = {"energy", "kinetic_energy", "potential_energy"}
"""Questions whose answers the largest alone decides, but for what is lost beside it."""


def sizes(s: Scope, seed: int) -> None:
    """Write a few oscillators. Their random numbers are their own: models keep all else."""
    kinds = {e.kind for st in s.statements for slot in st.slots for e in slot.expression.walk()}
    if kinds & _ASKED or any("energy(" in str(part) for st in s.statements for part in st.parts):
        return
    with s.apart(f"sizes of {seed}"):
        if s.chance(SHARE):
            _Sizes(s).write()


def sized(model: Model) -> frozenset[str]:
    """Return the names of the states of a model that are compared over their own size."""
    names = {s.name for s in model.statements() if s.data and "sized" in s.data and s.name}
    return frozenset((*names, *(f"der({n})" for n in names)))


class _Sizes(Chain):
    """Writes masses on springs that grow stiffer."""

    mark = "sized"

    def write(self) -> None:
        s = self.s
        for size in s.random.sample(list(_SIZES), s.pick((1, 2, 3))):
            q = s.fresh("q")
            m, k, start, hard = self.numbers(4, 0.5, 1.5)
            text = f"coordinate Length {q} = {start:g}*({size});"
            self.say(text, text, name=q)
            self.same(
                f"initial der({q}) = {self.numbers(1, -3, 3)[0]:g}*({size})/(1 s);",
                f"kinetic 1/2*{m:g} kg*der({q})^2;",
                f"potential 1/2*{_SIZES[size] * k:g} N/m*{q}^2 + 1/4*{_SIZES[size] * hard:g} N/m/({size})^2*{q}^4;",
            )
            if s.chance(0.5):
                self.same(f"force -{0.3 * hard:g} kg/s*der({q})*(1 + ({q}/({size}))^2) on {q};")
            if s.chance(0.4):
                self.same(f"output {s.fresh('o')} = {q}/({size});")
