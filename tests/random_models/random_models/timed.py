"""Laws and events that ask for the time in more than one comparison: pulses that repeat themselves, timers, cases that overlap, steps of
potentials beside laws that change with time.

Each statement holds what it means in plain words, which a twin says in its place.
"""

from __future__ import annotations

from random_models.lists import Chain
from random_models.scope import Scope, rare

SHARE = 0.12
"""Of the models."""


@rare(SHARE)
def timed(s: Scope) -> None:
    """Write some of it about two masses."""
    _Timed(s).write()


class _Timed(Chain):
    """Writes what happens to a chain of masses at given times."""

    def write(self) -> None:
        s = self.s
        self.n = 2
        text = f"structural parameter Integer {self.N} = 2;"
        self.say(text, text, name=self.N)
        self.m = s.fresh("p")
        self.masses = self.array(f"parameter Mass {self.m}", "kg")
        self.array(f"coordinate Length {self.x}", "m", -0.5, 0.5)
        self._energies()
        for part in s.random.sample(
            [self._pulses, self._timer, self._branches, self._stairs], s.pick((2, 3))
        ):
            part()

    def _pulses(self) -> None:
        """What repeats itself with time, by rests and whole parts."""
        x, (a, b) = self.x, self.numbers(2, -0.6, 0.6)
        period, part = float(self.s.number(0.08, 0.2)), self.s.pick((0.25, 0.4, 0.5))
        t, first = f"time/({period:g} s)", f"({part * period:.17g} s)"
        text, plain = self.s.pick(
            (
                (f"mod(time, {period:g} s) < {first}", f"time - {period:g} s*floor({t}) < {first}"),
                (f"mod(floor({t}), 2) == 0", f"floor({t}) - 2*floor(floor({t})/2) < 0.5"),
                (f"floor({t}) < 3", f"time < {3 * period:.17g} s"),
                (f"{t} - floor({t}) >= {part:g}", f"mod(time, {period:g} s) >= {first}"),
                (f"sin(2*pi*{t}) > 0", f"mod(time, {period:g} s) < {period / 2:.17g} s"),
            )
        )
        self.say(
            f"force (if {text} then {a:g} N else {b:g} N) on {x}[1];",
            f"force (if {plain} then {a:g} N else {b:g} N) on {x}[1];",
        )

    def _timer(self) -> None:
        """An event that says when it comes again."""
        s, n, late = self.s, self.s.fresh("n"), self.s.fresh("n")
        first, step = float(s.number(0.05, 0.12)), float(s.number(0.04, 0.1))
        a = self.numbers(1, -0.6, 0.6)[0]
        self.same(f"discrete Real {n} = 0;", f"discrete Time {late} = {first:g} s;")
        condition = s.pick((f"time >= {late}", f"time > {late}", f"{late} <= time", f"time - {late} >= 0 s"))
        text = f"when {condition} then {n} := {n} + 1; {late} := {late} + {n}*{step:g} s; end when;"
        self.say(text, text, kind="when")
        self.same(
            f"force {a:g} N*{n} on {self.x}[1];",
            f"force (if time < {late} - {0.3 * step:.3g} s then 0.2 N else 0 N) on {self.x}[2];",
        )

    def _branches(self) -> None:
        """Cases that overlap, of which the first that holds counts."""
        x, s = self.x, self.s
        a, b, c, d = (f"{v:g} N" for v in self.numbers(4, -0.7, 0.7))
        by = s.pick((f"{x}[1]", "time"))
        unit = "s" if by == "time" else "m"
        low, mid, high = (
            f"{by} < {v:g} {unit}"
            for v in sorted(self.numbers(3, 0.02, 0.9) if by == "time" else self.numbers(3, -0.6, 0.6))
        )
        self.say(f"force (if {low} then {a} elseif {mid} then {b} elseif {high} then {c} else {d}) on {x}[2];",
                 f"force (if {low} then {a} else (if {mid} then {b} else (if {high} then {c} else {d}))) on {x}[2];")  # fmt: skip
        self.output(
            f"(if {low} then 1 elseif {mid} then 2 elseif {high} then 3 else 4)",
            f"(if {low} then 1 else (if {mid} then 2 else (if {high} then 3 else 4)))",
        )

    def _stairs(self) -> None:
        """A body that crosses steps of a potential while laws of time change beside them."""
        s, q = self.s, self.s.fresh("q")
        start, speed, m = (
            -float(s.number(0.05, 0.15)),
            float(s.number(0.9, 1.6)),
            self.numbers(1, 0.6, 1.4)[0],
        )
        early, late = float(s.number(0.01, 0.04)), float(s.number(0.2, 0.5))
        height = self.numbers(1, -0.5, 0.25)[0]
        text = f"coordinate Length {q} = {start:g} m;"
        self.say(text, text, name=q)
        self.same(f"initial der({q}) = {speed:g} m/s;", f"kinetic 1/2*{m:g} kg*der({q})^2;")
        laws = [
            f"potential (if time < {s.pick((early, late)):g} s then 0.1 N else 0.4 N)*{q};",
            f"potential (if {q} < 0 m then 0 else {height:g} J);",
            f"potential (if {q} >= 0.1 m then {-height / 2:.17g} J else 0 J);",
        ]
        if s.chance(0.4):
            laws.append(f"lagrangian (if time > {late:g} s then 0.2 N else 0 N)*{q};")
        s.random.shuffle(laws)
        self.same(*laws)
