"""Text to syntax tree: what each construct becomes, and the rules that are easy to get wrong."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from syntax import errors_of, parse_expression, parse_text, sample_files

from mechc.lang import ast
from mechc.lang.parser import DEEPEST
from mechc.lang.printing.expressions import print_expression
from mechc.lang.source import SourceFile, Span


def only(text: str) -> ast.Statement:
    (item,) = parse_text(text).items
    return item


def nodes(node: ast.Node) -> list[ast.Node]:
    """The node and all below it."""
    found = [node]
    for name in node.__struct_fields__:
        value = getattr(node, name)
        for child in value if isinstance(value, tuple) else (value,):
            if isinstance(child, ast.Node):
                found += nodes(child)
    return found


@pytest.mark.parametrize("path", sample_files(), ids=lambda p: p.stem)
def test_samples_parse_with_exact_spans(path: Path) -> None:
    """Each expression's own text, parsed alone, is that expression: no span is too long or too short."""
    file = parse_text(path.read_text(encoding="utf-8"))
    assert file.items
    actions = ast.Reinit | ast.Assign | ast.Terminate | ast.Impulse | ast.Release | ast.Engage
    every = [n for item in file.items for n in nodes(item)]
    bodies = [s for n in every if isinstance(n, ast.Function) for s in n.body]
    steps = {id(n) for s in bodies for n in nodes(s) if isinstance(n, ast.Statement)}
    for node in every:
        text = node.span.text
        assert text == text.strip()
        if id(node) in steps:
            function = only(f"function f_()\n{text}\nend f_;")
            assert isinstance(function, ast.Function)
            assert node in [n for step in function.body for n in ast.single(step)] + [*function.body]
        elif isinstance(node, actions):
            assert text.endswith(";")
        elif isinstance(node, ast.Statement):
            (found,) = parse_text(text).items
            assert node == found or node in ast.single(found)
        elif isinstance(node, ast.Expression) and not isinstance(
            node, ast.Range | ast.Aggregate | ast.Whole | ast.Result
        ):
            assert parse_expression(text) == node


def test_spans_of_names() -> None:
    model = only('partial model A "doc" parameter Real b = 1; end A;')
    assert isinstance(model, ast.Model)
    assert (model.name, model.partial, model.doc, model.name_span.text) == ("A", True, "doc", "A")
    (parameter,) = model.body
    assert isinstance(parameter, ast.Parameter)
    assert parameter.name_span.text == "b"


# ---------------------------------------------------------------- statements


def test_declarations() -> None:
    p = only('structural parameter Integer n[2, i in 1:3](min = 0, display = "mm") = 5 "count";')
    assert isinstance(p, ast.Parameter)
    assert (p.structural, p.type, p.name, p.doc) == (True, "Integer", "n", "count")
    assert [d.name for d in p.dimensions] == ["", "i"]
    assert [(m.kind, print_expression(m.target)) for m in p.attributes] == [("=", "min"), ("=", "display")]
    guess = only("coordinate mech.Angle q ~ 1;")
    assert isinstance(guess, ast.Coordinate)
    assert guess.type == "mech.Angle"
    assert guess.start is not None and guess.start.guess
    known = only("state x = 1;")
    assert isinstance(known, ast.State)
    assert known.start is not None and not known.start.guess
    frame = only('frame a "body frame";')
    assert isinstance(frame, ast.Frame)
    assert (frame.value, frame.doc) == (None, "body frame")


def test_component() -> None:
    c = only('cut mech.Revolute r[3](a -> b, angle ~ 1, der(angle) = 2, m in v) if closed "hinge";')
    assert isinstance(c, ast.Component)
    assert (c.cut, c.type, c.name, c.doc) == (True, "mech.Revolute", "r", "hinge")
    assert [m.kind for m in c.modifications] == ["->", "~", "=", "in"]
    assert isinstance(c.modifications[2].target, ast.Derivative)
    assert c.condition == parse_expression("closed")


def test_imports() -> None:
    texts = ["import a.b.*;", "import P = a.b;", "import a.b.{X, Y};", "import a.b;"]
    found = [only(t) for t in texts]
    assert [(i.path, i.alias, i.names) for i in found if isinstance(i, ast.Import)] == [
        ("a.b", "", ("*",)),
        ("a.b", "P", ()),
        ("a.b", "", ("X", "Y")),
        ("a.b", "", ()),
    ]


