"""What is drawn to a centre, by all forms that a power of a distance has; other forms of the same stand in a twin."""

from __future__ import annotations

from random_models.lists import Chain
from random_models.scope import Scope, rare

SHARE = 0.06
"""Of the models."""


@rare(SHARE)
def orbits(s: Scope) -> None:
    """Write a body that goes around."""
    _Orbit(s).write()


class _Orbit(Chain):
    """Writes a body in the plane or in space, and what draws it."""

    mark = "sharp"

    def write(self) -> None:
        s = self.s
        n, r = s.pick((2, 2, 3)), self.x
        m, k = self.numbers(2, 0.6, 1.6)
        start = [self.s.pick((0.8, 1.0, 1.3)), 0.1, 0.2][:n]
        rate = [0.1, s.pick((0.7, 1.0, 1.2)), -0.2][:n]
        for head, values, unit in (
            (f"coordinate Length {r}[{n}]", start, "m"),
            (f"initial der({r})", rate, "m/s"),
        ):
            text = f"{head} = {{{', '.join(f'{v:g}' for v in values)}}} {unit};"
            self.say(text, text, name=r if unit == "m" else "")
        self.same(f"kinetic 1/2*{m:g} kg*dot(der({r}), der({r}));")
        square = " + ".join(f"{r}[{i}]^2" for i in range(1, n + 1))
        power = s.pick((1, 1, 2, 3))  # of the distance in the potential, as a divisor
        d = f"({square})"
        ways = [
            (f"1/norm({r})^{p}", f"{d}^(-{p}/2)", f"1/sqrt({d})^{p}", f"1/dot({r}, {r})^({p}/2)", f"1/{d}^{p / 2:g}", f"exp(-{p}*log(norm({r})/(1 m)))/(1 m)^{p}")
            for p in (power, power + 2)
        ]  # fmt: skip
        text, plain = s.random.sample(ways[0], 2)
        unit = f"J.m^{power}"
        if s.chance(0.5):
            self.say(f"potential -{k:g} {unit}*{text};", f"potential -{k:g} {unit}*{plain};")
        else:
            for i in range(1, n + 1):
                text, plain = s.random.sample(ways[1], 2)
                self.say(f"force -{power * k:g} {unit}*{r}[{i}]*{text} on {r}[{i}];",
                         f"force -{power * k:g} {unit}*{r}[{i}]*{plain} on {r}[{i}];")  # fmt: skip
        if s.chance(0.4):
            text, plain = s.random.sample(ways[0], 2)
            self.output(f"{text}*(1 m)^{power}", f"{plain}*(1 m)^{power}")
        if s.chance(0.4):
            c = f"{self.numbers(1, 0.02, 0.1)[0]:g} kg"
            self.say(f"force -{c}*norm(der({r}))*der({r}[1])/(1 m) on {r}[1];",
                     f"force -{c}*sqrt({' + '.join(f'der({r}[{i}])^2' for i in range(1, n + 1))})*der({r}[1])/(1 m) on {r}[1];")  # fmt: skip
        if s.chance(0.6):
            u, k = f"({d}/(1 m)^2)", self.numbers(1, 0.1, 0.4)[0]
            roots = (
                f"sqrt(sqrt({u}))",
                f"{u}^0.25",
                f"1/sqrt(1/sqrt({u}))",
                f"(1/{u}^1.5)^(-1/6)",
                f"sqrt({u}^0.5)",
                f"sqrt(sqrt(1/{u}))^-1",
            )
            text, plain = s.random.sample(roots, 2)
            self.say(
                f"force -{k:g} N/m*{text}*{r}[1] on {r}[1];", f"force -{k:g} N/m*{plain}*{r}[1] on {r}[1];"
            )
