"""Functions of the model: looked up, their arguments bound, and written out where they are called."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from mechc.lang import ast
from mechc.lang.builtins import BUILTINS
from mechc.lang.diagnostics import Label
from mechc.suggest import closest

from .. import types
from ..instances.declared_types import declared_type, fit
from ..instances.instantiate import extents
from ..model import Expression, Kind
from ..names.namespace import Found
from ..names.scope import Poisoned, Scope
from ..operands import written_size

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
}
"""What functions of other languages are called here."""
_INSTEAD = {
    **dict.fromkeys(
        ("delay", "delayed", "transportdelay"),
        "there are no delayed values; a state of first order lags: 'equation der(y) = (x - y)/T;'",
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
        ("rand", "randn", "random", "noise", "normal"),
        "a model has no random numbers; 'mechc ensemble' draws values for many runs",
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
"""What to write in the place of functions that there are not."""
_LARGEST = 20_000
"""Most operations of a call after it is written out."""


Place = Callable[[Expression], Expression]


def own_function(scope: Scope, node: ast.Call, name: str, place: Place | None = None) -> Expression:
    """Return a call written out; ``place`` gives what stands for the first argument, from its value."""
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
    own = Scope(scope.flattening, None, found.namespace)
    local: dict[str, Expression] = {}
    for formal, given in zip(function.arguments, node.arguments, strict=True):
        value = _bound(scope, own, formal, given)
        local[formal.name] = place(value) if place is not None and not local else value
    inner = Scope(
        scope.flattening,
        None,
        found.namespace,
        local,
        (*scope.calls, (name, node.span)),
        scope.in_event,
    )
    result = _result(inner, function, inner.elaborate(function.value))
    if written_size(result) > _LARGEST:
        raise scope.fail(
            "E0419",
            f"written out, '{name}' has more than {_LARGEST} operations here",
            node.span,
            help="name its arguments by 'let', so that each is written once",
        )
    return result


def _bound(scope: Scope, own: Scope, formal: ast.Argument, given: ast.Expression) -> Expression:
    """Return an argument, checked against the type that the function declares."""
    value = scope.elaborate(given)
    if not formal.type:
        if formal.dimensions and value.type.shape != extents(own, formal.dimensions):
            raise scope.fail(
                "E0305",
                f"'{formal.name}' has the shape {types.shape_text(extents(own, formal.dimensions))}",
                given.span,
                caption=f"this is {types.describe(value.type)}",
                labels=(Label(formal.span, "declared here"),),
            )
        return value
    type = types.with_shape(declared_type(own, formal.type, formal.span), extents(own, formal.dimensions))
    if value.type.shape and not type.shape and type.kind is Kind.REAL:
        raise scope.fail(
            "E0305",
            f"'{formal.name}' is one value, this is {types.describe(value.type)}",
            given.span,
            labels=(Label(formal.span, "declared here"),),
        )
    return fit(scope, value, type, given.span, name=formal.name, declared=formal.span)


def _result(scope: Scope, function: ast.Function, value: Expression) -> Expression:
    if not function.result:
        return value
    type = types.with_shape(
        declared_type(scope, function.result, function.name_span), extents(scope, function.result_dimensions)
    )
    return fit(scope, value, type, function.value.span, name=function.name, declared=function.name_span)


def _no_function(scope: Scope, node: ast.Call, name: str, found: Found | None) -> Poisoned:
    if found is None and scope.namespace.broken:
        return Poisoned()
    declared = scope.instance is not None and name in scope.instance.members
    if declared or found is not None:
        noun = "declared, but it is no function" if declared else "no function"
        return scope.fail(
            "E0209",
            f"'{name}' is {noun}",
            node.function.span,
            help=f"write '{name}*(...)' for a product" if declared else "",
        )
    return scope.fail(
        "E0209", f"unknown function '{name}'", node.function.span, help=_meant(name, _functions(scope, node))
    )


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
