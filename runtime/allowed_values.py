"""Values with which no run can begin, of parameters, inputs and the state, and the bounds of a search among the others."""

from __future__ import annotations

import math
import sys

from .interface import Quantity
from .memo import once
from .outcome import SimulationError
from .problem import Array, Problem
from .settings import Free


@once
def _bounded(problem: Problem) -> bool:
    """Whether a parameter has a smallest or a largest value, or takes whole numbers or truth values alone."""
    return any(
        q.minimum is not None or q.maximum is not None or q.type in _ALLOWED for q in problem.parameters
    )


def check_parameters(problem: Problem, p: Array) -> None:
    """Refuse parameters without a value, infinite ones, and those out of their ranges. Raises ``SimulationError``."""
    values = p[: len(problem.parameters)].tolist()
    if all(map(math.isfinite, values)) and not _bounded(problem):
        return
    for quantity, value in zip(problem.parameters, values, strict=True):
        if math.isnan(value):
            raise SimulationError(
                f"the parameter '{quantity.name}' has no value; "
                f"give it one in the model, or with --set {quantity.name}=...",
                quantity.origin,
            )
        if math.isinf(value):
            raise SimulationError(f"the parameter '{quantity.name}' is infinite", quantity.origin)
        _check_range(quantity, value, "the parameter")
        check_type(quantity, value)


_ALLOWED = {"integer": "a whole number", "boolean": "true or false, 1 or 0"}
"""What a quantity of a type can be, if not any number."""


def check_type(quantity: Quantity, *values: float) -> None:
    """Refuse a fraction where a whole number belongs, and what is neither true nor false. Raises ``SimulationError``."""
    if quantity.type not in _ALLOWED:
        return
    for value in values:
        if value not in (0.0, 1.0) if quantity.type == "boolean" else not value.is_integer():
            raise SimulationError(
                f"the parameter '{quantity.name}' is {_ALLOWED[quantity.type]}, not {value:g}",
                quantity.origin,
            )


SLACK = 1e-9
"""Of a range: what units and the fit of a function round of inputs."""


def check_inputs(problem: Problem, u: Array) -> None:
    """Refuse inputs out of their ranges, at the start or wherever they are given; runs look at each step. Raises ``SimulationError``."""
    for quantity, value in zip(problem.inputs, u.tolist(), strict=True):
        check_input(quantity, value)


def check_input(quantity: Quantity, value: float) -> None:
    """Refuse such a value of an input. Raises ``SimulationError``."""
    low, high = quantity.minimum, quantity.maximum
    slack = SLACK * max(abs(low or 0.0), abs(high or 0.0), quantity.nominal or 0.0)
    if (low is not None and value < low - slack) or (high is not None and value > high + slack):
        _check_range(quantity, value, "the input")


@once
def _bounded_start(problem: Problem) -> bool:
    """Whether a state has a smallest or a largest value."""
    return any(q.minimum is not None or q.maximum is not None for q in problem.states)


def check_state(problem: Problem, y0: Array) -> None:
    """Refuse such a state; give its rotations unit length. Raises ``SimulationError``."""
    values = y0.tolist()
    looked = _bounded_start(problem) or not all(map(math.isfinite, values))
    for quantity, value in zip(problem.states, values, strict=True) if looked else ():
        if not math.isfinite(value):
            what = "not a number" if math.isnan(value) else "infinite"
            if quantity.name.startswith("guess("):  # rows/without_mass.py
                raise SimulationError(
                    f"no balance of forces on '{quantity.name[6:-1]}' is found at the start",
                    quantity.origin,
                    help="start where a spring or a damping holds it, or give a mass to what it moves",
                )
            raise SimulationError(f"the initial value of '{quantity.name}' is {what}", quantity.origin)
        _check_range(quantity, value, "the initial value of")
    for index in problem.rotations:
        a, b, c, d = y0[index : index + 4].tolist()
        square = a * a + b * b + c * c + d * d
        norm = math.sqrt(square)
        if not norm > 0:
            quantity = problem.states[index]
            raise SimulationError(f"the initial rotation '{quantity.name}' is zero", quantity.origin)
        if not abs(square - 1) <= 4 * sys.float_info.epsilon:  # as the kernel does, bit by bit (rotations.c)
            y0[index : index + 4] *= 1 / norm


def _check_range(quantity: Quantity, value: float, what: str) -> None:
    if quantity.minimum is None and quantity.maximum is None:
        return
    unit = f" {quantity.unit}" if quantity.unit else ""
    if quantity.minimum is not None and value < quantity.minimum:
        raise SimulationError(
            f"{what} '{quantity.name}' is {value:g}{unit}, below its minimum {quantity.minimum:g}{unit}",
            quantity.origin,
        )
    if quantity.maximum is not None and value > quantity.maximum:
        raise SimulationError(
            f"{what} '{quantity.name}' is {value:g}{unit}, above its maximum {quantity.maximum:g}{unit}",
            quantity.origin,
        )


def bounds_of(problem: Problem, free: Free) -> tuple[float, float]:
    """Give the bounds between which a value is searched: its own, else those of the model; infinite where there are none."""
    quantities = (*problem.parameters, *problem.states, *problem.inputs)
    stated = next(q for q in quantities if q.name == free.name)
    low = stated.minimum if free.low is None else free.low
    high = stated.maximum if free.high is None else free.high
    return -math.inf if low is None else low, math.inf if high is None else high
