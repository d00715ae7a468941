"""The inverse of the discrete Laplacian: two axes by fast transforms, the third by elimination.

Transforms along x and one more axis leave a tridiagonal system on every line along the last, which
costs a fraction of a transform and is the axis that ranks share: they send a plane or two instead
of transposing the box (`lines`). Only where ranks share two axes the pencils are turned once, so
that y is whole. What can be done plane by plane is done on a few planes at a time, which stay in
the cache: the block is read and written once on the way to the eigenvectors and once on the way
back.
Source: Schumann & Sweet, J. Comput. Phys. 75 (1988) 123.
"""

import numpy as np
from mpi4py_fft.pencil import Pencil, Subcomm

from solver.grid import AXES, Field, Grid
from solver.lines import Lines, Y, Z
from solver.transform import OPEN, PERIODIC, AxisTransform, Hop, axis_kinds

X = 0
IN_CACHE = 2**17   # doubles that are worked on in one go: a megabyte


class InverseLaplacian:
    """Solves -∇²p = r exactly (to round-off), p and r being x-pencils (mz, my, nx) of this rank.

    Where no face is open the constant is in the kernel: its component of r is dropped and p has
    zero mean.
    """

    def __init__(self, grid: Grid):
        self.axes = [AxisTransform(n, h, *axis_kinds(grid, axis)) for axis, (n, h) in
                     enumerate(zip(grid.cells, grid.spacing, strict=True))]
        _, rows, layers = grid.processes
        self.line = Z if layers > 1 or (rows == 1 and grid.cells[Z] > 1) else Y
        here = [slice(s, s + n) for s, n in zip(grid.start, grid.count, strict=True)]
        self.turn: Hop | None = None
        if rows > 1 and layers > 1:
            pencil = Pencil(Subcomm(grid.comm, [layers, rows, 1]), tuple(reversed(grid.cells)), 2)
            y_whole = pencil.pencil(AXES[Y])
            self.turn = Hop(pencil, y_whole)
            here = [slice(s, s + n) for s, n in
                    zip(reversed(y_whole.substart), reversed(y_whole.subshape), strict=True)]
        self.in_planes = [Y] if self.turn else [X, Y + Z - self.line]
        self.lines = self._lines(grid, here)

    def _lines(self, grid: Grid, here: list[slice]) -> Lines:
        """The systems along the last axis, for the eigenvalues of the others that are here."""
        line, kinds = self.line, axis_kinds(grid, self.line)
        known = [axis.eigenvalues[part] for axis, part in zip(self.axes, here, strict=True)]
        has_constant = OPEN not in kinds and all(
            values[0] == 0 for axis, values in enumerate(known) if axis != line)
        coupling = 1 / grid.spacing[line]**2
        if grid.cells[line] == 1:
            coupling = 0.0   # its cell has no neighbour: the eigenvalue is all there is
        else:
            diagonal = np.full(grid.cells[line], 2 * coupling)
            for end, face in zip((0, -1), kinds, strict=True):
                if face != PERIODIC:
                    diagonal[end] += coupling if face == OPEN else -coupling
            known[line] = diagonal[here[line]]
        plane = len(known[X]) * len(known[Y + Z - line])
        return Lines(grid, line, list(reversed(known)), coupling,
                     self._solve_constant_line if has_constant else None,
                     max(1, IN_CACHE // plane))

    def _solve_constant_line(self, values: Field) -> None:
        """The line that varies along its own axis only, by that axis' transform; zero mean."""
        axis = self.axes[self.line]
        axis("forward", values, 0)
        values[1:] /= axis.eigenvalues[1:]
        values[0] = 0.0
        axis("inverse", values, 0)

    def solve(self, r: Field, p: Field, copy: Field | None = None) -> None:
        """p = (-∇²)⁻¹ r; and the same into `copy`, which need not be contiguous."""
        if self.turn:
            np.copyto(p, r)
            self.axes[X]("forward", p, AXES[X])
            self.turn.transfer.forward(p, self.turn.there)
            self._solve_in_planes(self.turn.there, self.turn.there, None)
            self.turn.transfer.backward(self.turn.there, p)
            self.axes[X]("inverse", p, AXES[X])
            if copy is not None:
                np.copyto(copy, p)
        else:
            self._solve_in_planes(r, p, copy)

    def _solve_in_planes(self, r: Field, p: Field, copy: Field | None) -> None:
        """The transforms that planes across the lines allow, and the lines."""
        for block in self.lines.blocks:
            planes = self._planes(block)
            if p is not r:   # first: transforms stride through memory, fastest where it is cached
                np.copyto(p[planes], r[planes])
            for axis in self.in_planes:
                self.axes[axis]("forward", p[planes], AXES[axis])
            self.lines.eliminate(p, block)
        self.lines.meet(p)
        for block in reversed(self.lines.blocks):
            self.lines.substitute(p, block)
            planes = self._planes(block)
            for axis in reversed(self.in_planes):
                self.axes[axis]("inverse", p[planes], AXES[axis])
            if copy is not None:
                np.copyto(copy[planes], p[planes])

    def _planes(self, block: range) -> tuple[slice, ...]:
        """The part of an array that a block of planes across the lines is."""
        part = slice(min(block), max(block) + 1)
        return (part,) if self.line == Z else (slice(None), part)

    def destroy(self) -> None:
        """Free what MPI made for it."""
        self.lines.destroy()
