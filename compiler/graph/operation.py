"""One row of the table of operations: its columns, and how a text of a target is read from them.

A row says everything about an operation that is a name, a number or a formula; targets and passes read their columns. What a target
adds for all operations (signatures, imports, files) is the target's own. A new target is a new column with a default.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from fractions import Fraction
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

Partial = Callable[[Any, tuple[Any, ...], Any], Any]
"""Derivative with respect to one argument: (graph, arguments, the node itself) -> node. (The graph is built on the
table, which therefore does not know its type.)"""


class Parity(Enum):
    """Behaviour of a unary function under a change of sign of its argument."""

    NONE = "none"
    EVEN = "even"
    ODD = "odd"


class Sign(Enum):
    """Sign of the value of a unary function."""

    ANY = "any"
    NEVER_NEGATIVE = "never negative"
    OF_ARGUMENT = "that of its argument"


ATOM, UNARY, PRODUCT, SUM, BITWISE, COMPARISON, LOGIC, CHOICE = 100, 80, 70, 60, 50, 40, 30, 10
"""Binding strength of what stands outermost in an expression."""


class Form(Struct, frozen=True):
    """How to write one operation.

    ``binds``: the strength of the result; ``needs``: the least strength of each operand without
    parentheses. ``condition``: the result is a truth value; ``conditions``: so is every operand marked.
    """

    template: str
    binds: int
    needs: tuple[int, ...]
    condition: bool = False
    conditions: tuple[bool, ...] = (False, False, False)


def call(name: str, arity: int) -> Form:
    return Form(f"{name}({', '.join(['{}'] * arity)})", ATOM, (0,) * arity)


def infix(sign: str, binds: int, *, groups: bool = True) -> Form:
    """Return the form of a binary operation that groups from left to right; comparisons do not group."""
    return Form(f"{{}} {sign} {{}}", binds, (binds + (not groups), binds + 1))


class Operation(Struct, frozen=True):
    """One row of the table.

    ``partials`` has one rule for each argument, or is empty where the derivative is zero everywhere
    it exists (comparisons, logic, sign, floor). SELECT has none: its derivative is a SELECT of the
    derivatives of its branches (differentiate.py).
    """

    code: int
    name: str
    arity: int
    partials: tuple[Partial, ...] = ()
    parity: Parity = Parity.NONE
    value: Callable[..., Any] | None = None
    """What it gives for floats; None: no function of numbers alone (leaves, tables)."""
    digits: Callable[[Any], Callable[..., Any]] | None = None
    """The same for many digits, from an mpmath context; None: ``value`` does for any kind of number."""
    exact: Callable[..., Fraction | None] | None = None
    """The result for constants where it is rational, else None. (The four kinds of arithmetic fold as they are built.)"""
    regular: Callable[..., bool] | None = None
    """Tells where it has a value and a derivative; None: everywhere. (abs and its like are defined everywhere.)"""
    sign: Sign = Sign.ANY
    jumps: bool = False
    """Its value jumps where it is regular: events are looked for there."""
    kinks: bool = False
    """Its derivative jumps where its value does not: events are looked for there, too."""
    narrow: bool = False
    """Its value may change within a small part of the range of its argument."""
    condition: bool = False
    """Its value is a truth value."""
    conditions: tuple[bool, ...] = (False, False, False)
    """Which arguments are truth values."""
    build: str = ""
    """Its constructor in ``Graph`` (node.py), if it has one with another name."""

    # Texts. An empty one means ``form`` where there is one, else a call of the function with the name of the operation.
    form: Form | None = None
    """How it is written with signs that C, Python and libraries read alike."""
    c: str | Form = ""
    c_text: str = ""
    """The definition of that function of ``mech_real``, where the C library has none."""
    calls: tuple[str, ...] = ()
    """Functions of the libraries that ``c_text`` and the text of an own function in Python call."""
    wasm: str = ""
    """An instruction of WebAssembly, by its name; else the function in C is called, which the kernels of pages offer then."""
    lanes: str | Form | None = ""
    """Of vectors: a function ``lane_NAME`` of the kernel; None: the function in C, lane by lane."""
    python: str | Form | Callable[..., Any] = ""
    """A function of ``math``, or an own one whose text is copied."""
    array: str | None = ""
    """The function of NumPy that does it for arrays; None: the one in Python for each element."""
    casadi: str | None = ""
    """A function of the library or of ``casadi_module.py``; None: the own one in Python."""
    jax: str | None = ""
    """A function of ``jax.numpy``, by default that of NumPy, of another module of JAX by its whole name, or of ``jax_module.py``;
    None: the own one in Python."""
    sympy: str | Callable[..., Any] | None = ""
    """A function of SymPy; None: an undefined one."""
    ball: Callable[..., Any] | None = None
    """The function of balls (``flint.arb``), which gives None where they do not decide; None: proofs cannot use it."""


def form_of(row: Operation, text: str | Form) -> Form:
    """Return how a target writes an operation, from what its column holds."""
    if isinstance(text, Form):
        form = text
    elif row.form is not None and not text:
        form = row.form
    else:
        form = call(text or row.name, row.arity)
    return replace(form, condition=row.condition, conditions=row.conditions)
