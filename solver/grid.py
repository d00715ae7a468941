"""The staggered grid and how it is spread over MPI ranks.

    v[k, j, i]                 cell (k, j, i) holds p, T and phi at its centre,
       ─▲─                     u, v, w on its right, top and front face.
    ┌───┴───┐                 Arrays are indexed [k, j, i] (z, y, x), C order, with
    │   p   ├─► u[k, j, i]     GHOSTS layers around the cells of this rank; the low
    └───────┘                  boundary face of u is u[:, :, GHOSTS - 1].

Ranks own pencils along x (the process grid is 1 × Py × Pz), the layout of the fast transforms.
A PETSc DMDA holds the decomposition and makes the vectors of the pressure solve.
"""

from collections.abc import Sequence
from math import prod
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from solver.kernel import GHOSTS
from solver.scene import SceneError
from solver.scene_physics import Domain

Field = NDArray[np.float64]
AXES = (2, 1, 0)   # array axis of x, y, z
INNER = (slice(GHOSTS, -GHOSTS),) * 3
TURNS = ((2, 0, 1), (1, 0, 2), (0, 1, 2))   # of the array axes: that of x, y or z first


class Grid:
    """Cells, spacing, this rank's share of them, and the exchange of ghost layers.

    cells, size, spacing   of the whole box, in x, y, z order
    start, count           first cell and number of cells of this rank, in x, y, z order
    periodic               per axis
    """

    def __init__(self, domain: Domain, comm: MPI.Comm):
        self.comm = comm
        self.cells = domain.cells
        self.size = domain.size
        self.spacing = tuple(s / n for s, n in zip(domain.size, domain.cells, strict=True))
        self.volume = prod(self.spacing)
        self.domain = domain
        self.periodic = tuple(domain.face(f"{a}_min") == "periodic" for a in "xyz")
        self.processes = process_grid(domain.cells, comm.size)
        self.dm = self._distributed_array()
        self.start, self.count = self.dm.getCorners()
        self.shape = tuple(n + 2 * GHOSTS for n in reversed(self.count))
        self._buffers: dict[Any, NDArray[Any]] = {}

    def _distributed_array(self) -> PETSc.DMDA:
        kinds = [PETSc.DM.BoundaryType.PERIODIC if p else PETSc.DM.BoundaryType.NONE
                 for p in self.periodic]
        return PETSc.DMDA().create(
            dim=3, dof=1, sizes=self.cells, proc_sizes=self.processes, boundary_type=kinds,
            stencil_type=PETSc.DMDA.StencilType.STAR, stencil_width=1, comm=self.comm)

    def destroy(self) -> None:
        """Free PETSc's part (before PETSc itself ends)."""
        self.dm.destroy()

    def field(self, value: float = 0.0) -> Field:
        """A new ghosted field."""
        return np.full(self.shape, value)

    def at_low_end(self, axis: int) -> bool:
        """Whether this rank touches the low face of the box along x, y or z (0, 1, 2)."""
        return bool(self.start[axis] == 0)

    def at_high_end(self, axis: int) -> bool:
        """Whether this rank touches the high face of the box along x, y or z (0, 1, 2)."""
        return bool(self.start[axis] + self.count[axis] == self.cells[axis])

    def neighbours(self, axis: int) -> tuple[int, int]:
        """Ranks that own the cells below and above along an axis; PROC_NULL at a box face."""
        _, rows, layers = self.processes
        y, z = self.comm.rank % rows, self.comm.rank // rows
        here, number, stride = ((0, 1, 1), (y, rows, 1), (z, layers, rows))[axis]

        def rank(there: int) -> int:
            if not 0 <= there < number and not self.periodic[axis]:
                return int(MPI.PROC_NULL)
            return int(self.comm.rank + (there % number - here) * stride)

        return rank(here - 1), rank(here + 1)

    def exchange(self, axis: int, *fields: Field, layers: int = GHOSTS) -> None:
        """Fill the first ghost layers along one axis from the neighbours (or from the far side,
        where a periodic axis is not split). Box faces that are not periodic are left alone."""
        if self.processes[axis] > 1:
            self._exchange_with_neighbours(axis, fields, layers)
        elif self.periodic[axis]:
            for field in fields:
                _wrap(field.transpose(TURNS[axis]), self.count[axis], layers)

    def _exchange_with_neighbours(self, axis: int, fields: tuple[Field, ...], layers: int) -> None:
        low, high = self.neighbours(axis)
        first, end = GHOSTS, self.count[axis] + GHOSTS
        pieces = [tuple(view[at:at + layers] for at in (first, end - layers, first - layers, end))
                  for view in (field.transpose(TURNS[axis]) for field in fields)]
        if pieces[0][0].flags.c_contiguous:   # along z they go as they lie
            self._swap(pieces, low, high)
            return
        packed = self._buffer(("exchange", axis, len(fields), layers),
                              (4, len(fields), *pieces[0][0].shape))
        for n, (bottom, top, _, _) in enumerate(pieces):
            packed[0, n], packed[1, n] = bottom, top
        self._swap([tuple(packed)], low, high)
        for n, (_, _, below, above) in enumerate(pieces):
            if low != MPI.PROC_NULL:
                below[...] = packed[2, n]
            if high != MPI.PROC_NULL:
                above[...] = packed[3, n]

    def _swap(self, pieces: list[tuple[Field, ...]], low: int, high: int) -> None:
        """Send what is at the bottom and at the top; receive what comes below and above."""
        requests = []
        for _, _, below, above in pieces:
            requests += [self.comm.Irecv(below, low, 1), self.comm.Irecv(above, high, 2)]
        for bottom, top, _, _ in pieces:
            requests += [self.comm.Isend(bottom, low, 2), self.comm.Isend(top, high, 1)]
        MPI.Request.Waitall(requests)

    def share_faces(self, velocity: Sequence[Field]) -> None:
        """Copy the low face of every block from the rank that owns it (the box owns its own).
        `velocity` is u, v, w."""
        for axis, field in enumerate(velocity):
            view = field.transpose(TURNS[axis])
            count = self.count[axis]
            if self.processes[axis] > 1:
                low, high = self.neighbours(axis)
                mine, theirs = self._buffer(("faces", axis), (2, *view.shape[1:]))
                np.copyto(mine, view[count + GHOSTS - 1])
                self.comm.Sendrecv(mine, high, 7, theirs, low, 7)
                if low != MPI.PROC_NULL:
                    view[GHOSTS - 1] = theirs
            elif self.periodic[axis]:
                view[GHOSTS - 1] = view[count + GHOSTS - 1]

    def fold(self, *fields: Field) -> None:
        """Add what was deposited in the first ghost layer to the cell that owns it; at a face of
        the box to the nearest cell inside. The ghosts are cleared."""
        for axis in (2, 1, 0):
            low, high = self.neighbours(axis)
            split = self.processes[axis] > 1
            for field in fields:
                view = field.transpose(TURNS[axis])
                last = self.count[axis] + GHOSTS - 1
                below, above = view[GHOSTS - 1].copy(), view[last + 1].copy()
                view[GHOSTS - 1], view[last + 1] = 0, 0
                if split:
                    below, above = self._swap_layers(axis, low, high, below, above)
                elif self.periodic[axis]:
                    below, above = above, below
                view[GHOSTS] += below
                view[last] += above

    def _swap_layers(self, axis: int, low: int, high: int, below: Field,
                     above: Field) -> tuple[Field, Field]:
        """Send the layers beyond this rank to their owners; a layer with no owner stays here."""
        from_low, from_high = self._buffer(("fold", axis), (2, *below.shape))
        np.copyto(from_low, below)
        np.copyto(from_high, above)
        self.comm.Sendrecv(below, low, 3, from_high, high, 3)
        self.comm.Sendrecv(above, high, 4, from_low, low, 4)
        return from_low, from_high

    def _buffer(self, key: Any, shape: tuple[int, ...]) -> Field:
        if key not in self._buffers:
            self._buffers[key] = np.empty(shape)
        return self._buffers[key]


