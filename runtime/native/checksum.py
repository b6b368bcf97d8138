"""SHA-256 of what is kept: by the code that Python brings, where OpenSSL is not loaded already, which takes longer than a short
run hashes."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

LONG = 1_000_000
"""Bytes from which on the faster code is worth its loading."""


def sha256(content: bytes) -> Any:
    """Begin a checksum with ``content``."""
    if "_hashlib" not in sys.modules and len(content) < LONG:
        for own in ("_sha2", "_sha256"):  # by the version of Python; others may have neither
            try:
                return import_module(own).sha256(content)
            except ImportError:
                continue
    return import_module("hashlib").sha256(content)
