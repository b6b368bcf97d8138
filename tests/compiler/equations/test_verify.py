"""Equations that are broken by hand are found, and shown with what surrounds the place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from compiled import compiled
from msgspec.structs import replace

from mechc.compiler.equations.model import Equations, Function, Slot
from mechc.compiler.equations.needs import EVERYTHING
from mechc.compiler.equations.verify import verify
from mechc.compiler.graph import Node
from mechc.compiler.malformed import Malformed
from mechc.runtime.interface import Quantity

TEXT = """
model Mix
  parameter m = 1 kg;
  parameter half = m/2;
  input Force push = 0 N;
  coordinate z = 1 m;
  coordinate w = 0.5 m;
  kinetic 1/2*m*der(z)^2 + half*der(w)^2;
  potential m*9.81 m/s^2*z;
  force push on z;
  damping 0.1 N.s/m on z;
  constraint rod: z + w = 1.5 m;
  contact floor: z restitution 0.5;
  discrete count = 0;
  state s = 0;
  equation der(s) = sin(z/1 m)/1 s;
  output height = z;
  assert z < 10 m, "too high";
  initial z*w = 0.5 m^2;
  when s > 0.5 then
    reinit(s, 0);
    count := count + 1;
  end when;
  experiment(stop = 1 s);
  experiment heavy(stop = 2 s, m = 2 kg);
