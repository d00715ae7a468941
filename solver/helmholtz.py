"""Implicit diffusion by fast transforms: (1 - Σ c ∂²) q = r, one transform per axis.

c = μ dt D / h² per axis; the second difference of a value has the eigenvectors of

    values                             faces (low, high)        transform    θ_k
    in cells; along the face           no flux or slip, both    DCT-II       π k / n
    along the face                     no slip, both            DST-II       π (k + 1) / n
    along the face                     no slip, slip            DST-IV       π (k + ½) / n
    along the face                     slip, no slip            DCT-IV       π (k + ½) / n
    normal to the face, on it          both 0                   DST-I        π (k + 1) / n
    all                                periodic                 real FFT     2π ⌈k / 2⌉ / n

and the eigenvalues -λ = -(2 - 2 cos θ_k), less `far` λ² for the fourth difference of ∂² of fourth
order, whose ghosts are mirrored alike: q is exact to round-off. The values normal to two walls are
n - 1; the last of n is the wall's own and stays 0. Open faces are refused: what they are to the
velocity depends on which way it goes.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from ducc0.fft import dst

from solver.grid import AXES, INNER, Field, Grid
from solver.kernel import FIELD, REAL, kernel
from solver.transform import (DIVIDED, OPEN, PERIODIC, WALL, AxisTransform, plan_route,
                              there_and_back)

CELLS = 3   # in place of an axis: values in cells


class Helmholtz:
    """Solves for values in cells or on the faces of one axis, on all ranks together."""

    def __init__(self, grid: Grid, place: int, far: Sequence[float] = (0.0,) * 3):
        self.axes: list[Any] = []
        for axis, (n, h) in enumerate(zip(grid.cells, grid.spacing, strict=True)):
            low, high = _ends(grid, axis, place)
            between_walls = axis == place and low != PERIODIC
            self.axes.append(WallToWall(n) if between_walls else AxisTransform(n, h, low, high))
        self.route, local = plan_route(grid)
        self.eigenvalues = []
        for axis, transform in enumerate(self.axes):
            once = transform.eigenvalues[local[AXES[axis]]] * (
                1.0 if isinstance(transform, WallToWall) else grid.spacing[axis]**2)
            self.eigenvalues.append(once + far[axis] * once**2)
        self.values = np.empty(tuple(reversed(grid.count)))

    def __call__(self, field: Field, c: Sequence[float]) -> None:
        """Solve in place on the cells of this rank (and their right, top or front faces)."""
        np.copyto(self.values, field[INNER])
        factors = [factor * known for factor, known in
                   zip(reversed(c), reversed(self.eigenvalues), strict=True)]
        there_and_back(self.route, self.axes, self.values, lambda there: damp(there, *factors))
        field[INNER] = self.values


class WallToWall:
    """DST-I of the n - 1 values between two walls; the n-th, on the wall, becomes 0."""

    def __init__(self, cells: int):
        self.cells = cells
        self.eigenvalues = 2 - 2 * np.cos(np.pi * np.arange(1, cells + 1) / cells)

    def __call__(self, direction: str, values: Field, axis: int) -> None:
        """Transform along an array axis, in place."""
        across = np.moveaxis(values, axis, 0)
        across[-1] = 0.0
        if self.cells > 1:
            between = np.moveaxis(across[:-1], 0, axis)
            dst(between, type=1, axes=(axis,), out=between,
                inorm=0 if direction == "forward" else DIVIDED)


def _ends(grid: Grid, axis: int, place: int) -> tuple[str, str]:
    """What the second difference sees at the two ends of an axis: "wall" is no flux, "open" is 0 on
    the face, in the words of `AxisTransform`."""
    ends = []
    for side in ("min", "max"):
        face = grid.domain.face(f"{'xyz'[axis]}_{side}")
        if face == "periodic":
            ends.append(PERIODIC)
        elif face == "slip" or place == CELLS:
            ends.append(WALL)
        else:
            ends.append(OPEN)
    return ends[0], ends[1]


@kernel(FIELD, REAL[::1], REAL[::1], REAL[::1])
def damp(values, lz, ly, lx):
    """values /= 1 + lz + ly + lx."""
    for k in range(values.shape[0]):
        for j in range(values.shape[1]):
            base = 1.0 + lz[k] + ly[j]
            for i in range(values.shape[2]):
                values[k, j, i] /= base + lx[i]
