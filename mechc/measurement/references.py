"""References of a model: its functions compiled with more digits, and the methods that they allow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from ..compiler.pipeline import program_with
from ..compiler.problem import HEADER, SHARES, header
from ..compiler.targets import c_double_double
from ..compiler.targets.c import emit_c
from ..compiler.targets.c_data import SHARES_INCLUDED
from ..runtime.native.build import build_shared
from ..runtime.native.compiler import NATIVE
from ..runtime.reference.high_precision import (
    SERIES_PRECISION,
    PrecisionReference,
    ReferenceFailed,
    ReferenceTooLong,
    best_precision,
    reference,
    reference_flags,
)

if TYPE_CHECKING:
    from ..model import CompiledModel
    from ..runtime.case import Case
    from ..runtime.problem import Array

EXPLICIT: Final = "dop853"
SERIES: Final = "taylor"


class ReferenceCode(Struct, frozen=True):
    """The functions of a model, compiled with the numbers of a reference; ``series``: with Taylor series."""

    library: Path
    precision: str
    series: bool

    @property
    def explicit(self) -> str:
        """The method of references of motions that are not stiff."""
        return SERIES if self.series else EXPLICIT


def compile_for_reference(model: CompiledModel, precision: str | None = None) -> ReferenceCode:
    """Compile the functions of a model with the numbers of a reference, the best of this machine without ``precision``.

    Beside numbers of 113 bits stand Taylor series of 106, of which processors form the coefficients, where they are short
    enough. Raises ReferenceFailed, BuildError.
    """
    precision = precision or best_precision()
    flags = reference_flags(precision)
    program = program_with(model.compilation, {"jacobian"})
    sources = {HEADER: header()}
    series = c_double_double.with_series(program) if precision == SERIES_PRECISION else None
    if series is not None:
        name = c_double_double.HEADER
        sources |= {name: header(f"reference/{name}"), "series.h": header("series.h")}
        flags = (*flags, NATIVE, "-ffp-contract=off")
    text = emit_c(program if series is None else series, double_double=series is not None)
    if SHARES_INCLUDED in text:
        sources |= {name: header(name) for name in SHARES}
        text = f"#include <math.h>\n{text}"  # before its functions get other names
    library = build_shared({"model.c": text, **sources}, flags, name="reference-model")
    return ReferenceCode(library, precision, series is not None)


def solve(
    code: ReferenceCode,
    case: Case,
    nominal: Array,
    times: Array,
    method: str,
    seconds: float,
    *,
    ladders: Mapping[str, Sequence[float]] | None = None,
    decimals: bool = False,
) -> PrecisionReference:
    """Solve a case as ``high_precision.reference`` does. Where Taylor series end at a singular place, another method goes on.

    Raises ReferenceFailed.
    """

    def by(method: str) -> PrecisionReference:
        return reference(
            code.library,
            case,
            nominal,
            times,
            precision=code.precision,
            method=method,
            seconds=seconds,
            decimals=decimals,
            ladder=None if ladders is None else ladders[method],
        )

    try:
        return by(method)
    except ReferenceTooLong:
        raise
    except ReferenceFailed:
        if method != SERIES:
            raise
        return by(EXPLICIT)
