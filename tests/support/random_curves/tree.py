"""Formulas as trees, which print as text of the language and are evaluated in jets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from .jets import FUNCTIONS, Jet, power


@dataclass(frozen=True)
class E:
    """A formula: ``op`` says what ``data`` and ``args`` are."""

    op: str
    args: tuple[E, ...] = ()
    data: tuple[object, ...] = ()

    def __add__(self, other: E | float) -> E:
        return E("+", (self, as_formula(other)))

    def __sub__(self, other: E | float) -> E:
        return E("-", (self, as_formula(other)))

    def __mul__(self, other: E | float) -> E:
        return E("*", (self, as_formula(other)))

    def __truediv__(self, other: E | float) -> E:
        return E("/", (self, as_formula(other)))

    def __radd__(self, other: float) -> E:
        return as_formula(other) + self

    def __rsub__(self, other: float) -> E:
        return as_formula(other) - self

    def __rtruediv__(self, other: float) -> E:
        return as_formula(other) / self

    def __rmul__(self, other: float) -> E:
        return as_formula(other) * self

    def __pow__(self, n: float) -> E:
        return E("^", (self,), (n,))

    def __neg__(self) -> E:
        return E("neg", (self,))


def as_formula(e: E | float) -> E:
    return e if isinstance(e, E) else E("num", (), (float(e), "", 1.0))


def quantity(value: float, unit: str, size: float) -> E:
    """Return a number in a unit that is ``size`` in SI."""
    return E("num", (), (value, unit, size))


def parameter(name: str) -> E:
    return E("par", (), (name,))


X = E("x")
END = E("end")


def coordinate(i: int, order: int = 0) -> E:
    return E("q", (), (i, order))


def function(name: str, e: E) -> E:
    return E("f", (e,), (name,))


def by_place(place: E, below: E, above: E, strict: bool = True) -> E:
    return E("if", (place, below, above), (strict,))


def table(e: E, places: tuple[float, ...], values: tuple[float, ...]) -> E:
    return E("table", (e,), (places, values))


def called(name: str, body: Callable[..., E], *args: E) -> E:
    """Return a function of the model with its arguments; it is worth what its body is worth."""
    return E("call", (body(*args), *args), (name,))


def named(name: str, e: E) -> E:
    """Return a ``let``."""
    return E("let", (e,), (name,))


def shown(text: str, e: E) -> E:
    """Return a formula that is printed as ``text`` and is worth ``e``: sums over arrays, products of vectors."""
    return E("shown", (e,), (text,))


def derivative(e: E) -> E:
    return E("der", (e,))


def integral(e: E) -> E:
    return E("integral", (e,))


def at(e: E, place: E) -> E:
    return E("at", (e, place))


def walk(e: E) -> list[E]:
    """Return the formula and all its parts, also what is after names."""
    return [e, *(part for a in e.args for part in walk(a))]


def replaced(e: E, change: Callable[[E], E | None]) -> E:
    new = change(e)
    if new is not None:
        return new
    args = tuple(replaced(a, change) for a in e.args)
    return e if args == e.args else E(e.op, args, e.data)


def along(e: E) -> E:
    """Return the derivative along the curve, as a formula."""
    match e.op, e.args, e.data:
        case (("num" | "par" | "end" | "at" | "integral"), _, _):
            return as_formula(0.0)
        case "x", _, _:
            return as_formula(1.0)
        case "q", _, (int(i), int(order)):
            return coordinate(i, order + 1)
        case (("+" | "-"), (a, b), _):
            return E(e.op, (along(a), along(b)))
        case "*", (a, b), _:
            return along(a) * b + a * along(b)
        case "/", (a, b), _:
            return (along(a) * b - a * along(b)) / (b * b)
        case "neg", (a,), _:
            return -along(a)
        case "^", (a,), (float(n) | int(n),):
            return n * a ** (n - 1) * along(a)
        case "f", (a,), (str(name),):
            return _SLOPES[name](a) * along(a)
        case (("let" | "shown"), (a,), _):
            return along(a)
        case "call", (a, *_), _:
            return along(a)
        case "der", (a,), _:
            return along(along(a))
    raise AssertionError(f"no derivative of {e.op} was written")


_SLOPES: dict[str, Callable[[E], E]] = {
    "sin": lambda a: function("cos", a),
    "cos": lambda a: -function("sin", a),
    "exp": lambda a: function("exp", a),
    "cosh": lambda a: function("sinh", a),
    "sinh": lambda a: function("cosh", a),
    "log": lambda a: 1 / a,
    "sqrt": lambda a: 1 / (2 * function("sqrt", a)),
    "tanh": lambda a: 1 - function("tanh", a) ** 2,
    "atan": lambda a: 1 / (1 + a**2),
}


def evaluate(e: E, leaf: Callable[[E], Jet]) -> Jet:
    """Return the jet of a formula; ``leaf`` answers for numbers, parameters, places, coordinates and integrals."""
    match e.op, e.args, e.data:
        case "+", (a, b), _:
            return evaluate(a, leaf) + evaluate(b, leaf)
        case "-", (a, b), _:
            return evaluate(a, leaf) - evaluate(b, leaf)
        case "*", (a, b), _:
            return evaluate(a, leaf) * evaluate(b, leaf)
        case "/", (a, b), _:
            return evaluate(a, leaf) / evaluate(b, leaf)
        case "neg", (a,), _:
            return evaluate(as_formula(-1.0) * a, leaf)
        case "^", (a,), (float(n) | int(n),):
            return power(evaluate(a, leaf), n)
        case "f", (a,), (str(name),):
            inner = evaluate(a, leaf)
            return inner.through(*FUNCTIONS[name](inner.value))
        case "if", (place, below, above), _:
            chosen = evaluate(X, leaf).value < evaluate(place, leaf).value
            low, high = evaluate(below, leaf), evaluate(above, leaf)
            return Jet(
                np.where(chosen, low.value, high.value),
                np.where(chosen[:, None], low.slope, high.slope),
                np.where(chosen[:, None, None], low.bend, high.bend),
            )
        case "table", (a,), (tuple(places), tuple(values)):
            inner = evaluate(a, leaf)
            curve = PchipInterpolator(places, values, extrapolate=False)
            return inner.through(
                *(curve.derivative(k)(inner.value) if k else curve(inner.value) for k in range(3))
            )
        case (("let" | "shown"), (a,), _):
            return evaluate(a, leaf)
        case "call", (a, *_), _:
            return evaluate(a, leaf)
        case "der", (a,), _:
            return evaluate(along(a), leaf)
    return leaf(e)


def text(e: E, names: list[str], variable: str) -> str:
    """Return the formula in the language, with the names of coordinates and of the independent variable."""

    def said(a: E) -> str:
        return text(a, names, variable)

    match e.op, e.args, e.data:
        case "num", _, (float(value), str(unit), _):
            number = f"{value:.12g}"
            quantity_ = f"{number} {unit}" if unit else number
            return f"({quantity_})" if value < 0 else quantity_
        case "par", _, (str(name),):
            return name
        case "x", _, _:
            return variable
        case "end", _, _:
            return names[-1]
        case "q", _, (int(i), 0):
            return names[i]
        case "q", _, (int(i), 1):
            return f"der({names[i]})"
        case "q", _, (int(i), int(order)):
            return f"der({names[i]}, {order})"
        case (("+" | "-" | "*" | "/"), (a, b), _):
            return f"({said(a)} {e.op} {said(b)})" if e.op in "+-" else f"{said(a)}{e.op}({said(b)})"
        case "neg", (a,), _:
            return f"(-({said(a)}))"
        case "^", (a,), (float(n) | int(n),):
            return f"({said(a)})^{f'({n:g})' if n < 0 else f'{n:g}'}"
        case "f", (a,), (str(name),):
            return f"{name}({said(a)})"
        case "if", (place, below, above), (bool(strict),):
            relation = "<" if strict else ">"
            first, second = (below, above) if strict else (above, below)
            return f"(if {variable} {relation} {said(place)} then {said(first)} else {said(second)})"
        case "table", (a,), (tuple(places), tuple(values)):
            lists = (", ".join(f"{v:.12g}" for v in row) for row in (places, values))
            return "table({}, {{{}}}, {{{}}})".format(said(a), *lists)
        case "call", (_, *args), (str(name),):
            return f"{name}({', '.join(map(said, args))})"
        case (("let" | "shown"), _, (str(name),)):
            return name
        case "der", (a,), _:
            return f"der({said(a)})"
        case "integral", (a,), _:
            return f"integral({said(a)})"
        case "at", (a, place), _:
            return f"at({said(a)}, {said(place)})"
    raise AssertionError(e.op)
