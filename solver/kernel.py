"""How every hot loop is compiled.

Kernels take bare arrays and numbers, allocate nothing and know nothing of MPI. They are compiled
when their module is imported (their signature is given) and cached on disk. Of the fast-math
freedoms only contraction (fused multiply-add) and reassociation are allowed: NaN stays NaN.
"""

from collections.abc import Callable
from typing import Any

import numba

GHOSTS = 2   # ghost layers on every side of every field: enough for second-order bounded schemes
FIELD = numba.float64[:, :, ::1]
VIEW = numba.float64[:, :, :]   # of a field, with its axes turned
READ_FIELD = numba.types.Array(numba.float64, 3, "C", readonly=True)   # PETSc lends these
REAL = numba.float64
INT = numba.int64
SWEEP: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc"}, "_nrt": False}


def kernel(*signature: Any, result: Any = numba.void) -> Callable[[Callable[..., Any]], Any]:
    """Compile a loop for these argument types, once for all processes."""
    return numba.njit(result(*signature), cache=True, error_model="numpy",
                      fastmath={"contract", "reassoc"})


def inlined(function: Callable[..., Any]) -> Any:
    """A piece of a kernel; the compiler dissolves it into its caller."""
    return numba.njit(function, error_model="numpy", fastmath={"contract", "reassoc"})


def sweep(*signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """As `kernel`, for loops over rows that are slices of fields: numba's run time (`_nrt`) would
    count who refers to each slice, which takes longer than a row does; nothing here lets one go."""
    return numba.njit(numba.void(*signature), cache=True, **SWEEP)


def part_of_sweep(function: Callable[..., Any]) -> Any:
    """As `inlined`, for a piece of a sweep, whatever its size."""
    return numba.njit(function, forceinline=True, **SWEEP)
