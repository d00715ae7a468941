"""Real fast transforms, one per axis, that diagonalise second differences on any number of ranks.

Along an axis of n cells the 3-point Laplacian with the ghosts of `boundary.fill_pressure` has the
eigenvectors of a real transform; its eigenvalue is -(2 - 2 cos θ_k) / h²:

    faces (low, high)    transform    θ_k
    wall, wall           DCT-II       π k / n
    open, open           DST-II       π (k + 1) / n
    wall, open           DCT-IV       π (k + ½) / n
    open, wall           DST-IV       π (k + ½) / n
    periodic             real FFT     2π ⌈k / 2⌉ / n     (order 1, cos, sin, cos, sin, …)

All are real with as many values as cells, so one array serves all axes. Ranks own pencils along x;
to transform an axis that ranks share, the pencils are turned so that it becomes whole.
Source: Schumann & Sweet, J. Comput. Phys. 75 (1988) 123.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from ducc0.fft import dct, dst, r2r_fftpack
from mpi4py_fft.pencil import Pencil, Subcomm

from solver.grid import AXES, Field, Grid

WALL, OPEN, PERIODIC = "wall", "open", "periodic"
DIVIDED = 2   # ducc0's norm that makes an inverse: by the logical length


class AxisTransform:
    """The transform that diagonalises the Laplacian along one axis."""

    def __init__(self, cells: int, spacing: float, low: str, high: str):
        k = np.arange(cells)
        self.cells = cells
        if low == PERIODIC:
            angle = 2 * np.pi * ((k + 1) // 2) / cells
            self.forward = partial(r2r_fftpack, real2hermitian=True, forward=True)
            self.inverse = partial(r2r_fftpack, real2hermitian=False, forward=False, inorm=DIVIDED)
        else:
            shift = {(WALL, WALL): 0.0, (OPEN, OPEN): 1.0}.get((low, high), 0.5)
            angle = np.pi * (k + shift) / cells
            transform = dst if low == OPEN else dct
            there, back = (2, 3) if low == high else (4, 4)
            self.forward = partial(transform, type=there)
            self.inverse = partial(transform, type=back, inorm=DIVIDED)
        self.eigenvalues = (2 - 2 * np.cos(angle)) / spacing**2
        if low == PERIODIC or low == high == WALL:
            self.eigenvalues[0] = 0.0

    def __call__(self, direction: str, values: Field, axis: int) -> None:
        """Transform along an array axis, in place."""
        if self.cells > 1:
            transform = self.forward if direction == "forward" else self.inverse
            transform(values, axes=(axis,), out=values)


class Hop:
    """A transpose that makes another axis whole on every rank; `there` holds the values then."""

    def __init__(self, before: Pencil, after: Pencil):
        self.transfer = before.transfer(after, np.dtype("d"))
        self.there = np.empty(after.subshape)


def plan_route(grid: Grid) -> tuple[list[Any], tuple[slice, ...]]:
    """The route from x-pencils to all axes transformed, and this rank's part of what is there."""
    _, rows, layers = grid.processes
    if rows == layers == 1:
        return [0, 1, 2], (slice(None),) * 3
    shape = tuple(reversed(grid.cells))
    ranks = Subcomm(grid.comm, [layers, rows, 1])
    if rows > 1 and layers > 1:
        pencil = Pencil(ranks, shape, axis=2)
        y_whole = pencil.pencil(1)
        z_whole = y_whole.pencil(0)
        route = [0, Hop(pencil, y_whole), 1, Hop(y_whole, z_whole), 2]
    else:
        split, other = (2, 1) if rows == 1 else (1, 2)
        given = other if grid.cells[other] >= grid.comm.size else 0   # this axis is split instead
        pencil = Pencil(ranks, shape, axis=AXES[given])
        z_whole = pencil.pencil(AXES[split])
        route = [0, other, Hop(pencil, z_whole), split]
    return route, tuple(slice(s, s + n)
                        for s, n in zip(z_whole.substart, z_whole.subshape, strict=True))


def there_and_back(route: list[Any], axes: Sequence[Any], values: Field,
                   divide: Callable[[Field], None]) -> None:
    """Transform values along a route, divide them where it ends, and transform back: in place."""
    here, left = values, []
    for step in route:
        if isinstance(step, Hop):
            left.append(here)
            step.transfer.forward(here, step.there)
            here = step.there
        else:
            axes[step]("forward", here, AXES[step])
    divide(here)
    for step in reversed(route):
        if isinstance(step, Hop):
            back = left.pop()
            step.transfer.backward(here, back)
            here = back
        else:
            axes[step]("inverse", here, AXES[step])


def axis_kinds(grid: Grid, axis: int) -> tuple[str, str]:
    """What the pressure sees at the two ends of an axis: "wall", "open" or "periodic"."""
    faces = (grid.domain.face(f"{'xyz'[axis]}_{side}") for side in ("min", "max"))
    low, high = (face if face in (OPEN, PERIODIC) else WALL for face in faces)
    return str(low), str(high)
