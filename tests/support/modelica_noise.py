"""Noise as Modelica.Blocks.Noise defines it: xorshift128+ after S. Vigna, begun by xorshift64* from a seed and the hash of a name (A. Partow)."""

from __future__ import annotations

WORD, HALF = (1 << 64) - 1, (1 << 32) - 1
GLOBAL_SEED = 67867967
"""Of a model that says nothing else."""


def hashed(name: str) -> int:
    """Return 32 bits for the name of a block in its model."""
    found = 0xAAAAAAAA
    for i, letter in enumerate(name.encode()):
        if i % 2:
            found ^= ~((found << 11) + (letter ^ (found >> 5))) & HALF
        else:
            found ^= ((found << 7) ^ letter * (found >> 3)) & HALF
    return found


def mixed(state: int) -> int:
    """Return the next state of xorshift64*."""
    state ^= state >> 12
    state ^= state << 25 & WORD
    state ^= state >> 27
    return state * 2685821657736338717 & WORD


def uniform(count: int, low: float, high: float, name: str, seed: int = GLOBAL_SEED) -> list[float]:
    """Return what a block of uniform noise gives, one number for each of its periods."""
    older = hashed(name) | seed << 32
    for _ in range(10):
        older = mixed(older)
    newer = mixed(older)
    found = []
    for _ in range(count):
        bits = older ^ (older << 23 & WORD)
        older, newer = newer, (bits ^ newer ^ bits >> 17 ^ newer >> 26) + newer & WORD
        signed = newer - (1 << 64) if newer >> 63 else newer
        found.append((signed * 2.0**-64 + 0.5) * (high - low) + low)
    return found