def _wrap(view: Field, count: int, layers: int) -> None:
    """Periodic ghosts of an axis that one rank owns whole (it may be a single cell long)."""
    for layer in range(layers):
        view[GHOSTS - 1 - layer] = view[GHOSTS + (-1 - layer) % count]
        view[GHOSTS + count + layer] = view[GHOSTS + layer % count]


def process_grid(cells: tuple[int, int, int], ranks: int) -> tuple[int, int, int]:
    """(1, Py, Pz) with Py Pz = ranks, every rank at least GHOSTS cells wide along a split axis and
    the least surface between ranks; raises `SceneError` where there are too many ranks."""
    _, ny, nz = cells
    fits = _fitting(cells, ranks)
    if not fits:
        most = max(n for n in range(1, ranks) if _fitting(cells, n))
        raise SceneError(f"domain.cells = {cells}: too few cells for {ranks} ranks; fix: run on at "
                         f"most {most}, or use more cells along y and z")
    py, pz = min(fits, key=lambda grid: ((grid[0] - 1) * nz + (grid[1] - 1) * ny, grid[0]))
    return 1, py, pz


def _fitting(cells: tuple[int, int, int], ranks: int) -> list[tuple[int, int]]:
    """All (Py, Pz) that leave every rank wide enough, also while the transforms transpose."""
    nx, ny, nz = cells
    found = []
    for py in (n for n in range(1, ranks + 1) if ranks % n == 0):
        pz = ranks // py
        wide = (py == 1 or ny // py >= GHOSTS) and (pz == 1 or nz // pz >= GHOSTS)
        if py > 1 and pz > 1:
            transposes = nx >= py and ny >= pz
        else:
            transposes = max(nx, ny if py == 1 else nz) >= ranks
        if wide and transposes:
            found.append((py, pz))
    return found
