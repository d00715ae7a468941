"""Random numbers that depend only on what they are for: hashes instead of streams.

A pixel's numbers are the same whatever tile or rank computes it.
"""

from render.kernel import kernel


@kernel
def mix(a: int, b: int) -> int:
    """A 32-bit hash of two 32-bit numbers (C. Wellons' lowbias32 of a linear combination)."""
    x = (a * 0x9E3779B1 + b + 0x7F4A7C15) & 0xFFFFFFFF
    x ^= x >> 16
    x = (x * 0x7FEB352D) & 0xFFFFFFFF
    x ^= x >> 15
    x = (x * 0x846CA68B) & 0xFFFFFFFF
    return x ^ (x >> 16)


@kernel
def uniform(a: int, b: int) -> float:
    """A number in [0, 1) that depends on nothing but a and b."""
    return mix(a, b) / 4294967296.0
