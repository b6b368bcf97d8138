"""Random machines: masses with nodes without mass, frictions on these, laws by functions with bodies, delays and noise.

Their definition is an integrator of its own: SciPy's DOP853 between all instants where something bends (turns of frictions, numbers of
noise, what comes again after a delay), with nodes eliminated by hand and the past looked up in the pieces.

    python -m random_models.machines 0 300       # examine the machines of some seeds
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import ndtri

import mechc
from random_models.networks import CLASSES, Network, network

Array = NDArray[np.float64]

STOP = 3.0
CLOSE = 1e-7
"""Difference of a place, relative to one and its size, that both integrators may leave."""
BOUNDLESS = 1e8
"""What no machine comes to, if it does not go to infinity."""
NETWORKS = 0.4
"""Share of the machines that have a network of nodes, too."""
MASK = 0xFFFFFFFF

# ---------------------------------------------------------------- noise, from the page of the language and the paper on Philox


def _philox(counter: list[int], key: list[int]) -> list[int]:
    a, b, c, d = counter
    for turn in range(10):
        k0, k1 = ((k + turn * w) & MASK for k, w in zip(key, (0x9E3779B9, 0xBB67AE85), strict=True))
        one, two = 0xD2511F53 * a, 0xCD9E8D57 * c
        a, b, c, d = (two >> 32) ^ b ^ k0, two & MASK, (one >> 32) ^ d ^ k1, one & MASK
    return [a, b, c, d]


def _number(seed: int, k: int) -> float:
    high, low, *_ = _philox([k & MASK, k >> 32 & MASK, 0, 0], [seed & MASK, seed >> 32 & MASK])
    return float(ndtri((((high << 32 | low) >> 12) + 0.5) / 2**52))


def noise(t: float, seed: int, period: float, known: dict[tuple[int, int], float]) -> float:
    """The cubic of Catmull and Rom through four numbers, as a sum of Hermite's cubics."""
    k = math.floor(t / period)
    p = []
    for n in range(k - 1, k + 3):
        if (seed, n) not in known:
            known[seed, n] = _number(seed, n)
        p.append(known[seed, n])
    s = t / period - k
    slopes = (p[2] - p[0]) / 2, (p[3] - p[1]) / 2
    steep = s * (1 - s) ** 2 * slopes[0] - s**2 * (1 - s) * slopes[1]
    return float((1 + 2 * s) * (1 - s) ** 2 * p[1] + s**2 * (3 - 2 * s) * p[2] + steep)


# ---------------------------------------------------------------- elements


