"""Checksums are those of the standard, formed without OpenSSL."""

from __future__ import annotations

import subprocess
import sys

ASKED = """
import sys
from mechc.runtime.native.checksum import checksum
found = checksum(b"some bytes")
found.update(b" more")
assert "_hashlib" not in sys.modules
import hashlib
assert found.hexdigest() == hashlib.blake2b(b"some bytes more", digest_size=32).hexdigest()
"""


def test_checksums_need_no_openssl() -> None:
    subprocess.run([sys.executable, "-c", ASKED], check=True)
