"""One mistake, one error, at the right place and in the words of the language."""

from __future__ import annotations

import re
import time
from collections.abc import Callable

import pytest
from syntax import errors_of, parse_text

from mechc.lang.diagnostics import CompileError
from mechc.lang.grammar.lexer import MOST_ERRORS
from mechc.lang.grammar.tables import load_tables
from mechc.presentation.render import render

# (statement in a model, code, what the error points at)
MISTAKES = [
    ("let a = 1 @ 2;", "E0105", "@"),
    ("let a = m\u00a0;", "E0105", "\u00a0"),
    ("let a = |x|;", "E0105", "|"),
    ("let a = x ? 1 : 2;", "E0105", "?"),
    ("let \u03b8 = 3;", "E0106", "\u03b8"),
    ("coordinate \u03c6 = 1 rad;  kinetic \u03c6^2;", "E0106", "\u03c6"),
    ("let na\u00efve = 3;", "E0106", "na\u00efve"),
    ('let s = "abc;', "E0107", '"abc'),
    ("/* open", "E0108", "/*"),
    ("let a = 3.;", "E0109", "3."),
    ("let a = 0x1F;", "E0109", "0x1F"),
    ("let a = 1e;", "E0109", "1e"),
    ("let a = 1.2.3;", "E0109", "1.2.3"),
    ("let a = 1..3;", "E0109", "1..3"),
    ("let a = 1e999;", "E0109", "1e999"),
    ("parameter = 3;", "E0110", "="),
    ("parameter m = ;", "E0110", ";"),
    ("let a = 1 +;", "E0110", ";"),
    ("force F at P;", "E0110", "at"),
    ("mass 1 kg, P;", "E0110", ","),
    ("constraint c: a = b = c;", "E0110", "="),
    ("let a = sin x;", "E0110", "x"),
    ("let a = b c;", "E0110", "c"),
    ("let a = 5 N (x);", "E0110", "("),
    ("let a = [1, 2];", "E0110", "["),
    ("let a = (1, 2);", "E0110", ","),
    ("let a = 5 [m];", "E0110", "["),
    ("let a = 1,5 m;", "E0110", ","),
    ("let a = if x > 1 then 2;", "E0110", "if"),
    ('assert(x > 1 m, "far");', "E0110", ","),
    ("reinit(x, 2);", "E0110", "reinit"),
    ("1 + 2;", "E0110", "1"),
    ("a.b.c;", "E0110", ";"),
    ("let a = f(x = 1, 2);", "E0110", "2"),
    ("let a = der(x, 1.5);", "E0110", "1.5"),
    ("parameter m = 1 kg", "E0111", "g"),
    ("discrete n = 0\n  discrete k = 1;", "E0111", "0"),
    ("output E = momentum(x) potential m;", "E0111", ")"),
    ("import mech.planar.*", "E0111", "*"),
    ("function f(x) = x^2", "E0111", "2"),
    ("parameter m = 2 metres;", "E0112", "metres"),
    ("parameter v = 2 metres/second;", "E0112", "metres"),
    ("let a = 2 theta;", "E0112", "theta"),
    ("let a = (1/2) metre;", "E0112", "metre"),
    ("let a = 5 \u00b5m;", "E0112", "\u00b5m"),
    ('type K = unit "1/metre";', "E0112", '"1/metre"'),
    ("parameter m = 2m;", "E0113", "2m"),
    ("let a = 1e-3m/s;", "E0113", "1e-3m/s"),
    ("parameter m = 2x;", "E0113", "2x"),
    ("let a = 30\u00b0;", "E0113", "30\u00b0"),
    ("let a = {1, 2}mm;", "E0113", "mm"),
    ("let a = 1/2 m;", "E0114", "1/2 m"),
    ("let a = -1/2 m;", "E0114", "-1/2 m"),
    ("let a = +1/2 m;", "E0114", "+1/2 m"),
    ("let a = 1/-2 m;", "E0114", "1/-2 m"),
    ("let a = 2*3/4 m;", "E0114", "2*3/4 m"),
    ("let a = 1/3/4 m;", "E0114", "1/3/4 m"),
    ("for i in 1:3 loop\n    mass m at P;", "E0115", "for"),
    ("for i in 1:3 loop mass m at P; end if;", "E0115", "for"),
    ("for i in 1:3 loop mass m at P; end;", "E0115", "end"),
    ("if a then\n    mass m at P;\n  end when;", "E0115", "if"),
    ("end for;", "E0115", "end for"),
    ("else mass m at P;", "E0115", "else"),
    ("model N end N;", "E0115", "M"),
    ("potential V = m*g*x;", "E0110", "="),
    ("potential = m*g*x;", "E0110", "="),
    ("force F = 3 N on x;", "E0110", "="),
    ("coordinate x = 1 m, y = 2 m;", "E0110", ","),
    ("let a = b if b > 1 else 1;", "E0110", "if"),
    ("when x > 1 then der(x) := 0; end when;", "E0125", "der"),
    ("parameter g = 9.81 m/s\u00b2;", "E0121", "\u00b2"),
    ("let a = (1 + 2;", "E0117", "("),
    ("let a = {1, 2);", "E0117", "{"),
    ("let a = 1 + 2);", "E0117", ")"),
    ("Body b(m = 1 kg", "E0117", "("),
    ("parameter m := 1 kg;", "E0118", ":="),
    ("n := 3;", "E0118", ":="),
    ("when x > 0 then n = 1; end when;", "E0118", "="),
    ("let a = if x = 1 then 2 else 3;", "E0119", "="),
    ("when x = 0 then n := 1; end when;", "E0119", "="),
    ('assert n = 1, "one";', "E0119", "="),
    ("Body b if n = 1;", "E0119", "="),
    ("parameter m == 1 kg;", "E0119", "=="),
    ("constraint a == b;", "E0119", "=="),
    ("connect(a.b, c.d);", "E0120", "connect"),
    ("def f(x):\n    return", "E0120", "def"),
    ("from mech.planar import *;", "E0120", "from"),
    ("import numpy as np;", "E0120", "import"),
    ("x.start = 3;", "E0125", "x"),
    ("let a = tip[i][2];", "E0110", "["),
    ("equation\n    m*der(v) = F;", "E0120", "equation"),
    ("initial equation x = 0;", "E0120", "initial equation"),
    ("Bar b(each m = 1);", "E0120", "each"),
    ("annotation(Evaluate = true);", "E0120", "annotation"),
    ("constant g = 9.81 m/s^2;", "E0120", "constant"),
    ("parameter Real x = 1 annotation(Evaluate = true);", "E0120", "annotation"),
    ("let a = x**2;", "E0121", "**"),
    ("let a = b != c;", "E0121", "!="),
    ("let a = x\u00b2;", "E0121", "\u00b2"),
    ("let a = 2\u00b7x;", "E0121", "\u00b7"),
    ("when a && b then n := 1; end when;", "E0121", "&&"),
    ("# comment", "E0122", "#"),
    ("assert c, 'abc';", "E0122", "'abc'"),
    ("assert c, \u201cabc\u201d;", "E0122", "\u201cabc\u201d"),
    ("paramter m = 1 kg;", "E0123", "paramter"),
    ("potental -m*g;", "E0123", "potental"),
    ("mass m att P;", "E0123", "att"),
    ("force F onq;", "E0123", "onq"),
    ("if a thn mass m at P; end if;", "E0123", "thn"),
    ("for i in 1:3 do mass m at P; end for;", "E0123", "do"),
    ("x = 3;", "E0125", "x"),
    ("der(x) = v;", "E0125", "der"),
    ("Real x = 3;", "E0125", "Real"),
    ("x[1] = 3;", "E0125", "x"),
    ("let time = 3;", "E0126", "time"),
    ("parameter end = 3;", "E0126", "end"),
    ("Bar b(hip(angle = 3 deg));", "E0127", "hip(angle = 3 deg)"),
    ("Bar b(3);", "E0127", "3"),
    ("Bar b(2*x = 3);", "E0127", "2*x"),
    ("let a = 2 m^n;", "E0128", "m^"),
    ("let a = 2 m ^2;", "E0128", "^"),
    ("let a = (1/2) m ^2;", "E0128", "^"),
    ('assert c, "a\\q";', "E0129", "\\q"),
]


