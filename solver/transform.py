"""The inverse of the discrete Laplacian by fast transforms, one per axis, on any number of ranks.

Along an axis of n cells the 3-point Laplacian with the ghosts of `boundary.fill_pressure` has the
eigenvectors of a real transform; its eigenvalue is -(2 - 2 cos θ_k) / h²:

    faces (low, high)    transform    θ_k
    wall, wall           DCT-II       π k / n
    open, open           DST-II       π (k + 1) / n
    wall, open           DCT-IV       π (k + ½) / n
    open, wall           DST-IV       π (k + ½) / n
    periodic             real FFT     2π ⌈k / 2⌉ / n     (order 1, cos, sin, cos, sin, …)

All are real with as many values as cells, so one array serves all axes. Where the axis that comes
last has walls or open faces it is not transformed at all: the tridiagonal system that remains on
each of its lines is solved by elimination, at a fraction of the cost. Ranks own pencils along x;
they are transposed so that the split axes become whole. What can be done plane by plane is done on
a few planes at a time, which stay in the cache. Cost: two transforms per axis and two
(split along y and z: four) all-to-all exchanges.
Source: Schumann & Sweet, J. Comput. Phys. 75 (1988) 123.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.fft
import scipy.fftpack
from mpi4py_fft.pencil import Pencil, Subcomm

from solver.grid import AXES, Field, Grid
from solver.kernel import FIELD, INT, REAL, inlined, kernel

WALL, OPEN, PERIODIC = "wall", "open", "periodic"
IN_CACHE = 2**16   # doubles that are transformed along x and y in one go: half a megabyte
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
        """Transform along an array axis, in place; returns the values."""
        if self.cells == 1:
            return values
        transform = self.forward if direction == "forward" else self.inverse
        result = transform(values, axis=axis, overwrite_x=True, **self.options)
        if not np.may_share_memory(result, values):   # scipy was free to overwrite, but did not
            np.copyto(values, result)
        return values


class Hop:
    """A transpose that makes another axis whole on every rank; `there` holds the values then."""

    def __init__(self, before: Pencil, after: Pencil):
        self.transfer = before.transfer(after, np.dtype("d"))
        self.there = np.empty(after.subshape)


class InverseLaplacian:
    """Solves -∇²p = r exactly (to round-off), p and r being x-pencils (mz, my, nx) of this rank.

    Where no face is open the constant is in the kernel: its component of r is dropped and p has
    zero mean. `route` is what happens on the way to the eigenvectors, after the transforms within
    planes: axes to transform, and hops.
    """

    def __init__(self, grid: Grid):
        kinds = [axis_kinds(grid, axis) for axis in range(3)]
        self.axes = [AxisTransform(n, h, *kind) for n, h, kind in
                     zip(grid.cells, grid.spacing, kinds, strict=True)]
        self.route, local = plan_route(grid)
        eigenvalues = [self.axes[axis].eigenvalues[local[AXES[axis]]] for axis in (2, 1, 0)]
        self.line = self.route[-1]
        if kinds[self.line][0] == PERIODIC or grid.cells[self.line] == 1:
            self.divide: Callable[[Field], None] = DivideByEigenvalues(eigenvalues)
        else:
            self.route.pop()
            self.divide = SolveAlongLines(eigenvalues, self.line, grid.spacing[self.line],
                                          kinds[self.line])
        self.in_planes = []   # along x and y, as far as the route begins with them
        while self.route and self.route[0] in (0, 1):
            self.in_planes.append(self.route.pop(0))
        nx, ny, nz = grid.count
        thickness = max(1, IN_CACHE // (nx * ny))
        self.blocks = [slice(k, k + thickness) for k in range(0, nz, thickness)]

    def solve(self, r: Field, p: Field) -> None:
        """p = (-∇²)⁻¹ r."""
        for planes in self.blocks:
            np.copyto(p[planes], r[planes])
            for axis in self.in_planes:
                self.axes[axis]("forward", p[planes], AXES[axis])
        there_and_back(self.route, self.axes, p, self.divide)
        for planes in self.blocks:
            for axis in reversed(self.in_planes):
                self.axes[axis]("inverse", p[planes], AXES[axis])


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


class DivideByEigenvalues:
    """The last step where all three axes have been transformed."""

    def __init__(self, eigenvalues: list[Field]):
        self.eigenvalues = eigenvalues

    def __call__(self, values: Field) -> None:
        """In place."""
        divide_by_eigenvalues(values, *self.eigenvalues)


class SolveAlongLines:
    """The last step where one axis (y or z, as `line`) was left: (λ - d²/dz²) p = r on each line.

    Gaussian elimination with the reciprocal pivots m, which are computed once:
    m_k = 1 / (b_k - c² m_{k-1}), with c = 1 / h² off the diagonal b.
    """

    def __init__(self, eigenvalues: list[Field], line: int, spacing: float, kind: tuple[str, str]):
        lz, ly, lx = eigenvalues
        self.step = (int(line == 1), int(line == 2))
        self.coupling = 1 / spacing**2
        along = np.zeros(len(lz) if line == 2 else len(ly))
        along += 2 * self.coupling
        for end, face in zip((0, -1), kind, strict=True):
            along[end] += self.coupling if face == OPEN else -self.coupling
        if line == 2:
            diagonal = along[:, None, None] + ly[None, :, None] + lx
        else:
            diagonal = lz[:, None, None] + along[None, :, None] + lx
        self.singular = bool(lx[0] == 0 and (ly if line == 2 else lz)[0] == 0 and OPEN not in kind)
        self.pivots = np.ascontiguousarray(diagonal)
        invert_pivots(self.pivots, self.coupling, *self.step)
        if self.singular:
            self._constant_line(self.pivots)[-1] = 0.0

    def __call__(self, values: Field) -> None:
        """In place."""
        solve_lines(values, self.pivots, self.coupling, *self.step)
        if self.singular:
            line = self._constant_line(values)
            line -= line.mean()

    def _constant_line(self, values: Field) -> Field:
        """The line that does not vary along the two other axes."""
        return values[:, 0, 0] if self.step[1] else values[0, :, 0]


@kernel(FIELD, REAL, INT, INT)
def invert_pivots(pivots, coupling, dj, dk):
    """Diagonal → reciprocal pivots of the elimination, in place."""
    for k in range(pivots.shape[0]):
        for j in range(pivots.shape[1]):
            first = (k if dk else j) == 0
            for i in range(pivots.shape[2]):
                before = 0.0 if first else pivots[k - dk, j - dj, i]
                pivots[k, j, i] = 1 / (pivots[k, j, i] - coupling * coupling * before)


@inlined
def forward_row(here, before, pivots, coupling):
    """Elimination: d = (r + c d_before) m."""
    for i in range(here.size):
        here[i] = (here[i] + coupling * before[i]) * pivots[i]


@inlined
def backward_row(here, after, pivots, coupling):
    """Substitution: p = d + c m p_after."""
    for i in range(here.size):
        here[i] += coupling * pivots[i] * after[i]


@kernel(FIELD, FIELD, REAL, INT, INT)
def solve_lines(values, pivots, coupling, dj, dk):
    """Lines run along y (dj = 1) or z (dk = 1), a plane of them after the other: the way back finds
    in the cache what the way there has left."""
    nz, ny, nx = values.shape
    planes, steps = (ny, nz) if dk else (nz, ny)
    for plane in range(planes):
        for step in range(steps):
            k, j = (step, plane) if dk else (plane, step)
            if step == 0:
                for i in range(nx):
                    values[k, j, i] *= pivots[k, j, i]
            else:
                forward_row(values[k, j], values[k - dk, j - dj], pivots[k, j], coupling)
        for step in range(steps - 2, -1, -1):
            k, j = (step, plane) if dk else (plane, step)
            backward_row(values[k, j], values[k + dk, j + dj], pivots[k, j], coupling)


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
