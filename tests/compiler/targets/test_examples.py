"""All examples: well formed, clean in C, equal bits in C and Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from native_code import Both, bits, random_states

from mechc.compiler.pipeline import compile_source
from mechc.lang.read import read_source

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("**/*.mech"))


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_have_equal_bits(path: Path, tmp_path: Path) -> None:
    both = Both(compile_source(read_source(path), search=(path.parent,)).equations, tmp_path)
    p = np.full_like(both.p, np.nan)
    both.complete(p, np.zeros(len(both.program.arrays["p"]), np.uint8))
    assert bits(p) == bits(both.p)
    for function in both.program.functions:
        if function.n_out:
            for state in random_states(10, both.program.size("y")):
                both.compare(function.name, state)
