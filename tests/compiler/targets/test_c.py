"""The C text: clean, split without a difference, the same in quadruple precision."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace
from native_code import KERNEL, REPRODUCIBLE, Both, NativeModel, bits, compile_c, compiler, random_states
from sample_equations import chain, equations, every_operation, pendulum

import mechc
from mechc.compiler.equations.model import Equations, Function
from mechc.compiler.graph import Graph, Samples, Table
from mechc.compiler.graph.evaluate import evaluate, multiprecision
from mechc.compiler.program import lower
from mechc.compiler.targets.c import emit_c
from mechc.runtime.interface import Quantity


@pytest.mark.parametrize("size", [20, 100])
def test_split_functions_give_the_same_bits(size: int, tmp_path: Path) -> None:
    program = lower(chain(20, joint_angles=True))
    whole = NativeModel(program, tmp_path, 0, "whole")
    split = NativeModel(program, tmp_path, size, "split")
    p = whole.default_parameters()
    assert bits(p) == bits(split.default_parameters())
    nothing = np.empty(0)
    for state in random_states(100, 40):
        y = np.array(state)
        expected = whole.call("rhs", 0.0, y, nothing, nothing, p)
        assert bits(split.call("rhs", 0.0, y, nothing, nothing, p)) == bits(expected)


def test_the_text_of_the_pendulum_reads_well() -> None:
    text = emit_c(lower(pendulum()))
    assert "out[1] = (torque - der_theta * b - k0 * sin(theta)) / J;" in text
    assert " *     0  theta [rad]  from the vertical" in text
    assert "if (!set[2]) p[2] = real(9.80665);" in text
    assert "/* What must hold. */" in text
    assert max(map(len, text.splitlines())) <= 120


def test_what_is_used_twice_is_computed_once() -> None:
    """The text holds as many operators and calls as the program has operations."""
    program = lower(chain(3, joint_angles=True))
    text = emit_c(program)
    start = text.index("static void rhs")
    body = text[text.index("{", start) : text.index("\n}\n", start)]
    signs = len(re.findall(r" [-+*/] ", body)) + len(re.findall(r"\b(?:sin|cos)\(", body))
    negations = len(re.findall(r"(?:= |\()-(?!\d)", body))
    assert signs + negations == program.functions[0].operations


@pytest.mark.parametrize("flags", [("-O0",), ("-O2", "-march=native", "-ffp-contract=fast")])
def test_other_builds_compile_without_a_warning(flags: tuple[str, ...], tmp_path: Path) -> None:
    compile_c(emit_c(lower(every_operation())), tmp_path, flags)


def test_long_double_compiles(tmp_path: Path) -> None:
    flags = ("-O1", "-DMECH_REAL=long double", "-DMECH_LONG")
    compile_c(emit_c(lower(every_operation())), tmp_path, flags)


DIGITS = r"""
#include <quadmath.h>
#include <stdio.h>
#include "model.h"
const mech_model *mech_model_get(void);
extern mech_function everything;
int main(void)
{
    mech_real p[64], y[2] = {0.3Q, 0.7Q}, out[256];
    unsigned char set[64] = {0};
    char text[64];
    mech_model_get()->parameters(p, set);
    everything(0.25Q, y, p, p, p, out);
    for (int i = 0; i < N_OUT; i++) {
        quadmath_snprintf(text, sizeof text, "%.36Qg", out[i]);
        puts(text);
    }
    return 0;
}
"""


def cubic(table: Table | Samples, x: Any, order: int) -> Any:
    """Return the value or a derivative of a table in the arithmetic of x; what samples give is a float."""
    if isinstance(table, Samples):
        return type(x)(table(float(x), order))
    points, values, slopes = ([type(x)(v) for v in row] for row in (table.points, table.values, table.slopes))
    i = max(k for k, point in enumerate(points) if point <= x)
    h, s = points[i + 1] - points[i], x - points[i]
    secant = (values[i + 1] - values[i]) / h
    c2 = (3 * secant - 2 * slopes[i] - slopes[i + 1]) / h
    c3 = (slopes[i] + slopes[i + 1] - 2 * secant) / h**2
    polynomial = [values[i], slopes[i], c2, c3]
    for _ in range(order):
        polynomial = [k * c for k, c in enumerate(polynomial)][1:]
    return sum(c * s**k for k, c in enumerate(polynomial))


def test_the_same_text_in_quadruple_precision_has_its_digits(tmp_path: Path) -> None:
    """Checked with mpmath; 1e-33 is five units in the last place of 113 bits."""
    mpmath = pytest.importorskip("mpmath")
    model = every_operation()
    (function,) = model.functions
    (tmp_path / "model.c").write_text(emit_c(lower(model)))
    (tmp_path / "main.c").write_text(DIGITS)
    flags = ["-std=gnu11", "-O1", "-DMECH_REAL=__float128", "-DMECH_QUAD", f"-DN_OUT={len(function.outputs)}"]
    command = [compiler(), *flags, "-I", str(KERNEL), "model.c", "main.c", "-lquadmath", "-lm", "-o", "main"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    if "quadmath.h" in done.stderr:
        pytest.skip("no libquadmath")
    assert done.returncode == 0, done.stderr
    lines = subprocess.run(
        [str(tmp_path / "main")], capture_output=True, text=True, check=True
    ).stdout.split()
    with mpmath.workdps(40):
        names = {"a": "0.3", "b": "0.7", "t": "0.25", "c": "1.25"}
        numbers = {s: mpmath.mpf(names[model.graph.name(s)]) for s in model.graph.support(*function.outputs)}
        expected = evaluate(
            model.graph, function.outputs, numbers, replace(multiprecision(mpmath), interpolate=cubic)
        )
        compared = 0
        for text, value in zip(lines, expected, strict=True):
            if mpmath.isinf(value) or isinstance(value, mpmath.mpc) or mpmath.isnan(value):
                continue
            error = abs(mpmath.mpf(text) - value)
            assert error <= mpmath.mpf("1e-33") * max(1, abs(value)), (text, value)
            compared += 1
    assert compared > 50


def test_functions_of_constants_are_left_to_the_library(tmp_path: Path) -> None:
    """A compiler that computes exp(1/2) rounds correctly, the library does not always."""
    (tmp_path / "model.c").write_text(emit_c(lower(every_operation())))
    command = [compiler(), *REPRODUCIBLE, "-I", str(KERNEL), "-S", "-o", "-", "model.c"]
    assembly = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    start = assembly.index("\nparameters:")
    assert len(re.findall(r"\bexp\b", assembly[start : assembly.index(".cfi_endproc", start)])) == 2


def awkward() -> Equations:
    """Names that are words of C or Python, arrays of the signature, duplicates after cleaning, comments."""
    g = Graph()
    names = [
        "y",
        "t",
        "int",
        "lambda",
        "sin",
        "R[1]",
        "R_1",
        "der(y)",
        "v1",
        "sin_y",
        "real",
        "PI",
        "out",
        "double.x",
    ]
    symbols = [g.symbol(name) for name in names]
    total = g.sum(g.sin(g.mul(s, g.constant(i + 1))) for i, s in enumerate(symbols))
    return equations(
        g,
        [
            Function(
                "rhs", 'ends a comment */ and a docstring """ \\', tuple(g.mul(total, s) for s in symbols)
            )
        ],
        name='odd */ "name"',
        doc='a doc with """ and */ \\',
        states=[(s, Quantity(n, "state", "", doc="*/")) for n, s in zip(names, symbols, strict=True)],
        nx=len(names),
    )


