"""Scripts of pages without blanks: nothing but blanks in code goes."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from mechc.web import page
from mechc.web.squeeze import squeezed

FOLDER = Path(page.__file__).parent
NODE = shutil.which("node")
SCRIPT = """\
// a comment
const a = b + ++c - -d,  e = /[",] \\/ x/.test(f ? `one,  ${ g( 'h, i' ) ? ` or  ${ j + 1 } ` : "k = l" }, two` : 2) / 3;
  return   /x y/g.exec(s)  in { m : n };  // why
"""
SQUEEZED = """\
const a=b + ++c - -d,e=/[",] \\/ x/.test(f?`one,  ${ g('h, i')?` or  ${ j + 1 } `:"k = l" }, two`:2)/3;
return   /x y/g.exec(s)in{m:n};
"""


def test_words_patterns_and_templates_stay_as_they_are() -> None:
    assert squeezed(SCRIPT) == SQUEEZED


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.js")), ids=lambda path: path.name)
def test_scripts_lose_nothing_but_blanks_and_comments(path: Path) -> None:
    text, found = path.read_text(encoding="utf-8"), squeezed(path.read_text(encoding="utf-8"))
    code = re.sub(r"^\s*(//.*|/\*\*(.|\n)*?\*/)\n| +// [^'`\"\n]*$", "", text, flags=re.MULTILINE)
    assert re.sub(r"\s", "", found) == re.sub(r"\s", "", code)
    assert len(found) < len(text)
    if NODE is not None:
        checked = subprocess.run(
            [NODE, "--check", "-"], input=found, text=True, capture_output=True, check=False
        )
        assert checked.returncode == 0, checked.stderr
