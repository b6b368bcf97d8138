"""The language server as an editor meets it: a process, JSON-RPC by hand."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from editor_client import Client, editor

from mechc.editor.server import make_server

TEXT = "model M\n  parameter rod = 1 m;\n  coordinate x = 0 m;\n  kinetic 1/2*1 kg*der(x)^2;\n  output y = x + rod;\nend M;\n"
URI = "file:///tmp/of_an_editor/m.mech"


@pytest.fixture
def client() -> Iterator[Client]:
    with editor() as made:
        yield made


def test_an_editor_opens_writes_asks_and_closes(client: Client) -> None:
    item = {"uri": URI, "languageId": "mech", "version": 1, "text": TEXT}
    client.send("textDocument/didOpen", {"textDocument": item}, asks=False)
    assert client.messages() == []
    here = {"textDocument": {"uri": URI}, "position": {"line": 4, "character": 17}}
    assert "parameter: a length (m)" in client.send("textDocument/hover", here)["contents"]["value"]
    place = client.send("textDocument/definition", here)
    assert place["uri"] == URI and place["range"]["start"] == {"line": 1, "character": 12}
    assert len(client.send("textDocument/references", {**here, "context": {"includeDeclaration": True}})) == 2
    edit = client.send("textDocument/rename", {**here, "newName": "length"})
    assert [e["newText"] for e in edit["changes"][URI]] == ["length", "length"]
    library = {"uri": URI.replace("m.mech", "n.mech"), "languageId": "mech", "version": 1}
    text = "import mech.planar.*;\nBar bar();\n"
    client.send("textDocument/didOpen", {"textDocument": {**library, "text": text}}, asks=False)
    there = {"textDocument": {"uri": library["uri"]}, "position": {"line": 1, "character": 1}}
    assert client.send("textDocument/definition", there)["uri"].endswith("stdlib/planar.mech")
    labels = {i["label"] for i in client.send("textDocument/completion", here)["items"]}
    assert {"rod", "x", "sin"} <= labels
    assert client.send("textDocument/documentSymbol", {"textDocument": {"uri": URI}})[0]["name"] == "M"
    options = {"textDocument": {"uri": URI}, "options": {"tabSize": 2, "insertSpaces": True}}
    assert client.send("textDocument/formatting", options) == []
    wrong = {
        "textDocument": {"uri": URI, "version": 2},
        "contentChanges": [{"text": TEXT.replace("x + rod", "x + rodd")}],
    }
    client.send("textDocument/didChange", wrong, asks=False)
    while not (told := client.messages()):
        pass
    assert told[0]["code"] == "E0201" and told[0]["range"]["start"] == {"line": 4, "character": 17}
    action = {
        "textDocument": {"uri": URI},
        "range": told[0]["range"],
        "context": {"diagnostics": told},
    }
    (fix,) = client.send("textDocument/codeAction", action)
    assert fix["edit"]["changes"][URI][0]["newText"] == "rod"
    client.send("textDocument/didClose", {"textDocument": {"uri": URI}}, asks=False)


@pytest.mark.parametrize("waits", [False, True])
def test_what_was_answered_is_forgotten(waits: bool) -> None:
    """pygls keeps the futures of all notifications; a session has hundreds of thousands."""
    server = make_server()
    seen = []

    def noticed(what: str) -> Iterator[None]:  # as pygls writes its own
        seen.append(what)
        yield from ()

    async def late(what: str) -> None:
        await asyncio.sleep(0)
        seen.append(what)

    server.feature("noticed")(late if waits else noticed)

    async def session() -> int:
        for _ in range(5):
            server.protocol._handle_notification("noticed", "noticed")
        await asyncio.sleep(0.01)
        return len(server.protocol._request_futures)

    assert asyncio.run(session()) == 0
    assert seen == ["noticed"] * 5


WHOLE = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
LINE = {"line": 5, "character": 19}
ASKED: dict[str, tuple[dict[str, Any], Any]] = {
    "hover": ({"position": LINE}, {"contents", "range"}),
    "completion": ({"position": LINE}, {"isIncomplete", "items"}),
    "signatureHelp": ({"position": LINE}, {"signatures", "activeSignature", "activeParameter"}),
    "definition": ({"position": LINE}, {"uri", "range"}),
    "references": ({"position": LINE, "context": {"includeDeclaration": True}}, 4),
    "documentHighlight": ({"position": LINE}, 4),
    "rename": ({"position": LINE, "newName": "z"}, {"changes"}),
    "documentSymbol": ({}, 1),
    "foldingRange": ({}, 1),
    "selectionRange": ({"positions": [LINE]}, 1),
    "semanticTokens/full": ({}, {"data"}),
    "inlayHint": ({"range": WHOLE}, 2),
    "codeLens": ({}, 6),
    "formatting": ({"options": {"tabSize": 2, "insertSpaces": True}}, 0),
    "codeAction": ({"range": WHOLE, "context": {"diagnostics": []}}, 0),
}
"""Question -> what is asked, and the fields of the answer or its length."""


def test_every_capability_answers(client: Client) -> None:
    """All that the server says it can do, on a text that is right and on one that is half written."""
    text = TEXT.replace("end M;", "  output s = atan2(x, rod);\n  experiment(stop = 1 s);\nend M;")
    item = {"uri": URI, "languageId": "mech", "version": 1, "text": text}
    client.send("textDocument/didOpen", {"textDocument": item}, asks=False)
    able = {name.lower() for name, value in client.abilities.items() if name.endswith("Provider") and value}
    asked = {question.split("/")[0].lower() for question in ASKED}
    assert {name.removesuffix("provider").removeprefix("document") for name in able} - {"executecommand"} == {
        name.removeprefix("document") for name in asked
    }
    for question, (what, wanted) in ASKED.items():
        found = client.send(f"textDocument/{question}", {"textDocument": {"uri": URI}, **what})
        if isinstance(wanted, int):
            assert len(found) == wanted, (question, found)
        else:
            assert wanted <= set(found), (question, found)
    half = {
        "textDocument": {"uri": URI, "version": 2},
        "contentChanges": [{"text": text.replace("rod);", "rod +")}],
    }
    client.send("textDocument/didChange", half, asks=False)
    for question, (what, _) in ASKED.items():
        client.send(f"textDocument/{question}", {"textDocument": {"uri": URI}, **what})


def test_the_model_moves_beside_its_text(client: Client) -> None:
    """What is written, saved or not, is run; of a wrong text it is said what is wrong with it."""
    text = TEXT.replace("end M;", "  potential 1/2*(4 N/m)*x^2;\n  experiment(stop = 1 s);\nend M;")
    client.open(URI, text)
    found = client.send("mechc/preview", {"uri": URI})
    assert "<!-- a page of mechc -->" in found["page"] and "M: completed" in found["report"]
    assert found["message"] == ""
    client.change(URI, text.replace("x^2;\n  exp", "x^2\n  exp"))
    found = client.send("mechc/preview", {"uri": URI})
    assert found["page"] == found["report"] == "" and "E0111" in found["message"]


def test_names_are_sent_as_distances(client: Client) -> None:
    text = 'model M "𝑥"\n  parameter a = 1;  /* 𝑥 */ parameter b = a;\nend M;\n'
    item = {"uri": URI, "languageId": "mech", "version": 1, "text": text}
    client.send("textDocument/didOpen", {"textDocument": item}, asks=False)
    data = client.send("textDocument/semanticTokens/full", {"textDocument": {"uri": URI}})["data"]
    line = column = 0
    lines = text.split("\n")
    seen = []
    for k in range(0, len(data), 5):
        line, column = line + data[k], data[k + 1] + (0 if data[k] else column)
        encoded = lines[line].encode("utf-16-le")
        seen.append(encoded[2 * column : 2 * (column + data[k + 2])].decode("utf-16-le"))
    assert seen == ["M", "a", "b", "a", "M"]


def test_files_of_the_folder_are_looked_at_and_changed(tmp_path: Path) -> None:
    (tmp_path / "wrong.mech").write_text("output y = nobody;\n")
    (tmp_path / "parts.mech").write_text("model Rod\n  parameter Length size = 1 m;\nend Rod;\n")
    user = "import parts.*;\nmodel Two\n  Rod a;\n  output s = a.size;\nend Two;\n"
    with editor(tmp_path) as client:
        while "E0201" not in {message["code"] for message in client.messages()}:
            pass
        uri = (tmp_path / "two.mech").as_uri()
        item = {"uri": uri, "languageId": "mech", "version": 1, "text": user}
        client.send("textDocument/didOpen", {"textDocument": item}, asks=False)
        here = {"textDocument": {"uri": uri}, "position": {"line": 3, "character": 15}}
        changes = client.send("textDocument/rename", {**here, "newName": "long"})["changes"]
        assert set(changes) == {uri, (tmp_path / "parts.mech").as_uri()}
        (tmp_path / "wrong.mech").write_text("output y = nothing_else;\n")
        change = {"uri": (tmp_path / "wrong.mech").as_uri(), "type": 2}
        client.send("workspace/didChangeWatchedFiles", {"changes": [change]}, asks=False)
        while not any("nothing_else" in message["message"] for message in client.messages()):
            pass


def test_messages_of_the_whole_compiler_follow(client: Client) -> None:
    text = "coordinate x = 0 m;\npotential 1 N*x;\n"
    item = {"uri": URI, "languageId": "mech", "version": 1, "text": text}
    client.send("textDocument/didOpen", {"textDocument": item}, asks=False)
    assert client.messages() == []
    assert client.messages()[0]["code"].startswith("E05")
