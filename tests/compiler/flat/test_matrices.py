"""Matrices in the language: values and derivatives against NumPy and SciPy, units, slices, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy.linalg import eigh

import mechc
from mechc.lang.diagnostics import CompileError

BODY = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2;\n"
STATE = """
coordinate Real q[5] = {0.1, 0.2, 0.3, 0.4, 0.5};
kinetic 1/2*1 kg.m^2*sum(der(q[i])^2 for i in 1:5);
let A[5, 5] = {if i == j then 3 + q[i] else sin(q[i] + 2*q[j]) for i in 1:5, j in 1:5} N/m;
"""


def matrix(q: Any) -> Any:
    return np.array([[3 + q[i] if i == j else np.sin(q[i] + 2 * q[j]) for j in range(5)] for i in range(5)])


def outputs(text: str) -> Any:
    return mechc.loads(text).functions


def value(expression: str, prelude: str = "") -> Any:
    functions = outputs(f"{prelude}{BODY}output y = {expression};\n")
    return functions.output["y"](np.array([1.0, 0.0]))


@pytest.mark.parametrize(
    ("call", "unit", "function"),
    [
        ("solve(A, {1, 2, 3, 4, 5} N)", "m", lambda a: np.linalg.solve(a, np.arange(1, 6))),
        ("det(A)", "N^5/m^5", np.linalg.det),
        ("inverse(A)*{1, 0, 2, 0, 3}", "m/N", lambda a: np.linalg.inv(a) @ [1, 0, 2, 0, 3]),
        ("solve(A, A[:, 2:3])*{1, 10}", "1", lambda a: np.linalg.solve(a, a[:, 1:3]) @ [1, 10]),
        ("{trace(A*A), 0}", "N^2/m^2", lambda a: np.array([np.trace(a @ a), 0])),
    ],
)
def test_values_units_and_derivatives(call: str, unit: str, function: Any) -> None:
    functions = outputs(f"{STATE}output y = {call};\n")
    assert functions.offer("y", "output").rows[0][1] in (unit, "", "kg^5/s^10", "s^2/kg", "kg^2/s^4")
    for seed in range(4):
        q = np.random.default_rng(seed).uniform(-1, 1, 5)
        y = np.concatenate([q, np.zeros(5)])
        wanted = np.atleast_1d(function(matrix(q.astype(complex))))
        assert np.abs(functions.output["y"](y) - wanted.real).max() < 1e-12 * np.abs(wanted).max()
        slopes = np.reshape(functions.jacobian["y"](y), (len(wanted), -1))
        for k in range(5):
            moved = q.astype(complex)
            moved[k] += 1e-30j
            derivative = np.atleast_1d(function(matrix(moved))).imag / 1e-30
            assert np.abs(slopes[:, k] - derivative).max() < 1e-11 * max(1, np.abs(derivative).max())


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("A[:, 1]", [1, 4, 7]),
        ("A[2, :]", [4, 5, 6]),
        ("A[2:3, 1:2]*{1, 10}", [54, 87]),
        ("A[3:-2:1, 2]", [8, 2]),
        ("{10*i + k for i in 1:2, k in 1:3}[2, :]", [21, 22, 23]),
        ("{10*i + k for i in 1:2 for k in 1:2}", [11, 12, 21, 22]),
        ("{{10*i + k for k in 1:2} for i in 1:2}[:, 2]", [12, 22]),
        ("sum(i*k for i in 1:3, k in 1:i)", 25),
        ("max(i - k^2 for i in 1:3, k in 1:3)", 2),
        ("min(A[i, k]*k for i in 1:2, k in 1:3)", 1),
        ("product(i + k for i in 1:2, k in 1:2)", 72),
        ("size(A[1:2, :], 1)*10 + size(A[1:2, :], 2)", 23),
        ("concat({1, 2}, 3, A[1, 2:3])", [1, 2, 3, 2, 3]),
        ("concat(A, {{0, 1, 0}})*{0, 1, 0}", [2, 5, 8, 1]),
        ("trace(A)", 15),
        ("det({{2, 1}, {7, 4}})", 1),
        ("inverse({{2, 1}, {7, 4}})*{1, 1}", [3, -5]),
    ],
)
def test_slices_and_ranges(expression: str, expected: Any) -> None:
    found = value(expression, "parameter Real A[:, :] = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};\n")
    assert np.allclose(found, expected, rtol=1e-14, atol=0)


def test_eigenvalues_and_structural_values() -> None:
    K, M = np.array([[3.0, -1, 0.5], [-1, 2, 0], [0.5, 0, 4]]), np.diag([2.0, 1, 0.3])
    text = f"""
structural parameter K[3, 3] = {{{{3, -1, 0.5}}, {{-1, 2, 0}}, {{0.5, 0, 4}}}} N/m;
structural parameter M[3, 3] = diag({{2, 1, 0.3}}) kg;
structural parameter Integer n = det({{{{2, 1}}, {{7, 5}}}});
parameter Real c[n] = 1;
{BODY}
output y = eigenvalues(inverse(M)*K)*1 s^2;
"""
    found = outputs(text).output["y"](np.array([1.0, 0.0]))
    assert np.allclose(found, eigh(K, M, eigvals_only=True), rtol=1e-14)


@pytest.mark.parametrize("n", [2, 3, 5, 8])
def test_eigenvalues_of_plain_parameters(n: int) -> None:
    text = f"""