@dataclass(frozen=True)
class Element:
    """What stands between the mass ``a`` and the mass ``b`` (-1: the ground) with a node: springs k, l, a damping c, limits of a
    friction forwards and backwards. ``z0``: where a node that is a state begins; ``name`` of that node."""

    kind: str
    name: str
    a: int
    b: int
    k: float
    l: float
    c: float
    forward: float
    backward: float
    z0: float

    @property
    def remembers(self) -> bool:
        return self.kind != "series"

    def text(self) -> str:
        a, z = f"x{self.a}", self.name
        rest = f"{z} - x{self.b}" if self.b >= 0 else z
        lines = [f"potential 1/2*{self.k}*({a} - {z})^2;"]
        start = f"coordinate {z} {'=' if self.remembers else '~'} {self.z0};"
        if self.kind == "series":
            lines.append(f"potential 1/2*{self.l}*({rest})^2 + 1/4*{self.c}*({rest})^4;")
        elif self.kind == "chain":
            lines = [
                f"coordinate {z}n ~ {self.z0};",
                f"potential 1/2*{self.k}*({a} - {z}n)^2 + 1/2*{self.l}*({z}n - {z})^2;",
                f"damping {self.c} on {rest};",
            ]
        elif self.kind in ("maxwell", "rubbing"):
            lines.append(f"damping {self.c} on {rest};")
        if self.kind in ("rubbing", "jenkins"):
            limits = f"forward {self.forward} backward {self.backward}"
            limits = f"{self.forward}" if self.forward == self.backward else limits
            lines.append(f"friction f{z}: {limits} on {rest};")
        return "\n".join([start, *lines])

    def stiffness(self) -> float:
        return 1 / (1 / self.k + 1 / self.l) if self.kind == "chain" else self.k

    def pull(self, xa: float, xb: float, z: float) -> float:
        """The force that draws a back."""
        if self.kind != "series":
            return self.stiffness() * (xa - z)
        # c u^3 + (k + l) u = k stretch, by Viete's formula for one real root, and a step of Newton's method
        stretch = xa - xb
        stiff = self.k + self.l
        size = 2 * math.sqrt(stiff / (3 * self.c))
        u = size * math.sinh(math.asinh(3 * self.k * stretch / (stiff * size)) / 3)
        u += (self.k * stretch - stiff * u - self.c * u**3) / (stiff + 3 * self.c * u**2)
        return self.k * (stretch - u)

    def rate(self, pull: float, va: float, vb: float, mode: int) -> float:
        """The rate of a node that is a state."""
        if self.kind == "jenkins":
            return va if mode else vb
        if self.kind == "rubbing":
            return vb + (pull - {1: self.forward, -1: -self.backward, 0: pull}[mode]) / self.c
        return vb + pull / self.c

    def ends(self, mode: int) -> list[tuple[str, float, int, int]]:
        """What ends a mode: a quantity, its limit, its direction, the next mode."""
        if self.kind not in ("rubbing", "jenkins"):
            return []
        if mode == 0:
            return [("pull", self.forward, 1, 1), ("pull", -self.backward, -1, -1)]
        if self.kind == "jenkins":
            return [("slip", 0.0, -mode, 0)]
        return [("pull", self.forward if mode > 0 else -self.backward, -mode, 0)]


