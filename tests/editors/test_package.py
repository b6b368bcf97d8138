"""The editor package: what it names exists, its snippets are models, its commands start what they say."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from syntax import parse_text

from mechc.cli.main import run
from mechc.editor.lenses import COMMANDS

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "editors" / "vscode"
DESCRIPTION: dict[str, Any] = json.loads((PACKAGE / "package.json").read_text(encoding="utf-8"))
EXAMPLES = sorted((ROOT / "examples").glob("*.mech"))
SNIPPETS: dict[str, Any] = json.loads((PACKAGE / "snippets" / "mech.json").read_text(encoding="utf-8"))
FIELD = re.compile(r"\$\{(\d+):((?:\\.|[^\\}])*)\}|\$(\d+)")


def named(part: object) -> list[str]:
    """All relative paths in the description."""
    if isinstance(part, dict):
        return [path for value in part.values() for path in named(value)]
    if isinstance(part, list):
        return [path for value in part for path in named(value)]
    return [part] if isinstance(part, str) and part.startswith("./") else []


def expanded(snippet: dict[str, Any]) -> str:
    """The text of a snippet whose fields were left as they are."""
    body = snippet["body"]
    text = body if isinstance(body, str) else "\n".join(body)
    fields = {number: value for number, value, _ in FIELD.findall(text) if number}
    fields.setdefault("0", "")

    def written(match: re.Match[str]) -> str:
        value = FIELD.sub(lambda inner: fields[inner[3]], fields[match[1] or match[3]])
        return re.sub(r"\\([$}\\])", r"\1", value)

    return FIELD.sub(written, text)


def test_every_file_that_the_description_names_exists() -> None:
    paths = [*named(DESCRIPTION), DESCRIPTION["icon"]]
    assert len(paths) >= 6
    assert [path for path in paths if not (PACKAGE / path).is_file()] == []


def test_the_licence_is_that_of_the_project() -> None:
    assert (PACKAGE / "LICENSE").read_text(encoding="utf-8") == (ROOT / "LICENSE").read_text(encoding="utf-8")


def test_lines_are_indented_as_the_layout_is() -> None:
    """By the words that begin and end blocks; lines that continue a statement lie as their writer likes."""
    rules = json.loads((PACKAGE / "language-configuration.json").read_text(encoding="utf-8"))[
        "indentationRules"
    ]
    opens, closes = (re.compile(rules[f"{way}IndentPattern"]) for way in ("increase", "decrease"))
    word = re.compile(r"\s*(?:(?:partial\s+)?model|end|if|elseif|else|for|when|elsewhen)\b")
    seen = 0
    for source in EXAMPLES:
        depth = 0
        for line in source.read_text(encoding="utf-8").splitlines():
            if word.match(line) and (opens.search(line) or closes.search(line)):
                depth -= closes.search(line) is not None
                assert line.startswith("  " * depth) and line[2 * depth] != " ", (source.name, line)
                depth += opens.search(line) is not None
                seen += 1
        assert depth == 0, source.name
    assert seen > 2 * len(EXAMPLES)


@pytest.mark.parametrize(
    "name", [name for name, snippet in SNIPPETS.items() if "experiment(" in str(snippet)]
)
def test_models_among_the_snippets_are_right(name: str, tmp_path: Path) -> None:
    file = tmp_path / "snippet.mech"
    file.write_text(expanded(SNIPPETS[name]) + "\n", encoding="utf-8")
    assert run(["check", "--quiet", str(file)]) == 0
    assert run(["fmt", "--check", str(file)]) == 0


@pytest.mark.parametrize("name", sorted(SNIPPETS))
def test_snippets_can_be_read(name: str) -> None:
    text = expanded(SNIPPETS[name])
    assert "$" not in text
    whole = text if "model " in text else f"model M\n{text}\nend M;"
    assert parse_text(whole).items


STAND_IN = """
const Module = require('node:module'), load = Module._load;
const happened = { commands: {}, tasks: [], errors: [], servers: [], stopped: 0, asked: [], shown: [] };
let saved = true, fails = false, configured, typed, disposed;
class LanguageClient {
  constructor(id, name, server, client) { happened.servers.push({ ...server, ...client }); }
  async start() { if (fails) throw new Error('not found'); }
  async stop() { happened.stopped += 1; }
  async sendRequest(name, what) {
    happened.asked.push([name, what]);
    if (happened.asked.length === 2) await typed({ document }), await new Promise((done) => setTimeout(done, 350));
    return { page: '<p>', report: 'run', message: '' };
  }
}
const document = {
  languageId: 'mech', save: async () => saved, uri: { scheme: 'file', path: '/place with blank/a.mech', fsPath: '/place with blank/a.mech', toString: () => 'file:///a.mech' },
};
const values = { path: '/opt/mechc', runArguments: ['--experiment', 'all'] };
const vscode = {
  commands: { registerCommand: (name, run) => { happened.commands[name] = run; return {}; } },
  workspace: {
    getConfiguration: () => ({ get: (name) => values[name] }),
    getWorkspaceFolder: () => undefined,
    onDidChangeConfiguration: (heard) => { configured = heard; return {}; },
    onDidChangeTextDocument: (heard) => { typed = heard; return {}; },
    createFileSystemWatcher: (pattern) => pattern,
  },
  window: {
    activeTextEditor: { document }, showErrorMessage: (text) => happened.errors.push(text),
    createWebviewPanel: () => ({
      webview: { postMessage: (message) => happened.shown.push(message) }, reveal: () => {},
      onDidDispose: (heard) => { disposed = heard; },
    }),
  },
  ViewColumn: { Beside: -2 }, Uri: { parse: (text) => text },
  tasks: { executeTask: async (task) => happened.tasks.push(task) },
  TaskScope: { Workspace: 2 }, TaskRevealKind: { Always: 1 },
  Task: class { constructor(kind, scope, name, source, execution) { Object.assign(this, { scope, name, execution }); } },
  ProcessExecution: class { constructor(program, args, options) { Object.assign(this, { program, args, options }); } },
};
Module._load = (name, ...rest) => name === 'vscode' ? vscode
  : name === 'vscode-languageclient/node' ? { LanguageClient } : load(name, ...rest);
