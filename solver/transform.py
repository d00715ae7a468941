"""The inverse of the discrete Laplacian by fast transforms, one per axis, on any number of ranks.

Along an axis of n cells the 3-point Laplacian with the ghosts of `boundary.fill_pressure` has the
eigenvectors of a real transform; its eigenvalue is -(2 - 2 cos θ_k) / h²:

    faces (low, high)    transform    θ_k
    wall, wall           DCT-II       π k / n
    open, open           DST-II       π (k + 1) / n
    wall, open           DCT-IV       π (k + ½) / n
    open, wall           DST-IV       π (k + ½) / n
    periodic             real FFT     2π ⌈k / 2⌉ / n     (order 1, cos, sin, cos, sin, …)

All are real with as many values as cells, so one array serves all axes. Ranks own pencils along x;
they are transposed to y and to z. Cost: two transforms per axis and two (pencils: four)
all-to-all exchanges. Source: Schumann & Sweet, J. Comput. Phys. 75 (1988) 123.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.fft
import scipy.fftpack
from mpi4py_fft.pencil import Pencil, Subcomm

from solver.grid import Field, Grid
from solver.kernel import FIELD, REAL, kernel

WALL, OPEN, PERIODIC = "wall", "open", "periodic"
Transform = Callable[..., Field]


class AxisTransform:
    """The transform that diagonalises the Laplacian along one axis."""

    def __init__(self, cells: int, spacing: float, low: str, high: str):
        k = np.arange(cells)
        self.cells = cells
        self.forward: Transform
        self.inverse: Transform
        if low == PERIODIC:
            angle = 2 * np.pi * ((k + 1) // 2) / cells
            self.forward, self.inverse = scipy.fftpack.rfft, scipy.fftpack.irfft
            self.options: dict[str, Any] = {}
        else:
            shift = {(WALL, WALL): 0.0, (OPEN, OPEN): 1.0}.get((low, high), 0.5)
            angle = np.pi * (k + shift) / cells
            sine = low == OPEN
            self.forward = scipy.fft.dst if sine else scipy.fft.dct
            self.inverse = scipy.fft.idst if sine else scipy.fft.idct
            self.options = {"type": 2 if low == high else 4}
        self.eigenvalues = (2 - 2 * np.cos(angle)) / spacing**2
        if low == PERIODIC or low == high == WALL:
            self.eigenvalues[0] = 0.0

    def __call__(self, direction: str, values: Field, axis: int) -> Field:
        """Transform along an array axis, in place; returns the result."""
        if self.cells == 1:
            return values
        transform = self.forward if direction == "forward" else self.inverse
        return transform(values, axis=axis, overwrite_x=True, **self.options)


class InverseLaplacian:
    """Solves -∇²p = r exactly (to round-off), p and r being x-pencils (mz, my, nx) of this rank.

    Where no face is open the constant is in the kernel: its component of r is dropped and p has
    zero mean.
    """

    def __init__(self, grid: Grid):
        kinds = [axis_kinds(grid, axis) for axis in range(3)]
        self.x, self.y, self.z = (AxisTransform(n, h, *kind) for n, h, kind in
                                  zip(grid.cells, grid.spacing, kinds, strict=True))
        self.work = np.empty(tuple(reversed(grid.count)))
        self._hops: list[tuple[Any, Field]] = []
        eigenvalues = [self.z.eigenvalues, self.y.eigenvalues, self.x.eigenvalues]
        local = (slice(None),) * 3
        if grid.comm.size > 1:
            local = self._plan_transposes(grid)
        self.eigenvalues = [e[part] for e, part in zip(eigenvalues, local, strict=True)]

    def _plan_transposes(self, grid: Grid) -> tuple[slice, ...]:
        """x-pencils → (y-pencils →) z-pencils; returns this rank's part of the last."""
        _, rows, layers = grid.processes
        shape = tuple(reversed(grid.cells))
        ranks = Subcomm(grid.comm, [layers, rows, 1])
        pencil = Pencil(ranks, shape, axis=1 if rows == 1 else 2)
        route = [0] if rows == 1 else [1, 0]
        for axis in route:
            after = pencil.pencil(axis)
            self._hops.append((pencil.transfer(after, np.dtype("d")), np.empty(after.subshape)))
            pencil = after
        return tuple(slice(s, s + n) for s, n in zip(pencil.substart, pencil.subshape, strict=True))

    def solve(self, r: Field, p: Field) -> None:
        """p = (-∇²)⁻¹ r."""
        np.copyto(self.work, r)
        p[...] = self._through(self.work)

    def _through(self, values: Field) -> Field:
        """Transform x, hop, transform y, hop, transform z, divide, and all the way back."""
        values = self.x("forward", values, 2)
        if len(self._hops) == 2:
            values = self._hop(0, values, lambda v: self.y("forward", v, 1), self._across_z,
                               lambda v: self.y("inverse", v, 1))
        else:
            values = self._across_z(self.y("forward", values, 1))
            values = self.y("inverse", values, 1)
        return self.x("inverse", values, 2)

    def _across_z(self, values: Field) -> Field:
        if not self._hops:
            return self._divide(values)
        return self._hop(len(self._hops) - 1, values, self._divide)

    def _divide(self, values: Field) -> Field:
        values = self.z("forward", values, 0)
        divide_by_eigenvalues(values, *self.eigenvalues)
        return self.z("inverse", values, 0)

    def _hop(self, index: int, values: Field, *work: Transform) -> Field:
        """Transpose, do the work there, and transpose back."""
        transfer, there = self._hops[index]
        transfer.forward(values, there)
        result = there
        for operation in work:
            result = operation(result)
        transfer.backward(result, values)
        return values


def axis_kinds(grid: Grid, axis: int) -> tuple[str, str]:
    """What the pressure sees at the two ends of an axis: "wall", "open" or "periodic"."""
    faces = (grid.domain.face(f"{'xyz'[axis]}_{side}") for side in ("min", "max"))
    low, high = (face if face in (OPEN, PERIODIC) else WALL for face in faces)
    return str(low), str(high)


@kernel(FIELD, REAL[::1], REAL[::1], REAL[::1])
def divide_by_eigenvalues(values, lz, ly, lx):
    """values /= lz + ly + lx; the constant, whose eigenvalue is 0, becomes 0."""
    for k in range(values.shape[0]):
        for j in range(values.shape[1]):
            base = lz[k] + ly[j]
            first = values[k, j, 0]
            for i in range(values.shape[2]):
                values[k, j, i] /= base + lx[i]
            if base + lx[0] == 0.0:
                values[k, j, 0] = 0.0 * first