@dataclass
class Machine:
    """``late``: (mass it acts on, factor, what of the past, delay); ``noises``: (mass, factor, seed, period, delay of it or 0);
    ``laws``: (mass, coefficients, form)."""

    seed: int
    m: list[float]
    k: list[float]
    c: list[float]
    x0: list[float]
    v0: list[float]
    elements: list[Element] = field(default_factory=list)
    late: list[tuple[int, float, str, float]] = field(default_factory=list)
    noises: list[tuple[int, float, int, float, float]] = field(default_factory=list)
    laws: list[tuple[int, list[float], int]] = field(default_factory=list)
    net: Network | None = None

    # ------------------------------------------------------------ the text

    def text(self) -> str:
        lines = [_LAWS[form][0].replace("NAME", f"law{n}") for n, (_, _, form) in enumerate(self.laws)]
        lines += [] if self.net is None else [CLASSES]
        lines += ["model Machine", "dimensionless;"]
        for i, (m, k, c, x, v) in enumerate(zip(self.m, self.k, self.c, self.x0, self.v0, strict=True)):
            lines.append(f"coordinate x{i} = {x}; initial der(x{i}) = {v}; kinetic 1/2*{m}*der(x{i})^2;")
            lines.append(f"potential 1/2*{k}*x{i}^2; damping {c} on x{i};")
        lines += [element.text() for element in self.elements]
        lines += [] if self.net is None else self.net.lines()
        for n, (i, coefficients, form) in enumerate(self.laws):
            listed = "{" + ", ".join(map(str, coefficients)) + "}"
            lines.append(_LAWS[form][1].format(n=n, i=i, c=listed))
        for i, factor, past, delay in self.late:
            lines.append(f"force {factor}*{past.replace('LATE', str(delay))} on x{i};")
        for i, factor, seed, period, delay in self.noises:
            one = f"noise({seed}, {period})"
            lines.append(f"force {factor}*{f'delay({one}, {delay})' if delay else one} on x{i};")
        lines.append(f"experiment(stop = {STOP}, tolerance = 1e-11);")
        return "\n".join([*lines, "end Machine;"])

    # ------------------------------------------------------------ the definition

    def breaks(self, stop: float) -> list[float]:
        found = {0.0, stop}
        delays = sorted({d for *_, d in self.late} | {d for *_, d in self.noises if d})
        comes = {0.0}
        for _ in range(8):
            comes |= {t + d for t in comes for d in delays if t + d < stop}
        found |= comes
        for *_, period, delay in self.noises:
            knots = np.arange(1, int(stop / period) + 1) * period
            found |= {float(t) for t in knots if t < stop}
            found |= {float(t) + delay for t in knots if delay and t + delay < stop}
        if delays:
            found |= {float(t) for t in np.arange(1, int(stop / delays[0]) + 1) * delays[0]}
        listed = sorted(found)
        return [t for t, after in zip(listed, [*listed[1:], np.inf], strict=True) if after - t > 1e-12]

    def run(self, times: Array) -> Array:
        """Return x of the masses and of the nodes that are states at some times."""
        n = len(self.m)
        return np.delete(self.motion(times), np.s_[n : 2 * n], axis=1)

    def motion(self, times: Array, rtol: float = 1e-11, longest: float = 0.05, most: float = np.inf) -> Array:
        """Return x and v of the masses, and the nodes that are states, at some times, by steps that are not longer than ``longest``.

        Raises TimeoutError where that takes more than ``most`` evaluations, OverflowError where it goes to infinity.
        """
        stop = float(np.max(times))
        n, kept = len(self.m), [e for e in self.elements if e.remembers]
        pieces: list[tuple[float, float, Any]] = []
        known: dict[tuple[int, int], float] = {}
        y = np.array([*self.x0, *self.v0, *(e.z0 for e in kept)])
        if self.net is not None:
            y = np.append(y, self.net.first(y[:n]))
        first = y.copy()
        place = {e.name: 2 * n + j for j, e in enumerate(kept)}

        def past(t: float) -> Array:
            if t <= 0 or not pieces:
                return first
            for begin, end, sol in reversed(pieces):
                if begin - 1e-13 <= t <= end + 1e-9:
                    return np.asarray(sol(t))
            raise AssertionError(t)

        def pulls(y: Sequence[float]) -> list[float]:
            return [
                e.pull(y[e.a], y[e.b] if e.b >= 0 else 0.0, y[place[e.name]] if e.remembers else 0.0)
                for e in self.elements
            ]

        count = 0

        def rates(t: float, state: Array, modes: dict[str, int]) -> list[float]:
            nonlocal count
            count += 1
            if count > most:
                raise TimeoutError
            y: list[float] = state.tolist()  # whose numbers compute faster than those of arrays
            if not max(map(abs, y)) <= BOUNDLESS:  # a step that is too long may come there, and is made again
                return [math.nan] * len(y)
            x, v, found = y[:n], y[n : 2 * n], [0.0] * len(y)
            force = [-k * a - c * b for k, c, a, b in zip(self.k, self.c, x, v, strict=True)]
            for e, pull in zip(self.elements, pulls(y), strict=True):
                force[e.a] -= pull
                if e.b >= 0:
                    force[e.b] += pull
                if e.remembers:
                    vb = v[e.b] if e.b >= 0 else 0.0
                    found[place[e.name]] = e.rate(pull, v[e.a], vb, modes.get(e.name, 0))
            if self.net is not None:
                nodes = 2 * n + len(kept)
                found[nodes:], pulled = self.net.motion(t, state[:n], state[n : 2 * n], state[nodes:])
                force = [a + b for a, b in zip(force, pulled, strict=True)]
            for i, coefficients, form in self.laws:
                force[i] += _LAWS[form][2](x[i], v[i], coefficients)
            for i, factor, what, delay in self.late:
                force[i] += factor * _PAST[what](past, t, delay, y)
            for i, factor, seed, period, delay in self.noises:
                force[i] += factor * noise(max(t - delay, 0.0), seed, period, known)
            found[:n], found[n : 2 * n] = v, [f / m for f, m in zip(force, self.m, strict=True)]
            return found

        modes = {e.name: 0 for e in kept if e.kind in ("rubbing", "jenkins")}
        begun = dict(zip((e.name for e in self.elements), pulls(y.tolist()), strict=True))
        for e in kept:
            if e.kind == "rubbing":
                modes[e.name] = 1 if begun[e.name] > e.forward else -1 if begun[e.name] < -e.backward else 0
        breaks, t = self.breaks(stop), 0.0
        while t < stop - 1e-12:
            to = next(b for b in breaks if b > t + 1e-12)
            events: list[Any] = []
            turns = []
            for j, e in enumerate(self.elements):
                for what, limit, direction, after in e.ends(modes.get(e.name, 0)):

                    def end(
                        t: float, y: Array, modes: Any, e: Element = e, j: int = j, what: str = what, limit: float = limit
                    ) -> float:  # fmt: skip
                        if what == "pull":
                            return pulls(y.tolist())[j] - limit
                        return float(y[n + e.a] - (y[n + e.b] if e.b >= 0 else 0.0))

                    end.terminal, end.direction = True, direction  # type: ignore[attr-defined]
                    events.append(end)
                    turns.append((e.name, after))
            found = solve_ivp(
                rates,
                (t, to),
                y,
                "DOP853",
                events=events or None,
                args=(modes,),
                dense_output=True,
                rtol=rtol,
                atol=rtol / 100,
                max_step=longest,
            )
            if found.status < 0:
                raise OverflowError
            pieces.append((t, float(found.t[-1]), found.sol))
            t, y = float(found.t[-1]), found.y[:, -1]
            if found.status == 1:
                met = [len(at) > 0 for at in found.t_events]  # of several at one instant SciPy tells one
                met = [hit or abs(end(t, y, modes)) < 1e-9 for hit, end in zip(met, events, strict=True)]
                modes |= {name: after for (name, after), hit in zip(turns, met, strict=True) if hit}
        return np.array([past(at) for at in times])


