"""Ends, loads, conditions and questions of random curves, and their text."""

from __future__ import annotations

from .generator import AMOUNTS, Drawing
from .posed import LOWER, UPPER, Condition, Everywhere, Posed
from .tree import (
    END,
    E,
    as_formula,
    at,
    coordinate,
    derivative,
    function,
    integral,
    named,
    quantity,
    replaced,
    text,
)


class Model(Drawing):
    """A whole model."""

    def drawn(self) -> Posed:
        p = self.posed
        self.statements: list[str] = []
        self.range_()
        self.coordinates()
        self.amount = self.scale(self.rng.choice(AMOUNTS), self.some(0.3, 3))
        if self.energies:
            self.amount = self.scale(AMOUNTS[0], self.some(0.3, 3))
        self.dependent: int | None = None
        self.dependence = ""
        if self.count > 1 and not p.unknown_end and self.chance(0.2):
            self.dependent = self.count - 1
            self.dependence = self.rng.choice(("values", "rates", "circle"))
            if self.dependence == "circle" and not (self.shape == "array" and self.same_size()):
                self.dependence = "values"
            if self.dependence == "rates":
                p.orders[0] = 1
        terms = self.terms()
        self.all_ends()
        loads = [] if self.energies else self.loads()
        self.stationary(terms, loads)
        self.conditions()
        self.questions()
        self.declare()
        self.settings()
        p.text = self.written()
        return p

    def said(self, e: E) -> str:
        p = self.posed
        ends = {LOWER: p.lower, UPPER: END if p.unknown_end else p.upper}
        return text(replaced(e, lambda part: ends.get(part)), p.names, p.variable)

    def statement(self, words: str) -> None:
        self.statements.append(words)

    def terms(self) -> list[E]:
        """Return the terms of the integrand, pure numbers."""
        p = self.posed
        terms = []
        for i in range(self.count):
            before = p.orders[i]
            terms.append(self.stiff(i))
            if i == self.dependent and p.orders[i] > before:
                p.orders[i] = 0
                terms[-1] = 0.5 * self.rate(i) ** 2
            terms += [self.field(i) for _ in range(self.rng.choice((0, 1, 1, 2)))]
        if self.dependence == "rates":
            p.orders[0] = 1
        for i in range(self.count):
            for j in range(i):
                if self.chance(0.7):
                    terms.append(self.coupling(j, i))
        if p.unknown_end:
            terms.append(self.number(self.some(0.5, 2)))
        return terms

    # ---- ends

    def all_ends(self) -> None:
        p = self.posed
        whole = self.shape == "array" and self.dependent is None and self.chance(0.5)
        for end, word in ((LOWER, "initial"), (UPPER, "final")):
            if whole and (word == "initial" or self.chance(0.6)):
                values = [self.in_y(i, self.some(-0.7, 0.7)) for i in range(self.count)]
                for i, value in enumerate(values):
                    self.hold(coordinate(i), value, end)
                self.statement(f"{word} r = {{{', '.join(map(self.said, values))}}};")
                continue
            for i in range(self.count):
                if i == self.dependent and (self.dependence != "rates" or self.chance(0.6)):
                    continue
                if (
                    (p.unknown_end and i == 0)
                    or (word == "initial" and self.chance(0.85))
                    or self.chance(0.6)
                ):
                    self.given_end(i, end, word)
                if p.orders[i] and not (self.dependence == "rates" and i == 0) and self.chance(0.5):
                    slope = self.in_y(i, self.some(-0.5, 0.5)) / self.length
                    self.hold(coordinate(i, 1), slope, end)
                    self.statement(f"{word} der({p.names[i]}) = {self.said(slope)};")

    def given_end(self, i: int, end: E, word: str) -> None:
        value = self.in_y(i, self.some(-0.7, 0.7))
        draw = self.rng.random()
        others = [j for j in range(self.count) if j not in (i, self.dependent)]
        if draw < 0.12 and others:
            j = self.rng.choice(others)
            value = value + self.y[i] * self.some(-0.8, 0.8) * self.eta(j)
        elif draw < 0.18 and others:
            value = self.y[i] * function("sin", self.eta(self.rng.choice(others)))
        elif draw < 0.28 or (self.posed.unknown_end and draw < 0.6 and end == UPPER):
            value = value + self.y[i] * self.some(-0.4, 0.4) * self.xi()
        self.hold(coordinate(i), value, end)
        self.statement(f"{word} {self.posed.names[i]} = {self.said(value)};")

    def hold(self, left: E, right: E, end: E) -> None:
        name = f"end {len(self.posed.conditions)}"
        self.posed.conditions.append(Condition(name, at(left, end), at(right, end)))

    # ---- what is stationary

    def loads(self) -> list[E]:
        p = self.posed
        found: list[E] = []
        open_ = [i for i in range(self.count) if i != self.dependent]
        for _ in range(self.rng.choice((0, 0, 1, 1, 2))):
            i = self.rng.choice(open_)
            place = UPPER if p.unknown_end or self.chance(0.15) else self.place()
            if place != UPPER:
                p.breaks.append(place)
            here = at(coordinate(i), place) / self.y[i] if self.chance(0.5) else at(self.eta(i), place)
            c = self.number(self.some(-2, 2))
            match self.rng.randrange(5):
                case 0:
                    found.append(0.5 * self.some(0.5, 5) * (here - self.some(-0.5, 0.5)) ** 2)
                case 1:
                    found.append(c * at(function("cos", self.eta(i)), place))
                case 2:
                    found.append(0.5 * c * here * at(self.eta(self.rng.choice(open_)), place))
                case _:
                    found.append(c * here)
        return found

    def whole(self, e: E) -> E:
        """Return the integral of a pure number over the range in its scale."""
        return integral(e) / self.length

    def stationary(self, terms: list[E], loads: list[E]) -> None:
        p = self.posed
        if self.energies:
            self.of_energies(terms)
            return
        self.rng.shuffle(terms)
        cut = self.rng.randrange(len(terms) + 1) if self.chance(0.3) else len(terms)
        goal = as_formula(0.0)
        parts = [part for part in (terms[:cut], terms[cut:]) if part]
        for n, part in enumerate(parts):
            e = sum(part[1:], part[0])
            if self.chance(0.2):
                name = self.label("density")
                self.lets.append(f"let {name} = {self.said(e)};")
                e = named(name, e)
            piece = self.whole(e)
            goal = goal + piece if n else piece
        extra = self.rng.random()
        i = self.rng.choice([k for k in range(self.count) if k != self.dependent])
        if extra < 0.12:
            mean = self.whole(self.eta(i))
            if self.chance(0.5):
                name = self.label("mean")
                self.lets.append(f"let {name} = {self.said(mean)};")
                mean = named(name, mean)
            goal = goal + 0.5 * self.some(0.5, 5) * (mean - self.some(-0.5, 0.5)) ** 2
        elif extra < 0.18:
            goal = goal + 0.3 * self.whole(self.eta(i)) * self.whole(self.eta(i) ** 2)
        elif extra < 0.24:
            goal = goal + 0.5 * function("sqrt", 1 + self.whole(self.rate(i) ** 2))
        for load in loads:
            goal = goal + load
        if extra > 0.95:
            goal = function("exp", 0.2 * goal)
        if self.chance(0.08):
            goal = -goal
        p.stationary = self.amount * goal
        self.statement(f"stationary {self.said(p.stationary)};")

    def of_energies(self, terms: list[E]) -> None:
        p = self.posed
        total = as_formula(0.0)
        for term in terms:
            word = self.rng.choice(("kinetic", "potential", "lagrangian"))
            term = self.amount * term
            total = total - term if word == "potential" else total + term
            if word == "potential" and self.chance(0.7):
                total, term = total + 2 * term, -term
            self.statement(f"{word} {self.said(term)};")
        p.stationary = integral(total)

    # ---- conditions

    def conditions(self) -> None:
        p = self.posed
        if self.dependent is not None:
            self.everywhere(self.dependent)
        open_ = [i for i in range(self.count) if i != self.dependent]
        for _ in range(self.rng.choice((0, 0, 0, 1, 1, 2))):
            i, j = self.rng.choice(open_), self.rng.choice(open_)
            right: E
            match self.rng.randrange(9):
                case 0:
                    left, right = integral(coordinate(i)), self.some(-0.5, 0.5) * self.y[i] * self.length
                case 1 if self.chance(0.2):  # longer than it would be, a curve soon has corners at any place
                    left = self.whole(function("sqrt", 1 + self.rate(i) ** 2))
                    right = self.number(self.span * self.some(1.1, 1.5))
                case 2 if i != j:
                    left, right = self.whole(self.eta(i) * self.eta(j)), self.number(self.some(-0.2, 0.2))
                case 3 if i != j:
                    left, right = (
                        self.whole(self.eta(i)),
                        0.5 * self.whole(self.eta(j)) + self.some(-0.3, 0.3),
                    )
                case 4:
                    left, right = self.whole(self.eta(i) ** 2), self.number(self.span * self.some(0.15, 0.6))
                case 5 | 6 if not p.unknown_end:
                    place = self.place()
                    p.breaks.append(place)
                    left, right = at(coordinate(i), place), self.in_y(i, self.some(-0.5, 0.5))
                case 7 if not p.unknown_end:
                    place, other = self.place(), self.place()
                    p.breaks += [place, other]
                    left, right = at(self.eta(i), place), self.some(-0.5, 0.5) * at(self.eta(j), other) + 0.2
                case 8 if not p.unknown_end:
                    place = self.place()
                    p.breaks.append(place)
                    left, right = at(self.eta(i), place), 0.4 * self.whole(self.eta(j)) + self.some(-0.3, 0.3)
                case _:
                    left, right = self.whole(self.eta(i)), self.number(self.some(-0.5, 0.5))
            self.condition(left, right)

    def condition(self, left: E, right: E) -> None:
        if self.chance(0.3):
            left, right = right, left
        name = self.label("held")
        self.posed.conditions.append(Condition(name, left, right))
        self.statement(f"constraint {name}: {self.said(left)} = {self.said(right)};")
        self.posed.multipliers[self.label("lam")] = name

    def everywhere(self, i: int) -> None:
        p = self.posed
        left, right = self.eta(i), as_formula(0.0)
        share = self.number(self.some(-0.6, 0.6))
        match self.dependence:
            case "values":
                right = share * function("sin", self.eta(0)) + self.some(-0.5, 0.5) * self.xi()
                if self.count > 2:
                    right = right + 0.3 * self.eta(1)
                formula = self.y[i] * right
            case "rates":
                right = self.rate(0) + share * function("cos", self.xi())
                formula = self.y[i] * right
            case _:
                radius = self.some(1.5, 2.5) * self.y[0]
                left, right = as_formula(0.0), radius**2
                for k in range(self.count):
                    left = coordinate(k) ** 2 if not k else left + coordinate(k) ** 2
                inner = radius**2
                for k in range(self.count - 1):
                    inner = inner - coordinate(k) ** 2
                formula = function("sqrt", inner)
                self.guesses[i] = 1.5
        if self.chance(0.3):
            left, right = right, left
        name = self.label("held")
        p.everywhere.append(Everywhere(name, left, right, i, formula))
        self.statement(f"constraint {name}: {self.said(left)} = {self.said(right)};")
        p.densities[self.label("lam")] = name

    # ---- questions

    def questions(self) -> None:
        p = self.posed
        for name, held in {**p.multipliers, **p.densities}.items():
            self.statement(f"output {name} = multiplier({held});")
        for _ in range(self.rng.choice((0, 1, 2, 3))):
            i, j = self.rng.randrange(self.count), self.rng.randrange(self.count)
            name = self.label("out")
            place = self.rng.choice((LOWER, UPPER)) if p.unknown_end or self.chance(0.4) else self.place()
            match self.rng.randrange(7):
                case 0:
                    e = at(self.eta(i) * self.eta(j), place)
                case 1:
                    e = self.whole(self.eta(i) * function("cos", self.eta(j)))
                case 2:
                    e = at(coordinate(i), place) * self.whole(self.eta(j) + self.xi())
                case 3:
                    e = at(self.rate(i), self.rng.choice((LOWER, UPPER)))
                case 4:
                    e = function("sin", self.eta(i)) + 0.3 * self.xi()
                case 5:
                    e = derivative(self.eta(i) * self.eta(j)) * self.length
                case _:
                    e = self.eta(i) * self.rate(j) + 1
            whole = e.op == "at" or "integral" in self.said(e)
            (p.outputs if whole else p.along)[name] = e
            self.statement(f"output {name} = {self.said(e)};")

    def settings(self) -> None:
        p = self.posed
        plain = [k for k, e in p.parameters.items() if e.op == "num"]
        if not plain or not self.chance(0.4):
            return
        for name in self.rng.sample(plain, min(len(plain), self.rng.choice((1, 2)))):
            value, unit, size = p.parameters[name].data
            changed = float(f"{float(str(value)) * self.some(0.93, 1.07):.5g}")
            p.changed[name] = changed * float(str(size))
            p.given[name] = f"{changed:.12g} {unit}" if self.chance(0.5) else p.changed[name]
        if self.chance(0.5):
            p.experiment = "changed"
            told = {k: self.said(quantity(v, "", 1.0)) for k, v in p.changed.items()}
            for name in told:
                value, unit, size = p.parameters[name].data
                number = p.changed[name] / float(str(size))
                told[name] = self.said(quantity(float(f"{number:.9g}"), str(unit), 1.0))
            self.statement(f"experiment changed({', '.join(f'{k} = {v}' for k, v in told.items())});")
            p.given = {}

    def written(self) -> str:
        p = self.posed
        lines = [*self.functions, *self.before, "model Curve"]
        body = ["dimensionless;"] if self.pure else []
        rest = [f"parameter {k} = {self.said(e)};" for k, e in p.parameters.items()]
        upper = p.names[-1] if p.unknown_end else self.said(p.upper)
        rest += [f"independent {p.variable} from {self.said(p.lower)} to {upper};"]
        rest += [*(d for d in self.declared if "extends" not in d), *self.lets, *self.statements]
        if self.chance(0.3):
            self.rng.shuffle(rest)
        body += [d for d in self.declared if "extends" in d] + rest
        if self.pure:
            lines = [part for line in lines for part in self.made_pure(line)]
        return "\n".join([*lines, *(f"  {line}" for line in body), "end Curve;", ""])

    @staticmethod
    def made_pure(line: str) -> list[str]:
        return [line, "  dimensionless;"] if line.startswith(("model Part", "partial model")) else [line]


def generate(seed: int) -> Posed:
    return Model(seed).drawn()


__all__ = ["Model", "generate"]
