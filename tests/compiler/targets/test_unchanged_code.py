"""The C of plain models stays as it is, byte for byte: what is added for others costs them nothing.

``golden/code.txt`` holds a digest of each. Who means to change what all models are compiled to, or changes one of these examples,
renews it by ``pytest tests/compiler/targets/test_unchanged_code.py --update-golden`` and says in the commit what the change is for;
after any other change, a digest that differs is a fault.
"""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import pytest

import mechc
from mechc.compiler.targets.c import emit_c

EXAMPLES = Path(__file__).parents[3] / "examples"
PLAIN = {
    "ball_in_bowl": "a rolling ball",
    "bouncing_ball": "impacts",
    "cart_pendulum": "two freedoms by energies",
    "clutch": "friction",
    "coulomb_block": "friction alone",
    "damped_oscillator": "one freedom",
    "double_pendulum": "parts",
    "driven_pendulum": "a prescribed motion",
    "elastic_pendulum": "a spring",
    "four_bar": "a loop",
    "heavy_symmetric_top": "a rotation in space",
    "kepler": "a field",
}
"""What stands in none of them: coordinates without mass, unknowns, functions, matrices, delays and noise."""


@pytest.mark.parametrize("name", PLAIN)
def test_code_of_plain_models_is_unchanged(name: str, update_golden: bool) -> None:
    """Measured: 0.1 s each."""
    file = Path(__file__).parent / "golden" / "code.txt"
    known = (
        dict(line.split() for line in file.read_text(encoding="utf-8").splitlines()) if file.exists() else {}
    )
    text = emit_c(mechc.load(EXAMPLES / f"{name}.mech").program(frozenset()))
    digest = sha256(text.encode()).hexdigest()[:24]
    if update_golden:
        lines = (f"{name} {digest}\n" for name, digest in sorted({**known, name: digest}.items()))
        file.parent.mkdir(exist_ok=True)
        file.write_text("".join(lines), encoding="utf-8")
    else:
        assert digest == known.get(name), (
            f"the C of {name} is another one; the head of this file says what to do"
        )
