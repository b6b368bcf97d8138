"""What is narrow, by formulas that runs look at (accuracy, what steps may pass over): hills that a body meets within a small part of its way, pushes that are over within a small part of the time.

Nothing else moves with them, so that the steps of a method grow, and might pass over them.
"""

from __future__ import annotations

from random_models.lists import Chain
from random_models.scope import Scope, rare
from random_models.tree import Model

SHARE = 0.06
"""Of the models."""


@rare(SHARE)
def narrow(s: Scope) -> None:
    """Write one or two of them."""
    _Narrow(s).write()


def is_marked(model: Model, *marks: str) -> bool:
    """Whether a model has something of a kind."""
    return any(s.data and mark in s.data for s in model.statements() for mark in marks)


class _Narrow(Chain):
    """Writes a body that moves freely but for what is narrow."""

    mark = "narrow"

    def write(self) -> None:
        s = self.s
        for part in s.random.sample([self._hill, self._push, self._switch], s.pick((1, 1, 2))):
            part()

    def _body(self, speed: float) -> tuple[str, float]:
        """Write a mass that moves by itself; return its coordinate and what it weighs."""
        q, m = self.s.fresh("q"), self.numbers(1, 0.5, 2)[0]
        self.same(
            f"coordinate Length {q} = 0 m;",
            f"initial der({q}) = {speed:g} m/s;",
            f"kinetic 1/2*{m:g} kg*der({q})^2;",
        )
        return q, m

    def _hill(self) -> None:
        """A hill that turns the body back or lets it pass, or a hole."""
        s, speed, place = self.s, self.numbers(1, 0.7, 1.3)[0], self.numbers(1, 0.1, 0.25)[0]
        q, m = self._body(speed)
        width = s.pick((2.0, 3.0, 5.0))
        height = 0.5 * m * speed**2 * s.pick((0.4, 1.8, -0.8))
        u = f"(({q} - {place:g} m)/{width:g} mm)"
        form = s.pick(
            (
                f"exp(-{u}^2)",
                f"(1 - tanh({u})^2)",
                f"(1 + tanh({u}))/2",
                f"(0.5 + atan({u}^3)/pi)",
                f"table({u}, {{-9, -3, -1, 0, 1, 3, 9}}, {{0, 0, 0.4, 1, 0.4, 0, 0}})",
            )
        )
        self.same(f"potential {height:.6g} J*{form};")
        if s.chance(0.7):
            n = s.fresh("n")
            self.same(f"discrete Real {n} = 0;")
            self.say(text := f"when {q} > {place + 0.05:g} m then {n} := 1; end when;", text, kind="when")

    def _push(self) -> None:
        """A push that comes late, and is short; what is at rest until then may go on at once."""
        s, late = self.s, self.numbers(1, 0.15, 0.35)[0]
        q, m = self._body(s.pick((0.0, 0.0, 0.6)))
        width = s.pick((1.0, 2.0, 4.0))
        u = f"((time - {late:g} s)/{width:g} ms)"
        form = s.pick((f"exp(-{u}^2)", f"(1 - tanh({u})^2)", f"exp(-abs({u}))"))
        self.same(f"force {200 * m:g} N*{form} on {q};")
        if s.chance(0.5):
            x = s.fresh("x")
            self.same(f"state Real {x} = 0;", f"equation der({x}) = {form}/(10 ms) - {x}/(0.5 s);")
        if s.chance(0.6):
            n = s.fresh("n")
            self.same(f"discrete Real {n} = 0;")
            self.say(text := f"when der({q}) > 0.1 m/s then {n} := 1; end when;", text, kind="when")

    def _switch(self) -> None:
        """A law that holds for a moment, and a contact that is touched for one."""
        s, late, short = self.s, self.numbers(1, 0.1, 0.35)[0], self.s.pick((1.0, 3.0))
        q, m = self._body(s.pick((0.0, 0.5)))
        end = late + 1e-3 * short
        self.same(f"force (if time > {late:g} s and time < {end:.6g} s then {300 * m:g} N else 0 N) on {q};")
        if s.chance(0.5):
            place = self.numbers(1, 0.05, 0.12)[0]
            self.same(f"force (if abs({q} - {place:g} m) < 1 mm then {-50 * m:g} N else 0 N) on {q};")
