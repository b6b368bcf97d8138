"""The canonical layout: it reads back to the same tree, and formatting twice changes nothing."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import pytest
from msgspec.structs import replace
from syntax import SAMPLES, parse_expression, parse_text, sample_files

from mechc.lang import ast
from mechc.lang.printing.layout import WIDTH
from mechc.lang.printing.printer import format_file, print_expression
from mechc.lang.source import SourceFile, Span


@pytest.mark.parametrize("path", sample_files(), ids=lambda p: p.stem)
def test_samples(path: Path) -> None:
    tree = parse_text(path.read_text(encoding="utf-8"))
    text = format_file(tree)
    again = parse_text(text)
    assert again == tree
    assert [c.text for c in again.comments] == [c.text for c in tree.comments]
    assert format_file(again) == text
    assert all(len(line) <= WIDTH for line in text.splitlines() if not set(line) & set('"/'))


def formatted(text: str) -> str:
    result = format_file(parse_text(text))
    assert format_file(parse_text(result)) == result
    assert parse_text(result) == parse_text(text)
    return result


def test_layout(golden: Callable[[str, str], None]) -> None:
    golden("tour.mech", formatted((SAMPLES / "09_tour.mech").read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("text", "canonical"),
    [
        ("let a=1+2*3 ;", "let a = 1 + 2*3;"),
        ("let a = b * c / d;", "let a = b * c / d;"),
        ("let a = b *c;", "let a = b*c;"),
        ("let a = - x ^ 2;", "let a = -x^2;"),
        ("let a = ( 1/2 )  m;", "let a = (1/2) m;"),
        ("let a = 5 N / m;", "let a = 5 N / m;"),
        ("let a = 5 N /m;", "let a = 5 N / m;"),
        ("let a = 5 N /x;", "let a = 5 N/x;"),
        ("let a = 2*(5 N) / m;", "let a = 2*(5 N) / m;"),
        ("let a = {1,2} N /m;", "let a = {1, 2} N / m;"),
        ("let a = 1.50e-3 m;", "let a = 1.50e-3 m;"),
        ("let a = x[ i - 1 ];", "let a = x[i-1];"),
        ("let a = x[1 : n - 1, div(n + 1, 2)];", "let a = x[1:n-1, div(n + 1, 2)];"),
        ("let a = not(b)and c;", "let a = not (b) and c;"),
        ("let a = if b then c elseif d then e else f;", "let a = if b then c elseif d then e else f;"),
        ("let a = sum(i for i in 1:3 for j in v);", "let a = sum(i for i in 1:3 for j in v);"),
        ("let a = der(x,2)[1] + pre(n);", "let a = der(x, 2)[1] + pre(n);"),
        ('assert a<b,"text";', 'assert a < b, "text";'),
        ("experiment();", "experiment();"),
        ("extends A();", "extends A;"),
        ("contact c:g restitution e,rest=1;", "contact c: g restitution e, rest = 1;"),
        ("import a.{X,Y};", "import a.{X, Y};"),
        ("independent Length x from 0 to 1;", "independent Length x from 0 to 1;"),
        ("function f(Length x[3], k)->F=x;", "function f(Length x[3], k) -> F = x;"),
        ("function f()=1;", "function f() = 1;"),
        (r'let a = "a \"b\" \\ \n";', r'let a = "a \"b\" \\ \n";'),
    ],
)
def test_statement(text: str, canonical: str) -> None:
    assert formatted(text) == canonical + "\n"


def test_blocks_and_empty_lines() -> None:
    text = (
        '\n\n\npartial model A "a"\n\n\nlet b = 1;\n\n\n\nlet c = 2; let d = 3;\n'
        'when x > 1 then n := 1; elsewhen y then terminate("t"); end when;\n'
        'if a then\n\nmass m at P; elseif b then else mass n at Q; end if "why";\n\nend A;\nmodel B end B;\n\n'
    )
    assert formatted(text) == (
        'partial model A "a"\n'
        "  let b = 1;\n\n"
        "  let c = 2;\n"
        "  let d = 3;\n"
        "  when x > 1 then\n"
        "    n := 1;\n"
        "  elsewhen y then\n"
        '    terminate("t");\n'
        "  end when;\n"
        "  if a then\n"
        "    mass m at P;\n"
        "  elseif b then\n"
        "  else\n"
        "    mass n at Q;\n"
        '  end if "why";\n'
        "end A;\n\n"
        "model B\n"
        "end B;\n"
    )


def test_comments_stay_where_they_belong() -> None:
    text = (
        "// head\n\n/* two\n   lines */\nmodel A // of the model\n      // before b\n   let b = 1;   // after b\n"
        "  /* before c */ let c = 2; /* after c */\n"
        "  for i in 1:2 loop // each\n // inside\n  mass m at P;\n // last\n end for; // after\n"
        "  if a then // then\n  let d = 1;\n // before else\n else // otherwise\n let d = 2; end if;\n// in A\nend A; // of A\n// tail"
    )
    assert formatted(text) == (
        "// head\n\n/* two\n   lines */\nmodel A  // of the model\n  // before b\n  let b = 1;  // after b\n"
        "  /* before c */\n  let c = 2;  /* after c */\n"
        "  for i in 1:2 loop  // each\n    // inside\n    mass m at P;\n    // last\n  end for;  // after\n"
        "  if a then  // then\n    let d = 1;\n    // before else\n  else  // otherwise\n    let d = 2;\n  end if;\n"
        "  // in A\nend A;  // of A\n// tail\n"
    )


def test_a_statement_with_comments_inside_stays_as_written() -> None:
    text = "model A\n let b = {1,   // one\n          2};\nend A;\n"
    assert formatted(text) == "model A\n  let b = {1,   // one\n           2};\nend A;\n"


def test_only_comments() -> None:
    assert formatted("  // a\n\n\n// b") == "// a\n\n// b\n"
    assert formatted("") == ""


def test_words_in_texts_and_comments_do_not_mislead() -> None:
    text = 'model A "end A;" // end A;\n  if a == "else" then // else\n    let c = 1;\n  // end if\n  end if;\nend A;\n'
    assert formatted(text).splitlines()[-3:] == ["    // end if", "  end if;", "end A;"]


def test_long_lines_are_broken_and_read_back() -> None:
    names = [f"quantity_{i}" for i in range(30)]
    for text in (
        f"let a = {' + '.join(names)};",
        f"let a = {'*'.join(names)};",
        f"let a = {' and '.join(names)};",
        f"let a = f({', '.join(names)});",
        f"let a = {{{', '.join(names)}}} mm;",
        f'Bar b({", ".join(f"{n} = {n}" for n in names)}) if {" or ".join(names)} "doc";',
        f"let a = f(x, g({', '.join(names)}), {{{', '.join(names)}}});",
        f"contact {names[0]} with {', '.join(names)} friction 0.3;",
        f"force {names[0]} on {'.'.join(names[:5])} at {'.'.join(names[:5])} from {'.'.join(names[:5])};",
    ):
        lines = formatted(text).splitlines()
        assert len(lines) > 1
        assert max(map(len, lines)) <= WIDTH
        assert all(line.startswith("  ") for line in lines[1:])


# ---------------------------------------------------------------- trees that no author wrote

_NOWHERE = Span(SourceFile("none", ""), 0, 0)


def _number(value: Fraction) -> ast.Number:
    return ast.Number(value, text=str(float(value)), span=_NOWHERE)


def _reference(name: str) -> ast.Reference:
    return ast.Reference((ast.Part(name, span=_NOWHERE),), span=_NOWHERE)


def _random_tree(random: Random, depth: int) -> ast.Expression:
    """An expression of every kind of node, which nobody would write."""

    def tree() -> ast.Expression:
        return _random_tree(random, depth - 1)

    def trees() -> tuple[ast.Expression, ...]:
        return tuple(tree() for _ in range(random.randint(1, 3)))

    kind = random.randrange(5) if depth == 0 else random.randrange(5, 16)
    unit = random.choice(["", "mm", "N"])
    match kind:
        case 0:
            return _reference(random.choice(["x", "m", "s", "mass", "at"]))
        case 1:
            return _number(Fraction(random.choice(["1", "0.5", "2.25"])))
        case 2:
            return ast.Quantity(Fraction(2), random.choice(["m", "N", "m/s^2"]), text="2.0", span=_NOWHERE)
        case 3:
            return ast.Time(span=_NOWHERE) if random.random() < 0.5 else ast.Boolean(True, span=_NOWHERE)
        case 4:
            return ast.String(random.choice(["", 'a"b', "\\", "end"]), span=_NOWHERE)
        case 5 | 6 | 7 | 8:
            operator = random.choice(["+", "-", "*", "/", "/", "^", "<", "==", "and", "or"])
            return ast.Binary(operator, tree(), tree(), span=_NOWHERE)
        case 9:
            return ast.Unary(random.choice(["-", "+", "not"]), tree(), span=_NOWHERE)
        case 10:
            branches = tuple(ast.Branch(tree(), tree(), span=_NOWHERE) for _ in range(random.randint(1, 2)))
            return ast.Conditional(branches, tree(), span=_NOWHERE)
        case 11:
            return ast.Vector(trees(), unit, span=_NOWHERE)
        case 12:
            return ast.Call(_reference("f"), trees(), span=_NOWHERE)
        case 13:
            return ast.Derivative(tree(), random.randint(1, 3), span=_NOWHERE)
        case 14:
            base = tree()
            return base if isinstance(base, ast.Reference) else ast.Subscript(base, trees(), span=_NOWHERE)
        case _:
            return ast.Reference((ast.Part("q", trees(), span=_NOWHERE),), span=_NOWHERE)


def without_parentheses(node: Any) -> Any:
    """The tree without the parentheses that only group."""
    while isinstance(node, ast.Parenthesis) and not node.unit:
        node = node.inner
    if isinstance(node, tuple):
        return tuple(without_parentheses(n) for n in node)
    if not isinstance(node, ast.Node):
        return node
    changes = {n: without_parentheses(getattr(node, n)) for n in node.__struct_fields__ if n != "span"}
    return replace(node, **changes)


def _ratio_of_literals(e: Any) -> bool:
    """``1/2 m``, which the language refuses, somewhere in a tree."""
    if isinstance(e, ast.Binary) and e.operator == "/":
        left = e.left
        if isinstance(left, ast.Number) and isinstance(e.right, ast.Quantity):
            return True
    children = (
        e
        if isinstance(e, tuple)
        else [getattr(e, name) for name in e.__struct_fields__]
        if isinstance(e, ast.Node)
        else []
    )
    return any(_ratio_of_literals(c) for c in children if isinstance(c, ast.Node | tuple))


@pytest.mark.parametrize("seed", range(20))
def test_any_tree_prints_to_text_that_means_the_same(seed: int) -> None:
    random = Random(seed)
    for _ in range(30):
        tree = _random_tree(random, random.randint(1, 4))
        if not _ratio_of_literals(tree):
            assert without_parentheses(parse_expression(print_expression(tree))) == tree
