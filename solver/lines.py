"""The tridiagonal systems that remain along y or z when the other axes have been transformed.

    (λ + d_k) p_k - c (p_{k-1} + p_{k+1}) = r_k         on every line of n cells, c = 1 / h²

Gaussian elimination with reciprocal pivots m that are computed once, at a fraction of the cost of
a transform:

    elimination     e_k = (r_k + c e_{k-1}) m_k            m_k = 1 / (λ + d_k - c² m_{k-1})
    substitution    p_k = e_k + g_k p_before + c m_k p_{k+1}

Ranks that share a line eliminate their parts of it, and only what joins the parts is sent, a plane
or two instead of the block: see `interfaces`. The part at the high end of a line is eliminated from
there, so that p_before, the value next to where a part begins, is needed only by parts that have
neighbours at both ends (all parts, where the axis is periodic): g_k = c m_k g_{k-1}, `reach`.
"""

from collections.abc import Callable

import numpy as np
from mpi4py import MPI

from solver.grid import Field, Grid
from solver.interfaces import Interfaces, Meeting
from solver.kernel import FIELD, INT, REAL, inlined, kernel

PLANE = REAL[:, ::1]
Y, Z = 1, 2


class Lines:
    """All lines of this rank along an axis (Y or Z), a block of planes across them at a time:

        for block in lines.blocks: lines.eliminate(values, block)
        lines.meet(values)
        for block in reversed(lines.blocks): lines.substitute(values, block)

    eigenvalues   of -∂² per array axis (z, y, x) on this rank; along the lines d instead
    constant      solves, in place, the whole line that has λ = 0 where the ends do not fix its
                  mean; None where there is no such line
    thickness     planes per block
    """

    def __init__(self, grid: Grid, axis: int, eigenvalues: list[Field], coupling: float,
                 constant: Callable[[Field], None] | None, thickness: int):
        self.axis, self.coupling, self.constant = axis, coupling, constant
        self.comm, self.owns_comm = _ranks_along(grid, axis)
        ring = grid.periodic[axis] and grid.cells[axis] > 1
        below = ring or self.comm.rank > 0
        above = ring or self.comm.rank < self.comm.size - 1
        n = grid.count[axis]
        order = range(n)[::-1 if below and not above else 1]
        self.first, self.last = order[0], order[-1]
        self.blocks = [order[i:i + thickness] for i in range(0, n, thickness)]
        lz, ly, lx = eigenvalues
        self.pivots = lz[:, None, None] + ly[:, None] + lx
        invert_pivots(self.pivots, coupling, order.start, order.stop, order.step, axis == Z)
        if constant is not None:
            self._plane(self.pivots, self.last)[0, 0] = 0.0
            self.here = slice(grid.start[axis], grid.start[axis] + n)
            self.line = np.zeros(grid.cells[axis])
            self.counts = self.comm.allgather(n)
        across = self._plane(self.pivots, 0).shape
        self.after = np.zeros(across)
        self.before = self.begin = np.zeros((0, 0))
        self.reach = np.zeros((0, 0, 0))
        if below and above:
            self.before, self.begin = np.zeros(across), np.zeros(across)
            self.reach = np.cumprod(coupling * self.pivots, axis=2 - axis)
        end = coupling * self._plane(self.pivots, self.last)
        self.meeting = (Meeting(self.comm, end) if below != above and self.comm.size == 2 else None)
        self.interfaces = (Interfaces(self.comm, ring, self._answers(below, above, end))
                           if (below or above) and not self.meeting else None)

    def _answers(self, below: bool, above: bool, end: Field) -> Field:
        """What 1 beyond this part makes of it: one below its low end at the low end, at the other
        end, and one above its high end at the high end; three planes."""
        answers = np.zeros((3, *self.after.shape))
        if below and above:
            g = np.moveaxis(self.reach, 2 - self.axis, 0)
            answers[:] = g[0] + (g[:-1] * g[1:]).sum(axis=0), g[-1], end
        else:
            answers[0 if below else 2] = end
        if self.constant is not None:
            answers[:, 0, 0] = 0.0
        return answers

    def eliminate(self, values: Field, block: range) -> None:
        """r → e in one block of planes; the blocks come in their order."""
        if self.constant is not None:
            self.line[self.here][list(block)] = self._constant_line(values)[list(block)]
        span = block.start, block.stop, block.step, self.axis == Z
        eliminate(values, self.pivots, self.coupling, block[0] == self.first, *span)
        if self.reach.size:
            weigh_begin(values, self.reach, self.begin, block[0] == self.first, *span)

    def meet(self, values: Field) -> None:
        """Learn the values next to this part, when all blocks have been eliminated."""
        line_comes = self._send_constant_line()
        end = self._plane(values, self.last)
        self.after[:] = 0.0
        if self.meeting:
            self.meeting.solve(end, self.after)
        elif self.interfaces and self.reach.size:
            self.before[:], self.after[:] = self.interfaces.solve(self.begin, end)
        elif self.interfaces and self.first > self.last:
            self.after[:], _ = self.interfaces.solve(end, self.after)
        elif self.interfaces:
            _, self.after[:] = self.interfaces.solve(self.after, end)
        if self.constant is not None:
            line_comes.Wait()
            self.constant(self.line)

    def substitute(self, values: Field, block: range) -> None:
        """e → p in one block of planes; the blocks come in reversed order. Then the planes of the
        block are free: the last one is kept for the next block."""
        span = block.start, block.stop, block.step, self.axis == Z
        if self.reach.size:
            add_reach(values, self.reach, self.before, *span)
        substitute(values, self.pivots, self.coupling, self.after, *span)
        if self.constant is not None:
            self._constant_line(values)[list(block)] = self.line[self.here][list(block)]

    def _send_constant_line(self) -> MPI.Request:
        """All ranks that share the line of λ = 0 will have it whole."""
        if self.constant is None or self.comm.size == 1:
            return MPI.REQUEST_NULL
        return self.comm.Iallgatherv(MPI.IN_PLACE, (self.line, self.counts))

    def _constant_line(self, values: Field) -> Field:
        """Its part on this rank: the line that does not vary along the two other axes."""
        return values[:, 0, 0] if self.axis == Z else values[0, :, 0]

    def _plane(self, values: Field, index: int) -> Field:
        """One plane across the lines."""
        return values[index] if self.axis == Z else values[:, index]

    def destroy(self) -> None:
        """Free the communicator, where it was made for these lines."""
        if self.owns_comm:
            self.comm.Free()


