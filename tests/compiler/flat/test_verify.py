"""Flat models that are broken by hand are found, and shown with what surrounds the place."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest
from flat_models import flat
from msgspec.structs import replace

from mechc.compiler.flat import types
from mechc.compiler.flat.model import (
    Apply,
    Array,
    Derivative,
    Expression,
    FlatModel,
    Literal,
    Name,
    Origin,
    Switch,
)
from mechc.compiler.flat.verify import verify
from mechc.compiler.malformed import Malformed
from mechc.lang.source import Span

TEXT = """
import mech.planar.*;
model Mix
  parameter m = 1 kg;
  parameter l = 2*k;
  parameter k = 0.5 m;
  parameter w[2] = {1, 2} N;
  gravity {0, -9.81} m/s^2;
  Bar bar(m = m, l = l);
  Revolute pin(world -> bar.a, angle = 10 deg);
  coordinate x[2] = {0.1, 0.2} m;
  kinetic 1/2*m*(der(x[1])^2 + der(x[2])^2);
  potential m*9.81 m/s^2*x[1] + sum(w[i]*x[i] for i in 1:2);
  state s = 0;
  equation der(s) = sin(x[1]/l)/1 s;
  constraint rod: x[1] + x[2] = 0.3 m;
  contact floor: x[1] + 1 m restitution 0.5;
  output height = if x[1] < 0 m then -x[1] else x[1];
  output turned = norm(pos(bar.b));
  output push = reaction(pin);
  when x[2] > 5 m then
    release floor;
    reinit(s, 1);
  end when;
  experiment(stop = 1 s, tolerance = 1e-8);
  experiment far(stop = 2 s, m = 2 kg);
