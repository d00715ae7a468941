"""Where particles live: a PETSc DMSwarm that keeps each particle on the rank that owns its cell.

A particle is one record (`PARTICLE`), carried by the swarm as 14 doubles that PETSc moves between
ranks untouched. The swarm sends to whatever rank is named; which rank owns a point is the grid's
rule, the same as for cells.
"""

import numpy as np
from numba import from_dtype
from numpy.typing import NDArray
from petsc4py import PETSc

from solver.grid import Grid
from solver.kernel import INT, REAL, kernel

FUEL, SOOT = 0, 1
NO_SOOT, SOOT_DUE, SOOT_MADE = 0, 1, 2
PARTICLE = np.dtype([
    ("position", "f8", 3), ("velocity", "f8", 3), ("mass", "f8"), ("temperature", "f8"),
    ("soot", "f8"), ("burnt", "f8"), ("id", "i8"), ("kind", "i4"), ("ignited", "i4"),
    ("soot_state", "i4"), ("spare", "i4")])
RECORDS = from_dtype(PARTICLE)[::1]
DOUBLES = PARTICLE.itemsize // 8
FIELD_NAME = "particle"


class Swarm:
    """The particles of this rank; `points` is a view that holds until the next change in number."""

    def __init__(self, grid: Grid):
        self.grid = grid
        self.dm = PETSc.DMSwarm().create(comm=grid.comm)
        self.dm.setDimension(3)
        self.dm.setType(PETSc.DMSwarm.Type.BASIC)
        self.dm.registerField(FIELD_NAME, DOUBLES, dtype=PETSc.ScalarType)
        self.dm.finalizeFieldRegister()
        self.dm.setLocalSizes(0, 64)
        self.points = self._view()

    def _view(self) -> NDArray[np.void]:
        values = self.dm.getField(FIELD_NAME)
        self.dm.restoreField(FIELD_NAME)   # a held field forbids resizing; the memory stays
        return values.view(PARTICLE)

    def append(self, records: NDArray[np.void]) -> None:
        """Add particles (dtype PARTICLE) to this rank."""
        if len(records):
            self.dm.addNPoints(len(records))
            self.points = self._view()
            self.points[-len(records):] = records

    def census(self) -> tuple[int, int, int]:
        """Numbers of fuel particles, soot particles and burning particles on this rank."""
        soot = int(self.points["kind"].sum())
        return len(self.points) - soot, soot, int(self.points["ignited"].sum())

    def settle(self) -> None:
        """Wrap positions on periodic axes, drop particles that are spent or outside the box, and
        send the others to the ranks that own them. Every rank must call it."""
        grid = self.grid
        wraps = np.array(grid.periodic, dtype=np.int64)
        kept = keep_inside(self.points, *grid.size, wraps)
        if kept < len(self.points):
            self.dm.setLocalSizes(kept, 64)
            self.points = self._view()
        if grid.comm.size > 1:
            self._migrate()

    def _migrate(self) -> None:
        ranks = self.dm.getField("DMSwarm_rank")
        ranks[:] = owners(self.grid, self.points["position"])
        self.dm.restoreField("DMSwarm_rank")
        self.dm.migrate(remove_sent_points=True)
        self.points = self._view()

    def destroy(self) -> None:
        """Free PETSc's part."""
        self.dm.destroy()


def owners(grid: Grid, position: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n,) the rank that owns the cell of each point; points outside go to the nearest cell."""
    _, rows, layers = grid.processes
    parts = []
    for axis, ranks in ((1, rows), (2, layers)):
        cell = np.floor(position[:, axis] / grid.spacing[axis]).astype(np.int64)
        width, wider = divmod(grid.cells[axis], ranks)
        starts = np.arange(1, ranks) * width + np.minimum(np.arange(1, ranks), wider)
        parts.append(np.searchsorted(starts, cell, side="right"))
    return parts[1] * rows + parts[0]


@kernel(RECORDS, REAL, REAL, REAL, INT[::1], result=INT)
def keep_inside(points, lx, ly, lz, wraps):
    """Move the records to keep to the front, in order; returns how many. Spent: mass < 0."""
    kept = 0
    size = (lx, ly, lz)
    for n in range(len(points)):
        inside = points[n].mass >= 0.0
        for axis in range(3):
            x = points[n].position[axis]
            if wraps[axis]:
                x -= np.floor(x / size[axis]) * size[axis]
                points[n].position[axis] = x if x < size[axis] else 0.0
            elif not 0.0 <= x <= size[axis]:
                inside = False
        if inside:
            if kept < n:
                points[kept] = points[n]
            kept += 1
    return kept