def _ranks_along(grid: Grid, axis: int) -> tuple[MPI.Comm, bool]:
    """The ranks that share lines, in the order of their parts, and whether that is a new
    communicator."""
    _, rows, layers = grid.processes
    y, z = grid.comm.rank % rows, grid.comm.rank // rows
    if grid.processes[axis] == rows * layers:
        return grid.comm, False
    return (grid.comm.Split(z, y) if axis == Y else grid.comm.Split(y, z)), True


@inlined
def row(values, along, across, along_z):
    """The cells along x of one line's place and one place across."""
    return values[along, across] if along_z else values[across, along]


@inlined
def eliminate_row(here, before, pivots, coupling):
    """e = (r + c e_before) m."""
    for i in range(here.size):
        here[i] = (here[i] + coupling * before[i]) * pivots[i]


@inlined
def substitute_row(here, after, pivots, coupling):
    """p = e + c m p_after."""
    for i in range(here.size):
        here[i] += coupling * pivots[i] * after[i]


@kernel(FIELD, REAL, INT, INT, INT, INT)
def invert_pivots(pivots, coupling, start, stop, step, along_z):
    """Diagonal λ + d → reciprocal pivots of the elimination in this order, in place."""
    for s in range(start, stop, step):
        for t in range(pivots.shape[1] if along_z else pivots.shape[0]):
            here = row(pivots, s, t, along_z)
            for i in range(here.size):
                before = 0.0 if s == start else row(pivots, s - step, t, along_z)[i]
                here[i] = 1 / (here[i] - coupling * coupling * before)


@kernel(FIELD, FIELD, REAL, INT, INT, INT, INT, INT)
def eliminate(values, pivots, coupling, begins, start, stop, step, along_z):
    """The planes start, start + step, … of all lines; where a part begins there is none before."""
    for s in range(start, stop, step):
        for t in range(values.shape[1] if along_z else values.shape[0]):
            here, m = row(values, s, t, along_z), row(pivots, s, t, along_z)
            if begins and s == start:
                for i in range(here.size):
                    here[i] *= m[i]
            else:
                eliminate_row(here, row(values, s - step, t, along_z), m, coupling)


@kernel(FIELD, FIELD, REAL, PLANE, INT, INT, INT, INT)
def substitute(values, pivots, coupling, after, start, stop, step, along_z):
    """The planes in reversed order; `after` is that beyond them, and becomes the first of them."""
    last = stop - step
    for s in range(last, start - step, -step):
        for t in range(after.shape[0]):
            here, m = row(values, s, t, along_z), row(pivots, s, t, along_z)
            if s == last:
                substitute_row(here, after[t], m, coupling)
            else:
                substitute_row(here, row(values, s + step, t, along_z), m, coupling)
    for t in range(after.shape[0]):
        after[t, :] = row(values, start, t, along_z)


@kernel(FIELD, FIELD, PLANE, INT, INT, INT, INT, INT)
def weigh_begin(values, reach, begin, begins, start, stop, step, along_z):
    """Σ g_{k-1} e_k, what the first value of every line is where nothing lies beyond its part."""
    for s in range(start, stop, step):
        for t in range(begin.shape[0]):
            here = row(values, s, t, along_z)
            if begins and s == start:
                begin[t, :] = here
            else:
                g = row(reach, s - step, t, along_z)
                for i in range(here.size):
                    begin[t, i] += g[i] * here[i]


@kernel(FIELD, FIELD, PLANE, INT, INT, INT, INT)
def add_reach(values, reach, before, start, stop, step, along_z):
    """e += g p_before."""
    for s in range(start, stop, step):
        for t in range(before.shape[0]):
            here, g = row(values, s, t, along_z), row(reach, s, t, along_z)
            for i in range(here.size):
                here[i] += g[i] * before[t, i]