def test_forces_and_labels() -> None:
    load = only("force pull[i]: F on P at Q from world in body;")
    assert isinstance(load, ast.Load)
    assert load.label is not None and (load.label.name, len(load.label.indices)) == ("pull", 1)
    parts = (load.value, load.on, load.at, load.source, load.frame)
    assert [print_expression(p) for p in parts if p] == ["F", "P", "Q", "world", "body"]
    contact = only('contact hit[i]: gap restitution e friction mu static ms along s, rest = 1, law = "x";')
    assert isinstance(contact, ast.Contact)
    assert contact.label is not None and contact.label.name == "hit"
    assert [o.name for o in contact.options] == ["rest", "law"]
    assert contact.along == parse_expression("s")
    bare = only("contact pos(w)[2] - R;")
    assert isinstance(bare, ast.Contact)
    assert (bare.label, bare.restitution, bare.friction) == (None, None, None)
    friction = only('friction f static fs on x, law = "stick";')
    assert isinstance(friction, ast.Friction)
    assert friction.static == parse_expression("fs")
    rack = only("nonholonomic constraint rack[i]: a = b;")
    assert isinstance(rack, ast.Constraint)
    assert (rack.kind, rack.label and rack.label.name) == ("nonholonomic", "rack")


def test_blocks() -> None:
    when = only("when a then n := 1; elsewhen b then release c; engage c; end when;")
    assert isinstance(when, ast.When)
    assert [[type(a).__name__ for a in b.actions] for b in when.branches] == [
        ["Assign"],
        ["Release", "Engage"],
    ]
    block = only("if a then mass m at P; elseif b then else damping c on q; end if;")
    assert isinstance(block, ast.If)
    assert [len(b.body) for b in block.branches] == [1, 0]
    assert len(block.otherwise) == 1
    loop = only("for i in 1:2:9 loop damping c on q[i]; end for;")
    assert isinstance(loop, ast.For)
    assert isinstance(loop.range, ast.Range) and loop.range.step == parse_expression("2")


def test_variational_words() -> None:
    independent = only("independent Length x from 0 to d;")
    assert isinstance(independent, ast.Independent)
    assert (independent.type, independent.name, independent.upper) == ("Length", "x", parse_expression("d"))
    assert isinstance(only("stationary integral(f);"), ast.Stationary)
    assert isinstance(only("final z ~ 1;"), ast.Final)
    assert isinstance(only("dimensionless;"), ast.Dimensionless)


def test_a_doc_string_may_end_every_statement() -> None:
    for text in (
        "gravity g",
        "for i in r loop end for",
        "import a.*",
        'assert c, "m"',
        "release_ r",
        'type T = unit "m"',
    ):
        assert only(f'{text} "why";').doc == "why"


def test_function() -> None:
    f = only("function f(Length x[3], k) -> mech.Force[2] = x;")
    assert isinstance(f, ast.Function)
    assert [(a.type, a.name, len(a.dimensions)) for a in f.arguments] == [("Length", "x", 1), ("", "k", 0)]
    assert (f.result, len(f.result_dimensions)) == ("mech.Force", 1)


# ---------------------------------------------------------------- words and units


def test_keywords_are_names_where_no_keyword_can_stand() -> None:
    for word in ("mass", "force", "at", "on", "unit", "from", "initial", "state", "static"):
        only(f"parameter {word} = 1 kg;")
    assert only("mass mass at at;") == only("mass mass at at ;")
    call = parse_expression("reaction(j, in = F)")
    assert isinstance(call, ast.Call)
    assert call.keywords[0].name == "in"


def test_keywords_are_whole_words() -> None:
    assert errors_of("force F onq;")
    assert errors_of("mass m1 atP;")
    model = only("forces x;")
    assert isinstance(model, ast.Component)
    assert model.type == "forces"


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("9.81 m/s^2", "9.81", "m/s^2"),
        ("5\tN.m/rad", "5", "N.m/rad"),
        ("2 m^2", "2", "m^2"),
        ("2 m^-1", "2", "m^-1"),
        ("1e-3 kg", "1e-3", "kg"),
        (".5 s", ".5", "s"),
        ("3 kg.m^2.s", "3", "kg.m^2.s"),
        ("2 m^(1/2)", "2", "m^(1/2)"),
    ],
)
def test_quantities(text: str, value: str, unit: str) -> None:
    quantity = parse_expression(text)
    assert isinstance(quantity, ast.Quantity)
    assert (quantity.value, quantity.text, quantity.unit) == (Fraction(value), value, unit)


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("2 m/x", "(2 m)/x"),
        ("5 N / m", "(5 N)/m"),
        ("2*m*g", "(2*m)*g"),
        ("1 N*(x)", "(1 N)*(x)"),
        ("(u - f)/50 ms", "(u - f)/(50 ms)"),
        ("x/1 mm", "x/(1 mm)"),
        ("-x^2", "-(x^2)"),
        ("2^-x", "2^(-x)"),
        ("a^b^c", "a^(b^c)"),
        ("a - b - c", "(a - b) - c"),
        ("a/b/c", "(a/b)/c"),
        ("a/b*c", "(a/b)*c"),
        ("not a and b", "(not a) and b"),
        ("a or b and c", "a or (b and c)"),
        ("not a == b", "not (a == b)"),
        ("a + b < c*d", "(a + b) < (c*d)"),
        ("-a*b", "(-a)*b"),
        ("if a then b else c + d", "if a then b else (c + d)"),
    ],
)
def test_what_belongs_to_what(text: str, same: str) -> None:
    def bare(e: ast.Expression) -> str:
        """The tree as text, without the parentheses of the author."""
        match e:
            case ast.Parenthesis(inner=inner, unit=""):
                return bare(inner)
            case ast.Binary():
                return f"[{bare(e.left)} {e.operator} {bare(e.right)}]"
            case ast.Unary():
                return f"[{e.operator} {bare(e.operand)}]"
            case ast.Conditional():
                return (
                    f"[{bare(e.branches[0].condition)} ? {bare(e.branches[0].value)} : {bare(e.otherwise)}]"
                )
            case _:
                return print_expression(e)

    assert bare(parse_expression(text)) == bare(parse_expression(same))


