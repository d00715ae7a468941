"""Fuel burns: it makes gas (the divergence φ), heat and soot.

A burning particle loses Δm = min(m, z dt) in a step, and over that step

    φ += b_g Δm / (dt V),   H += b_h Δm / (dt V),   s += b_s Δm        (V: volume of a cell)

spread over cells by trilinear weights (or to the nearest cell), so that ∫∫φ dV dt = b_g × burnt
mass to round-off, whatever dt, grid and ranks are. Heat is per volume: the printed heat per cell
would depend on the grid. A fuel particle whose soot reaches the threshold makes one soot particle
with its mass, temperature and velocity; soot decays at z_s and makes neither gas nor heat.

The rates at full burning (Δm = z dt) are laid down before dt is chosen, because dt depends on
them; what a particle lacks in its last step is taken back once dt is known.
"""

import numpy as np

from solver.emit import ID_BITS
from solver.grid import INNER
from solver.hashing import uniform_at
from solver.interpolate import deposit
from solver.kernel import FIELD, INT, REAL, inlined, kernel
from solver.scene import Scene
from solver.state import State
from solver.swarm import FUEL, NO_SOOT, RECORDS, SOOT, SOOT_DUE, SOOT_MADE

SOOT_STREAM = 12


class Burn:
    """Sources of φ and T, loss of mass, birth of soot."""

    def __init__(self, scene: Scene, state: State):
        assert scene.fuel is not None
        grid = state.grid
        self.fuel, self.soot, self.seed = scene.fuel, scene.soot, scene.seed
        self.nearest = int(self.fuel.deposit == "nearest")
        self.gas = self.fuel.gas / grid.volume
        self.heat = self.fuel.heat / grid.volume
        self.geometry = (*grid.spacing, *(float(s) for s in grid.start))
        self.spread = scene.domain.expansion == "spread" and scene.is_closed
        self.phi_before = grid.field()
        state.totals.update(burnt=0.0, gas=0.0, heat=0.0)

    def prepare(self, state: State) -> None:
        """Lay down φ and H of everything that burns."""
        self.phi_before, state.phi = state.phi, self.phi_before
        state.phi.fill(0.0)
        state.heat.fill(0.0)
        deposit_rates(state.swarm.points, state.phi, state.heat, *self.geometry,
                      self.fuel.burn_rate, self.gas, self.heat, self.nearest)
        state.grid.fold(state.phi, state.heat)

    def limit(self, state: State) -> tuple[float, str]:
        """dt from the flow that the change of φ is about to cause (see `source_speed`)."""
        change = state.phi[INNER] - self.phi_before[INNER]
        grid = state.grid
        net = grid.comm.allreduce(float(change.sum())) * grid.volume
        peak = grid.comm.allreduce(float(np.abs(change).max(initial=0.0)), op=max)
        state.source_speed = source_speed(peak, abs(net), grid.cells, grid.size)
        return np.inf, "sources"

    def __call__(self, state: State, dt: float) -> None:
        """Burn for dt."""
        fuel = self.fuel
        soot_rate, soot_end, threshold = 0.0, 0.0, np.inf
        if self.soot is not None:
            soot_rate, soot_end = self.soot.burn_rate, self.soot.min_mass
            threshold = self.soot.threshold
        burnt = burn(state.swarm.points, state.phi, state.heat, *self.geometry, dt, fuel.burn_rate,
                     self.gas, self.heat, self.nearest, fuel.soot, fuel.min_mass, threshold,
                     soot_rate, soot_end)
        state.grid.fold(state.phi, state.heat)
        if self.soot is not None:
            self._make_soot(state)
        volume = state.grid.volume
        state.add_total("burnt", burnt)
        state.add_total("gas", float(state.phi[INNER].sum()) * volume * dt)
        state.add_total("heat", float(state.heat[INNER].sum()) * volume * dt)
        if self.spread:
            mean = state.grid.comm.allreduce(float(state.phi[INNER].sum()))
            state.phi[INNER] -= mean / np.prod(state.grid.cells)

    def _make_soot(self, state: State) -> None:
        points = state.swarm.points
        due = np.flatnonzero(points["soot_state"] == SOOT_DUE)
        if len(due) == 0:
            return
        points["soot_state"][due] = SOOT_MADE
        born = points[due].copy()
        number = (born["id"] >> ID_BITS).astype(np.uint64)
        draws = uniform_at(self.seed, SOOT_STREAM,
                           np.uint64(3) * number[:, None] + np.arange(3, dtype=np.uint64))
        born["position"] += self.soot.perturbation * (2 * draws - 1) * state.grid.spacing
        born["id"] += 1
        born["kind"], born["ignited"], born["soot"] = SOOT, 0, 0.0
        born["mass"] = self.fuel.mass
        state.swarm.append(born)


def source_speed(peak: float, net: float, cells: tuple[int, ...], size: tuple[float, ...]) -> float:
    """The fastest flow that a divergence of at most `peak` [1/s] and of total `net` [L³/s] can
    drive in still air: all of it in a ball of radius R with |∇ψ| ≤ peak R (a disc or a slab where
    the box is one cell thick along one or two axes), L/s."""
    if peak == 0 or net == 0:
        return 0.0
    thin = [s for s, n in zip(size, cells, strict=True) if n == 1]
    dimensions = 3 - len(thin)
    unit = {3: 4 * np.pi / 3, 2: np.pi, 1: 2.0, 0: np.inf}[dimensions]
    extent = net / (peak * unit * float(np.prod(thin)))
    return float(peak * extent ** (1 / max(dimensions, 1)))


@inlined
def in_cells(point, hx, hy, hz, x0, y0, z0):
    """A particle's place in cells from the low corner of this rank's block."""
    return (point.position[0] / hx - x0, point.position[1] / hy - y0, point.position[2] / hz - z0)


@kernel(RECORDS, FIELD, FIELD, *[REAL] * 9, INT)
def deposit_rates(points, phi, heat, hx, hy, hz, x0, y0, z0,
                  rate, gas, hot, nearest):
    """Gas and heat of every burning particle at its full rate."""
    for n in range(len(points)):
        if points[n].ignited:
            X, Y, Z = in_cells(points[n], hx, hy, hz, x0, y0, z0)
            deposit(phi, X, Y, Z, gas * rate, nearest)
            deposit(heat, X, Y, Z, hot * rate, nearest)


@kernel(RECORDS, FIELD, FIELD, *[REAL] * 10, INT, *[REAL] * 5, result=REAL)
def burn(points, phi, heat, hx, hy, hz, x0, y0, z0, dt,
         rate, gas, hot, nearest, soot_yield, fuel_end, threshold, soot_rate, soot_end):
    """Take Δm from fuel and decay from soot; returns the fuel mass burnt. Spent ones get mass -1."""
    total = 0.0
    for n in range(len(points)):
        point = points[n]
        if point.kind == SOOT:
            point.mass -= soot_rate * dt
            if point.mass < soot_end:
                point.mass = -1.0
        elif point.ignited:
            loss = min(point.mass, rate * dt)
            if loss < rate * dt:
                missing = loss / dt - rate
                X, Y, Z = in_cells(point, hx, hy, hz, x0, y0, z0)
                deposit(phi, X, Y, Z, gas * missing, nearest)
                deposit(heat, X, Y, Z, hot * missing, nearest)
            point.mass -= loss
            point.soot += soot_yield * loss
            total += loss
            if point.soot >= threshold and point.soot_state == NO_SOOT:
                point.soot_state = SOOT_DUE
            if point.kind == FUEL and point.mass < fuel_end:
                point.mass = -1.0
    return total
