"""Fields of gravity inside of each other: of the model, of a component, and of one inside of that; the nearest outwards holds.

A twin says the weights as energies.
"""

from __future__ import annotations

from random_models.lists import Chain
from random_models.scope import Scope
from random_models.tree import statement

SHARE = 0.08
"""Of the models in the plane or in space."""
_ASKED = ("mass_centre", "inertia_tensor")
"""What counts masses, which energies are not."""


def weights(s: Scope, seed: int) -> None:
    """Write cabins with masses. Their random numbers are their own: models keep all else."""
    with s.apart(f"weights of {seed}"):
        if s.space and s.chance(SHARE) and not any(word in str(st) for st in s.statements for word in _ASKED):
            _Weights(s).write()


class _Weights(Chain):
    """Writes a cabin in a train, or alone."""

    def write(self) -> None:
        s = self.s
        outer = next((str(x.slots[0].expression) for x in s.statements if x.kind == "gravity"), "")
        cabin, train = s.fresh("Cabin"), s.fresh("Train")
        fields = [self._field() if s.chance(0.6) else "" for _ in range(2)]
        if not any(fields):
            fields[s.pick((0, 1))] = self._field()
        inner, middle = fields
        self._cabin(cabin, inner)
        text = f"model {train} {_said(middle)} parameter Mass m = 1 kg; {cabin} c(m = 2*m); end {train};"
        s.file.items.append(statement("class", text, name=train))
        a, b, both = s.fresh("c"), s.fresh("c"), s.pick((True, True, False))
        m = self.numbers(2)
        self._put(train, a, "c.", m[0], 2 * m[0], inner or middle or outer)
        if both:
            self._put(cabin, b, "", m[1], m[1], inner or outer)

    def _field(self) -> str:
        g = self.numbers(self.s.space, -3, 3)
        return "{" + ", ".join(f"{x:g}" for x in g) + "} m/s^2"

    def _cabin(self, name: str, field: str) -> None:
        axes = ("x", "y", "z")[: self.s.space]
        own = " ".join(
            f"coordinate Length {q} = {x:g} m;"
            for q, x in zip(axes, self.numbers(len(axes), -1, 1), strict=True)
        )
        parts = [
            _said(field),
            "parameter Mass m = 1 kg;",
            own,
            f"frame f = world * trans({{{', '.join(axes)}}});",
            "mass m at f;",
        ]
        light = name.replace("Cabin", "Light")
        self.s.random.shuffle(parts)
        self.s.file.items.append(statement("class", f"model {name} {' '.join(parts)} end {name};", name=name))
        text = f"model {light} parameter Mass m = 1 kg; {own} end {light};"
        self.s.file.items.append(statement("class", text, name=light))
        self.light, self.axes = light, axes

    def _put(self, kind: str, name: str, inside: str, told: float, m: float, field: str) -> None:
        """Write a component; its twin has the energies of its mass in the field that reaches it."""
        q = [f"{name}.{inside}{axis}" for axis in self.axes]
        speeds = " + ".join(f"der({x})^2" for x in q)
        light = kind.replace("Cabin", "Light").replace("Train", "LightTrain")
        if inside:
            text = f"model {light} parameter Mass m = 1 kg; {self.light} c(m = 2*m); end {light};"
            self.s.file.items.append(statement("class", text, name=light))
        plain = [f"{light} {name}(m = {told:g} kg);", f"kinetic 1/2*{m:g} kg*({speeds});"]
        plain += [f"potential -{m:g} kg*dot({field}, {{{', '.join(q)}}});"] if field else []
        self.say(f"{kind} {name}(m = {told:g} kg);", *plain, name=name)
        self.same(f"force -0.5 N/m*{q[0]} on {q[0]};")


def _said(field: str) -> str:
    return f"gravity {field};" if field else ""