def test_a_unit_is_on_the_line_of_its_number() -> None:
    assert errors_of("let a = 2\n m;")
    assert isinstance(parse_expression("2\n/ m"), ast.Binary)


def test_words_behind_numbers_are_no_units() -> None:
    assert isinstance(parse_expression("if a < 1 then 2 else 3"), ast.Conditional)
    assert isinstance(only("mass 1 at P;"), ast.Mass)
    assert errors_of("let a = 2 theta;")


def test_units_behind_brackets() -> None:
    vector = parse_expression("{1, 2} mm")
    assert isinstance(vector, ast.Vector)
    assert vector.unit == "mm"
    half = parse_expression("(1/2) m")
    assert isinstance(half, ast.Parenthesis)
    assert half.unit == "m"
    element = parse_expression("{i for i in 1:3} deg[2]")
    assert isinstance(element, ast.Subscript)
    assert isinstance(element.base, ast.Comprehension)
    assert (element.base.unit, element.base.span.text) == ("deg", "{i for i in 1:3} deg")


def test_generators_and_subscripts() -> None:
    total = parse_expression("sum(i*j for i in 1:3 for j in v)")
    assert isinstance(total, ast.Call)
    (argument,) = total.arguments
    assert isinstance(argument, ast.Aggregate)
    assert [g.name for g in argument.generators] == ["i", "j"]
    element = parse_expression("origin(b)[2]")
    assert isinstance(element, ast.Subscript)
    rate = parse_expression("der(R, 2)[1]")
    assert isinstance(rate, ast.Subscript) and isinstance(rate.base, ast.Derivative)
    assert rate.base.order == 2
    name = parse_expression("leg[1].hip[2, 3].angle")
    assert isinstance(name, ast.Reference)
    assert name.name == "leg.hip.angle"
    assert [len(p.indices) for p in name.parts] == [1, 2, 0]


def test_numbers_are_exact() -> None:
    number = parse_expression("0.1")
    assert isinstance(number, ast.Number)
    assert number.value == Fraction(1, 10)
    tiny = parse_expression("6.674e-11 m^3/kg/s^2")
    assert isinstance(tiny, ast.Quantity)
    assert tiny.value == Fraction("6.674e-11")


def test_texts() -> None:
    text = parse_expression(r'"a \"b\" \\ \n"')
    assert text == ast.String('a "b" \\ \n', span=Span(SourceFile("", ""), 0, 0))


# ---------------------------------------------------------------- layout of the file


def test_comments_are_kept_apart() -> None:
    file = parse_text('// one\nlet a = 1; /* two\n */ let b = "// no comment"; // three\n')
    assert [c.text for c in file.comments] == ["// one", "/* two\n */", "// three"]
    assert [c.span.text for c in file.comments] == [c.text for c in file.comments]


def test_tabs_and_blank_lines_do_not_matter() -> None:
    assert parse_text("\t\nlet\ta\n=\n1 m\t;\n\n").items == parse_text("let a = 1 m;").items


def test_an_empty_file_has_no_items() -> None:
    assert parse_text("").items == ()
    assert parse_text("  // nothing\n").items == ()


@pytest.mark.parametrize("opening, closing", [("(", ")"), ("-", ""), ("f(", ")"), ("1 + (", ")"), ("{", "}")])
def test_depth_is_limited(opening: str, closing: str) -> None:
    """What is accepted can be compared, hashed, shown and printed by recursive functions."""
    fits, too_deep = (f"let a = {opening * n}x{closing * n};" for n in (DEEPEST // 2 - 5, 40 * DEEPEST))
    file = parse_text(fits)
    assert hash(file.items) == hash(parse_text(fits).items)
    assert repr(file.items)
    (error,) = errors_of(too_deep)
    assert (error.code, error.message) == ("E0124", "expression nested too deeply")