end Mix;
"""


@pytest.fixture(scope="module")
def mix() -> Equations:
    return compiled(TEXT, parts={"jacobian", "momenta"}).equations


@pytest.mark.parametrize("parts", [(), EVERYTHING], ids=["what is needed", "everything"])
def test_equations_as_they_are_made_pass(parts: tuple[str, ...]) -> None:
    verify(compiled(TEXT, parts=parts).equations)


def at(equations: Equations, collection: str, number: int, /, **changes: Any) -> Equations:
    elements = list(getattr(equations, collection))
    elements[number] = replace(elements[number], **changes)
    return replace(equations, **{collection: tuple(elements)})


def function(
    equations: Equations, name: str, outputs: Callable[[tuple[Node, ...]], tuple[Node, ...]]
) -> Equations:
    k = next(k for k, f in enumerate(equations.functions) if f.name == name)
    return at(equations, "functions", k, outputs=outputs(equations.functions[k].outputs))


def without(equations: Equations, name: str) -> Equations:
    return replace(equations, functions=tuple(f for f in equations.functions if f.name != name))


def moved(equations: Equations, old: Slot, new: Slot | None) -> Equations:
    layout = {n: s for n, s in equations.layout.items() if s != old}
    if new is not None:
        layout |= {n: new for n, s in equations.layout.items() if s == old}
    return replace(equations, layout=layout)


def symbol(equations: Equations, array: str, index: int) -> Node:
    return next(n for n, slot in equations.layout.items() if slot == Slot(array, index))


def switching(equations: Equations, **changes: Any) -> Equations:
    assert equations.switching is not None
    return replace(equations, switching=replace(equations.switching, **changes))


def row(equations: Equations, **changes: Any) -> Equations:
    assert equations.switching is not None
    return switching(equations, rows=(replace(equations.switching.rows[0], **changes),))


BREAKS: dict[str, tuple[Callable[[Equations], Equations], str]] = {
    "kind": (lambda e: at(e, "states", 0, kind="output"), r"y\[0\]: a output has no place in y"),
    "order": (lambda e: at(e, "states", 0, kind="state"), "follows a state"),
    "name twice": (lambda e: at(e, "states", 0, name="w"), "another entry has this name"),
    "sizes": (lambda e: replace(e, nx=e.nx + 1), "the states say"),
    "known": (lambda e: replace(e, known=e.known[1:]), "known has"),
    "spans": (lambda e: replace(e, starts=()), "starts has 0"),
    "slot outside": (lambda e: moved(e, Slot("u", 0), Slot("u", 1)), r"u\[1\]: is the place of 'push'"),
    "slot twice": (lambda e: moved(e, Slot("y", 0), Slot("y", 1)), "belongs to"),
    "slot of none": (lambda e: moved(e, Slot("p", 0), None), r"p\[0\]: has no symbol"),
    "slot of a formula": (
        lambda e: replace(e, layout={**e.layout, e.functions[0].outputs[2]: Slot("u", 0)}),
        "which is not a symbol",
    ),
    "results": (lambda e: function(e, "rhs", lambda n: n[1:]), "function rhs: has 6 results instead of 7"),
    "function lost": (lambda e: without(e, "assembly"), "lack assembly"),
    "function of no use": (
        lambda e: replace(e, functions=(*e.functions, Function("rhs2", "", ()))),
        "function rhs2: nothing asks for it",
    ),
    "function twice": (lambda e: replace(e, functions=(*e.functions, e.functions[0])), "two functions have one name"),
    "no such node": (lambda e: function(e, "outputs", lambda n: (Node(10**7), *n[1:])), "is node 10000000 of"),
    "initial of states": (
        lambda e: function(e, "initial", lambda n: (symbol(e, "y", 1), *n[1:])),
        "depends on 'w', which lies in y",
    ),
    "symbol of no place": (
        lambda e: function(e, "rhs", lambda n: (e.graph.symbol("alien"), *n[1:])),
        "depends on 'alien', which has no place at run time",
    ),
    "experiment of states": (
        lambda e: function(e, "experiment_1", lambda n: (*n[:-1], symbol(e, "y", 0))),
        "which lies in y",
    ),
    "rule of states": (
        lambda e: at(e, "parameter_rules", 0, value=symbol(e, "y", 0)),
        "the rule of parameter m.*which lies in y",
    ),
    "rule of itself": (
        lambda e: at(e, "parameter_rules", 0, value=symbol(e, "p", 1)),
        "follows from itself",
    ),
    "rule twice": (lambda e: at(e, "parameter_rules", 0, index=1), "name a parameter twice"),
    "rotations": (lambda e: replace(e, rotations=(0,)), "rotations: names number 3 of 2"),
    "conserved": (lambda e: replace(e, conserved=(99,)), "conserved: names number 99"),
    "balance": (lambda e: replace(e, energy_balance=(99, -1, -1)), "energy_balance: names number 99"),
    "pattern": (
        lambda e: replace(e, jacobian_pattern=(e.jacobian_pattern[0],) * len(e.jacobian_pattern)),
        "names a place twice",
    ),
    "levels": (lambda e: at(e, "assembly", 0, stage=3), "assembly are not in the order"),
    "target": (
        lambda e: at(e, "experiments", 1, settings=(replace(e.experiments[1].settings[0], index=9),)),
        "experiment 'heavy', p: names number 9",
    ),
    "separable": (lambda e: replace(e, separable=True), "said to be separable"),
    "switch of the user": (lambda e: row(e, flag=0), "is switched, but the user's"),
    "mode of no use": (
        lambda e: row(e, enabled=-1, impulse=e.switching.rows[0].flag),  # type: ignore[union-attr]
        "a mode that nothing switches",
    ),
    "normal": (lambda e: row(e, normal=5), "normal: names number 5"),
    "account": (lambda e: switching(e, dissipated=0), "a state that is not an account"),
    "total": (lambda e: switching(e, total=99), "hybrid, total: names number 99"),
    "fact": (lambda e: replace(e, needs=e.needs - {"inputs"}), "need inputs: False, have it: True"),
    "fact of nothing": (lambda e: replace(e, needs=e.needs | {"tables"}), "need tables: True, have it: False"),
    "graph": (
        lambda e: replace(e, layout={**e.layout, Node(10**7): Slot("u", 0)}),
        "node 10000000, which is not a symbol",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BREAKS)
def test_broken_equations_are_found(mix: Equations, name: str) -> None:
    spoil, message = BREAKS[name]
    with pytest.raises(Malformed, match=message):
        verify(spoil(mix))


def test_a_plan_that_is_lost_is_found(mix: Equations) -> None:
    switching = {"indicators", "indicator_rates", "conditions", "row_values", "respond", "act_1"}
    functions = tuple(f for f in mix.functions if f.name not in switching)
    with pytest.raises(Malformed, match="need events, but have no plan"):
        verify(replace(mix, switching=None, functions=functions))


@pytest.mark.parametrize("name", ["phase", "phase_gradient", "scene", "jacobian"])
def test_what_is_described_but_not_there_is_found(name: str) -> None:
    """A library lacks its symbol otherwise, when a run looks for it."""
    whole = compiled(
        "coordinate x = 1 m; kinetic 1/2*2 kg*der(x)^2; potential 3 N*x;",
        parts={"phase", "scene", "jacobian"},
    ).equations
    verify(whole)
    with pytest.raises(Malformed, match=f"lack {name}"):
        verify(replace(whole, functions=tuple(f for f in whole.functions if f.name != name)))


def test_rotations_need_their_fact() -> None:
    equations = compiled("coordinate Rotation R; kinetic 1/2*1 kg.m^2*dot(der(R), der(R));").equations
    verify(equations)
    with pytest.raises(Malformed, match="have rotations, but do not need them"):
        verify(replace(equations, needs=equations.needs - {"rotations"}))


def test_the_graph_is_verified_too() -> None:
    equations = compiled(TEXT).equations
    equations.graph._values[equations.functions[0].outputs[2]] += 1
    with pytest.raises(Malformed, match="another value in the field"):
        verify(equations)


def test_a_message_shows_the_neighbours() -> None:
    equations = compiled("coordinate x = 1 m; kinetic 1/2*2 kg*der(x)^2; potential 3 N*x;").equations
    entry = equations.states[0]
    wrong = replace(equations, states=(entry, Quantity("v", "coordinate", "m/s")))
    with pytest.raises(Malformed) as caught:
        verify(wrong)
    assert str(caught.value) == "equations: nq, nv, nx are (1, 1, 0), the states say (2, 0, 0)"
    with pytest.raises(Malformed) as caught:
        verify(moved(equations, Slot("y", 1), None))
    assert str(caught.value) == (
        "equations, y[1]: has no symbol\n"
        "       y[0] coordinate x [m]\n"
        "    -> y[1] rate der(x) [m/s]"
    )  # fmt: skip
