"""Random numbers that depend on nothing but (seed, stream, key): not on ranks, order or history.

A counter-based generator: the 64-bit finaliser of SplitMix64 (Steele, Lea & Flood, OOPSLA 2014)
applied to seed, stream and key in turn. Each purpose has a stream number of its own, each particle
or face a key, so any rank can draw any number and all agree.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

GOLDEN = np.uint64(0x9E3779B97F4A7C15)


def _mix(z: Any) -> Any:
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def uniform_at(seed: int, stream: int, key: NDArray[np.uint64]) -> NDArray[np.float64]:
    """Uniform in [0, 1), one number per key (any shape)."""
    with np.errstate(over="ignore"):
        state = _mix(np.uint64(seed) + GOLDEN)
        state = _mix(state + np.uint64(stream) * GOLDEN + GOLDEN)
        bits = _mix(state + key * GOLDEN + GOLDEN)
        result: NDArray[np.float64] = (bits >> np.uint64(11)) * 2.0**-53
        return result


def normal_at(seed: int, stream: int, key: NDArray[np.uint64]) -> NDArray[np.float64]:
    """Standard normal, one number per key (Box-Muller on two sub-streams)."""
    even = np.multiply(key, np.uint64(2), dtype=np.uint64)
    radius = np.sqrt(-2 * np.log1p(-uniform_at(seed, stream, even)))
    angle = 2 * np.pi * uniform_at(seed, stream, even + np.uint64(1))
    result: NDArray[np.float64] = radius * np.cos(angle)
    return result
