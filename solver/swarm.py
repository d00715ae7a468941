"""Where particles live: a PETSc DMSwarm, with each particle on the rank that owns its cell.

A particle is one record (`PARTICLE`), 14 doubles that the swarm stores and that travel between
ranks untouched. Which rank owns a point is the grid's rule, the same as for cells. Those that leave
are sent straight to their ranks: DMSwarm's own migration ends in the same place, but takes a
quarter of a step (500 000 particles on each of two ranks, 4700 of them leaving: 8.5 ms of
computing, against 1.1 ms). Every so often the records are put in the order of their cells,
so that neighbours in memory read the same part of the fields (unsorted, a step of a million
particles takes several times as long).
"""

import math

import numpy as np
from numba import from_dtype, int32, uint8
from numpy.typing import NDArray
from petsc4py import PETSc

from solver.grid import Grid
from solver.interpolate import in_cells
from solver.kernel import INT, REAL, kernel

FUEL, SOOT = 0, 1
PARTICLE = np.dtype([
    ("position", "f8", 3), ("velocity", "f8", 3), ("mass", "f8"), ("temperature", "f8"),
    ("soot", "f8"), ("spare", "f8"), ("id", "i8"), ("kind", "i4"), ("ignited", "i4"),
    ("soot_due", "i4"), ("soot_made", "i4")])
RECORDS = from_dtype(PARTICLE)[::1]
DOUBLES = PARTICLE.itemsize // 8
FIELD_NAME = "particle"
ID_BITS = 16            # a fuel particle's id is a multiple of 2^16, its soot has the ids above
BUFFER = 1024           # records that PETSc keeps free for new ones
SORT_EVERY = 32         # steps; below SORT_FROM particles a rank's share fits the cache anyway
SORT_FROM = 20_000

SENT, BROKEN = 0, 1     # columns of what ranks tell each other: particles sent, particles nowhere


