"""References of many models, made before anything is timed: by as many processes as there are cores, into the cache."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TypeVar

import mechc
from mechc.lang.diagnostics import CompileError
from mechc.measurement.benchmark import benchmark
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.native.build import BuildError
from mechc.runtime.outcome import SimulationError
from mechc.runtime.reference.high_precision import ReferenceFailed

T = TypeVar("T")
R = TypeVar("R")

EXAMPLES = Path(__file__).parent.parent / "examples"
SECONDS = 6.0
"""CPU seconds that the reference of an example may take."""
FAILURES = (ReferenceFailed, SimulationError, CompileError, BuildError, UsageMistake)
"""Why a model cannot be measured."""


def examples(quick: bool, every: int) -> list[Path]:
    """Return all examples, or every few of them."""
    return sorted(EXAMPLES.glob("*.mech"))[:: every if quick else 1]


def in_parallel(work: Callable[[T], R], items: Sequence[T]) -> Iterator[R]:
    """Give the results in the order of the items. Nothing that is timed belongs here."""
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(os.cpu_count(), mp_context=fresh) as pool:
        yield from pool.map(work, items)


def example_reference(path: Path, seconds: float = SECONDS) -> str:
    """Put the reference of an example into the cache; return why there is none, or an empty text."""
    try:
        benchmark(mechc.load(path).for_experiment(None), methods=("dop853",), tolerances=(), seconds=seconds)
    except FAILURES as error:
        return str(error).splitlines()[0]
    return ""


def example_references(paths: Sequence[Path], seconds: float = SECONDS) -> dict[str, str]:
    """Make the references of all; return those that have none, with the reason."""
    reasons = in_parallel(partial(example_reference, seconds=seconds), paths)
    return {path.stem: why for path, why in zip(paths, reasons, strict=True) if why}