def test_awkward_names_and_texts(tmp_path: Path) -> None:
    both = Both(awkward(), tmp_path)
    for state in random_states(20, 14):
        both.compare("rhs", state)


def test_missing_functions_are_null(tmp_path: Path) -> None:
    native = NativeModel(lower(every_operation()), tmp_path)
    assert not native.model.outputs
    assert not native.model.jacobian
    assert native.model.np == 1
    assert native.model.nh == 4


def test_the_jacobian_pattern_and_rotations_are_in_the_struct(tmp_path: Path) -> None:
    g = Graph()
    a, b = g.symbol("a"), g.symbol("b")
    model = replace(
        equations(
            g,
            [Function("rhs", "", (b, a)), Function("jacobian", "", (g.one, g.one))],
            states=[(a, Quantity("a", "state", "")), (b, Quantity("b", "state", ""))],
            nx=2,
        ),
        jacobian_pattern=((0, 1), (1, 0)),
        rotations=(3,),
    )
    native = NativeModel(lower(model), tmp_path)
    assert native.model.n_jacobian == 2
    assert list(native.model.jac_row[:2]) == [0, 1]
    assert list(native.model.jac_col[:2]) == [1, 0]
    assert native.model.rotations[0] == 3
    y = np.zeros(2)
    assert native.call("jacobian", 0.0, y, y, y, y).tolist() == [1.0, 1.0]


def test_names_of_the_model_do_not_depend_on_the_run() -> None:
    assert emit_c(lower(chain(5))) == emit_c(lower(chain(5)))


def test_values_of_constants_are_variables() -> None:
    """gcc puts the value of a constant in its place and, with -frounding-math, leaves it unevaluated: chains grew to 24 GB."""
    model = mechc.load(Path(__file__).parents[3] / "examples" / "filters.mech")
    text = emit_c(model.compilation.program)
    chained = re.findall(r"^    (const )?mech_real v\d+ = ([^;]*);", text, re.M)
    for const, expression in chained:
        words = set(re.findall(r"[A-Za-z_]\w*(?![\w(])", expression)) - {"PI"}
        assert bool(const) == bool(words), expression
    assert not all(const for const, _ in chained)


NAMED_AS_MACROS = """model Named
  {parameters}
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential -1 J*({sum});
end Named;
"""


@pytest.mark.parametrize("standard", ["c11", "gnu17"])
def test_names_of_the_model_that_are_macros_of_headers(standard: str, tmp_path: Path) -> None:
    """What the headers of a model define is asked of the compiler: parameters with these names keep their values 1, 2, 3 and so on."""

    def text(names: list[str]) -> str:
        parameters = " ".join(f"parameter Real {name} = {k + 1};" for k, name in enumerate(names))
        return NAMED_AS_MACROS.format(
            parameters=parameters, sum=" + ".join(f"cos({name}*x/1 m)" for name in names)
        )

    def written(names: list[str]) -> str:
        path = tmp_path / "model.c"
        path.write_text(emit_c(mechc.loads(text(names)).compilation.program))
        return str(path)

    def ask(*options: str) -> str:
        command = [compiler(), f"-std={standard}", "-I", str(KERNEL), *options]
        return subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path).stdout

    found = re.findall(r"^#define ([A-Za-z]\w*) ", ask("-dM", "-E", written(["a"])), re.M)
    names = sorted({*found, "INFINITY", "NAN", "M_PI", "linux"})
    assert len(names) > 10
    ask("-c", "-o", "model.o", written(names))
    values = np.arange(1, len(names) + 1)
    expected = -np.sum(values * np.sin(0.3 * values))
    found_there = mechc.loads(text(names)).functions.accelerations([0.3, 0.0])[0]
    assert found_there == pytest.approx(expected, abs=1e-13 * len(names) ** 2)