class Swarm:
    """The particles of this rank; `points` is a view that holds until the next change in number."""

    def __init__(self, grid: Grid):
        self.grid = grid
        self.dm = PETSc.DMSwarm().create(comm=grid.comm)
        self.dm.setDimension(3)
        self.dm.setType(PETSc.DMSwarm.Type.BASIC)
        self.dm.registerField(FIELD_NAME, DOUBLES, dtype=PETSc.ScalarType)
        self.dm.finalizeFieldRegister()
        self.dm.setLocalSizes(0, BUFFER)
        self.points = self._view()
        self.per_cell = np.array([1 / h for h in grid.spacing])
        self.size = np.array(grid.size, dtype=float)
        self.wraps = np.array(grid.periodic, dtype=np.uint8)
        self.row, self.layer = rank_tables(grid)
        self.ranks = np.empty(0, np.int32)
        self.leaving, self.arriving = (np.zeros((grid.comm.size, 2), np.int64) for _ in range(2))
        self.settled = 0
        self.scratch = np.empty(0, PARTICLE)

    def _view(self) -> NDArray[np.void]:
        values = self.dm.getField(FIELD_NAME)
        self.dm.restoreField(FIELD_NAME)   # a held field forbids resizing; the memory stays
        points: NDArray[np.void] = values.reshape(-1).view(PARTICLE)   # newer PETSc: rows
        return points

    def append(self, records: NDArray[np.void]) -> None:
        """Add particles (dtype PARTICLE) to this rank."""
        if len(records):
            self.dm.addNPoints(len(records))
            self.points = self._view()
            self.points[-len(records):] = records

    def census(self) -> tuple[int, int, int]:
        """Numbers of fuel particles, soot particles and burning particles on this rank."""
        counts = np.zeros(2, np.int64)
        count_kinds(self.points, counts)
        soot, burning = (int(n) for n in counts)
        return len(self.points) - soot, soot, burning

    def settle(self) -> None:
        """Wrap positions on periodic axes, drop particles that are spent or outside the box, and
        send the others to the ranks that own them. Every rank must call it; raises
        FloatingPointError on all of them where a position is not finite."""
        self.drop()
        if self.grid.comm.size > 1:
            self.exchange()
        broken = self.arriving[:, BROKEN].sum()
        if broken:
            raise FloatingPointError(f"{broken} particles are nowhere: their positions are not "
                                     "finite")
        self.settled += 1
        if self.settled % SORT_EVERY == 1:
            self.sort()

    def drop(self) -> None:
        """Keep what is to be kept, in order, and note where it belongs."""
        if len(self.ranks) < len(self.points):
            self.ranks = np.empty(len(self.points) + len(self.points) // 4, np.int32)
        self._resize(keep_inside(self.points, self.ranks, self.size, self.wraps, self.per_cell,
                                 self.row, self.layer, self.grid.comm.rank, self.leaving))
        np.copyto(self.arriving, self.leaving)   # what holds where there is one rank

    def exchange(self) -> None:
        """Send the particles that other ranks own; every rank must call it."""
        comm = self.grid.comm
        comm.Alltoall(self.leaving, self.arriving)
        sent, received = self.leaving[:, SENT], self.arriving[:, SENT]
        outbox = np.empty(sent.sum(), PARTICLE)
        kept = take_out(self.points, self.ranks, comm.rank, np.cumsum(sent) - sent, outbox)
        self._resize(kept + int(received.sum()))
        inbox = self.points[kept:]
        comm.Alltoallv([outbox.view(float), (sent * DOUBLES, (np.cumsum(sent) - sent) * DOUBLES)],
                       [inbox.view(float), (received * DOUBLES,
                                            (np.cumsum(received) - received) * DOUBLES)])

    def _resize(self, number: int) -> None:
        """Keep the first records, or add some that are still to be set."""
        if number != len(self.points):
            self.dm.setLocalSizes(number, BUFFER)
            self.points = self._view()

    def sort(self) -> None:
        """Put the records in the order of their cells."""
        number = len(self.points)
        if number < SORT_FROM:
            return
        if len(self.scratch) < number:
            self.scratch = np.empty(number + number // 4, PARTICLE)
            self.keys = np.empty(len(self.scratch), np.int32)
            self.first = np.empty(math.prod(self.grid.count) + 1, np.int32)
        sort_by_cell(self.points, self.scratch, self.keys, self.first, self.per_cell,
                     np.array(self.grid.start, float), np.array(self.grid.count, np.int64))
        np.copyto(self.points, self.scratch[:number])

    def destroy(self) -> None:
        """Free PETSc's part."""
        self.dm.destroy()


def rank_tables(grid: Grid) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For each cell along y and along z what it adds to the rank that owns it."""
    _, rows, layers = grid.processes
    tables = []
    for axis, ranks, stride in ((1, rows, 1), (2, layers, rows)):
        width, wider = divmod(grid.cells[axis], ranks)
        widths = width + (np.arange(ranks) < wider)
        tables.append(np.repeat(np.arange(ranks) * stride, widths).astype(np.int64))
    return tables[0], tables[1]


def owners(grid: Grid, position: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n,) the rank that owns the cell of each point; points outside go to the nearest cell."""
    parts = []
    for axis, table in zip((1, 2), rank_tables(grid), strict=True):
        cell = (position[:, axis] * (1 / grid.spacing[axis])).astype(np.int64)
        parts.append(table[np.clip(cell, 0, grid.cells[axis] - 1)])
    result: NDArray[np.int64] = parts[0] + parts[1]
    return result


@kernel(RECORDS, INT[::1])
def count_kinds(points, counts):
    """How many are soot, and how many burn."""
    soot = burning = 0
    for n in range(len(points)):
        soot += points[n].kind
        burning += points[n].ignited
    counts[0], counts[1] = soot, burning


@kernel(RECORDS, int32[::1], REAL[::1], uint8[::1], REAL[::1], INT[::1], INT[::1], INT,
        INT[:, ::1], result=INT)
def keep_inside(points, ranks, size, wraps, per_cell, row, layer, me, leaving):
    """Move the records to keep to the front, in order, and name the ranks that own them; returns
    how many. Spent: mass < 0. Counts those that each other rank owns and those that are nowhere."""
    kept = broken = 0
    leaving[:] = 0
    for n in range(len(points)):
        inside = points[n].mass >= 0.0
        place = points[n].position
        if not math.isfinite(place[0] + place[1] + place[2]):
            broken += 1
        for axis in range(3):
            x = points[n].position[axis]
            if not 0.0 <= x <= size[axis]:
                if wraps[axis]:
                    x -= np.floor(x / size[axis]) * size[axis]
                    points[n].position[axis] = x if x < size[axis] else 0.0
                else:
                    inside = False
        if inside:
            if kept < n:
                points[kept] = points[n]
            y = min(int(points[kept].position[1] * per_cell[1]), len(row) - 1)
            z = min(int(points[kept].position[2] * per_cell[2]), len(layer) - 1)
            ranks[kept] = row[y] + layer[z]
            if ranks[kept] != me:
                leaving[ranks[kept], SENT] += 1
            kept += 1
    leaving[:, BROKEN] = broken
    return kept


@kernel(RECORDS, int32[::1], INT, INT[::1], RECORDS, result=INT)
def take_out(points, ranks, me, first, outbox):
    """Move what other ranks own to the outbox, each rank's part from `first` on, and fill the gaps
    from the end; returns how many stay."""
    n, last = 0, len(points)
    while n < last:
        rank = ranks[n]
        if rank == me:
            n += 1
        else:
            outbox[first[rank]] = points[n]
            first[rank] += 1
            last -= 1
            points[n] = points[last]
            ranks[n] = ranks[last]
    return last


@kernel(RECORDS, RECORDS, int32[::1], int32[::1], REAL[::1], REAL[::1], INT[::1])
def sort_by_cell(points, ordered, keys, first, per_cell, start, count):
    """Counting sort into `ordered`; within a cell the order stays."""
    first[:] = 0
    for n in range(len(points)):
        key = 0
        for axis in (2, 1, 0):
            cell = int(in_cells(points[n].position, per_cell, start, axis))
            key = key * count[axis] + min(max(cell, 0), count[axis] - 1)
        keys[n] = key
        first[key + 1] += 1
    for cell in range(len(first) - 1):
        first[cell + 1] += first[cell]
    for n in range(len(points)):
        ordered[first[keys[n]]] = points[n]
        first[keys[n]] += 1