_PAST: dict[str, Callable[[Callable[[float], Array], float, float, Sequence[float]], float]] = {
    "delay(x0, LATE)": lambda past, t, d, y: float(past(t - d)[0]),
    "delay(sin(x0), LATE)": lambda past, t, d, y: math.sin(past(t - d)[0]),
    "delay(delay(x0, LATE), LATE)": lambda past, t, d, y: float(past(t - 2 * d)[0]),
    "cos(x0)*delay(x0^2, LATE)": lambda past, t, d, y: math.cos(y[0]) * float(past(t - d)[0]) ** 2,
    "delay(time*x0, LATE)": lambda past, t, d, y: max(t - d, 0.0) * float(past(t - d)[0]),
}
"""What looks back: how it is written, for the delay LATE, and its value from the past and the present."""


def _polynomial(x: float, v: float, c: list[float]) -> float:
    s = 0.0
    for i, one in enumerate(c, 1):
        s += one * x**i
    return -s / (1 + x * x) - 0.1 * v


def _both(x: float, v: float, c: list[float]) -> float:
    f = e = 0.0
    for i, one in enumerate(c, 1):
        u = math.tanh(i * x)
        f, e = f + one * u, e + one * u * u
    return -f - 0.05 * e * v


def _pieces(x: float, v: float, c: list[float]) -> float:
    if x > 0:
        f = c[0] * x**3
    elif x > -1:
        f = c[1] * x**3
    else:
        f = c[1] * (-1 + 3 * (x + 1))
    return -f


_LAWS: list[tuple[str, str, Callable[[float, float, list[float]], float]]] = [
    (
        "function NAME(Real x, Real v, Real c[n]) -> Real\n  var s = 0;\n  for i in 1:n loop\n    s := s + c[i]*x^i;\n  end for;\n"
        "  let w = 1 + x^2;\n  return -s/w - 0.1*v;\nend NAME;",
        "force law{n}(x{i}, der(x{i}), {c}) on x{i};",
        _polynomial,
    ),
    (
        "function NAME(Real x, Real c[:]) -> (Real f, Real e)\n  var f = 0; var e = 0;\n  for i in 1:size(c, 1) loop\n"
        "    let u = tanh(i*x);\n    f := f + c[i]*u;\n    e := e + c[i]*u^2;\n  end for;\n  return (f, e);\nend NAME;",
        "let (f{n}, e{n}) = law{n}(x{i}, {c}); force -f{n} - 0.05*e{n}*der(x{i}) on x{i};",
        _both,
    ),
    (
        "function NAME(Real x, Real c[n]) -> Real\n  if x > 0 then\n    return c[1]*x^3;\n  elseif x > -1 then\n    return c[2]*x^3;\n"
        "  end if;\n  return c[2]*(-1 + 3*(x + 1));\nend NAME;",
        "force -law{n}(x{i}, {c}) on x{i};",
        _pieces,
    ),
]