def in_a_model(statement: str) -> str:
    return f"model M\n  {statement}\n  parameter l = 1 m;\nend M;\n"


@pytest.mark.parametrize(("statement", "code", "marked"), MISTAKES, ids=[m[0][:40] for m in MISTAKES])
def test_mistake(statement: str, code: str, marked: str) -> None:
    (error,) = errors_of(in_a_model(statement))
    assert (error.code, error.span and error.span.text) == (code, marked)
    assert error.span is not None and "E01" in code


def test_the_words(golden: Callable[[str, str], None]) -> None:
    blocks = [render(errors_of(in_a_model(statement))) for statement, _, _ in MISTAKES]
    golden("syntax_errors.txt", "\n\n".join(blocks) + "\n")


def test_no_message_shows_a_terminal_or_begins_with_a_capital() -> None:
    signs = {k for row in load_tables().moves for k in row if k.isupper()} - {"M"}
    for statement, _, _ in MISTAKES:
        (error,) = errors_of(in_a_model(statement))
        text = f"{error.message} {error.caption} {error.help} {' '.join(x.text for x in error.labels)}"
        assert not signs & set(re.findall(r"[A-Z_]{2,}", text))
        assert not error.message[0].isupper()


@pytest.mark.parametrize(
    ("statement", "advice"),
    [
        ("def f(x):\n    return", "'function f(Real x) = x^2;'"),
        ("import numpy as np;", "functions such as 'sin' are always there"),
        ("from mech.planar import *;", "write 'import mech.planar.*;'"),
        ("x.start = 3;", "'initial x = ..;' for a known value, 'initial x ~ ..;' for a guess"),
        ("part.x.start = 3;", "'initial part.x = ..;'"),
        ("let a = tip[i][2];", "'x[1, 2]'"),
        ("spring 3 N/m on x;", "'potential 1/2*k*x^2;'"),
        ("damper(x);", "'damping c on x;'"),
        ("joint = pin;", "'Revolute pin(world -> bar.a);'"),
    ],
)
def test_habits_of_python_and_modelica_are_translated(statement: str, advice: str) -> None:
    (error,) = errors_of(in_a_model(statement))
    assert advice in error.help


