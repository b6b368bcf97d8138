"""BLAKE2 of what is kept, by the code that Python brings: to load OpenSSL takes longer than a short run hashes."""

from __future__ import annotations

from _blake2 import blake2b


def checksum(content: bytes = b"") -> blake2b:
    """Begin a checksum of 256 bits with ``content``."""
    return blake2b(content, digest_size=32)
