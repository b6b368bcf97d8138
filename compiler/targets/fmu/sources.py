"""The C sources of an FMU: the model, its description, the interface, and of the kernel what these need."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from mechc.runtime.interface import Quantity, derived_among

from ...program.model import Program
from ..kernel_files import needed_kernel
from .variables import Start, VariableTable

_TYPES = ("real", "integer", "boolean")
"""In the order of ``fmu_type``."""

STARTS = ("start_tangent", "start_adjoint")
"""Functions for derivatives during initialisation, where formulas give the initial state."""

_EXPORTS = ('__attribute__((visibility("default")))', "__declspec(dllexport)")
_TOKEN = '    .token = "{}",'

HEADER = "names.h"
MODEL_FILES = ("model.c", "description.c")

_MODEL_FUNCTION = re.compile(r"^EXPORT void (\w+)\(", re.M)
_PREFIX = """\
/* -DFMI3_FUNCTION_PREFIX=Model_ (FMI2_FUNCTION_PREFIX): all names that the linker sees begin so. */
#if defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX)
#define MECH_PREFIX FMI3_FUNCTION_PREFIX
#elif defined(FMI2_FUNCTION_PREFIX) && !defined(FMI2_OVERRIDE_FUNCTION_PREFIX)
#define MECH_PREFIX FMI2_FUNCTION_PREFIX
#endif
"""
_JOIN = """\
#define MECH_JOIN(prefix, name) prefix##name
#define MECH_JOINED(prefix, name) MECH_JOIN(prefix, name)
#define MECH_NAME(name) MECH_JOINED(MECH_PREFIX, name)
"""


def sources(
    program: Program,
    code: str,
    start: Start,
    table: VariableTable,
    method: str,
    fmi: int,
    *,
    parts: Collection[str] = (),
    sizes: Sequence[int] = (),
) -> dict[str, str]:
    """Return the text of each C file and header by name, without the headers of the standard and without a token.

    ``code``: the C text of the program. ``parts``: what is kept though the model does not need it
    (equations/needs.py); all of them: the whole kernel. ``sizes``: number of elements by value reference, if there are arrays.
    """
    from mechc.runtime.native.kernel import kernel_sources
    from mechc.runtime.native.selection import METHOD_FILES, defined

    kernel, glue = kernel_sources(), kernel_sources(("fmi",))
    visible = ["mech_fmu_description", *(f"mech_{method}" for method in METHOD_FILES)]
    visible += defined({**kernel, **glue}.values())
    glue = {name: text for name, text in glue.items() if not name.startswith(f"fmi{5 - fmi}")}
    if program.switching is None:
        del glue["fmi_events.c"]
    if not (program.assembly or program.found):
        del glue["fmi_start.c"]
    own = {
        "model.c": code,
        "description.c": _description(program, start, table, method, sizes),
    }
    chosen = needed_kernel(program, (method,), {**glue, **own}, parts)
    # only the functions of the standard are exported
    return {name: _hidden(text) for name, text in sorted(with_prefix(chosen | glue | own, visible).items())}


def with_token(texts: Mapping[str, str], token: str) -> dict[str, str]:
    """Return the sources with the token in their description."""
    name = "description.c"
    return {**texts, name: texts[name].replace(_TOKEN.format(""), _TOKEN.format(token), 1)}


def _hidden(text: str) -> str:
    for attribute in _EXPORTS:
        text = text.replace(attribute, "")
    return text


def _description(
    program: Program, start: Start, table: VariableTable, method: str, sizes: Sequence[int]
) -> str:
    case = start.case
    ny, nu = program.nq + program.nv + program.nx, len(program.arrays["u"])
    n_seeds = sum(e.kind == "seed" for e in program.arrays["z"])
    n_p = len(program.arrays["p"])
    settable = set(table.settable_parameters)
    # an initial value that depends on nothing is its start value
    exact = {v.reference - 1 for v in table.variables if v.initial == "exact"}
    discretes = [e for e in program.arrays["z"] if e.kind == "discrete"]
    given_y = [int(i in start.given_states or i in exact) for i in range(ny)]
    signature = "mech_real t, const mech_real *y, const mech_real *u, const mech_real *z, const mech_real *p"
    lines = [
        f"/* Defaults of {program.name}: the exported experiment. */",
        '#include "instance.h"',
        "",
        f"void tangent({signature}, mech_real *out);",
        f"void adjoint({signature}, mech_real *out);",
        *(f"void {name}({signature}, mech_real *out);" for name in STARTS if program.function(name)),
        *([f"void initial_of_others({signature}, mech_real *out);"] if program.dependent else []),
        "",
        _numbers("mech_real", "nominal", start.nominal),
        _numbers("mech_real", "start_y", case.y0),
        _numbers("mech_real", "stated_y", case.wanted),
        _numbers("mech_real", "start_u", start.inputs),
        _numbers("mech_real", "start_p", case.p[:n_p]),
        _numbers("unsigned char", "y_given", given_y),
        _numbers("unsigned char", "u_given", [int(i in start.given_inputs) for i in range(nu)]),
        _numbers(
            "unsigned char",
            "p_given",
            [int(i in start.given_parameters or i in program.found) for i in range(n_p)],
        ),
        _numbers("unsigned char", "p_settable", [int(i in settable) for i in range(n_p)]),
        _numbers("unsigned char", "y_settable", [int(i not in program.found_states) for i in range(ny)]),
        _numbers("unsigned char", "y_held", case.known),
        _numbers("int", "dependent", program.dependent),
        *(
            _numbers("unsigned char", f"{name}_type", [_TYPES.index(e.type) for e in entries])
            for name, entries in (("z", discretes), ("u", program.arrays["u"]), ("p", program.arrays["p"]))
        ),
        _numbers("int", "indicators", table.zero_crossings),
        *([_numbers("int", "sizes", sizes)] if sizes else []),
        *_drives(program),
        "static const char *const assertions[] = {",
        *(f"    {_string(a.message)}," for a in program.assertions),
        "    NULL};",
        *_ranges(program),
        *_events(program),
        "",
        "const fmu_description mech_fmu_description = {",
        _TOKEN.format(""),
        f"    .method = {_string(method)},",
        f"    .t0 = {case.begin!r},",
        f"    .stop = {case.stop!r},",
        f"    .tolerance = {case.tolerance!r},",
        f"    .dt = {case.step or 0.0!r},",
        f"    .nz = {len(program.arrays['z']) - n_seeds},",
        f"    .n_seeds = {n_seeds},",
        f"    .n_discrete = {len(discretes)}, .z_type = z_type, .u_type = u_type, .p_type = p_type,",
        f"    .n_indicators = {len(table.zero_crossings)}, .indicators = indicators,",
        "    .nominal = nominal, .y = start_y, .y_stated = stated_y, .u = start_u, .p = start_p,",
        "    .y_given = y_given, .u_given = u_given, .p_given = p_given,",
        "    .p_settable = p_settable, .y_settable = y_settable,",
        f"    .initial_is_free = {int(table.free_initial)},",
        f"    .y_held = y_held, .n_dependent = {len(program.dependent)}, .dependent = dependent,",
        f"    .others = {'initial_of_others' if program.dependent else 'NULL'},",
        f"    .assemble = {'fmu_assemble' if program.assembly or program.found else 'NULL'},",
        f"    .inputs_move = {int(table.inputs_move)},",
        *(
            [f"    .n_drives = {n}, .drives = drives, .drive_names = drive_names,"]
            if (n := len(driving(program)))
            else []
        ),
        f"    .n_sizes = {len(sizes)}, .sizes = {'sizes' if sizes else 'NULL'},",
        "    .assertions = assertions,",
        *([f"    .n_ranges = {n}, .ranges = ranges,"] if (n := len(_bounded(program))) else []),
        *(
            ["    .branches = branches, .ends = ends, .rows = rows, .checks = checks,"]
            if program.switching
            else []
        ),
        f"    .events = {'&fmu_events_of_models' if program.switching else 'NULL'},",
        "    .tangent = tangent, .adjoint = adjoint,",
        *(f"    .{name} = {name}," for name in STARTS if program.function(name)),
        "};",
    ]
    return "\n".join(lines) + "\n"


def _bounded(program: Program) -> list[tuple[int, Quantity]]:
    """List the parameters that state a range, with their indices."""
    return [
        (k, q) for k, q in enumerate(program.parameters) if q.minimum is not None or q.maximum is not None
    ]


def _ranges(program: Program) -> Iterator[str]:
    """Yield the ranges of parameters, where one states any."""
    if not _bounded(program):
        return
    yield "static const fmu_range ranges[] = {"
    for k, q in _bounded(program):
        low = "-INFINITY" if q.minimum is None else repr(float(q.minimum))
        high = "INFINITY" if q.maximum is None else repr(float(q.maximum))
        unit = f" {q.unit}" if q.unit else ""
        yield f"    {{{k}, {low}, {high}, {_string(q.name)}, {_string(unit)}}},"
    yield "};"


def driving(program: Program) -> dict[int, tuple[int, int]]:
    """Return the inputs that drive, and their derivatives."""
    return derived_among([e.name for e in program.arrays["u"]])


def _drives(program: Program) -> Iterator[str]:
    """Yield the inputs that drive with their derivatives, where there are any."""
    if found := driving(program):
        rows = ", ".join(f"{{{k}, {first}, {second}}}" for k, (first, second) in found.items())
        yield f"static const int drives[][3] = {{{rows}}};"
        yield _texts("drive_names", [program.arrays["u"][k].name for k in found])


def _events(program: Program) -> Iterator[str]:
    """Yield the names and messages of what happens at events."""
    plan = program.switching
    if plan is None:
        return
    for k, branch in enumerate(plan.branches):
        yield _texts(f"checks_{k}", [c.message for c in branch.shown.checks])
    checks = ", ".join(f"checks_{k}" for k in range(len(plan.branches))) or "NULL"
    yield f"static const char *const *const checks[] = {{{checks}}};"
    yield _texts("branches", [b.shown.text for b in plan.branches])
    yield _texts("ends", [b.shown.message for b in plan.branches])
    yield _texts("rows", [r.name for r in plan.rows])


def _texts(name: str, texts: Iterable[str | None]) -> str:
    written = ", ".join("NULL" if t is None else _string(" ".join(t.split())) for t in texts) or "NULL"
    return f"static const char *const {name}[] = {{{written}}};"


def _numbers(kind: str, name: str, values: Iterable[float]) -> str:
    written = [repr(float(v)) if kind == "mech_real" else str(int(v)) for v in values] or ["0"]
    return f"static const {kind} {name}[] = {{{', '.join(written)}}};"


def _string(text: str) -> str:
    """Write a C string: bytes beyond ASCII in octal."""
    return '"' + "".join(_character(b) for b in text.encode()) + '"'


def _character(byte: int) -> str:
    if byte in b'"\\?':
        return "\\" + chr(byte)
    return chr(byte) if 32 <= byte < 127 else f"\\{byte:03o}"


def with_prefix(texts: Mapping[str, str], kernel: Iterable[str]) -> dict[str, str]:
    """Return sources that link into one program with those of other FMUs. ``kernel``: the global names in all files that are no model's.

    The functions of the standard take ``FMI3_FUNCTION_PREFIX`` (or that of FMI 2) by its headers. What else is visible from one file
    to another takes it by macros: of the kernel in ``names.h``, the same for all models, and of the model at the head of its files.
    """
    found = dict(texts)
    own = _macros(_MODEL_FUNCTION.findall(texts["model.c"]))
    for name, text in texts.items():
        if name.endswith(".c"):
            macros = f"#ifdef MECH_PREFIX\n{own}#endif\n" if own and name in MODEL_FILES else ""
            found[name] = f'#include "{HEADER}"\n{macros}{text}'
    found[HEADER] = f"{_PREFIX}\n#ifdef MECH_PREFIX\n{_JOIN}{_macros(kernel)}#endif\n"
    return found


def _macros(names: Iterable[str]) -> str:
    return "".join(f"#define {name} MECH_NAME({name})\n" for name in sorted(set(names)))
