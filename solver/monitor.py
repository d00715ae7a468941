"""How a step went: the numbers that choose the next dt, prove the divergence and catch failure.

One sweep over the cells and two reductions per step, for all stages together.
"""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from solver.kernel import FIELD, GHOSTS, INT, REAL, inlined, kernel
from solver.state import State

TOTALS = ("burnt", "gas", "heat")


@dataclass(frozen=True)
class Report:
    """State of the whole box after a step.

    rate         max Σ|u|/h over cells, 1/s (dt = cfl / rate)
    divergence   max|∇·u - φ| / max(max|φ|, rate)
    energy       ∫ ½|u|² dV, L⁵/s²
    fuel, soot   particles;  burning: fuel that is lit
    burnt [M], gas [L³], heat [K L³]: totals since the start
    """

    rate: float
    divergence: float
    energy: float
    fuel: int = 0
    soot: int = 0
    burning: int = 0
    burnt: float = 0.0
    gas: float = 0.0
    heat: float = 0.0


class Monitor:
    """Makes the report of a step."""

    def __init__(self, state: State):
        self.inverse_h = [1 / h for h in state.grid.spacing]
        self.largest = np.zeros((3, state.grid.count[0]))
        self.sums = np.zeros(1 + (3 + len(TOTALS) if state.swarm is not None else 0))

    def __call__(self, state: State) -> Report:
        """Reduce over all ranks; a value that is not finite stays visible."""
        grid = state.grid
        source = state.u if state.phi is None else state.phi
        self.sums[0] = survey(*state.velocity, source, int(state.phi is not None), self.largest,
                              *self.inverse_h)
        if state.swarm is not None:
            self.sums[1:4] = state.swarm.census()
            self.sums[4:] = [state.totals[name] for name in TOTALS]
        largest, sums = self.largest.max(axis=1), self.sums
        if grid.comm.size > 1:
            sums = sums.copy()
            grid.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
            grid.comm.Allreduce(MPI.IN_PLACE, sums)
        rate, defect, peak = (float(x) for x in largest)
        energy = 0.5 * grid.volume * float(sums[0])
        counts = [int(x) for x in sums[1:4]]
        return Report(rate, defect / max(rate, peak, 1e-300), energy, *counts,
                      *(float(x) for x in sums[4:]))


@inlined
def larger(a, b):
    """The larger of two; b where they cannot be compared."""
    return a if a > b else b


@kernel(*[FIELD] * 4, INT, REAL[:, ::1], REAL, REAL, REAL, result=REAL)
def survey(u, v, w, phi, has_phi, largest, cx, cy, cz):
    """Writes max Σ|u|/h, max|∇·u - φ|, max|φ| of every x to `largest` (3, nx); returns Σ|u|² over
    the cells.

    A NaN would lose every comparison: it shows in the sum. (One maximum for all would have to be
    found a cell at a time; those of every x are found several at a time.)
    """
    largest[:] = 0.0
    total = 0.0
    for k in range(GHOSTS, u.shape[0] - GHOSTS):
        for j in range(GHOSTS, u.shape[1] - GHOSTS):
            for i in range(largest.shape[1]):
                I = i + GHOSTS  # noqa: E741
                east, west = u[k, j, I], u[k, j, I - 1]
                north, south = v[k, j, I], v[k, j - 1, I]
                front, rear = w[k, j, I], w[k - 1, j, I]
                source = has_phi * phi[k, j, I]
                gap = abs(cx * (east - west) + cy * (north - south) + cz * (front - rear) - source)
                speed = (cx * larger(abs(east), abs(west)) + cy * larger(abs(north), abs(south))
                         + cz * larger(abs(front), abs(rear)))
                largest[0, i] = larger(speed, largest[0, i])
                largest[1, i] = larger(gap, largest[1, i])
                largest[2, i] = larger(abs(source), largest[2, i])
                total += 0.5 * (east * east + west * west + north * north + south * south
                                + front * front + rear * rear)
    return total
