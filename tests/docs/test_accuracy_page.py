"""The model of the accuracy page says what the page quotes."""

from __future__ import annotations

from pathlib import Path

from page_blocks import blocks

import mechc

PAGE = (Path(__file__).parents[2] / "docs" / "accuracy.md").read_text(encoding="utf-8")


def test_the_jump_of_the_page_is_told_as_it_stands_there() -> None:
    (model,) = [block.text for block in blocks(PAGE) if block.language == "mech"]
    solution = mechc.loads(model).simulate(estimate_error=False)
    (jump,) = [remark for remark in solution.remarks if "jumps" in remark]
    assert jump in " ".join(PAGE.split())
