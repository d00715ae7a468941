"""How every hot loop of the renderer is compiled.

Kernels take arrays and named tuples of arrays, and allocate nothing. So they need no reference
counts, and go without: counting the arrays of a named tuple at every call made shading
25 times slower.
They are compiled at their first call and cached on disk.
"""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile a loop, or a part of one."""
    options: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}
    compiled: Function = njit(**options)(function)
    return compiled
