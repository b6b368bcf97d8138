"""What leaving out saves, over all examples: lean against ``--keep-all``, and interning by value against none."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path

import mechc
from mechc.compiler.equations.needs import EVERYTHING
from mechc.compiler.pipeline import compile_source
from mechc.lang.read import read_source
from mechc.measurement.savings import LARGEST, SQUARE, Cost, cost, costs_of

from .instructions import instructions, make_driver
from .machine import table, write
from .references import EXAMPLES, FAILURES, examples, in_parallel

AS_FMU = ("double_pendulum", "four_bar", "heavy_symmetric_top", "kepler", "hanging_chain")


def main(quick: bool = False) -> None:
    rows: list[list[str]] = []
    notes: list[str] = []
    worst: list[tuple[float, str]] = []
    smaller: list[float] = []
    merged: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        driver = make_driver(Path(folder))
        paths = examples(quick, every=16)
        # all of it before anything is timed
        found = list(in_parallel(partial(counted, driver=driver), paths))
        for path, made in zip(paths, found, strict=True):
            if isinstance(made, str):
                notes.append(f"- `{path.stem}`: {made}")
                continue
            counts, structural = made
            lean, everything, reduced = builds(path)
            small, large = costs_of({"lean": lean, "all": everything}).values()
            name = f"`{path.stem}`" + ("*" if reduced else "")
            rows.append([name, *cells(small, large, structural, counts)])
            if structural:
                merged.append(small.evaluation / structural)
            if small.size and large.size:
                smaller.append(small.size / large.size)
            a, b = counts
            if a is not None and b is not None:
                worst.append((a / b, path.stem))
            print(*rows[-1], flush=True)
    write(
        "leaving_out",
        "What leaving out saves",
        [*texts(worst, smaller, merged), table(HEAD, rows), *fmus(quick), *_noted(notes)],
    )


HEAD = [
    "example",
    "operations of the right-hand side",
    "keep-all",
    "by structure alone",
    "operations of all functions",
    "keep-all",
    "bytes of code",
    "keep-all",
    "instructions a step",
    "keep-all",
    "ns an evaluation",
    "keep-all",
]


def counted(path: Path, driver: Path | None) -> tuple[tuple[int | None, ...], int] | str:
    """Return the instructions of the lean build and of that with everything, and the operations by structure alone."""
    try:
        models = builds(path)[:2]
        counts = (None, None) if driver is None else tuple(instructions(model, driver) for model in models)
        for model in models:
            model.problem()  # compiled here, for `cost`
        return counts, operations_without_values(path)
    except FAILURES as error:
        return str(error).splitlines()[0]


def builds(path: Path) -> tuple[mechc.Model, mechc.Model, bool]:
    """Return the lean build, that with everything, and whether that had to do without the largest parts."""
    lean = mechc.load(path).for_experiment(None)
    everything = lean.keeping(EVERYTHING)
    if sum(f.operations for f in everything.compilation.program.functions) <= LARGEST:
        return lean, everything, False
    return lean, lean.keeping(EVERYTHING - SQUARE), True


def operations_without_values(path: Path) -> int:
    """Return the operations of the right-hand side where expressions are recognised by structure alone."""
    program = compile_source(read_source(path), search=(path.parent,), by_value=False).program
    rhs = program.function("rhs")
    return rhs.operations if rhs else 0


def cells(small: Cost, large: Cost, structural: int, counts: tuple[int | None, ...]) -> list[str]:
    times = [f"{c.nanoseconds:.0f}" if c.nanoseconds is not None else "-" for c in (small, large)]
    return [
        f"{small.evaluation}",
        f"{large.evaluation}",
        f"{structural}",
        f"{small.operations}",
        f"{large.operations}",
        *(f"{c.size}" if c.size is not None else "-" for c in (small, large)),
        *(f"{n // 100}" if n is not None else "-" for n in counts),
        *times,
    ]


def texts(worst: list[tuple[float, str]], smaller: list[float], merged: list[float]) -> list[str]:
    found = [
        "Each example as it is built, and with everything that the equations let leave out (`--keep-all`; * without "
        "Jacobian, momenta and the whole factorisation, which would be too large). Bytes are those of instructions and "
        "constants of the model's library; instructions are counted in `mech_advance` over 100 steps of `rk4` by "
        "valgrind, in code for any processor of this kind; times are those of an evaluation with its share of the step. "
        "'By structure alone': without recognising expressions by their value in a prime field."
    ]
    if smaller:
        found.append(f"Code: the lean build has {sum(smaller) / len(smaller):.0%} of the bytes, on average.")
    if merged:
        found.append(
            f"Interning by value: {sum(merged) / len(merged):.0%} of the operations, on average; "
            f"{min(merged):.0%} at best, {max(merged):.0%} at worst."
        )
    if worst:
        ratio, name = max(worst)
        found.append(
            f"Instructions: the lean build executes at most {ratio:.3f} times those of keep-all (`{name}`); "
            f"{sum(r for r, _ in worst) / len(worst):.2f} on average over {len(worst)} examples. Goal: never more."
        )
    return found


def fmus(quick: bool) -> list[str]:
    rows = []
    for name in AS_FMU[: 1 if quick else None]:
        lean, everything, _ = builds(EXAMPLES / f"{name}.mech")
        sizes = [cost(model, "fmu").size for model in (lean, everything)]
        rows.append([f"`{name}`", *map(str, sizes)])
    return ["Bytes of an FMU:", table(["example", "lean", "keep-all"], rows)]


def _noted(notes: list[str]) -> list[str]:
    return ["Not measured:\n\n" + "\n".join(notes)] if notes else []


if __name__ == "__main__":
    main()