(async () => {
  const extension = require(process.argv[1]);
  await extension.activate({ subscriptions: [] });
  for (const name of ['mechc.run', 'mechc.plot', 'mechc.view']) await happened.commands[name]({ scheme: 'file' });
  for (const name of LENSES) await happened.commands[name]('file:///a.mech', 'A');
  await happened.commands['mechc.preview']();
  const quiet = async () => { await typed({ document }); await new Promise((done) => setTimeout(done, 1000)); };
  await quiet();
  disposed();
  await quiet();
  await configured({ affectsConfiguration: (name) => name === 'mechc.path' });
  await configured({ affectsConfiguration: () => false });
  saved = false; await happened.commands['mechc.run']();
  document.languageId = 'c'; await happened.commands['mechc.run']();
  fails = true; await happened.commands['mechc.restart']();
  await extension.deactivate();
  console.log(JSON.stringify({ ...happened, commands: Object.keys(happened.commands) }));
})();
"""


@pytest.mark.slow
def test_commands_start_what_they_say() -> None:
    """With a stand-in for the editor, which notes what it is asked for."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("needs node")
    script = f"const LENSES = {json.dumps([f'mechc.{title}' for title in COMMANDS])};\n{STAND_IN}"
    done = subprocess.run(
        [node, "-e", script, str(PACKAGE / "extension.js")], capture_output=True, text=True, check=True
    )
    happened = json.loads(done.stdout)
    assert sorted(happened["commands"]) == sorted(
        c["command"] for c in DESCRIPTION["contributes"]["commands"]
    )
    file = "/place with blank/a.mech"
    assert [task["execution"]["args"] for task in happened["tasks"]] == [
        ["run", file, "--experiment", "all"],
        ["run", file, "--experiment", "all", "--plot"],
        ["view", file],
        *(
            [words[0], *words[1:2], file, "--model", "A"]
            if words[0] != "run"
            else ["run", file, "--model", "A", "--experiment", "all", *words[1:]]
            for words in COMMANDS.values()
        ),
    ]
    assert {task["execution"]["program"] for task in happened["tasks"]} == {"/opt/mechc"}
    assert {task["execution"]["options"]["cwd"] for task in happened["tasks"]} == {"/place with blank"}
    assert [server["args"] for server in happened["servers"]] == [["lsp"]] * 3
    assert happened["servers"][0]["documentSelector"] == [{"language": "mech"}]
    assert happened["servers"][0]["synchronize"] == {"fileEvents": "**/*.mech"}
    assert happened["asked"] == [["mechc/preview", {"uri": "file:///a.mech"}]] * 3
    assert happened["shown"] == [{"page": "<p>", "report": "run", "message": ""}] * 2, (
        "what was typed meanwhile is awaited"
    )
    assert happened["stopped"] == 2  # for the changed path, and for the restart that failed
    unsaved, other, missing = happened["errors"]
    assert "saved" in unsaved and ".mech file" in other
    assert "/opt/mechc" in missing and 'pip install "mechc[editor]"' in missing and "mechc.path" in missing
