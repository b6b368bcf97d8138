"""Checksums are the same, whichever code forms them."""

from __future__ import annotations

import subprocess
import sys

import pytest

ASKED = """
import sys
from mechc.runtime.native.checksum import LONG, sha256
text = b"some bytes" * int(sys.argv[1])
found = sha256(text).hexdigest()
own = "_hashlib" not in sys.modules
import hashlib
assert found == hashlib.sha256(text).hexdigest()
print(own, len(text) < LONG)
"""


@pytest.mark.parametrize("times", [1, 200_000])
def test_short_texts_need_no_openssl(times: int) -> None:
    command = [sys.executable, "-c", ASKED, str(times)]
    own, short = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    assert own == short