# ---------------------------------------------------------------- whole files


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("class A:\n  x = 3\n", "write 'model A .. end A;'"),
        ("class A(Base):\n  x = 3\n", "write 'model A .. end A;'"),
        ("class A\n  parameter m = 1 kg;\nend A;\n", "write 'model'"),
        ("def f(x):\n  return x\n", "'function f(Real x) = x^2;'"),
    ],
)
def test_files_of_other_languages_get_one_message(text: str, advice: str) -> None:
    (error,) = errors_of(text)
    assert error.code == "E0120" and advice in error.help


@pytest.mark.parametrize(
    ("text", "code", "marked"),
    [
        ("model A\n parameter m = 1 kg;\nmodel B\n parameter l = 1 m;\nend B;\n", "E0115", "A"),
        ("model A\n for i in 1:2 loop\n mass m at P;\nend A;\n", "E0115", "for"),
        ("model A\n parameter m = 1 kg;\n", "E0115", "A"),
        ("model A\n parameter m = 1 kg;\nend B;", "E0116", "B"),
        ("model A\nend;", "E0115", "end"),
        ("end Foo;", "E0115", "end"),
        ("parameter m = 1 kg; }", "E0117", "}"),
        ("let a = (1 +", "E0117", "("),
        ("let a = 1 +", "E0110", "+"),
        ("let a = 1", "E0111", "1"),
    ],
)
def test_ends_of_blocks_and_files(text: str, code: str, marked: str) -> None:
    (error,) = errors_of(text)
    assert (error.code, error.span and error.span.text) == (code, marked)


