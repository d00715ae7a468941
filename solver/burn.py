"""Fuel burns: it makes gas (the divergence φ), heat and soot.

A burning particle loses Δm = min(m, z dt) in a step, and over that step

    φ += b_g Δm / (dt V),   H += b_h Δm / (dt V),   s += b_s Δm        (V: volume of a cell)

spread over cells by trilinear weights (or to the nearest cell), so that ∫∫φ dV dt = b_g × burnt
mass to round-off, whatever dt, grid and ranks are. Heat is per volume: the printed heat per cell
would depend on the grid. Soot decays at z_s and makes neither gas nor heat.

The rates at full burning (Δm = z dt) are laid down before dt is chosen, because dt depends on
them; where a particle turns out to end within the step, they are laid down again.
"""

import numpy as np

from solver.expansion import source_speed
from solver.grid import INNER
from solver.interpolate import deposit, in_cells
from solver.kernel import FIELD, INT, REAL, kernel
from solver.scene import Scene, SceneError
from solver.state import State
from solver.swarm import ID_BITS, RECORDS, SOOT

LIST = REAL[::1]


class Burn:
    """Sources of φ and T, and loss of mass."""

    def __init__(self, scene: Scene, state: State):
        assert scene.fuel is not None
        grid = state.grid
        self.fuel, self.soot = scene.fuel, scene.soot
        self.nearest = int(self.fuel.deposit == "nearest")
        self.per_cell = np.array([1 / h for h in grid.spacing])
        self.start = np.array(grid.start, dtype=float)
        self.spread = scene.domain.expansion == "spread" and scene.is_closed
        self.phi_before = grid.field()
        self.lightest = 0.0
        state.totals.update(burnt=0.0, gas=0.0, heat=0.0)
        self._check_soot(scene)

    def _check_soot(self, scene: Scene) -> None:
        fuel, soot = self.fuel, self.soot
        if soot is not None and soot.repeat:
            number = fuel.mass * fuel.soot / soot.threshold
            if number >= 2**ID_BITS - 1:
                raise SceneError(f"{scene.path}: soot.threshold = {soot.threshold:g}: {number:g} "
                                 f"soot particles per fuel particle; fix: at least "
                                 f"{fuel.mass * fuel.soot / 2**(ID_BITS - 1):.3g}")

    def prepare(self, state: State) -> None:
        """Lay down φ and H of everything that burns, at its full rate."""
        self.phi_before, state.phi = state.phi, self.phi_before
        self._lay_down(state, 0.0)

    def _lay_down(self, state: State, dt: float) -> None:
        """φ and H of min(z, m / dt) of every burning particle."""
        state.heat.fill(0.0)
        self.lightest = deposit_burning(
            state.swarm.points, state.heat, self.per_cell, self.start, dt, self.fuel.burn_rate,
            1 / state.grid.volume, self.nearest)
        state.grid.fold(state.heat)
        np.multiply(state.heat, self.fuel.gas, out=state.phi)
        state.heat *= self.fuel.heat

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
        if state.grid.comm.allreduce(self.lightest, op=min) < fuel.burn_rate * dt:
            self._lay_down(state, dt)
        soot_rate, soot_end, threshold, repeat = 0.0, 0.0, np.inf, 0
        if self.soot is not None:
            soot_rate, soot_end = self.soot.burn_rate, self.soot.min_mass
            threshold, repeat = self.soot.threshold, int(self.soot.repeat)
        burnt = burn(state.swarm.points, dt, fuel.burn_rate, fuel.soot, fuel.min_mass, threshold,
                     repeat, soot_rate, soot_end)
        volume = state.grid.volume
        state.add_total("burnt", burnt)
        state.add_total("gas", float(state.phi[INNER].sum()) * volume * dt)
        state.add_total("heat", float(state.heat[INNER].sum()) * volume * dt)
        if self.spread:
            mean = state.grid.comm.allreduce(float(state.phi[INNER].sum()))
            state.phi[INNER] -= mean / np.prod(state.grid.cells)


@kernel(RECORDS, FIELD, LIST, LIST, REAL, REAL, REAL, INT, result=REAL)
def deposit_burning(points, field, per_cell, start, dt, rate, per_volume, nearest):
    """Mass burnt per time and volume, min(rate, m / dt) / V (dt = 0: the full rate), of every
    burning particle; returns the least mass among them."""
    lightest = np.inf
    for n in range(len(points)):
        point = points[n]
        if point.ignited:
            amount = rate
            if point.mass < rate * dt:
                amount = point.mass / dt
            lightest = min(lightest, point.mass)
            X = in_cells(point.position, per_cell, start, 0)
            Y = in_cells(point.position, per_cell, start, 1)
            Z = in_cells(point.position, per_cell, start, 2)
            deposit(field, X, Y, Z, amount * per_volume, nearest)
    return lightest


@kernel(RECORDS, *[REAL] * 5, INT, REAL, REAL, result=REAL)
def burn(points, dt, rate, soot_yield, fuel_end, threshold, repeat, soot_rate, soot_end):
    """Take Δm from fuel and decay from soot; returns the fuel mass burnt. The spent get mass -1."""
    total = 0.0
    for n in range(len(points)):
        point = points[n]
        if point.kind == SOOT:
            point.mass -= soot_rate * dt
            if point.mass <= soot_end:
                point.mass = -1.0
        elif point.ignited:
            loss = min(point.mass, rate * dt)
            total += loss
            point.mass -= loss
            point.soot += soot_yield * loss
            if point.soot >= threshold:
                if repeat:
                    point.soot_due = int(point.soot / threshold)
                    point.soot -= point.soot_due * threshold
                elif point.soot_made == 0:
                    point.soot_due = 1
            if point.mass <= fuel_end:
                point.mass = -1.0
    return total
