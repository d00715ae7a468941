"""The pressure operator as a matrix, for preconditioners that need its entries (GAMG, ILU, ...).

The same 7-point -∇² as `pressure.NegativeLaplacian`, in the numbering of the grid's DMDA: the cells
of rank 0 first, x fastest, then those of rank 1, and so on.
"""

from typing import Any

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from solver.grid import Grid

Indices = NDArray[np.int64]


def laplacian_rows(grid: Grid, signs: list[list[float]]) -> Any:
    """This rank's rows of -∇² as a scipy CSR matrix of shape (cells of this rank, all cells).

    signs   per axis and side: what a box face makes of the value mirrored in it (1 wall, -1 open)
    """
    k, j, i = np.meshgrid(*(np.arange(s, s + n) for s, n in
                            zip(reversed(grid.start), reversed(grid.count), strict=True)),
                          indexing="ij")
    here = [i.ravel(), j.ravel(), k.ravel()]
    number = _Numbering(grid)
    row = np.arange(len(here[0]))
    rows, columns, values = [], [], []
    for axis, h in enumerate(grid.spacing):
        for side, step in enumerate((-1, 1)):
            there = list(here)
            there[axis] = here[axis] + step
            beyond = (there[axis] < 0) | (there[axis] >= grid.cells[axis])
            if grid.periodic[axis]:
                there[axis] = there[axis] % grid.cells[axis]
                weight = np.ones(len(row))
            else:
                there[axis] = np.where(beyond, here[axis], there[axis])
                weight = np.where(beyond, signs[axis][side], 1.0)
            for place, value in ((here, 1 / h**2), (there, -weight / h**2)):
                rows.append(row)
                columns.append(number(place))
                values.append(np.broadcast_to(value, len(row)))
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return scipy.sparse.coo_matrix(triplets, shape=(len(row), int(np.prod(grid.cells)))).tocsr()


class _Numbering:
    """The global number of a cell."""

    def __init__(self, grid: Grid):
        corners = grid.comm.allgather((grid.start, grid.count))
        self.start = np.array([start for start, _ in corners])
        self.count = np.array([count for _, count in corners])
        self.first = np.concatenate([[0], np.cumsum(self.count.prod(axis=1))])
        self.rows = grid.processes[1]
        self.starts = [np.unique(self.start[:, axis]) for axis in range(3)]

    def __call__(self, place: list[Indices]) -> Indices:
        y, z = (np.searchsorted(self.starts[axis], place[axis], side="right") - 1
                for axis in (1, 2))
        owner = z * self.rows + y
        local = [p - self.start[owner, axis] for axis, p in enumerate(place)]
        nx, ny, _ = self.count[owner].T
        result: Indices = self.first[owner] + (local[2] * ny + local[1]) * nx + local[0]
        return result