end Mix;
"""


@pytest.fixture(scope="module")
def mix() -> FlatModel:
    return flat(TEXT)


def test_models_as_they_are_made_pass(mix: FlatModel) -> None:
    verify(mix)


def at(model: FlatModel, collection: str, index: int, **changes: Any) -> FlatModel:
    """Replace fields of one element of a collection."""
    elements = list(getattr(model, collection))
    elements[index] = replace(elements[index], **changes)
    return replace(model, **{collection: tuple(elements)})


def output(model: FlatModel, name: str, change: Callable[[Any], Expression]) -> FlatModel:
    """Change the value of an output."""
    k = next(k for k, d in enumerate(model.definitions) if d.name == name)
    return at(model, "definitions", k, value=change(model.definitions[k].value))


def variable(model: FlatModel, name: str, **changes: Any) -> FlatModel:
    k = next(k for k, v in enumerate(model.variables) if v.name == name)
    return at(model, "variables", k, **changes)


def value_of(model: FlatModel, name: str) -> Any:
    both: tuple[Any, ...] = (*model.variables, *model.definitions)
    return next(e.value for e in both if e.name == name)


def far_away(m: FlatModel) -> Origin:
    span = m.origin.span
    return Origin(Span(span.file, 0, len(span.file.text) + 1))


LENGTH = types.real(types.LENGTH)

BREAKS: dict[str, tuple[Callable[[FlatModel], FlatModel], str]] = {
    "variable twice": (lambda m: replace(m, variables=(*m.variables, m.variables[0])), "'m'.*declared twice"),
    "variable and definition": (
        lambda m: replace(m, definitions=(*m.definitions, replace(m.definitions[0], name="m"))),
        "'m'.*declared twice",
    ),
    "label twice": (lambda m: at(m, "contacts", 0, name="rod"), "'rod'.*labelled twice"),
    "experiment twice": (lambda m: at(m, "experiments", 1, name=""), "an experiment twice"),
    "unknown name": (
        lambda m: output(m, "height", lambda e: replace(e, then=replace(e.otherwise, base=Name(type=e.otherwise.base.type, span=e.span, name="lost")))),
        "nothing declares 'lost'",
    ),
    "circle": (lambda m: variable(m, "k", value=value_of(m, "l")), "defined by itself"),
    "other type of a name": (
        lambda m: variable(m, "m", value=Name(type=types.NUMBER, span=m.origin.span, name="k")),
        "stated to be 1, but is m",
    ),
    "index": (
        lambda m: output(m, "height", lambda e: replace(e, otherwise=replace(e.otherwise, indices=(2,)))),
        r"indices \(2,\) are outside of the shape \(2,\)",
    ),
    "order": (
        lambda m: output(m, "height", lambda e: Derivative(type=types.real(types.VELOCITY), span=e.span, operand=e, order=0)),
        "no derivative of order 0",
    ),
    "rate": (
        lambda m: output(m, "height", lambda e: Derivative(type=types.real(types.LENGTH), span=e.span, operand=e)),
        "stated to be m, but is m/s",
    ),
    "sum": (
        lambda m: output(m, "height", lambda e: Apply(type=LENGTH, span=e.span, function="add", arguments=(e, value_of(m, "m")))),
        "dimensions m and kg",
    ),
    "product": (
        lambda m: output(m, "height", lambda e: Apply(type=LENGTH, span=e.span, function="multiply", arguments=(e, e))),
        r"stated to be m, but is m\^2",
    ),
    "sine": (
        lambda m: output(m, "height", lambda e: Apply(type=LENGTH, span=e.span, function="sin", arguments=(e,))),
        "stated to be m, but is 1",
    ),
    "norm": (
        lambda m: output(m, "turned", lambda e: replace(e, type=types.real(types.LENGTH, (2,)))),
        r"shape is stated to be \(2,\), but is \(\)",
    ),
    "function": (lambda m: output(m, "turned", lambda e: replace(e, function="nurm")), "no function 'nurm'"),
    "array": (
        lambda m: variable(m, "w", value=replace(value_of(m, "w"), elements=value_of(m, "w").elements[:1])),
        "its 1 elements",
    ),
    "choice": (lambda m: output(m, "height", lambda e: replace(e, condition=e.then)), "its condition is a length"),
    "literal": (
        lambda m: variable(m, "k", value=Literal(type=LENGTH, span=m.origin.span, value=True)),
        "constant True is not a length",
    ),
    "whole": (
        lambda m: variable(m, "k", value=Literal(type=types.INTEGER, span=m.origin.span, value=Fraction(1, 2))),
        "whole number 1/2",
    ),
    "question": (
        lambda m: output(m, "push", lambda e: replace(e, target="pen")),
        "asks about 'pen'",
    ),
    "energy": (lambda m: at(m, "energies", 0, value=value_of(m, "m")), "in kg, not in kg.m"),
    "power": (lambda m: at(m, "energies", 0, kind="dissipation"), r"in kg.m\^2/s\^2, not in kg.m\^2/s\^3"),
    "mass": (lambda m: at(m, "masses", 0, value=value_of(m, "k")), "in m, not in kg"),
    "inertia": (lambda m: at(m, "inertias", 0, on=value_of(m, "k")), "is on no frame"),
    "sides": (lambda m: at(m, "constraints", 0, right=value_of(m, "m")), "sides are in m and in kg"),
    "joint": (lambda m: at(m, "joints", 0, target="bar.d"), "'bar.d', which is not a frame"),
    "coordinate of a joint": (lambda m: at(m, "joints", 0, coordinates=("m",)), "'m', which is not a coordinate"),
    "state": (lambda m: at(m, "equations", 0, state="x"), "'x' is not a state"),
    "switch": (
        lambda m: at(m, "events", 0, branches=(replace(m.events[0].branches[0], actions=(Switch("flaw", True, m.origin),)),)),
        "switches 'flaw'",
    ),
    "setting": (
        lambda m: at(m, "experiments", 1, settings=(replace(m.experiments[1].settings[0], target="mm"),)),
        "sets 'mm'",
    ),
    "start of a parameter": (
        lambda m: variable(m, "m", start=next(v.start for v in m.variables if v.start)),
        "'start' instead of 'value'",
    ),
    "elements of a start": (
        lambda m: variable(m, "s", starts={(3,): next(v.start for v in m.variables if v.start)}),
        "elements that it has not",
    ),
    "origin": (lambda m: at(m, "masses", 0, origin=far_away(m)), "lies outside of model.mech"),
    "no value": (lambda m: output(m, "height", lambda e: None), "is not a free frame"),  # type: ignore[arg-type, return-value]
    "value of another type": (
        lambda m: output(m, "height", lambda e: Array(type=types.real(types.LENGTH, (1,)), span=e.span, elements=(e,))),
        "of another type",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BREAKS)
def test_broken_models_are_found(mix: FlatModel, name: str) -> None:
    spoil, message = BREAKS[name]
    with pytest.raises(Malformed, match=message):
        verify(spoil(mix))


def test_a_message_shows_the_formula_and_the_line() -> None:
    model = flat("coordinate x = 1 m; kinetic 1/2*2 kg*der(x)^2; potential 3 N*x;")
    energy = model.energies[1]
    assert isinstance(energy.value, Apply)
    force, x = energy.value.arguments
    wrong = replace(energy.value, arguments=(force, replace(x, name="y")))
    broken = replace(model, energies=(model.energies[0], replace(energy, value=wrong)))
    with pytest.raises(Malformed) as caught:
        verify(broken)
    assert str(caught.value) == (
        "flat model, energies[1].value: nothing declares 'y'\n"
        "    -> y : a length (m)\n"
        "       in 3*y\n"
        "      model.mech:1:62: coordinate x = 1 m; kinetic 1/2*2 kg*der(x)^2; potential 3 N*x;"
    )
