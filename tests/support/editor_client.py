"""A client of the language server: a process, JSON-RPC by hand."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any


class Client:
    """An editor without a window. ``log``: where the server writes what goes wrong."""

    def __init__(self, folder: Path | None = None, log: IO[str] | None = None) -> None:
        command = [sys.executable, "-m", "mechc", "lsp"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log)
        self.notes: list[dict[str, Any]] = []
        self.count = 0
        root = None if folder is None else folder.as_uri()
        folders = None if root is None else [{"uri": root, "name": "all"}]
        self.abilities = self.send(
            "initialize",
            {"processId": None, "rootUri": root, "workspaceFolders": folders, "capabilities": {}},
        )["capabilities"]
        self.send("initialized", {}, asks=False)

    def end(self) -> None:
        with self.process:  # closes its streams
            self.send("shutdown", None)
            self.send("exit", None, asks=False)
            assert self.process.wait(timeout=20) == 0

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

    def open(self, uri: str, text: str) -> None:
        item = {"uri": uri, "languageId": "mech", "version": 1, "text": text}
        self.send("textDocument/didOpen", {"textDocument": item}, asks=False)

    def change(self, uri: str, text: str) -> None:
        whole = {"textDocument": {"uri": uri, "version": 2}, "contentChanges": [{"text": text}]}
        self.send("textDocument/didChange", whole, asks=False)

    def processor_time(self) -> float:
        """Seconds of processor time of the server so far, without those of its processes aside."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory(self) -> int:
        """Bytes that the server holds."""
        return int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]) * os.sysconf(
            "SC_PAGE_SIZE"
        )

    def messages(self) -> list[dict[str, Any]]:
        """Wait for the next messages about the text."""
        while True:
            for k, note in enumerate(self.notes):
                if note.get("method") == "textDocument/publishDiagnostics":
                    del self.notes[k]
                    found: list[dict[str, Any]] = note["params"]["diagnostics"]
                    return found
            self.notes.append(self.read())


@contextmanager
def editor(folder: Path | None = None, log: IO[str] | None = None) -> Iterator[Client]:
    made = Client(folder, log)
    try:
        yield made
    finally:
        made.end()
