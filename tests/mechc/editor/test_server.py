"""The language server as an editor meets it: a process, JSON-RPC by hand."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

TEXT = "model M\n  parameter rod = 1 m;\n  coordinate x = 0 m;\n  kinetic 1/2*1 kg*der(x)^2;\n  output y = x + rod;\nend M;\n"
URI = "file:///tmp/of_an_editor/m.mech"


class Client:
    def __init__(self) -> None:
        command = [sys.executable, "-m", "mechc", "lsp"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.notes: list[dict[str, Any]] = []
        self.count = 0

    def send(self, method: str, params: Any, *, asks: bool = True) -> Any:
        message = {"jsonrpc": "2.0", "method": method, "params": params}
        if asks:
            self.count += 1
            message["id"] = self.count
        data = json.dumps(message).encode()
        assert self.process.stdin is not None
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(data), data))
        self.process.stdin.flush()
        while asks:
            found = self.read()
            if found.get("id") == self.count and "method" not in found:
                assert "error" not in found, found
                return found["result"]
            self.notes.append(found)
        return None

    def read(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        length = 0
        while (line := self.process.stdout.readline().strip()) != b"":
            if line.lower().startswith(b"content-length:"):
                length = int(line.split(b":")[1])
        found: dict[str, Any] = json.loads(self.process.stdout.read(length))
        return found

    def messages(self) -> list[dict[str, Any]]:
        """Wait for the next messages about the text."""
        while True:
            for k, note in enumerate(self.notes):
                if note.get("method") == "textDocument/publishDiagnostics":
                    del self.notes[k]
                    found: list[dict[str, Any]] = note["params"]["diagnostics"]
                    return found
            self.notes.append(self.read())


@pytest.fixture
def client() -> Iterator[Client]:
    made = Client()
    made.send("initialize", {"processId": None, "rootUri": None, "capabilities": {}})
    made.send("initialized", {}, asks=False)
    yield made
    with made.process:  # closes its streams
        made.send("shutdown", None)
        made.send("exit", None, asks=False)
        assert made.process.wait(timeout=20) == 0


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


def test_messages_of_the_whole_compiler_follow(client: Client) -> None:
    text = "coordinate x = 0 m;\npotential 1 N*x;\n"
    item = {"uri": URI, "languageId": "mech", "version": 1, "text": text}
    client.send("textDocument/didOpen", {"textDocument": item}, asks=False)
    assert client.messages() == []
    assert client.messages()[0]["code"].startswith("E05")