def machine(seed: int) -> Machine:
    """Return the machine of a seed."""
    r = Random(seed)

    def of(low: float, high: float) -> float:
        return round(r.uniform(low, high), 2)

    n = r.randint(1, 3)
    made = Machine(
        seed,
        [of(0.5, 2) for _ in range(n)],
        [of(0.5, 4) for _ in range(n)],
        [of(0.05, 0.5) for _ in range(n)],
        [of(-1, 1) for _ in range(n)],
        [of(-1.5, 1.5) for _ in range(n)],
    )
    for j in range(r.randint(1, 3)):
        kind = r.choice(["series", "maxwell", "chain", "rubbing", "jenkins", "rubbing", "jenkins"])
        a = r.randrange(n)
        b = r.choice([-1, *(i for i in range(n) if i != a)])
        k, forward = of(1, 6), of(0.3, 1.2)
        backward = r.choice([forward, of(0.3, 1.2)])
        z0 = made.x0[a] - round(r.uniform(-0.8, 0.8) * min(forward, backward) / k, 4)
        element = Element(kind, f"z{j}", a, b, k, of(1, 6), of(0.2, 2), forward, backward, round(z0, 4))
        made.elements.append(element)
    for _ in range(r.choice([0, 1, 1, 2])):
        made.late.append((r.randrange(n), of(-1, 1), r.choice(list(_PAST)), of(0.15, 0.6)))
    for _ in range(r.choice([0, 0, 1])):
        delay = r.choice([0.0, of(0.15, 0.6)])
        made.noises.append((r.randrange(n), of(0.3, 1), r.randint(-5, 99), of(0.2, 0.5), delay))
    for _ in range(r.choice([0, 1, 1])):
        made.laws.append((r.randrange(n), [of(0.2, 1.5) for _ in range(r.randint(2, 5))], r.randrange(3)))
    return made


def examined(seed: int) -> list[str]:
    """Say what disagrees between a machine and its definition."""
    made = machine(seed)
    r = Random(f"network of {seed}")
    if r.random() < NETWORKS:
        made.net = network(r, len(made.m))
    methods = ["dop853", "radau5"] if made.late else ["dop853", "radau5", "taylor"]
    method = methods[seed % len(methods)] if seed % 3 == 0 else "dop853"
    if made.noises and method == "taylor":
        method = "dop853"
    solution = mechc.loads(made.text()).simulate(method=method, estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    if solution.failure is not None:
        return [f"{method}: {solution.message}"]
    times = np.linspace(0, STOP, 13)
    exact = made.run(times)
    names = [*(f"x{i}" for i in range(len(made.m))), *(e.name for e in made.elements if e.remembers)]
    if made.net is not None:
        count = len(names)
        exact = np.array(
            [
                [*y[:count], *made.net.places(t, y[: len(made.m)], y[count:])]
                for t, y in zip(times, exact, strict=True)
            ]
        )
        names += made.net.names
    told = solution(times)
    found = np.array([told[name] for name in names]).T
    off = np.abs(found - exact) / (1 + np.abs(exact))
    wrong = []
    if off.max() > CLOSE:
        at = np.unravel_index(int(off.argmax()), off.shape)
        wrong.append(f"{method}: {names[at[1]]} at {times[at[0]]:g} is off by {off.max():.2g}")
    total = solution["energy.total"]
    for what, sign in (("dissipated", 1), ("supplied", -1)):
        if f"energy.{what}" in solution.quantities:
            total = total + sign * solution[f"energy.{what}"]
    if np.ptp(total) > 1e-7 * (1 + np.abs(total).max()):
        wrong.append(f"{method}: the balance of energy is off by {np.ptp(total):.2g}")
    return wrong


def main(first: int, last: int) -> None:
    wrong = 0
    for seed in range(first, last):
        for text in examined(seed):
            wrong += 1
            print(f"{seed}: {text}", flush=True)
    print(f"{last - first} machines, {wrong} disagreements")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