parameter c[{n}] = {{0.3*i - 1 for i in 1:{n}}};
parameter s = 0.7;
output y = eigenvalues({{if i == j then c[i] else s*cos(i*j)/(1 + (i - j)^2) for i in 1:{n}, j in 1:{n}}});
"""
    functions = outputs(BODY + text)
    found = functions.output["y"](np.array([1.0, 0.0]))
    i = np.arange(1, n + 1)
    A = 0.7 * np.cos(np.outer(i, i)) / (1 + (i[:, None] - i) ** 2)
    A[i - 1, i - 1] = 0.3 * i - 1
    assert np.abs(found - np.linalg.eigvalsh(A)).max() < 1e-14 * n
    solution: Any = mechc.loads(BODY + text).simulate(stop=0.1, set={"s": 0}, estimate_error=False)
    assert [solution[f"y[{k}]"][0] for k in i] == pytest.approx(0.3 * i - 1, abs=1e-15)


def test_forces_by_solved_systems() -> None:
    """M(q) q'' = f, with the matrix in the kinetic energy, against the same force through its inverse."""
    text = """
structural parameter K[4, 4] = {{4, 1, 0, 0}, {1, 3, 1, 0}, {0, 1, 3, 1}, {0, 0, 1, 2}} N/m;
coordinate Length x[4] = {1, 2, 3, 4} cm;
kinetic 1/2*2 kg*dot(der(x), der(x));
parameter C[4, 4] = inverse(K);
potential 1/2*dot(K*x, C*(K*x));
output f = K*x;
experiment(stop = 2 s, tolerance = 1e-11);
"""
    solution: Any = mechc.loads(text).simulate()
    K = np.array([[4, 1, 0, 0], [1, 3, 1, 0], [0, 1, 3, 1], [0, 0, 1, 2.0]])
    w2, V = np.linalg.eigh(K / 2)
    start = V.T @ np.array([1, 2, 3, 4]) * 0.01
    wanted = V @ (np.cos(np.sqrt(w2) * solution.time[-1]) * start)
    assert np.allclose([solution[f"x[{k}]"][-1] for k in range(1, 5)], wanted, rtol=0, atol=1e-10)


WRONG = {
    "no square": ("output y = det({{1, 2}});\n", "E0305"),
    "no matrix": ("output y = inverse({1, 2});\n", "E0305"),
    "another number of rows": ("output y = solve({{1, 2}, {3, 4}}, {1, 2, 3});\n", "E0305"),
    "units": ("output Force y = solve({{1, 2}, {3, 5}} N/m, {1, 2} N)[1];\n", "E0303"),
    "a moving matrix": ("output y = eigenvalues({{1, 0}, {0, 1}}*x);\n", "E0315"),
    "an unsymmetric matrix of parameters": (
        "parameter k = 2; output y = eigenvalues({{k, k}, {0, 1}});\n",
        "E0315",
    ),
    "a large matrix of parameters": (
        "parameter k = 2; output y = eigenvalues({if i == j then k else 1 for i in 1:9, j in 1:9});\n",
        "E0422",
    ),
    "complex eigenvalues": ("output y = eigenvalues({{0, 1}, {-1, 0}});\n", "E0305"),
    "a singular matrix": ("output y = inverse({{1, 2}, {2, 4}}*x);\n", "E0518"),
    "a known singular matrix": ("output y = inverse({{1, 2}, {2, 4}});\n", "E0518"),
    "a third index": ("output y = size({{1, 2}}, 3);\n", "E0314"),
    "size of a number": ("output y = size(x, 1);\n", "E0305"),
    "rows of two lengths": ("output y = {i*k for i in 1:3, k in 1:i};\n", "E0305"),
    "other units": ("output y = concat({1, 2} m, {3} s);\n", "E0317"),
    "other columns": ("output y = concat({{1, 2}}, {{3}});\n", "E0305"),
    "a colon alone": ("output y = :;\n", "E0110"),
    "too large": ("output y = det({if i == j then x/1 m else i + j^2 for i in 1:11, j in 1:11});\n", "E0422"),
}


@pytest.mark.parametrize(("text", "code"), WRONG.values(), ids=list(WRONG))
def test_what_is_refused(text: str, code: str) -> None:
    with pytest.raises(CompileError) as caught:
        mechc.loads(BODY + text)
    assert [d.code for d in caught.value.diagnostics] == [code], str(caught.value)


def test_one_number_is_no_square_matrix() -> None:
    """It would fill all entries, which is singular, and is never meant; zero is."""
    text = "model M\n  parameter K[3, 3] = {value};\n  coordinate x[3] = {{1, 2, 3}} m;\n  kinetic 1/2*1 kg*dot(der(x), der(x));\n  potential 1/2*dot(x, K*x);\nend M;\n"
    assert "write 'identity(3)*(2 N/m)'" in mechc.render(
        refused(text.replace("K[3, 3]", "Stiffness K[3, 3]").format(value="2 N/m"))
    )
    mechc.loads(text.replace("K[3, 3]", "Stiffness K[3, 3]").format(value="0 N/m"))
    mechc.loads(text.replace("K[3, 3]", "Stiffness K[3, 3]").format(value="identity(3)*2 N/m"))
