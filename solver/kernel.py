"""How every hot loop is compiled.

Kernels take bare arrays and numbers, allocate nothing and know nothing of MPI. They are compiled
when their module is imported (their signature is given) and cached on disk. Of the fast-math
freedoms only contraction (fused multiply-add) and reassociation are allowed: NaN stays NaN.
"""

from collections.abc import Callable
from typing import Any

import numba
import numba.extending
from llvmlite import ir
from numba.core import cgutils

GHOSTS = 2   # ghost layers on every side of every field: enough for second-order bounded schemes
FIELD = numba.float64[:, :, ::1]
VIEW = numba.float64[:, :, :]   # of a field, with its axes turned
READ_FIELD = numba.types.Array(numba.float64, 3, "C", readonly=True)   # PETSc lends these
CACHE_LINE = 8   # doubles
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


def _fetch(_typing: Any, field: Any, k: Any, j: Any, i: Any) -> Any:
    """Bring the cache line of field[k, j, i] closer, by the processor's prefetch instruction."""
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        place = cgutils.get_item_pointer(context, builder, signature.args[0], array,
                                         list(arguments[1:]))
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        instruction = builder.module.declare_intrinsic(
            "llvm.prefetch", [byte], ir.FunctionType(ir.VoidType(), [byte, *[number] * 3]))
        how = [ir.Constant(number, n) for n in (0, 3, 1)]   # to read, into every level, data
        builder.call(instruction, [builder.bitcast(place, byte), *how])
        return context.get_dummy_value()

    return numba.void(field, *[numba.intp] * 3), build


fetch: Any = numba.extending.intrinsic(_fetch)


@part_of_sweep
def fetch_row(field, k, j):
    """Ask the memory for a row that will be read soon: of the many rows that a wide stencil reads
    at once the processor foresees only some. Beyond the field it does no harm."""
    for i in range(0, field.shape[2], CACHE_LINE):
        fetch(field, k, j, i)
