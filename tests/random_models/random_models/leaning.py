"""Rough rods that lean and slide: by Coulomb's law one motion goes on from there, several, or none (docs/events.md, section 9)."""

from __future__ import annotations

import math

from random_models.lists import Chain
from random_models.scope import Scope, rare

SHARE = 0.05
"""Of the models."""


@rare(SHARE)
def leaning(s: Scope) -> None:
    """Write a rod."""
    _Leaning(s).write()


class _Leaning(Chain):
    """Writes a rod whose lower end slides on a floor as the model begins, or right above it."""

    def write(self) -> None:
        s = self.s
        x, y, a = (s.fresh("q") for _ in range(3))
        m, l = self.numbers(2, 0.5, 1.5)
        angle, mu = self.numbers(1, 0.5, 1.4)[0], s.pick((0.2, 0.5, 1, 2, 3, 4))
        slides, turns = self.numbers(1, -8, 8)[0], self.numbers(1, -1, 4)[0]
        if s.chance(
            0.5
        ):  # turns so fast that it would rise by itself, and rough enough to be held down by its own friction
            slides, turns, mu = self.numbers(1, -9, -3)[0], self.numbers(1, 3.5, 6)[0], s.pick((2, 3, 4))
        above = s.pick((0, 0, 0.01))
        height, falls = l * math.sin(angle) + above, l * math.cos(angle) * turns
        for text in (
            f"coordinate Length {x} = 0 m;",
            f"coordinate Length {y} = {height:.17g} m;",
            f"coordinate Angle {a} = {angle:g} rad;",
        ):
            self.say(text, text, name=text.split()[2])
        self.same(
            f"initial der({x}) = {slides:g} m/s;",
            f"initial der({y}) = {falls:.17g} m/s;",
            f"initial der({a}) = {turns:g} rad/s;",
            f"kinetic 1/2*{m:g} kg*(der({x})^2 + der({y})^2) + 1/6*{m * l * l:.17g} kg.m^2*der({a})^2;",
            f"potential {m:g} kg*9.81 m/s^2*{y};",
            f"contact {s.fresh('C')}: {y} - {l:g} m*sin({a}) friction {mu:g} along der({x} - {l:g} m*cos({a}));",
        )
