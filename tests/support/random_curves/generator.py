"""Random models of curves: smooth terms that are well conditioned, with everything that docs/curves.md lets stand beside them."""

from __future__ import annotations

from math import pi
from random import Random

from .posed import Posed
from .tree import (
    E,
    X,
    as_formula,
    by_place,
    called,
    coordinate,
    derivative,
    function,
    named,
    parameter,
    quantity,
    shown,
    table,
    text,
)

TIMES = (("s", 1.0), ("ms", 1e-3), ("min", 60.0))
PLACES = ((("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)), (("rad", 1.0), ("deg", pi / 180)))
VALUES = (*PLACES, (("N", 1.0), ("kN", 1e3)), (("K", 1.0),), (("m/s", 1.0), ("km/h", 1 / 3.6)))
AMOUNTS = ((("J", 1.0), ("mJ", 1e-3), ("kJ", 1e3)), (("N", 1.0), ("kN", 1e3)), (("s", 1.0),), (("", 1.0),))


class Drawing:
    """A model that is being drawn."""

    def __init__(self, seed: int) -> None:
        self.rng = Random(seed)
        self.pure = self.chance(0.4)
        self.energies = self.chance(0.25)
        self.functions: list[str] = []
        self.lets: list[str] = []
        self.before: list[str] = []
        self.declared: list[str] = []
        self.ends: list[str] = []
        self.posed = Posed("x", [], [], as_formula(0.0), as_formula(1.0))
        self.labels = 0
        self.integrand_terms: list[E] = []
        self.outer_terms: list[E] = []
        self.plain_places: list[E] = []

    def chance(self, p: float) -> bool:
        return self.rng.random() < p

    def some(self, low: float, high: float) -> float:
        return float(f"{self.rng.uniform(low, high):.3g}")

    def label(self, kind: str) -> str:
        self.labels += 1
        return f"{kind}{self.labels}"

    def said(self, e: E) -> str:
        return text(e, self.posed.names, self.posed.variable)

    def number(self, value: float) -> E:
        """Return a pure number: as it is, or as a parameter, which may be made of another."""
        draw = self.rng.random()
        if draw < 0.6:
            return as_formula(value)
        name = self.label("k")
        if draw < 0.7 and (others := [k for k in self.posed.parameters if k.startswith("k")]):
            other = parameter(self.rng.choice(others))
            if abs(size := self.posed.number(other)) > 0.05:
                self.posed.parameters[name] = other * float(f"{value / size:.4g}")
                return parameter(name)
        self.posed.parameters[name] = as_formula(value)
        return parameter(name)

    def scale(self, units: tuple[tuple[str, float], ...], value: float) -> E:
        """Return a positive amount in one of the units of a kind that is ``value`` times the first of them."""
        if self.pure:
            return as_formula(value)
        unit, size = self.rng.choice(units)
        amount = quantity(float(f"{value * units[0][1] / size:.4g}"), unit, size)
        if self.chance(0.3):
            name = self.label("size")
            self.posed.parameters[name] = amount
            return parameter(name)
        return amount

    # ---- the range

    def range_(self) -> None:
        p = self.posed
        kinds = TIMES if self.energies else self.rng.choice(PLACES)
        p.variable = self.rng.choice(("t", "tau") if self.energies else ("x", "s", "u", "along"))
        self.length = self.scale(kinds, self.some(0.3, 3))
        self.x_size = p.number(self.length)
        first = self.rng.choice((0.0, 0.0, self.some(-1.5, -0.2), self.some(0.2, 1.5)))
        span = self.some(0.6, 1.8)
        p.unknown_end = self.chance(0.06)
        if p.unknown_end:
            first = 0.0
        if first < 0 and self.chance(0.3):
            half = self.in_length(span / 2, kinds, True)
            p.lower, p.upper = -half, half
        else:
            p.lower = self.in_length(first, kinds, first != 0 and self.chance(0.3))
            p.upper = self.in_length(first + span, kinds, self.chance(0.4))
            if self.chance(0.15):
                p.upper = p.lower + self.in_length(span, kinds, False)
        self.span = span
        self.low_share = p.number(p.lower) / self.x_size
        if p.unknown_end:
            p.end_size = span * self.x_size

    def in_length(self, share: float, kinds: tuple[tuple[str, float], ...], as_parameter: bool) -> E:
        value = share * self.x_size
        unit, size = ("", 1.0) if self.pure else self.rng.choice(kinds)
        amount = quantity(float(f"{value / size:.6g}"), unit, size)
        if not as_parameter:
            return amount
        name = self.label("end")
        self.posed.parameters[name] = amount
        return parameter(name)

    def place(self) -> E:
        """Return a place inside of the range."""
        p = self.posed
        share = self.some(0.2, 0.8)
        if self.chance(0.3):
            e = p.lower + (p.upper - p.lower) * share
        else:
            low, high = p.number(p.lower), p.number(p.upper)
            value = low + share * (high - low)
            e = quantity(float(f"{value:.5g}"), "" if self.pure else self.si_x(), 1.0)
        return e

    def si_x(self) -> str:
        unit = self.unit_of(self.length)
        return next(kind[0][0] for kind in (TIMES, *PLACES) if unit in [u for u, _ in kind])

    def unit_of(self, e: E) -> str:
        while e.op == "par":
            e = self.posed.parameters[str(e.data[0])]
        return str(e.data[1])

    # ---- coordinates

    def coordinates(self) -> None:
        p = self.posed
        count = self.rng.choice((1, 1, 2, 2, 2, 3))
        shape = self.rng.choice(("scalars", "scalars", "array", "components", "heir"))
        if shape == "array" and count == 1:
            shape = "scalars"
        kind = self.rng.choice(VALUES)
        self.y: list[E] = []
        self.y_kind: list[tuple[tuple[str, float], ...]] = []
        for i in range(count):
            if shape == "scalars" or (shape == "heir" and i > 0):
                kind = self.rng.choice(VALUES)
                p.names.append(("y", "z", "w")[i])
            elif shape == "array":
                p.names.append(f"r[{i + 1}]")
            elif shape == "heir":
                p.names.append("y")
            else:
                p.names.append(f"part[{i + 1}].q" if count > 1 else "part.q")
            if i and shape in ("array", "components") and self.chance(0.8):
                size = self.y[0]
            else:
                size = self.scale(kind, self.some(0.3, 3))
            self.y.append(size)
            self.y_kind.append(kind)
            p.sizes.append(p.number(size))
            p.orders.append(0)
        if p.unknown_end:
            p.names.append("far")
        self.shape, self.count = shape, count
        self.guesses = [self.some(-0.5, 0.5) for _ in range(count)]

    def eta(self, i: int) -> E:
        return coordinate(i) / self.y[i]

    def rate(self, i: int, order: int = 1) -> E:
        inner = coordinate(i, order)
        if order == 1 and self.chance(0.1):
            return derivative(coordinate(i) / self.y[i]) * self.length
        return inner * self.length**order / self.y[i]

    def xi(self) -> E:
        return X / self.length

    def in_y(self, i: int, share: float) -> E:
        """Return a value of coordinate i."""
        if self.chance(0.3):
            return self.number(share) * self.y[i]
        if self.pure:
            return as_formula(float(f"{share * self.posed.sizes[i]:.5g}"))
        unit, size = self.rng.choice(self.y_kind[i])
        return quantity(float(f"{share * self.posed.sizes[i] / size:.5g}"), unit, size)

    def declare(self) -> None:
        """Write the declarations of coordinates, with their guesses."""
        p = self.posed
        for i in range(self.count):
            guess = self.in_y(i, self.guesses[i])
            if self.chance(0.4) and not p.unknown_end:
                guess = guess + self.in_y(i, self.some(-0.3, 0.3)) * (X - p.lower) / (p.upper - p.lower)
            said = self.said(guess)
            if self.shape == "array":
                if i == 0:
                    many = ", ".join(self.said(self.in_y(k, self.guesses[k])) for k in range(self.count))
                    self.declared.append(f"coordinate r[{self.count}] ~ {{{many}}};")
            elif self.shape == "components":
                if i == 0:
                    self.before += ["model Part", f"  coordinate q ~ {said};", "end Part;"]
                    if "k" in said or "size" in said or "end" in said or p.variable in said:
                        self.before[1] = f"  coordinate q ~ {self.said(self.bare(i, self.guesses[i]))};"
                    change = f"(q ~ {said})" if self.count == 1 and self.chance(0.5) else ""
                    self.declared.append(f"Part part{f'[{self.count}]' if self.count > 1 else ''}{change};")
            elif self.shape == "heir" and i == 0:
                bare = self.said(self.bare(i, self.guesses[i]))
                self.before += ["partial model Base", f"  coordinate y ~ {bare};", "end Base;"]
                self.declared.insert(0, "extends Base;")
            else:
                self.declared.append(f"coordinate {p.names[i]} ~ {said};")
        if p.unknown_end:
            self.declared.append(f"coordinate far ~ {self.said(p.upper)};")

    def bare(self, i: int, share: float) -> E:
        unit, size = ("", 1.0) if self.pure else self.y_kind[i][0]
        return quantity(float(f"{share * self.posed.sizes[i] / size:.5g}"), unit, size)

    # ---- terms, all pure numbers

    def weight(self) -> E:
        """Return a positive factor that may depend on the place."""
        draw = self.rng.randrange(9)
        base = self.number(self.some(0.6, 2))
        xi = self.xi()
        match draw:
            case 0:
                return base + 0.4 * function("sin", self.some(0.5, 3) * xi)
            case 1:
                return base * function("exp", -self.some(0.1, 0.6) * xi)
            case 2 if not self.posed.unknown_end:
                edge = self.place()
                self.posed.breaks.append(edge)
                return by_place(edge, base, base + self.some(0.3, 2), self.chance(0.5))
            case 3 if not self.posed.unknown_end:
                return self.tabled()
            case 4:
                name = f"bump{len(self.functions)}"
                c = self.some(0.2, 1)
                self.functions.append(f"function {name}(Real u, Real v) = v + {c:g}/(1 + u^2);")
                return called(name, lambda u, v: v + c / (1 + u**2), xi, base)
            case 5:
                name = self.label("factor")
                e = base + 0.3 * function("tanh", xi)
                self.lets.append(f"let {name} = {self.said(e)};")
                return named(name, e)
            case _:
                return base

    def tabled(self) -> E:
        low, n = self.low_share, self.rng.choice((3, 4, 5))
        width = self.span + 1.2
        places = tuple(float(f"{low - 0.6 + width * k / (n - 1):.4g}") for k in range(n))
        values = tuple(self.some(0.5, 2.5) for _ in range(n))
        self.posed.breaks += [self.length * p for p in places]
        return table(self.xi(), places, values)

    def stiff(self, i: int) -> E:
        """Return a term that is convex in the slope."""
        d = self.rate(i)
        draw = self.rng.randrange(10)
        a = self.weight()
        match draw:
            case 0:
                length = a * function("sqrt", 1 + d**2)
                return length if self.chance(0.3) else length + 0.25 * d**2
            case 1:
                return a * function("cosh", 0.7 * d)
            case 2:
                return a * (0.5 * d**2 + 0.05 * d**4)
            case 3:
                return 0.5 * a * (d - 0.3 * function("sin", self.eta(i))) ** 2
            case 4:
                return 0.5 * a * d**2 * (1.5 + 0.3 * function("sin", self.eta(i)))
            case 5 if not self.posed.unknown_end and not self.energies:
                self.posed.orders[i] = 1
                return 0.5 * a * self.some(0.05, 0.5) * self.rate(i, 2) ** 2 + 0.1 * d**2
            case _:
                return 0.5 * a * d**2

    def field(self, i: int) -> E:
        e = self.eta(i)
        c = self.number(self.some(-2, 2))
        match self.rng.randrange(12):
            case 0:
                return c * function("cos", e)
            case 1:
                return abs(self.some(0.2, 1)) * function("exp", 0.5 * e)
            case 2:
                return c * function("tanh", e)
            case 3:
                return self.weight() * 0.5 * e**2
            case 4:
                return -0.5 * self.some(0.5, 18) * e**2
            case 5:
                return c * self.weight() * e
            case 6:
                return 0.3 * e**4 + c * e
            case 7:
                return c * function("log", 1 + e**2)
            case 8:
                return c / (1 + e**2)
            case 9:
                return c * function("atan", e - self.xi())
            case 10:
                name = f"shape{len(self.functions)}"
                self.functions.append(f"function {name}(Real u) = u^2/(1 + u^2);")
                return called(name, lambda u: u**2 / (1 + u**2), e) * c
            case _:
                return c * e * function("sin", 2 * self.xi())

    def coupling(self, i: int, j: int) -> E:
        c = self.number(self.some(-0.6, 0.6))
        a, b = self.eta(i), self.eta(j)
        match self.rng.randrange(7):
            case 0:
                return c * a * b
            case 1:
                return 0.5 * self.some(0.2, 2) * (a - b) ** 2
            case 2:
                return 0.4 * c * self.rate(i) * self.rate(j)
            case 3:
                return c * (a * self.rate(j) - b * self.rate(i))
            case 4:
                return c * function("cos", a - b)
            case 5 if self.shape == "array" and self.same_size():
                n = self.count
                factor = self.some(0.1, 1)
                worth = as_formula(0.0)
                for k in range(n):
                    worth = worth + (coordinate(k) / self.y[0]) ** 2 * (k + 1)
                size = self.said(self.y[0])
                return factor * shown(f"sum(i*(r[i]/({size}))^2 for i in 1:{n})", worth)
            case 6 if self.shape == "array" and self.same_size():
                worth = as_formula(0.0)
                for k in range(self.count):
                    worth = worth + coordinate(k, 1) ** 2
                square = shown("dot(der(r), der(r))", worth)
                return 0.2 * square * self.length**2 / self.y[0] ** 2
            case _:
                return 0.3 * c * a * b / (1 + a**2 + b**2)

    def same_size(self) -> bool:
        return len({(self.y[k], self.y_kind[k]) for k in range(self.count)}) == 1
