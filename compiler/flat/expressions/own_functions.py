"""Functions of the model: looked up, their arguments bound, and written out where they are called."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from functools import partial

from mechc.lang import ast
from mechc.lang.builtins import BUILTINS, CONSTANTS
from mechc.lang.diagnostics import Label
from mechc.lang.source import Span
from mechc.suggest import closest

from .. import types
from ..instances.declared_types import declared_type, fit
from ..instances.instantiate import extents
from ..model import Expression, Kind, Literal
from ..names.files import packages_with
from ..names.namespace import FoundDefinition
from ..names.scope import Poisoned, Scope
from ..operands import written_size
from .function_bodies import FunctionBody, Made, unpacked
from .references import OF_ONE_PART

_ELSEWHERE = {
    "ln": "log",
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "arctan2": "atan2",
    "fabs": "abs",
    "sgn": "sign",
    "diff": "der",
    "ddt": "der",
    "cumsum": "sum",
    "prod": "product",
    "heaviside": "if",
    "saturate": "clamp",
    "limit": "clamp",
    "sat": "clamp",
    "saturation": "clamp",
    "limiter": "clamp",
    "dead_zone": "deadzone",
    "backlash": "deadzone",
    "len": "norm",
    "length": "norm",
    "where": "if",
    "inv": "inverse",
    "linsolve": "solve",
    "mldivide": "solve",
    "determinant": "det",
    "eig": "eigenvalues",
    "eigvals": "eigenvalues",
    "eigvalsh": "eigenvalues",
    "shape": "size",
    "ndims": "size",
    "vstack": "concat",
    "hstack": "concat",
    "concatenate": "concat",
    "cat": "concat",
    "append": "concat",
    "eye": "identity",
    "loadtxt": "file",
    "genfromtxt": "file",
    "readmatrix": "file",
    "csvread": "file",
    "read_csv": "file",
}
"""What functions of other languages are called here."""
_INSTEAD = {
    **dict.fromkeys(("dissipated", "supplied", "heat", "loss"), OF_ONE_PART),
    **dict.fromkeys(
        ("delayed", "transport", "transportdelay", "transport_delay", "fixeddelay", "delay_line"),
        "what it was a while ago is 'delay(x, T)'; a state of first order lags: 'equation der(y) = (x - y)/T;'",
    ),
    **dict.fromkeys(
        (
            *(
                "interp",
                "interp1",
                "interp1d",
                "interp2",
                "interp2d",
                "lookup",
                "lookup1",
                "lookup1d",
                "lookup2d",
            ),
            *(
                "lookuptable",
                "table1d",
                "table2d",
                "griddata",
                "spline",
                "pchip",
                "combitable1d",
                "combitable1ds",
            ),
        ),
        "a table is written 'table(x, {0, 1, 2} m, {0, 5, 7} N)'",
    ),
    **dict.fromkeys(
        ("ode45", "ode15s", "ode23", "ode113", "odeint", "solve_ivp", "integrate", "simulate"),
        "a run integrates by itself: state energies and forces, and 'experiment(stop = 10 s);'",
    ),
    **dict.fromkeys(
        ("rand", "randn", "random", "normal", "whitenoise", "white_noise", "gauss", "randnoise"),
        "a random signal is 'noise(seed, period)'; 'mechc ensemble' draws values for many runs",
    ),
    **dict.fromkeys(
        ("noevent", "smooth"), "leave it out: every relation is located, and no step goes across it"
    ),
    **dict.fromkeys(
        ("edge", "change", "rising", "falling"),
        "what happens once is written 'when condition then .. end when;'",
    ),
    **dict.fromkeys(
        ("pid", "tf", "ss", "transferfunction", "lowpass", "pt1"),
        "a controller or filter is a model with states: 'state y ~ 0; equation der(y) = (u - y)/T;'",
    ),
    **dict.fromkeys(("step", "unitstep"), "a step is written 'if time < 1 s then 0 N else 5 N'"),
}
"""What to write instead of functions that there are not."""
_LARGEST = 20_000
"""Most operations of a call after it is written out."""


Place = Callable[[Expression], Expression]


def own_function(scope: Scope, node: ast.Call, name: str, place: Place | None = None) -> Expression:
    """Return a call written out; ``place`` gives what stands for the first argument, from its value."""
    results = _results(scope, node, name, place)
    if len(results) > 1:
        names = ", ".join(chr(97 + k) for k in range(len(results)))
        raise scope.fail(
            "E0222",
            f"'{name}' gives {len(results)} values, and one is wanted here",
            node.span,
            help=f"name them first: 'let ({names}) = {node.span.text};'",
        )
    return results[0]()


def results_of(scope: Scope, node: ast.Call) -> Sequence[Made]:
    """Return what makes each result of a call; a function of the language has one."""
    if node.function.name in BUILTINS or node.unit:
        return [partial(scope.elaborate, node)]
    return _results(scope, node, node.function.name)


def result(scope: Scope, node: ast.Result) -> Expression:
    """Return one of the results of a call."""
    return unpacked(scope, node.call, node.count, results_of)[node.index]()


def _results(scope: Scope, node: ast.Call, name: str, place: Place | None = None) -> Sequence[Made]:
    found = scope.namespace.look_up(name, node.function.span)
    if found is None or not isinstance(found.definition, ast.Function):
        raise _no_function(scope, node, name, found)
    function = found.definition
    if any(called == name for called, _ in scope.calls):
        raise scope.fail(
            "E0210",
            f"function '{name}' calls itself",
            node.span,
            labels=(Label(function.name_span, "defined here"),),
            help="functions are written out where they are called, so they cannot be recursive",
        )
    if node.keywords or len(node.arguments) != len(function.arguments):
        wanted = len(function.arguments)
        raise scope.fail(
            "E0309",
            f"'{name}' takes {wanted} argument{'s' if wanted != 1 else ''}, not {len(node.arguments)}"
            if not node.keywords
            else f"the arguments of '{name}' have no names in a call",
            node.span,
            labels=(Label(function.name_span, "defined here"),),
        )
    local: dict[str, Expression] = {}
    own = Scope(scope.flattening, None, found.namespace, local)
    calls = (*scope.calls, (name, node.span))
    inner = Scope(scope.flattening, None, found.namespace, local, calls, scope.in_event)
    body = FunctionBody(inner, function, results_of)
    for k, (formal, given) in enumerate(zip(function.arguments, node.arguments, strict=True)):
        if formal.name in local:
            size = not any(f.name == formal.name for f in function.arguments[:k])
            raise inner.fail(
                "E0204",
                f"'{formal.name}' is declared twice",
                formal.span,
                caption=f"it is the size of '{function.arguments[k - 1].name}' already"
                if size
                else "again here",
                help="a size that is an argument follows it" if size else "",
            )
        value = _bound(scope, own, formal, given)
        if place is not None and k == 0:
            value = place(value)
        local[formal.name] = value if function.value is not None else body.argument(formal, value)
    if function.value is None:
        return [partial(body.bindings.around, scope, e, node.span, name) for e in body.results(local)]
    result = _result(inner, function, function.value, inner.elaborate(function.value))
    if written_size(result) > _LARGEST:
        raise scope.fail(
            "E0419",
            f"written out, '{name}' has more than {_LARGEST} operations here",
            node.span,
            help="name its arguments by 'let', so that each is written once",
        )
    return [lambda: result]


def _sizes(scope: Scope, own: Scope, formal: ast.Argument, value: Expression, given: Span) -> tuple[int, ...]:
    """Return the declared sizes of an argument; a size that is a new name is bound to that of the value."""
    shape, names = value.type.shape, own.local
    assert isinstance(names, dict)
    fits = len(shape) == len(formal.dimensions)
    if not fits and any(isinstance(d.size, ast.Whole) or _new_size(own, d) for d in formal.dimensions):
        raise scope.fail(
            "E0305",
            f"'{formal.name}' is declared as '{formal.span.text}'",
            given,
            caption=f"this is {types.describe(value.type)}",
            labels=(Label(formal.span, "declared here"),),
        )
    for dimension, size in zip(formal.dimensions, shape, strict=False):
        if fits and (name := _new_size(own, dimension)):
            names[name] = Literal(type=types.INTEGER, span=dimension.span, value=Fraction(size))
    return extents(own, formal.dimensions, shape)


def _new_size(own: Scope, dimension: ast.Dimension) -> str:
    """Return the name that a size is bound to, if it is one that means nothing yet."""
    size = dimension.size
    if not isinstance(size, ast.Reference) or len(size.parts) > 1 or size.parts[0].indices:
        return ""
    return "" if size.name in own.local or size.name in CONSTANTS else size.name


def _bound(scope: Scope, own: Scope, formal: ast.Argument, given: ast.Expression) -> Expression:
    """Return an argument, checked against the type that the function declares."""
    value = scope.elaborate(given)
    if not formal.type:
        if formal.dimensions and value.type.shape != (sizes := _sizes(scope, own, formal, value, given.span)):
            raise scope.fail(
                "E0305",
                f"'{formal.name}' has the shape {types.shape_text(sizes)}",
                given.span,
                caption=f"this is {types.describe(value.type)}",
                labels=(Label(formal.span, "declared here"),),
            )
        return value
    type = declared_type(own, formal.type, formal.span)
    type = types.with_shape(type, _sizes(scope, own, formal, value, given.span))
    if value.type.shape and not type.shape and type.kind is Kind.REAL:
        raise scope.fail(
            "E0305",
            f"'{formal.name}' is one value, this is {types.describe(value.type)}",
            given.span,
            labels=(Label(formal.span, "declared here"),),
        )
    return fit(scope, value, type, given.span, name=formal.name, declared=formal.span)


def _result(scope: Scope, function: ast.Function, node: ast.Expression, value: Expression) -> Expression:
    if not function.result:
        return value
    type = types.with_shape(
        declared_type(scope, function.result, function.name_span),
        extents(scope, function.result_dimensions, value.type.shape),
    )
    return fit(scope, value, type, node.span, name=function.name, declared=function.name_span)


def _no_function(scope: Scope, node: ast.Call, name: str, found: FoundDefinition | None) -> Poisoned:
    if found is None and scope.namespace.broken:
        return Poisoned()
    declared = scope.instance is not None and name in scope.instance.members
    if declared or found is not None:
        noun = "declared, but it is not a function" if declared else "no function"
        return scope.fail(
            "E0209",
            f"'{name}' is {noun}",
            node.function.span,
            help=f"write '{name}*(...)' for a product" + _of_the_past(node, name) if declared else "",
        )
    meant = _meant(name, _functions(scope, node))
    packages = " or ".join(f"'import {package}.*;'" for package in packages_with(name, "function"))
    if packages:
        meant = f"{meant}{'' if meant[-1:] in ('', '?') else ';'} {packages} brings {name}".strip()
    return scope.fail("E0209", f"unknown function '{name}'", node.function.span, help=meant)


def _of_the_past(node: ast.Call, name: str) -> str:
    """Say how a value at another time is written, where the argument is a time."""
    if len(node.arguments) != 1 or not re.search(r"\b(t|time)\b", node.arguments[0].span.text):
        return ""
    return f"; its value a while ago is 'delay({name}, T)'"


def _functions(scope: Scope, node: ast.Call) -> Iterator[str]:
    """Yield the names of functions that the text defines or imports."""
    for name in scope.namespace.names():
        found = scope.namespace.look_up(name, node.function.span)
        if found is not None and isinstance(found.definition, ast.Function):
            yield name


def _meant(name: str, known: Iterable[str]) -> str:
    """Say how a function of another language is written here, or name the nearest one there is."""
    last = name.rpartition(".")[2].casefold()  # np.sin, Math.sin
    if last in ("pow", "power"):
        return "a power is written 'x^y'"
    if last in _INSTEAD:
        return _INSTEAD[last]
    here = _ELSEWHERE.get(last, last if name != last else "")
    if here == "if":
        return "a choice is written 'if c then a else b'"
    if here in BUILTINS or here == "der":
        return f"write '{here}(..)'"
    near = closest(name, [*BUILTINS, *known]) or next(
        (
            b
            for b in BUILTINS
            if len(b) > 2 and (last.startswith(b) or (b.startswith(last) and len(last) > 2))
        ),
        None,
    )
    return f"did you mean '{near}'?" if near else ""
