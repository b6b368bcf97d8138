"""Bytes as text inside a page, which its own ``unpack`` reads: gzip, and two digits for thirteen bits."""

from __future__ import annotations

import zlib
from itertools import product

DIGITS = [chr(k) for k in range(33, 127) if chr(k) not in '"<\\']  # a '<' might begin a tag
PAIRS = [b + a for a, b in product(DIGITS, repeat=2)]
VALUES = {digit: k for k, digit in enumerate(DIGITS)}


def packed(data: bytes) -> str:
    # smaller blocks, each with codes of its own: machine code is 2 % shorter by it
    writer = zlib.compressobj(9, zlib.DEFLATED, 31, 6)
    found, hold, bits = [], 0, 0
    for byte in writer.compress(data) + writer.flush():
        hold |= byte << bits
        bits += 8
        if bits >= 13:
            found.append(PAIRS[hold & 8191])
            hold >>= 13
            bits -= 13
    if bits:  # one digit holds six bits
        found.append(PAIRS[hold] if bits > 6 else DIGITS[hold])
    return "".join(found)


def unpacked(text: str) -> bytes:
    found, hold, bits = bytearray(), 0, 0
    for k in range(0, len(text), 2):
        pair = text[k : k + 2]
        hold |= sum(VALUES[digit] * 91**j for j, digit in enumerate(pair)) << bits
        bits += 13 if len(pair) == 2 else 6
        while bits >= 8:
            found.append(hold & 255)
            hold >>= 8
            bits -= 8
    return zlib.decompress(found, 31)
