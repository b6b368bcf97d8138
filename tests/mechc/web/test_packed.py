"""Bytes as text, which Python and the script of pages read."""

from __future__ import annotations

import json
import random
import re
import shutil
import subprocess

import pytest

from mechc.web.packed import packed, unpacked
from mechc.web.page import COMMENTS, HERE, page_text, squeezed

NODE = shutil.which("node")

READ = """
const texts = JSON.parse(require('fs').readFileSync(0, 'utf8'));
Promise.all(texts.map(unpack)).then(all => console.log(JSON.stringify(all.map(x => [...new Uint8Array(x)]))));
"""


@pytest.fixture(scope="module")
def samples() -> list[bytes]:
    """Of all lengths up to a few words, with every byte, and such that gzip cannot shorten."""
    rng = random.Random(1)
    return [*(rng.randbytes(n) for n in range(12)), bytes(range(256)), b"\xff" * 999, rng.randbytes(20_000)]


def test_python_reads_what_it_has_written(samples: list[bytes]) -> None:
    texts = [packed(data) for data in samples]
    assert [unpacked(text) for text in texts] == samples
    assert not {*"".join(texts)} & {*'<"\\\n '}  # it stands in a string of a script of a page


@pytest.mark.skipif(NODE is None, reason="needs node")
def test_the_page_reads_it_too(samples: list[bytes]) -> None:
    assert NODE is not None
    script = re.search(r"<script>\n(.*?)</script>", page_text("page.html"), re.DOTALL)
    assert script is not None
    given = json.dumps([packed(data) for data in samples])
    done = subprocess.run(
        [NODE, "-e", script[1] + READ], input=given, capture_output=True, text=True, check=True
    )
    assert [bytes(numbers) for numbers in json.loads(done.stdout)] == samples


@pytest.mark.parametrize(
    ("script", "short"),
    [
        (
            "a = b ? 'x = y, z' : [1, 2];\nif (q) { const c = a - -b; }\nd",
            "a=b?'x = y, z':[1,2];if(q){let c=a - -b}\nd",
        ),
        ('f(`p = ${q}, r`, "a = b", c - d);', 'f(`p = ${q}, r`,"a = b",c-d);'),
        (
            "f(`a ${b ? `c, d` : ''} e`, x + y)",
            "f(`a ${b ? `c, d` : ''} e`,x+y)",
        ),  # templates within each other
        ("f(`a, b\nc, d = e`, 1)", "f(`a, b\nc, d = e`,1)"),
        (
            "f = () => {\n  g([\n1,\n2]);\n}\nh();",
            "f=()=>{  g([1,2])}\nh();",
        ),  # a statement may end at a brace
    ],
)
def test_scripts_lose_spaces_beside_signs_and_texts_keep_theirs(script: str, short: str) -> None:
    assert squeezed(script) == short


def test_styles_lose_spaces_beside_signs() -> None:
    assert squeezed("a { b: c, d; }\n.e :is(f) {}", style=True) == "a{b:c,d}.e :is(f){}"


def test_no_comment_is_left_in_scripts() -> None:
    """Lines are joined: a comment would end the script."""
    for script in sorted(HERE.glob("*.js")):
        text = squeezed(COMMENTS.sub("", script.read_text(encoding="utf-8")))
        assert not re.search(r"(^|[\s;{}])//|/\*", text), script.name
