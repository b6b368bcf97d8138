"""A symbol without a place at run time may stand in a formula only if it cancels, which the tests of merges show."""

from __future__ import annotations

import pytest
from compiled import compiled
from msgspec.structs import replace

from mechc.compiler.equations.model import Equations, Function
from mechc.compiler.equations.solve.dead_symbols import without_dead_symbols
from mechc.compiler.malformed import Malformed

MODEL = "coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;"


def with_more(text: str) -> Equations:
    """Equations with one more function, of a question that nothing has answered."""
    equations = compiled(MODEL).equations
    graph = equations.graph
    asked, x = graph.symbol("?energy()"), graph.symbol("x")
    both = graph.tanh(graph.add(asked, x))
    values = {"sum": both, "condition": graph.select(graph.less(both, x), x, graph.one)}
    more = Function("more", "", (values[text],))
    return replace(equations, functions=(*equations.functions, more))


@pytest.mark.parametrize("text", ["sum", "condition"])
def test_forgotten_symbol_is_a_mistake_of_the_compiler(text: str) -> None:
    with pytest.raises(Malformed, match=r"energy\(\)"):
        without_dead_symbols(with_more(text))
