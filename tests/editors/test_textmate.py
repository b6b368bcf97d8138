"""The TextMate grammar of the editor package: as its program writes it, and what it makes of every example."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pytest
from pygments.token import Comment, Keyword, Name, Number, Operator, Punctuation, String, _TokenType
from textmate_lines import Piece, coloured

from mechc.editor.highlighting import MechLexer
from mechc.editor.textmate import WORDS, grammar, text
from mechc.lang.builtins import BUILTINS
from mechc.lang.diagnostics import Reporter
from mechc.lang.grammar.keywords import KEYWORDS
from mechc.lang.grammar.lexer import tokenise
from mechc.lang.grammar.tables import load_tables
from mechc.lang.source import SourceFile
from mechc.lang.units import UNIT_NAMES

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "editors" / "vscode"
KEPT = PACKAGE / "syntaxes" / "mech.tmLanguage.json"
EXAMPLES = sorted([*(ROOT / "examples").rglob("*.mech"), *(ROOT / "stdlib").rglob("*.mech")])

SAME: dict[_TokenType, tuple[str, ...]] = {
    Comment.Single: ("comment.line",),
    Comment.Multiline: ("comment.block",),
    String: ("string", "constant.character"),
    Number: ("constant.numeric",),
    Operator: ("keyword.operator",),
    Punctuation: ("punctuation",),
    Keyword.Type: ("support.type.unit",),
    Keyword.Declaration: ("storage.type",),
    Keyword.Constant: ("constant.language",),
    Keyword.Pseudo: ("variable.language", "keyword.operator.word"),
    Keyword: ("keyword.control", "keyword.other"),
    Name.Builtin: ("support.function",),
    Name.Constant: ("constant.language",),
    Name.Class: ("entity.name.type", "support.type"),
    Name: ("variable.other", "variable.language"),
}
"""What scopes begin with, for each kind of token of the Pygments lexer."""


def test_the_kept_grammar_is_what_the_tables_make() -> None:
    """``python -m mechc.editor.textmate > editors/vscode/syntaxes/mech.tmLanguage.json`` writes it again."""
    again = "python -m mechc.editor.textmate > editors/vscode/syntaxes/mech.tmLanguage.json"
    assert KEPT.read_text(encoding="utf-8") == text(), f"written again by {again}"


def test_every_word_of_the_language_has_one_scope() -> None:
    words = [word for group in WORDS.values() for word in group]
    assert set(words) >= KEYWORDS
    assert sorted(words) == sorted(set(words))


def test_every_unit_is_coloured() -> None:
    for unit in UNIT_NAMES:
        pieces = list(coloured(grammar(), f"x = 2.5e-3 {unit}^2/s;"))
        assert (f"{unit}^2/s", "support.type.unit.mech") in pieces


def test_every_function_is_coloured_where_it_is_called() -> None:
    for name in BUILTINS:
        assert next(iter(coloured(grammar(), f"{name}(x)"))) == (name, "support.function.mech")
        assert list(coloured(grammar(), f"body.{name}"))[-1] == (name, "variable.other.mech")


def test_words_behind_a_dot_are_names() -> None:
    for word in sorted(KEYWORDS):
        assert list(coloured(grammar(), f"a.{word};"))[2] == (word, "variable.other.mech")
        assert list(MechLexer().get_tokens(f"a.{word};"))[2] == (Name, word)


def test_what_is_no_unit_and_no_word() -> None:
    pieces = dict(coloured(grammar(), 'a.mass = (b) m + 3 kg^x; "open\nlet c = 2 mm; /* on\nlet */ 5 q'))
    assert pieces["mass"] == "variable.other.mech" and pieces["m"] == "support.type.unit.mech"
    assert pieces["kg"] == "variable.other.mech" and pieces["q"] == "variable.other.mech"
    assert pieces["open"] == "string.quoted.double.mech" and pieces["mm"] == "support.type.unit.mech"
    assert pieces["let "] == "comment.block.mech"


@cache
def pieces_of(path: Path) -> Sequence[Piece]:
    return list(coloured(grammar(), path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_no_token_of_an_example_is_left_out(path: Path) -> None:
    pieces = pieces_of(path)
    source = path.read_text(encoding="utf-8")
    assert "".join(piece for piece, _ in pieces) == source
    assert [piece for piece, scope in pieces if not scope and piece.strip()] == []
    tokens, _ = tokenise(SourceFile(str(path), source), load_tables(), Reporter())
    units = [t.text.split(maxsplit=1)[-1] for t in tokens if t.kind in ("QUANTITY", "UNITTAG")]
    assert [piece for piece, scope in pieces if scope == "support.type.unit.mech"] == units


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_documents_and_editors_colour_alike(path: Path) -> None:
    """The Pygments lexer is written apart from the patterns, from the same tables."""
    source = path.read_text(encoding="utf-8")
    scopes = [scope for piece, scope in pieces_of(path) for _ in piece]
    position = 0
    for kind, value in MechLexer(stripnl=False, ensurenl=False).get_tokens(source):
        if value.strip():
            assert scopes[position].startswith(SAME[kind]), (value, kind, scopes[position])
        position += len(value)


ENGINE = """
const fs = require('fs'), vsctm = require('vscode-textmate'), oniguruma = require('vscode-oniguruma');
(async () => {
  await oniguruma.loadWASM(fs.readFileSync(require.resolve('vscode-oniguruma/release/onig.wasm')).buffer);
  const registry = new vsctm.Registry({
    onigLib: Promise.resolve({
      createOnigScanner: (patterns) => new oniguruma.OnigScanner(patterns),
      createOnigString: (text) => new oniguruma.OnigString(text),
    }),
    loadGrammar: async () => vsctm.parseRawGrammar(fs.readFileSync(process.argv[1], 'utf8'), process.argv[1]),
  });
  const grammar = await registry.loadGrammar('source.mech');
  const answers = process.argv.slice(2).map((path) => {
    let stack = vsctm.INITIAL;
    return fs.readFileSync(path, 'utf8').split('\\n').map((line) => {
      const done = grammar.tokenizeLine(line, stack);
      stack = done.ruleStack;
      return done.tokens.map((t) => [line.slice(t.startIndex, t.endIndex), t.scopes.slice(1).pop() ?? '']);
    });
  });
  console.log(JSON.stringify(answers));
})();
"""


def test_the_engine_of_editors_reads_the_patterns_alike() -> None:
    """Needs ``npm install`` in editors/vscode: Oniguruma is not an expression library of Python."""
    node = shutil.which("node")
    asked = "require.resolve('vscode-textmate'), require.resolve('vscode-oniguruma')"
    if node is None or subprocess.run([node, "-e", asked], cwd=PACKAGE, capture_output=True).returncode != 0:
        pytest.skip("needs node, and `npm install` in editors/vscode")
    done = subprocess.run(
        [node, "-e", ENGINE, str(KEPT), *map(str, EXAMPLES)], cwd=PACKAGE, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    for path, lines in zip(EXAMPLES, json.loads(done.stdout), strict=True):
        theirs = [scope for line in lines for piece, scope in line for _ in piece]
        ours = [scope for piece, scope in pieces_of(path) for sign in piece if sign != "\n"]
        assert theirs == ours, path.name
