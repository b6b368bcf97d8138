"""Functions with bodies that are wrong, and what is said of them."""

from __future__ import annotations

import pytest

import mechc
from mechc.lang.diagnostics import CompileError

BODY = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2;\n"


def steps(*lines: str, head: str = "f(Real a) -> Real", call: str = "output y = f(x/1 m);") -> str:
    return f"function {head}\n" + "\n".join(lines) + f"\nend f;\n{call}\n{BODY}"


WRONG = {
    "while": (
        steps("var s = 0;", "while s < a loop s := s + 1; end while;", "return s;"),
        "E0133",
        "for i in",
    ),
    "break": (
        steps("for i in 1:3 loop if a > 2 then break; end if; end for;", "return a;"),
        "E0133",
        "return",
    ),
    "a declaration of a model": (steps("parameter b = 2;", "return a;"), "E0133", "'let', 'var'"),
    "a bare value": (steps("a*2;"), "E0133", "return"),
    "no arguments": ("function f\n input Real a;\nend f;\n" + BODY, "E0133", "parentheses"),
    "results of a formula": (
        "function f(Real a) -> (Real r, Real s) = (a, a);\n" + BODY,
        "E0133",
        "return (a, b)",
    ),
    "var in a model": ("var s = 2;\n" + BODY, "E0133", "let"),
    "return in a model": (BODY + "return x;", "E0133", "output"),
    "= for :=": (steps("var s = 1;", "s = 2;", "return s;"), "E0118", "':='"),
    "+=": (steps("var s = 1;", "s += 2;", "return s;"), "E0118", "s := s + .."),
    "not closed": (f"function f(Real a) -> Real\n return a;\noutput y = 1;\n{BODY}", "E0115", "end f;"),
    "another end": ("function f(Real a) -> Real\n return a;\nend g;\n" + BODY, "E0116", "end f;"),
    "an open loop": (
        steps(
            "var s = 0;",
            "for i in 1:a loop s := s + 1; end for;",
            "return s;",
            call="output y = f(time/1 s);",
        ),
        "E0315",
        "are known",
    ),
    "a parameter that counts": (
        steps("return n*1;", head="f(Integer n) -> Real", call="parameter k = 3; output y = f(k);"),
        "E0303",
        "structural parameter",
    ),
    "an inverse of NumPy": (
        f"output y = np.linalg.inv({{{{x/1 m, 1}}, {{0, 1}}}});\n{BODY}",
        "E0209",
        "'inverse(..)'",
    ),
    "no return on one way": (steps("if a > 1 then return a; end if;"), "E0221", "last 'if'"),
    "no return": (steps("let b = a;"), "E0221", "return e"),
    "after an if that always returns": (
        steps("if a > 1 then return a; else return 2; end if;", "let b = 2;"),
        "E0221",
        "condition",
    ),
    "after a return": (steps("return a;", "let b = 2;"), "E0221", "condition"),
    "a new value of a let": (steps("let s = 0;", "s := 2;", "return s;"), "E0220", "var s"),
    "a new value of an argument": (steps("a := 2;", "return a;"), "E0220", "var a_ = a"),
    "a new value of a counter": (steps("for i in 1:2 loop i := 2; end for;", "return a;"), "E0220", ""),
    "a new value of nothing": (steps("s := 2;", "return a;"), "E0201", "var s"),
    "a new value after its block": (
        steps("if a > 2 then var s = 3; end if;", "s := 2;", "return a;"),
        "E0201",
        "var s",
    ),
    "a name after its block": (
        steps("if a > 2 then let s = 3; end if;", "return s;"),
        "E0201",
        "same block",
    ),
    "a name of the model": (steps("let b = x;", "return a;"), "E0201", "arguments"),
    "a size and an argument": (
        steps("return c[n];", head="f(Real c[n], Integer n) -> Real", call="output y = f({1, 2}, 2);"),
        "E0204",
        "follows it",
    ),
    "two arguments of one name": (
        "function f(Real a, Real a) = a;\noutput y = f(1, 2);\n" + BODY,
        "E0204",
        "",
    ),
    "twice": (steps("let a = 2;", "return a;"), "E0204", ""),
    "units of branches": (
        steps("var s = 0;", "if a > 1 then s := 1 m; else s := 1 s; end if;", "return a;"),
        "E0303",
        "",
    ),
    "units of results": (
        steps("if a > 1 then return 1 m; end if;", "return 1 s;", head="f(Real a)"),
        "E0302",
        "",
    ),
    "unit of a variable": (steps("var s = 1 m;", "s := 2 s;", "return a;"), "E0303", ""),
    "unit of the result": (steps("return 1 m;"), "E0303", ""),
    "one size for two": (
        steps("return a[n]*b[n];", head="f(Real a[n], Real b[n])", call="let y = f({1, 2}, {1, 2, 3});"),
        "E0305",
        "",
    ),
    "no array": (steps("return a[n];", head="f(Real a[n])"), "E0305", ""),
    "outside": (steps("var s[3] = 0;", "s[4] := 1;", "return a;"), "E0314", ""),
    "an open size": ("parameter Real K[:, :];\n" + BODY, "E0422", "number of elements"),
    "open sizes of another rank": ("parameter Real K[:, :] = {1, 2};\n" + BODY, "E0422", "one ':'"),
    "recursion": (steps("return a*f(a - 1);"), "E0210", "recursive"),
    "mutual recursion": (
        "function g(Real a) = f(a);\n" + steps("return g(a);"),
        "E0210",
        "recursive",
    ),
    "several as one": (
        steps("return (a, a);", head="f(Real a) -> (Real b, Real c)", call="output y = 2*f(x/1 m);"),
        "E0222",
        "let (a, b)",
    ),
    "too many names": (
        steps("return (a, a);", head="f(Real a) -> (Real b, Real c)", call="let (p, q, r) = f(1);"),
        "E0222",
        "",
    ),
    "too few results": (
        steps("return a;", head="f(Real a) -> (Real b, Real c)", call="let (p, q) = f(1);"),
        "E0222",
        "",
    ),
    "names for one": (steps("return a;", call="let (p, q) = f(1);"), "E0222", "let a = f(x)"),
    "names for no call": ("let (p, q) = 3;\n" + BODY, "E0222", "f(x)"),
    "no truth": (steps("if a then return 1; end if;", "return 2;"), "E0318", "compare"),
    "an integral over time": (steps("let b = 2*a;", "return integral(b)/1 s;"), "E0315", "argument"),
    "an integral over time in another": (
        "output y = integral(integral(x*s) for s in 0:1);\n" + BODY,
        "E0315",
        "outside",
    ),
    "a rate of the place": (
        steps(
            "let b = a^2;",
            "return der(b)*1 s;",
            call="output y = grad(f, x/1 m);",
        ),
        "E0336",
        "",
    ),
}


@pytest.mark.parametrize(("text", "code", "help"), WRONG.values(), ids=list(WRONG))
def test_what_is_said(text: str, code: str, help: str) -> None:
    with pytest.raises(CompileError) as caught:
        mechc.loads(text)
    (found,) = caught.value.diagnostics
    assert found.code == code, str(caught.value)
    assert help in found.help, found.help
