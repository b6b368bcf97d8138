"""Bytes as text inside a page, which its own ``unpack`` reads: gzip, and five digits for four bytes."""

from __future__ import annotations

import base64
import gzip

# a '<' might begin a tag
INTO, BACK = bytes.maketrans(b"<", b"/"), bytes.maketrans(b"/", b"<")


def packed(data: bytes) -> str:
    return base64.b85encode(gzip.compress(data, 9, mtime=0)).translate(INTO).decode()


def unpacked(text: str) -> bytes:
    return gzip.decompress(base64.b85decode(text.encode().translate(BACK)))
