"""What particles take as heat, the air loses (two-way exchange).

In a cell with air of heat capacity C V (C per volume) and particles of heat capacity c_m each, all
with the same rate κ = α_h r²/c_m, the load is Λ = Σ c_m / (C V), and the difference between the
air and the mean particle decays at κ (1 + Λ). A particle takes in a step

    ΔY = (T - Y) (1 - exp(-κ (1 + Λ) dt)) / (1 + Λ)

and c_m ΔY is taken from the air with the weights with which T and Λ were read. That is the exact
solution for one particle alone with its cell, conserves heat to round-off, and tends to the one-way
law for Λ → 0. It is stable for any dt and load: in the norm Σ C V T² + Σ c_m Y² the step is 1 - A
with A = GᵀΦG, and the rows of Φ G Gᵀ sum to Φ (1 + Λ) ≤ 1, so its eigenvalues lie in [0, 1].
"""

import math

import numpy as np

from solver.boundary import fill_scalar
from solver.grid import INNER, Grid
from solver.interpolate import deposit, in_cells, scalar_at
from solver.kernel import FIELD, REAL, kernel
from solver.scene_physics import Fuel
from solver.state import State
from solver.swarm import RECORDS

TRILINEAR = 0   # the weights of `scalar_at`, whatever the deposit of gas is


class Exchange:
    """Heat exchange of all particles; adds the air's loss to the heat source of the step."""

    def __init__(self, fuel: Fuel, grid: Grid, rate: float):
        self.rate = rate
        self.share = fuel.thermal_mass / (fuel.air_heat_capacity * grid.volume)   # one in one cell
        self.per_cell = np.array([1 / h for h in grid.spacing])
        self.start = np.array(grid.start, dtype=float)
        self.load, self.loss = grid.field(), grid.field()

    def __call__(self, state: State, dt: float) -> None:
        """Warm the particles for dt."""
        place = self.per_cell, self.start
        self.load.fill(0.0)
        weigh(state.swarm.points, self.load, *place, self.share)
        state.grid.fold(self.load)
        fill_scalar(state.grid, self.load)
        self.loss.fill(0.0)
        warm(state.swarm.points, state.T, self.load, self.loss, *place, self.rate * dt,
             self.share / dt)
        state.grid.fold(self.loss)
        state.heat[INNER] -= self.loss[INNER]


@kernel(RECORDS, FIELD, REAL[::1], REAL[::1], REAL)
def weigh(points, load, per_cell, start, share):
    """Λ in every cell."""
    for n in range(len(points)):
        X = in_cells(points[n].position, per_cell, start, 0)
        Y = in_cells(points[n].position, per_cell, start, 1)
        Z = in_cells(points[n].position, per_cell, start, 2)
        deposit(load, X, Y, Z, share, TRILINEAR)


@kernel(RECORDS, FIELD, FIELD, FIELD, REAL[::1], REAL[::1], REAL, REAL)
def warm(points, T, load, loss, per_cell, start, decay, share):
    """ΔY of every particle, and `share` ΔY from the air around it; decay = κ dt."""
    for n in range(len(points)):
        point = points[n]
        X = in_cells(point.position, per_cell, start, 0)
        Y = in_cells(point.position, per_cell, start, 1)
        Z = in_cells(point.position, per_cell, start, 2)
        whole = 1 + scalar_at(load, X, Y, Z)
        gain = -math.expm1(-decay * whole) / whole * (scalar_at(T, X, Y, Z) - point.temperature)
        point.temperature += gain
        deposit(loss, X, Y, Z, share * gain, TRILINEAR)
