"""Vectors inside kernels: tuples of three numbers, which the compiler keeps in registers."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.kernel import kernel

Array = NDArray[np.float64]
Three = tuple[float, float, float]


@kernel
def load(array: Array, row: int) -> Three:
    """Row of an (n, 3) array."""
    return array[row, 0], array[row, 1], array[row, 2]


@kernel
def store(array: Any, row: int, a: Three) -> None:
    """Write a vector into a row of an (n, 3) array."""
    array[row, 0], array[row, 1], array[row, 2] = a[0], a[1], a[2]


@kernel
def add_to(array: Any, row: int, a: Three) -> None:
    """Add a vector to a row of an (n, 3) array."""
    array[row, 0] += a[0]
    array[row, 1] += a[1]
    array[row, 2] += a[2]


@kernel
def dot(a: Three, b: Three) -> float:
    """a · b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a: Three, b: Three) -> Three:
    """a x b"""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@kernel
def along(a: Three, t: float, b: Three) -> Three:
    """a + t b"""
    return a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]


@kernel
def scaled(a: Three, s: float) -> Three:
    """s a"""
    return s * a[0], s * a[1], s * a[2]


@kernel
def times(a: Three, b: Three) -> Three:
    """Component by component, as a colour filters light."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@kernel
def unit(a: Three) -> Three:
    """a / |a|; a zero vector stays zero."""
    length = np.sqrt(dot(a, a))
    return scaled(a, 1.0 / length) if length > 0.0 else a


@kernel
def largest(a: Three) -> float:
    """The largest component."""
    return max(a[0], max(a[1], a[2]))