@pytest.mark.parametrize(
    "block, word, advice",
    [
        (
            "if x > 1 then n := 1; else if x > 2 then n := 3; end if; end if;",
            "if",
            "n := if c then a else n;",
        ),
        ("for i in 1:2 loop for j in 1:2 loop n := j; end for; end for;", "for", "around the 'when'"),
    ],
)
def test_blocks_among_actions_get_one_message(block: str, word: str, advice: str) -> None:
    (found,) = errors_of(f"when x > 0 then n := 2; {block} m := 1; end when; let a = 2;")
    assert found.code == "E0110" and found.message == f"'{word}' is not an action of a 'when'"
    assert advice in found.help


def test_braces_around_blocks_as_in_c() -> None:
    text = "model A {\n for i in 1:3 {\n  mass m at P;\n }\n when x > 0 m {\n  n := 1;\n }\n}\n"
    found = errors_of(text)
    assert [e.code for e in found] == ["E0117"] * MOST_ERRORS
    assert [e.span and e.span.text for e in found] == ["{", "{", "}", "{", "}"]
    words = ["end A;", "'loop'", "end for;", "'then'", "end when;"]
    assert all(word in error.help for word, error in zip(words, found, strict=True))


def test_the_version_of_the_language() -> None:
    parse_text("// mech 1\nlet a = 1;")
    parse_text("// mech.planar, 2 dimensions\nlet a = 1;")
    parse_text("let a = 1; // mech 2")
    (error,) = errors_of("// mech 2\nlet a = 1;")
    assert error.code == "E0130"


def test_independent_errors_are_all_reported_in_order() -> None:
    text = "model A\n  paramter m = 1 kg;\n  let a = 1 + ;\n  mass m at P;\n  let b = 2 metres;\nend B;\n"
    assert [(e.code, e.span and e.span.file.position(e.span.start)[0]) for e in errors_of(text)] == [
        ("E0123", 2),
        ("E0110", 3),
        ("E0112", 5),
        ("E0116", 6),
    ]


def test_statements_behind_an_error_are_still_read() -> None:
    """An error in a nested block does not hide the end of the block."""
    text = "model A\n for i in 1:2 loop\n  mass m att P;\n end for;\n when c then\n  n := ;\n end when;\nend A;\n"
    assert [e.code for e in errors_of(text)] == ["E0123", "E0110"]


def test_a_broken_header_still_opens_its_block() -> None:
    for header in ("for i im 1:2 loop", 'if a "x" then', "when a ) then", "for 3 loop"):
        end = f"end {header.split()[0]};"
        (error,) = errors_of(f'model A\n {header}\n assert c, "text";\n {end}\nend A;\n')
        assert error.code in ("E0110", "E0117", "E0123")


def test_a_handful_of_errors_is_enough() -> None:
    assert len(errors_of("let a = ;\n" * 100)) == MOST_ERRORS
    assert len(errors_of("@ $ ? % ' &\n" * 100)) == MOST_ERRORS


@pytest.mark.parametrize(
    "piece", ["(", "{", "if ", "-", "for i in 1:2 loop ", "let a = ", "end ", "model A ", "1 ", "a.", "]"]
)
def test_hopeless_texts_end_quickly(piece: str) -> None:
    """Two seconds is the bound for any text; here about 20 000 tokens."""
    began = time.process_time()
    with pytest.raises(CompileError):
        parse_text(piece * 20_000)
    assert time.process_time() - began < 20


@pytest.mark.parametrize(
    ("action", "example"),
    [
        ("terminate;", 'terminate("arrived");'),
        ("terminate();", 'terminate("arrived");'),
        ("reinit;", "reinit(der(x), -der(x));"),
        ("release;", "release joint;"),
    ],
)
def test_a_statement_without_its_parts_is_shown_whole(action: str, example: str) -> None:
    """The message was "expected '('" alone."""
    (found,) = errors_of(f"coordinate x = 1 m; when x < 0 m then {action} end when;")
    assert found.code == "E0110" and found.help == f"write it like this: '{example}'"
