"""Half-typed statements through the server: what may follow, what words mean meanwhile, and one message about the place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from editor_client import Client, editor

URI = "file:///tmp/of_an_editor/half_typed.mech"
EVERYWHERE = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
WHOLE = """\
import mech.planar.*;

model Arm "an arm"
  parameter Length l = 0.5 m "how long";
  gravity {0, -9.81} m/s^2;
  Bar bar(m = 1 kg, l = l);
  Revolute pin(world -> bar.a, angle = 30 deg);
  let h = 2*l;
  // here
  output high = h;
  experiment(stop = 5 s);
end Arm;
"""
EXPRESSION = {"l", "h", "bar", "pin", "sin", "time"}
STATEMENT = {"parameter", "output", "potential", "Bar", "Revolute"}

STATES: dict[str, tuple[set[str], str]] = {
    "out|": (STATEMENT, "E0123"),
    "output e = pin.|": ({"angle", "from", "to"}, "E0110"),
    "output e = sin(pin.an|": ({"angle"}, "E0117"),
    "output e = der(pin.|": ({"angle"}, "E0110"),
    "output e = (h + |": (EXPRESSION, "E0110"),
    "output e = if h > 1 m then |": (EXPRESSION, "E0110"),
    "output e = 3 k|": ({"kg", "km", "kN"}, "E0112"),
    "parameter Mass q = 2 |": ({"kg", "g"}, "E0111"),
    "let |": ({"Length", "Angle"}, "E0203"),
    "Bar |": (set(), "E0110"),
    "Bar rod(|": ({"m", "l"}, "E0117"),
    "Bar rod(m = 2 kg, l|": ({"m", "l"}, "E0117"),
    "Revolute knee(bar.b -> |": ({"angle", "bar", "world"}, "E0110"),
    "damping 0.1 N.m.s on pin.|": ({"angle"}, "E0110"),
    "potential 1/2*|": (EXPRESSION, "E0110"),
    "constraint h = |": (EXPRESSION, "E0110"),
    "when pin.angle > |": (EXPRESSION, "E0110"),
    "for i in 1:3 loop out|": (STATEMENT, "E0115"),
    "draw li|": ({"line", "disk", "box"}, "E0111"),
    "study s = mo|": ({"modes", "period", "portrait"}, "E0110"),
    "study s = section(wh|": ({"where", "count"}, "E0117"),
    "experiment other(sto|": ({"stop", "tolerance"}, "E0117"),
    "import mech.|": ({"planar", "spatial"}, "E0110"),
}
"""What is written, the place marked -> what has to be offered there, and the code of the first message."""


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with editor() as made:
        made.open(URI, WHOLE)
        assert made.messages() == []
        yield made


def place(text: str, offset: int) -> dict[str, Any]:
    before = text[:offset]
    position = {"line": before.count("\n"), "character": offset - before.rfind("\n") - 1}
    return {"textDocument": {"uri": URI}, "position": position}


@pytest.mark.parametrize("state", STATES)
def test_half_typed(client: Client, state: str) -> None:
    offered, code = STATES[state]
    client.change(URI, WHOLE)  # what could be read last
    client.send("textDocument/documentSymbol", {"textDocument": {"uri": URI}})
    text = WHOLE.replace("// here", state)
    at = text.index("|")
    text = text.replace("|", "", 1)
    client.change(URI, text)
    items = client.send("textDocument/completion", place(text, at))["items"]
    assert offered <= {item["label"] for item in items}
    for word, told in (
        ("bar(m", "component of Bar"),
        ("l = 0.5", "a length (m)"),
        ("Revolute pin", "model Revolute"),
    ):
        found = client.send("textDocument/hover", place(text, text.index(word)))
        assert told in found["contents"]["value"]
    client.send("textDocument/inlayHint", {"textDocument": {"uri": URI}, "range": EVERYWHERE})
    messages = [
        note["params"]["diagnostics"] for note in client.notes if "diagnostics" in note.get("params", {})
    ]
    client.notes.clear()
    assert messages[-1][0]["code"] == code
    line = WHOLE[: WHOLE.index("// here")].count("\n")
    assert messages[-1][0]["range"]["start"]["line"] in (line, line + 1)
